"""Up to six charts of a page, in a grid that fills the window; the reader chooses which."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

from chladni.models.core.reading import Chart
from chladni.viewers.bench.parts import choice, column, drawing
from chladni.viewers.bench.theme import Theme
from chladni.viewers.bench.tile import Ghost, Tile, key_of

#: Charts at once: two rows of three can be read in a window of 1280 x 800 without scrolling.
SLOTS, COLUMNS = 6, 3

# The rows share the height that is left; Panel's button for scrolling would take a place in the grid.
_GRID_CSS = """
:host {
  display: grid !important; grid-template-columns: repeat(COLUMNS, minmax(0, 1fr)); width: 100%;
  flex: 1 1 ROOMpx !important; min-height: ROOMpx !important; height: auto !important;
  grid-auto-rows: minmax(LEASTpx, 1fr); gap: GAPpx;
}
.scroll-button { display: none !important; }
"""
#: Pixels; a lower chart can't be read, and the page scrolls instead.
LEAST_HEIGHT, GAP = 215, 8

_CARD_CSS = """
:host {
  background: var(--c-card); border: 1px solid var(--c-line); border-radius: 6px; padding: 4px 6px 2px;
  min-height: 0 !important; overflow: hidden;
}
"""
_CHOICE_CSS = """
select { border: 0; font-weight: 600; padding: 0 18px 0 4px; min-height: 22px; text-overflow: ellipsis; }
"""

Kept = tuple[str, str, Sequence[Chart]]


class Slot:
    """One place of the board: a list of charts to choose from, and the tile of the chosen one."""

    def __init__(self, name: str, charts: Sequence[Chart], *, theme: Theme, chosen: Callable[[], None]) -> None:
        self._theme, self._chosen = theme, chosen
        self._filling = False
        self.name = name
        self.tile: Tile | None = None
        self.select = choice(
            "", [], None, self._on_choice, css=_CHOICE_CSS, sizing_mode="stretch_width", margin=0, height=24
        )
        self.view = column(self.select, sizing_mode="stretch_both", stylesheets=[_CARD_CSS])
        self.show(charts, ())

    def show(self, charts: Sequence[Chart], kept: Sequence[Kept]) -> None:
        """Show the chosen chart; the first one when there is no such chart any more."""
        # A chart may vanish with an option that was switched.
        chart = next((one for one in charts if one.name == self.name), charts[0])
        self.name = chart.name
        self._offer(charts)
        # A figure is dear; another set of curves on the same axes is cheap.
        if self.tile is None or self.tile.key != key_of(chart):
            self.tile = Tile(chart, self._theme)
            self.tile.show_ghosts(_ghosts(chart.name, kept))
            self.view.objects = [self.select, drawing(self.tile.figure, sizing_mode="stretch_both")]
        else:
            self.tile.show(chart)

    def show_ghosts(self, kept: Sequence[Kept]) -> None:
        """Show faded curves of kept variants."""
        if self.tile is not None:
            self.tile.show_ghosts(_ghosts(self.name, kept))

    def _offer(self, charts: Sequence[Chart]) -> None:
        names = {chart.title: chart.name for chart in charts}
        if self.select.options != names or self.select.value != self.name:
            # Offering is no choice of the user.
            self._filling = True
            self.select.param.update(options=names, value=self.name)
            self._filling = False

    def _on_choice(self, event: Any) -> None:
        if not self._filling and event.new:
            self.name = event.new
            self._chosen()


class Board:
    """Slots for the charts of a reading.

    Parameters
    ----------
    first
        Charts to show first, the most wanted first; those there aren't are passed over.
    """

    def __init__(self, theme: Theme, *, first: Sequence[str] = ()) -> None:
        self._theme, self._first = theme, first
        self.slots: list[Slot] = []
        self._charts: Sequence[Chart] = ()
        self._kept: Sequence[Kept] = ()
        self.view = column(sizing_mode="stretch_both")

    def show(self, charts: Sequence[Chart]) -> None:
        """Show these charts."""
        self._charts = charts
        # Only then: slots keep what the reader chose.
        if len(self.slots) != min(SLOTS, len(charts)):
            self._rebuild()
        else:
            self._redraw()

    def show_ghosts(self, kept: Sequence[Kept]) -> None:
        """Show faded curves of kept variants: label, colour, charts of each."""
        self._kept = kept
        for slot in self.slots:
            slot.show_ghosts(kept)

    def shown(self) -> tuple[Chart, ...]:
        """Give the charts in the slots, with the curves of kept variants."""
        charts = {chart.name: chart for chart in self._charts}
        return tuple(_overlaid(charts[slot.name], _ghosts(slot.name, self._kept)) for slot in self.slots)

    def _redraw(self) -> None:
        for slot in self.slots:
            slot.show(self._charts, self._kept)

    def _rebuild(self) -> None:
        names = wanted([chart.name for chart in self._charts], self._first)[:SLOTS]
        self.slots = [Slot(name, self._charts, theme=self._theme, chosen=self._redraw) for name in names]
        self.show_ghosts(self._kept)
        self.view.stylesheets = [self._grid()]
        self.view.objects = [slot.view for slot in self.slots]

    def _grid(self) -> str:
        columns = min(COLUMNS, max(1, len(self.slots)))
        # Four in a square, not three and one.
        columns = 2 if len(self.slots) == 4 else columns
        rows = -(-len(self.slots) // columns) if self.slots else 1
        words = {"COLUMNS": columns, "LEAST": LEAST_HEIGHT, "GAP": GAP, "ROOM": rows * (LEAST_HEIGHT + GAP)}
        grid = _GRID_CSS
        for word, number in words.items():
            grid = grid.replace(word, str(number))
        return grid


def wanted(names: Sequence[str], first: Iterable[str]) -> list[str]:
    """Order names by wish; what nobody wished for comes last, as it comes."""
    return list(dict.fromkeys([*(name for name in first if name in names), *names]))


def _overlaid(chart: Chart, ghosts: Sequence[Ghost]) -> Chart:
    """Add the curves of variants, labelled by them."""
    more = (
        replace(curve, label=f"{ghost.label}: {curve.label}" if curve.label else ghost.label)
        for ghost in ghosts
        for curve in ghost.chart.curves
    )
    return replace(chart, curves=(*chart.curves, *more))


def _ghosts(name: str, kept: Sequence[Kept]) -> list[Ghost]:
    return [
        Ghost(label=label, colour=colour, chart=chart)
        for label, colour, charts in kept
        for chart in charts
        if chart.name == name
    ]
