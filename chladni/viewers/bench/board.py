"""Up to six charts of a page, in a grid that fills the window; the reader chooses which."""

from collections.abc import Callable, Iterable, Mapping, Sequence
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
#: Name and title of each chart there is.
Offered = Sequence[tuple[str, str]]


class Slot:
    """One place of the board: a list of charts to choose from, and the tile of the chosen one."""

    def __init__(self, name: str, *, theme: Theme, chosen: Callable[[], None]) -> None:
        self._theme, self._chosen = theme, chosen
        self._filling = False
        self.name = name
        self.tile: Tile | None = None
        self.select = choice(
            "", [], None, self._on_choice, css=_CHOICE_CSS, sizing_mode="stretch_width", margin=0, height=24
        )
        self.view = column(self.select, sizing_mode="stretch_both", stylesheets=[_CARD_CSS])

    def show(self, offered: Offered, charts: Mapping[str, Chart], kept: Sequence[Kept]) -> None:
        """Show the chosen chart, the first one when there is no such chart any more; what isn't computed waits."""
        # A chart may vanish with an option that was switched.
        if self.name not in (name for name, _ in offered):
            self.name = offered[0][0]
        self._offer(offered)
        chart = charts.get(self.name)
        if chart is None:
            return
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

    def _offer(self, offered: Offered) -> None:
        names = {title: name for name, title in offered}
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
    wanted
        Called when the reader chose another chart, which may have to be computed first.
    """

    def __init__(self, theme: Theme, *, first: Sequence[str] = (), wanted: Callable[[], None] | None = None) -> None:
        self._theme, self._first, self._wanted = theme, first, wanted
        self.slots: list[Slot] = []
        self._offered: Offered = ()
        self._charts: Mapping[str, Chart] = {}
        self._kept: Sequence[Kept] = ()
        self.view = column(sizing_mode="stretch_both")

    @property
    def names(self) -> tuple[str, ...] | None:
        """Of the charts that are to be seen; None while nobody knows which there are."""
        return tuple(dict.fromkeys(slot.name for slot in self.slots)) or None

    def missing(self) -> list[str]:
        """Names of charts that a slot waits for."""
        return [name for name in self.names or () if name not in self._charts]

    def show(self, charts: Sequence[Chart], offered: Offered = ()) -> None:
        """Show these charts, and offer these names and titles; those of the charts when none are given."""
        self._charts = {chart.name: chart for chart in charts}
        self._offered = offered or tuple((chart.name, chart.title) for chart in charts)
        # Only then: slots keep what the reader chose.
        if len(self.slots) != min(SLOTS, len(self._offered)):
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
        return tuple(
            _overlaid(self._charts[slot.name], _ghosts(slot.name, self._kept))
            for slot in self.slots
            if slot.name in self._charts
        )

    def _redraw(self) -> None:
        for slot in self.slots:
            slot.show(self._offered, self._charts, self._kept)

    def _chosen(self) -> None:
        self._redraw()
        if self._wanted is not None and self.missing():
            self._wanted()

    def _rebuild(self) -> None:
        names = wanted([name for name, _ in self._offered], self._first)[:SLOTS]
        self.slots = [Slot(name, theme=self._theme, chosen=self._chosen) for name in names]
        self._redraw()
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
