"""The table of influence as a figure: every cell written, the strongest marked."""

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from chladni.models.core.reading import InfluenceTable
from chladni.viewers.figures.influence import influence_figure
from chladni.viewers.figures.rendering import rendered

TABLE = InfluenceTable(
    behaviour=("answer_time", "overshoot"),
    construction=("active_area", "stroke", "mass"),
    nominal=np.array([0.2, 10.0]),
    change=np.array([-0.1, -0.1, -0.1]),
    relative_change=np.zeros((3, 2)),
    finite=np.array([[-0.9, 0.5], [0.0, 0.0], [0.4, np.nan]]),
    log_derivative=np.array([[-1.0, 0.6], [0.0, 0.0], [0.5, np.nan]]),
    definitions=("", ""),
)


def test_every_cell_is_written_and_named() -> None:
    axes = influence_figure(TABLE).axes[0]
    assert [text.get_text() for text in axes.texts] == ["-1", "+0.6", "0", "0", "+0.5", "–"]
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["answer\ntime", "overshoot"]
    assert [tick.get_text() for tick in axes.get_yticklabels()] == ["active area", "stroke", "mass"]


def test_the_strongest_are_marked() -> None:
    axes = influence_figure(TABLE).axes[0]
    frames = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    # A row without influence has no strongest cell.
    assert [(round(frame.get_x() + 0.47), round(frame.get_y() + 0.45)) for frame in frames] == [(0, 0), (0, 2)]
    dots = [tuple(np.round(line.get_xydata()[0] - [0.38, -0.3]).astype(int)) for line in axes.lines]
    assert dots == [(0, 0), (1, 0)]


@pytest.mark.parametrize(("of", "first", "title"), [("finite", "-0.9", "R_PCD"), ("log_derivative", "-1", "d ln")])
def test_either_coefficient_can_be_shown(of, first: str, title: str) -> None:
    axes = influence_figure(TABLE, of=of).axes[0]
    assert axes.texts[0].get_text() == first
    assert title in axes.get_title(loc="left")


def test_it_renders() -> None:
    assert len(rendered(influence_figure(TABLE), "png")) > 1000
