"""The page on which modes are picked: the stabilisation chart, synthesis, MAC, the modes and their list."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from html import escape as inert
from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.document import Document
from bokeh.models import ColumnDataSource, FactorRange
from bokeh.plotting import figure

from chladni.modal.shapes.mode_words import synthesised_from
from chladni.signals.channel import labels_of
from chladni.viewers.bench.errors import told
from chladni.viewers.bench.latest import Latest
from chladni.viewers.bench.parts import FILLING, WIDE, button, choice, column, drawing, flow, html, pn, row
from chladni.viewers.bench.picked import Picked, Picking
from chladni.viewers.bench.pole_chart import FunctionChart, PoleChart
from chladni.viewers.bench.theme import Ground, Theme, theme
from chladni.viewers.bench.words import MESSAGE_CSS, escape, message
from chladni.viewers.mode_tables import mode_table, mode_ticks
from chladni.viewers.overlays import Overlay, overlay_pages
from chladni.viewers.style import mac_colours

if TYPE_CHECKING:
    from concurrent.futures import Future

SIDE_WIDTH = 400
#: Up to so many modes every cell of the MAC has its number.
NUMBERED = 9
#: So long the page has to say that the selection is kept before its server ends.
FAREWELL_MS = 400

_SIDE_CSS = """
:host {
  background: var(--c-card); border: 1px solid var(--c-line); border-radius: 6px; padding: 8px 10px;
  box-sizing: border-box; overflow-y: auto; max-height: calc(100vh - 62px);
}
"""
_CARD_CSS = """
:host { background: var(--c-card); border: 1px solid var(--c-line); border-radius: 6px; padding: 4px 6px;
  min-height: 0 !important; overflow: hidden; }
"""
_TABLE_CSS = """
p { margin: 2px 0 6px; color: var(--c-soft); }
td, th { padding-right: 8px; }
code { display: block; background: var(--c-page); border: 1px solid var(--c-line); border-radius: 4px;
  padding: 4px 6px; margin: 4px 0; user-select: all; white-space: normal; overflow-wrap: anywhere; font-size: 12px; }
"""


class PickingPage:
    """Charts of a picking; a click at a pole picks its mode, or lets go of it.

    Parameters
    ----------
    picking
        What is picked; pages of one picking share it.
    document
        The page's document when a server holds it; None in a notebook, where everything happens at once.
    keep
        Called when the selection is kept; None where nobody waits for that.
    """

    def __init__(
        self,
        picking: Picking,
        *,
        document: Document | None = None,
        ground: Ground = "light",
        keep: Callable[[], None] | None = None,
    ) -> None:
        self.picking, self._document, self._keep = picking, document, keep
        look = theme(ground)
        self._fitter = Latest(document)
        self.words, self.notes = html("", MESSAGE_CSS), html("", MESSAGE_CSS)
        self.table = html("", _TABLE_CSS)
        modes = picking.shown.modes
        self.poles = PoleChart(modes, look, clicked=self._clicked)
        self.functions = FunctionChart(look, self.poles.figure) if picking.shown.response is not None else None
        self.function = choice("Function", [], None, self._choose, sizing_mode=WIDE)
        self.assurance = AssuranceChart(look)
        self._overlays: dict[str, tuple[Overlay, str]] = {}
        self._draw(picking.shown)

    def view(self) -> Any:
        """Lay the page out."""
        charts = [self._card(drawing(self.poles.figure, sizing_mode="stretch_both"))]
        if self.functions is not None:
            charts.append(self._card(self.function, drawing(self.functions.figure, sizing_mode="stretch_both")))
        buttons = [button("Let go of all", self._clear)]
        if self._keep is not None:
            self.keep = button("Keep these modes", self._kept)
            buttons.append(self.keep)
        side = column(
            flow(*buttons), self.words, self.table, self.assurance.view, self.notes, sizing_mode=None,
            width=SIDE_WIDTH, stylesheets=[_SIDE_CSS],
        )  # fmt: skip
        main = column(*charts, sizing_mode="stretch_both", margin=(0, 8, 0, 0), stylesheets=[FILLING])
        return row(main, side, sizing_mode="stretch_both", stylesheets=[FILLING])

    def close(self) -> None:
        """End the page's thread."""
        self._fitter.close()

    def _card(self, *parts: Any) -> Any:
        return column(*parts, sizing_mode="stretch_both", margin=(0, 0, 8, 0), stylesheets=[_CARD_CSS])

    def _clicked(self, pole: int) -> None:
        self._ask(self.picking.toggle(pole))

    def _clear(self, _event: Any) -> None:
        self.picking.asked = ()
        self._ask(())

    def _ask(self, frequencies_hz: tuple[float, ...]) -> None:
        with pn.io.hold(self._document):
            self.poles.expect(frequencies_hz)
            self.words.object = message("", ("Fitting …",))
        self._fitter.submit(partial(self.picking.fit, frequencies_hz), self._fitted)

    def _fitted(self, future: "Future[Picked]") -> None:
        error = future.exception()
        with pn.io.hold(self._document):
            if error is not None:
                self.picking.give_up()
                self._draw(self.picking.shown)
                self.words.object = message(f"{told(error)}. What was picked stays.", ())
                return
            self.picking.accept(future.result())
            self._draw(self.picking.shown)

    def _draw(self, picked: Picked) -> None:
        self.words.object = ""
        self.notes.object = message("", picked.modes.provenance.notes)
        self.table.object = _told(picked)
        self.poles.show(picked.modes)
        self.assurance.show(picked)
        self._offer(picked)

    def _offer(self, picked: Picked) -> None:
        """Offer the functions, those that fit worst first, and show the one that was looked at."""
        if self.functions is None:
            return
        pages = overlay_pages(replace(picked.modes, fit=picked.synthesis), picked.response)
        drawn = [(overlay, page.unit) for page in pages for overlay in page.overlays]
        names = labels_of((*picked.modes.channels, *picked.modes.references))
        drawn.sort(key=lambda one: -one[0].error)
        before = self.function.value
        self._overlays = {
            f"{names[one.response.name]} / {names[one.reference.name]}": (one, unit) for one, unit in drawn
        }
        if drawn:
            words = list(self._overlays)
            chosen = before if before in words else words[0]
            self.function.param.update(options=words, value=chosen)
        self._choose(None)

    def _choose(self, _event: Any) -> None:
        if self.functions is None:
            return
        overlay, unit = self._overlays.get(self.function.value, (None, ""))
        self.functions.show(overlay, unit)

    def _kept(self, _event: Any) -> None:
        if not self.picking.shown.frequencies_hz:
            self.words.object = message("No mode is picked. Click a pole first.", ())
            return
        self.keep.disabled = True
        self.words.object = message("", ("Kept. The terminal goes on; this page can be closed.",))
        if self._keep is None:
            return
        if self._document is None:
            self._keep()
        else:
            self._document.add_timeout_callback(self._keep, FAREWELL_MS)


class AssuranceChart:
    """AutoMAC of the modes that are picked."""

    def __init__(self, look: Theme) -> None:
        self._look = look
        self.cells = ColumnDataSource(_no_cells())
        self.figure: Any = figure(
            x_range=FactorRange(), y_range=FactorRange(), height=300, sizing_mode="stretch_width", tools="",
            title="AutoMAC", x_axis_location="below", output_backend="canvas",
        )  # fmt: skip
        self.figure.toolbar_location = None
        self.figure.grid.visible = False
        self.figure.xaxis.major_label_orientation = 0.9
        self.figure.rect("column", "row", 0.97, 0.97, source=self.cells, fill_color="colour", line_color=None)
        self.figure.text(
            "column", "row", "number", source=self.cells, text_align="center", text_baseline="middle",
            text_color="ink", text_font_size="11px",
        )  # fmt: skip
        self._drawing = drawing(self.figure, sizing_mode=WIDE)
        # Put in and taken out: a figure that was hidden isn't painted anew when it's shown.
        self.view = column(sizing_mode=WIDE)

    def show(self, picked: Picked) -> None:
        """Replace the matrix; one mode is like itself, which is nothing to show."""
        names = list(mode_ticks(picked.modes))
        if len(names) < 2 or len(picked.modes.channels) < 2:
            self.view.objects = []
            return
        self.figure.x_range.factors, self.figure.y_range.factors = names, names[::-1]
        places = [(line, place) for line in range(len(names)) for place in range(len(names))]
        values = [float(picked.mac[place]) for place in places]
        colours = mac_colours(np.array(values))
        self.cells.data = {
            "row": [names[line] for line, _ in places],
            "column": [names[place] for _, place in places],
            "colour": ["#{:02x}{:02x}{:02x}".format(*colour) for colour in colours.tolist()],
            "number": [f"{value:.2f}" if len(names) <= NUMBERED else "" for value in values],
            "ink": ["#101418" if value > 0.55 else "#f0f2f5" for value in values],
        }
        if not self.view.objects:
            self.view.objects = [self._drawing]


def _no_cells() -> dict[str, list[Any]]:
    return {"row": [], "column": [], "colour": [], "number": [], "ink": []}


def _told(picked: Picked) -> str:
    """Modes as a table, the error of their synthesis, and the list that repeats them."""
    if not picked.frequencies_hz:
        return "<p>Click a pole to pick its mode. A second click lets go of it.</p>"
    headings, rows = mode_table(picked.modes, None)
    head = "".join(f"<th>{escape(text)}</th>" for text in headings)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in one)}</tr>" for one in rows)
    listed = ", ".join(f"{one:g}" for one in picked.frequencies_hz)
    return (
        "<p>Click a pole to pick its mode, or one with a ring to let go of it.</p>"
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{_synthesis_told(picked)}"
        f"<p>This list gives the same modes again:</p><code>{inert(f'frequencies_hz=[{listed}]')}</code>"
    )


def _synthesis_told(picked: Picked) -> str:
    """How far the picked modes alone are off, and how far they are with what the terminal counts beside them."""
    whole, alone = picked.modes.fit, picked.synthesis
    if whole is None or alone is None:
        return ""
    if not whole.others(len(picked.frequencies_hz)):
        return f"<p>The synthesis of these modes is {whole.error:.2%} from the measured functions.</p>"
    return (
        f"<p>The synthesis of these modes alone is {alone.error:.2%} from the measured functions. That of "
        f"{synthesised_from(picked.modes)} is {whole.error:.2%} from them.</p>"
    )
