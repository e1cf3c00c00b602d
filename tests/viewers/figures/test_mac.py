"""Numbers in a matrix are read on a dark page, too."""

from chladni.viewers.figures.mac import DARK, LIGHT
from chladni.viewers.screen_colours import on_dark


def test_numbers_keep_their_colour_on_cells_that_keep_theirs() -> None:
    assert (on_dark(LIGHT), on_dark(DARK)) == (LIGHT, DARK)
