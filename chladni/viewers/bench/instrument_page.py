"""The page of one instrument, made from its declaration."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bokeh.document import Document

from chladni.models.core.instrument import Instrument, Option
from chladni.models.core.reading import InstrumentReading
from chladni.signals.errors import ModelError
from chladni.viewers.bench.board import Board
from chladni.viewers.bench.desk import Desk
from chladni.viewers.bench.download import Download
from chladni.viewers.bench.errors import told
from chladni.viewers.bench.influence_view import InfluenceView
from chladni.viewers.bench.knob import Knob
from chladni.viewers.bench.latest import Latest
from chladni.viewers.bench.log_view import LogView
from chladni.viewers.bench.parts import FILLING, WIDE, button, choice, column, flow, html, pn, row, switch, views
from chladni.viewers.bench.theme import Ground, theme
from chladni.viewers.bench.tools import Export, Shown, Tools, Variant
from chladni.viewers.bench.variants_view import Kept, VariantsView
from chladni.viewers.bench.words import MESSAGE_CSS, STRIP_CSS, message, quantity_strip

if TYPE_CHECKING:
    from concurrent.futures import Future

VIEWS = ("Behaviour", "Influence", "Variants", "Measured log")
KNOBS_WIDTH = 300
SWITCH = ("off", "on")
#: A page waits so long for its first charts; what takes longer (a law compiled for the first time) comes after it.
PATIENCE_S = 0.3

_MAIN_CSS = ":host { min-height: 0 !important; height: 100% !important; }"
_KNOBS_CSS = """
:host {
  background: var(--c-card); border: 1px solid var(--c-line); border-radius: 6px; padding: 8px 10px;
  box-sizing: border-box; overflow-y: auto; max-height: calc(100vh - 62px);
}
"""


class InstrumentPage:
    """Knobs, switches, charts, numbers and what goes with them.

    Parameters
    ----------
    instrument
        What to make a page of.
    tools
        What the page calls.
    document
        The page's document when a server holds it; None in a notebook, where everything happens at once.
    log
        A log to hold beside, or None.
    variants
        A file of rows to watch, or None.
    """

    def __init__(
        self,
        instrument: Instrument,
        tools: Tools,
        *,
        document: Document | None = None,
        ground: Ground = "light",
        log: Path | None = None,
        variants: Path | None = None,
    ) -> None:
        look = theme(ground)
        self.desk = Desk(instrument)
        self._tools, self._document = tools, document
        # Two threads: a picture that is being drawn must not hold up the next turn of a knob.
        self._reader, self._exporter = Latest(document), Latest(document)
        self._error = ""
        self.words = html("", MESSAGE_CSS)
        self.strip = html("", STRIP_CSS, margin=(0, 0, 6, 0))
        self.board = Board(look, first=first_charts(instrument), wanted=self._ask)
        self.knobs = {
            name: Knob(parameter, turned=self._turned, refused=self._refuse)
            for name, parameter in instrument.parameters.items()
        }
        self.options = {option.name: self._option(option) for option in instrument.options}
        self.influence = InfluenceView(self.desk, tools, document)
        self.variants = VariantsView(
            self.desk, tools, theme=look, document=document, file=variants, changed=self._ghosts
        )
        self.log = LogView(self.desk, tools, theme=look, document=document, path=log)
        self.views = views(VIEWS, self._look_at)
        self.exports = [self._export(export) for export in tools.exports]
        self.behaviour = column(self.strip, self.board.view, sizing_mode="stretch_both", stylesheets=[FILLING])
        self._ask()
        self._reader.settle(PATIENCE_S)
        # Who names a log wants to see it first.
        if log is not None:
            self.views.value = VIEWS[-1]

    def view(self) -> Any:
        """Lay the page out."""
        bar = flow(
            self.views,
            flow(self.variants.keep, self._reset_button(), *(one.view for one in self.exports), sizing_mode=None),
            justify="space-between",
            margin=(0, 0, 6, 0),
        )
        main = column(
            bar, self.words, self.variants.strip, self.behaviour, self.influence.view, self.variants.view,
            self.log.view, sizing_mode="stretch_both", margin=(0, 0, 0, 10), stylesheets=[_MAIN_CSS],
        )  # fmt: skip
        return row(self._side(), main, sizing_mode="stretch_both", stylesheets=[FILLING])

    def close(self) -> None:
        """End the page's threads and let go of its log."""
        for one in (self._reader, self._exporter, self.influence, self.variants, self.log):
            one.close()

    def _side(self) -> Any:
        switches = [column(*self.options.values(), margin=(0, 0, 8, 0))] if self.options else []
        knobs = (knob.view() for knob in self.knobs.values())
        return column(*switches, *knobs, sizing_mode=None, width=KNOBS_WIDTH, stylesheets=[_KNOBS_CSS])

    def _option(self, option: Option) -> Any:
        label = option.meaning or option.name.replace("_", " ")
        changed = partial(self._switched, option)
        if option.choices == SWITCH:
            return switch(label, option.default == "on", changed)
        return choice(label, list(option.choices), option.default, changed, sizing_mode=WIDE)

    def _reset_button(self) -> Any:
        return button("Reset", self._reset)

    def _export(self, export: Export) -> Download:
        return Download(
            label=export.label,
            file_name=export.file_name.format(name=self.desk.instrument.name),
            media_type=export.media_type,
            latest=self._exporter,
            build=partial(self._exporting, export),
            failed=lambda error: self._refuse(told(error)),
        )

    def _exporting(self, export: Export) -> Callable[[], bytes]:
        """Give the job with what the page shows now, however the knobs turn until it runs."""
        # Taken now, on the page's thread: the job runs later.
        good, known, charts = self.desk.good, self.desk.reading is not None, self.board.shown()
        instrument = self.desk.instrument

        def build() -> bytes:
            if not known:
                raise ModelError(f"{instrument.name}: this setting gave no reading; there is nothing to save")
            model = instrument.model(good.values, good.options)
            # With all charts: a log is as long as the longest step, whatever the page shows.
            reading = self._tools.read(instrument, good.values, good.options, None)
            return export.build(Shown(instrument=instrument, model=model, reading=reading, charts=charts))

        return build

    def _turned(self, name: str, value: float) -> None:
        self.desk.turn(name, value)
        self._ask()

    def _switched(self, option: Option, event: Any) -> None:
        word = ("on" if event.new else "off") if option.choices == SWITCH else event.new
        # Putting a switch back after a refusal is no wish of the user.
        if self.desk.asked.options[option.name] != word:
            self.desk.switch(option.name, word)
            self._ask()

    def _reset(self, _event: Any) -> None:
        # A fresh desk says what is declared.
        self.desk.load(Desk(self.desk.instrument).good)
        self._show_setting()
        self._ask()

    def _ask(self) -> None:
        setting, names = self.desk.asked, self.board.names
        job = partial(self._tools.read, self.desk.instrument, setting.values, setting.options, names)
        self._reader.submit(job, partial(self._answered, setting, names))

    def _answered(self, setting: Variant, asked: Sequence[str] | None, future: "Future[InstrumentReading]") -> None:
        error = future.exception()
        with self._one_patch():
            if error is not None:
                self._refuse(told(error))
                # Where a newer setting waits already, it may be a good one: nothing is put back.
                if self.desk.asked is setting:
                    self.desk.give_up()
                    self._show_setting()
                return
            self._error = ""
            for knob in self.knobs.values():
                knob.echo()
            self.desk.accept(setting, future.result())
            self._draw(future.result())
        # Another setting has other charts, and the reader may have chosen one meanwhile; but never twice the same.
        if asked is not None and set(self.board.missing()) - set(asked):
            self._ask()

    def _draw(self, reading: InstrumentReading) -> None:
        self.board.show(reading.charts, reading.offered)
        self.strip.object = quantity_strip(reading.quantities)
        self.words.object = message(self._error, reading.flags)
        # Last, since each only notes that there is something to follow.
        for follower in (self.influence, self.variants, self.log):
            follower.follow()

    def _show_setting(self) -> None:
        """Put knobs and switches where the setting is."""
        for name, value in self.desk.asked.values.items():
            self.knobs[name].show(value)
        for option in self.desk.instrument.options:
            word = self.desk.asked.options[option.name]
            self.options[option.name].value = word == "on" if option.choices == SWITCH else word

    def _refuse(self, line: str) -> None:
        self._error = f"{line}; the last good state stays" if self.desk.reading is not None else line
        self.words.object = message(self._error, self.desk.reading.flags if self.desk.reading is not None else ())

    def _ghosts(self, kept: Sequence[Kept]) -> None:
        with self._one_patch():
            self.board.show_ghosts([(one.variant.label, one.colour, one.reading.charts) for one in kept])

    def _look_at(self, event: Any) -> None:
        with self._one_patch():
            # Views are hidden, not removed: a figure that is made anew takes as long as the whole page.
            self.behaviour.visible = event.new == VIEWS[0]
            self.influence.show(event.new == VIEWS[1])
            self.variants.show(event.new == VIEWS[2])
            self.log.show(event.new == VIEWS[3])

    def _one_patch(self) -> AbstractContextManager[None]:
        """Send what changes inside as one message: curves and numbers of one setting arrive together."""
        held: AbstractContextManager[None] = pn.io.hold(self._document)
        return held


def first_charts(instrument: Instrument) -> list[str]:
    """Give the charts to open with: time, magnitude and loop above; acceleration, phase and roots below."""
    return [f"step.{instrument.step_output}", "bode.magnitude", "nyquist", "step.acceleration", "bode.phase", "poles"]


def heading(instrument: Instrument, ground: Ground, *, query: str = "") -> str:
    """Give the line above a page: name, way back, other ground, and who can reach it."""
    other = theme(ground).other
    return (
        f'<div class="head"><a href="./">All instruments</a><h1>{escape(instrument.title)}</h1>'
        f'<span class="grow"></span><span>only this computer can reach this page</span>'
        f'<a href="?theme={other}{escape(query)}">{other}</a></div>'
    )
