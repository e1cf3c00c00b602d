"""Kept variants: chips above the charts, faded curves in them, a table of their numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bokeh.document import Document

from chladni.models.core.instrument import Instrument
from chladni.models.core.reading import InstrumentReading
from chladni.signals.errors import ChladniError
from chladni.viewers.bench.desk import Desk
from chladni.viewers.bench.errors import told
from chladni.viewers.bench.latest import Latest
from chladni.viewers.bench.parts import button, column, flow, html
from chladni.viewers.bench.theme import Theme
from chladni.viewers.bench.tools import Rows, Tools, Variant
from chladni.viewers.bench.words import MESSAGE_CSS, message, quantity_table

if TYPE_CHECKING:
    from concurrent.futures import Future

#: Rows of a file that are drawn; more curves can't be told apart.
MOST_ROWS = 24
WATCH_MS = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Kept:
    """A variant with its reading and colour; `number` tells it from others that may be alike."""

    number: int
    variant: Variant
    reading: InstrumentReading
    colour: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Looked:
    """What a look at the file of rows gave: readings of its variants, and what to say about them."""

    rows: Rows
    found: tuple[tuple[Variant, InstrumentReading], ...]
    words: tuple[str, ...]


class VariantsView:
    """Variants kept by hand or read from a file.

    Parameters
    ----------
    file
        CSV or TOML file of rows that is watched while the page is open; None for none.
    changed
        Called when the faded curves are others.
    """

    def __init__(
        self,
        desk: Desk,
        tools: Tools,
        *,
        theme: Theme,
        document: Document | None,
        file: Path | None,
        changed: Callable[[Sequence[Kept]], None],
    ) -> None:
        self._desk, self._tools, self._theme, self._changed = desk, tools, theme, changed
        self._hand: list[Kept] = []
        self._rows: list[Kept] = []
        self._looked_at: Rows | None = None
        self._counted = 0
        self._numbers = count()
        # Two: neither the next look at the file nor the next variant may take the other's place.
        self._latest, self._completer = Latest(document), Latest(document)
        self.keep = button("Keep this variant", self._keep)
        self.chips = flow()
        self._words, self._table = html("", MESSAGE_CSS), html("")
        self.view = column(self._table, margin=(8, 0), visible=False)
        self.strip = column(self._words, self.chips, margin=(0, 0, 4, 0))
        if file is not None:
            self._watch(file, document)

    @property
    def kept(self) -> list[Kept]:
        """All, those from the file last."""
        return [*self._hand, *self._rows]

    def follow(self) -> None:
        """Show the numbers of the setting on the page in the table."""
        if self.view.visible:
            self._tabulate()

    def show(self, shown: bool) -> None:
        """Open or close the table."""
        self.view.visible = shown
        self.follow()

    def close(self) -> None:
        """End."""
        self._latest.close()
        self._completer.close()

    def _keep(self, _event: Any) -> None:
        if self._desk.reading is not None:
            # The reading is kept with the setting: ghosts must not change when a model does.
            self._hand.append(self._numbered(self._desk.good, self._desk.reading))
            self._redraw()
            self._complete()

    def _complete(self) -> None:
        """Compute the charts of kept variants that weren't on the page, since the reader may choose them later."""
        partly = [one for one in self._hand if len(one.reading.charts) < len(one.reading.offered)]
        if partly:
            self._completer.submit(partial(_completed, self._desk.instrument, self._tools, partly), self._take)

    def _take(self, future: "Future[dict[int, InstrumentReading]]") -> None:
        # What could be read with some charts can be read with all; else the charts there are stay.
        if future.exception() is None:
            found = future.result()
            self._hand = [replace(one, reading=found.get(one.number, one.reading)) for one in self._hand]
            self._changed(self.kept)

    def _remove(self, kept: Kept, _event: Any) -> None:
        self._hand = [one for one in self._hand if one.number != kept.number]
        self._redraw()

    def _next_colour(self) -> str:
        # The first colours are those of what moves now.
        self._counted += 1
        return self._theme.palette[self._counted % len(self._theme.palette)]

    def _numbered(self, variant: Variant, reading: InstrumentReading) -> Kept:
        return Kept(number=next(self._numbers), variant=variant, reading=reading, colour=self._next_colour())

    def _redraw(self) -> None:
        self.chips.objects = [self._chip(kept) for kept in self.kept]
        self._changed(self.kept)
        self.follow()

    def _chip(self, kept: Kept) -> Any:
        # What a file says is removed in the file.
        by_hand = any(kept.number == one.number for one in self._hand)
        css = f".bk-btn.bk-btn-default {{ border-left: 5px solid {kept.colour} !important; padding: 1px 8px; }}"
        return button(
            f"{kept.variant.label}  ✕" if by_hand else kept.variant.label,
            partial(self._remove, kept) if by_hand else None,
            css,
            description="remove this variant" if by_hand else "a row of the file",
        )

    def _tabulate(self) -> None:
        now = self._desk.reading
        columns = [] if now is None else [(f"now: {self._desk.good.label}", self._theme.palette[0], now.quantities)]
        columns += [(kept.variant.label, kept.colour, kept.reading.quantities) for kept in self.kept]
        advice = "<p>Keep variants to see them side by side, here and as faded curves.</p>" if not self.kept else ""
        self._table.object = quantity_table(columns) + advice

    def _watch(self, file: Path, document: Document | None) -> None:
        look = self._tools.watch(self._desk.instrument, file)
        order = partial(self._look, look)
        order()
        if document is not None and document.session_context is not None:
            document.add_periodic_callback(order, WATCH_MS)
        else:
            # The first look can't know whether the last row is still being written.
            order()

    def _look(self, look: Callable[[], Rows]) -> None:
        self._latest.submit(
            partial(read_rows, self._desk.instrument, self._tools, look, self._looked_at), self._looked
        )

    def _looked(self, future: "Future[Looked | None]") -> None:
        error = future.exception()
        if error is not None:
            # The rows that were read before stay.
            self._words.object = message(told(error), ())
            return
        looked = future.result()
        if looked is None:
            return
        self._looked_at = looked.rows
        self._words.object = message(looked.rows.mistake, looked.words)
        self._counted = len(self._hand)
        self._rows = [self._numbered(variant, reading) for variant, reading in looked.found]
        self._redraw()


def _completed(instrument: Instrument, tools: Tools, partly: Sequence[Kept]) -> dict[int, InstrumentReading]:
    return {one.number: tools.read(instrument, one.variant.values, one.variant.options, None) for one in partly}


def read_rows(instrument: Instrument, tools: Tools, look: Callable[[], Rows], known: Rows | None) -> Looked | None:
    """Look at a file of rows and take a reading of each; None when the file says what it said.

    Raises
    ------
    ChladniError
        When the file can't be read.
    """
    rows = look()
    # Most looks find nothing new, and readings are dear.
    if rows == known:
        return None
    found: list[tuple[Variant, InstrumentReading]] = []
    words: list[str] = []
    # One bad row doesn't take the others away.
    for variant in rows.variants[:MOST_ROWS]:
        try:
            found.append((variant, tools.read(instrument, variant.values, variant.options, None)))
        except ChladniError as error:
            words.append(f"{variant.label}: {error}")
    if len(rows.variants) > MOST_ROWS:
        words.append(f"The first {MOST_ROWS} of {len(rows.variants)} rows are drawn.")
    return Looked(rows=rows, found=tuple(found), words=tuple(words))
