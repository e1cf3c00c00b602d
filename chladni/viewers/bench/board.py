"""All charts of a page, in a grid that fills the window."""

from collections.abc import Sequence
from typing import Any

from chladni.models.core.reading import Chart
from chladni.viewers.bench.parts import column, drawing
from chladni.viewers.bench.theme import Theme
from chladni.viewers.bench.tile import Ghost, Tile, key_of

#: Shown below each other in a window of 800 pixels without scrolling.
ROWS = 2
_GRID_CSS = """
:host {
  display: grid !important; grid-template-columns: repeat(auto-fit, minmax(min(100%, COLUMN), 1fr));
  grid-auto-rows: minmax(230px, calc((100vh - OUTSIDE) / ROWS)); gap: 8px; width: 100%;
}
"""
_CARD_CSS = ":host { background: var(--c-card); border: 1px solid var(--c-line); border-radius: 6px; padding: 4px; }"

Kept = tuple[str, str, Sequence[Chart]]


class Board:
    """Tiles of the charts of a reading; tiles come and go with the charts, and stay where charts stay.

    Parameters
    ----------
    outside
        Pixels of the window's height that other things need.
    """

    def __init__(self, theme: Theme, *, outside: int = 190) -> None:
        self._theme = theme
        self._outside = outside
        self.tiles: dict[str, Tile] = {}
        self._charts: Sequence[Chart] = ()
        self._kept: Sequence[Kept] = ()
        self.view = column(sizing_mode="stretch_both")

    def show(self, charts: Sequence[Chart]) -> None:
        """Show these charts."""
        self._charts = charts
        if [key_of(chart) for chart in charts] != [tile.key for tile in self.tiles.values()]:
            self._rebuild()
        else:
            for chart in charts:
                self.tiles[chart.name].show(chart)

    def show_ghosts(self, kept: Sequence[Kept]) -> None:
        """Show faded curves of kept variants: label, colour, charts of each."""
        self._kept = kept
        for name, tile in self.tiles.items():
            tile.show_ghosts(_ghosts(name, kept))

    def _rebuild(self) -> None:
        standing = self.tiles
        self.tiles = {}
        for chart in self._charts:
            tile = standing.get(chart.name)
            if tile is None or tile.key != key_of(chart):
                tile = Tile(chart, self._theme)
                tile.show_ghosts(_ghosts(chart.name, self._kept))
            else:
                tile.show(chart)
            self.tiles[chart.name] = tile
        self.view.stylesheets = [self._grid()]
        self.view.objects = [self._card(tile) for tile in self.tiles.values()]

    def _grid(self) -> str:
        # Two charts or one take the whole width; from five on three stand side by side.
        column = "300px" if len(self.tiles) > 4 else "420px"
        rows = min(ROWS, max(1, (len(self.tiles) + 1) // 2))
        return _GRID_CSS.replace("COLUMN", column).replace("OUTSIDE", f"{self._outside}px").replace("ROWS", str(rows))

    def _card(self, tile: Tile) -> Any:
        return drawing(tile.figure, _CARD_CSS, sizing_mode="stretch_both")


def _ghosts(name: str, kept: Sequence[Kept]) -> list[Ghost]:
    return [
        Ghost(label=label, colour=colour, chart=chart)
        for label, colour, charts in kept
        for chart in charts
        if chart.name == name
    ]
