"""A measured log beside the simulation: which channel is what, from when to when, and how well they agree."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bokeh.document import Document

from chladni.models.core.instrument import Options, Values
from chladni.models.core.port import Terminal
from chladni.models.core.reading import InstrumentReading
from chladni.signals.errors import ChladniError
from chladni.signals.visible import visible
from chladni.viewers.bench.board import Board
from chladni.viewers.bench.desk import Desk
from chladni.viewers.bench.dropper import Dropper
from chladni.viewers.bench.errors import told
from chladni.viewers.bench.latest import Latest
from chladni.viewers.bench.parts import FILLING, choice, column, flow, html, pn, seconds_entry
from chladni.viewers.bench.pause import Pause
from chladni.viewers.bench.theme import Theme
from chladni.viewers.bench.tools import Assignment, MeasuredLog, Tools
from chladni.viewers.bench.words import MESSAGE_CSS, STRIP_CSS, message, quantity_strip

if TYPE_CHECKING:
    from concurrent.futures import Future

NOT_MEASURED = "– not in the log –"
REST_S = 0.3
#: Seconds of a log that are compared when the user says nothing: enough for a spectrum, quick to simulate.
FIRST_SPAN_S = 20.0

Terminals = tuple[tuple[Terminal, ...], tuple[Terminal, ...]]


class LogView:
    """Drop zone, choices, charts and scores."""

    def __init__(
        self, desk: Desk, tools: Tools, *, theme: Theme, document: Document | None, path: Path | None
    ) -> None:
        self._desk, self._tools, self._document = desk, tools, document
        self._log: MeasuredLog | None = None
        self._shown = self._filling = False
        self._path = path
        self._opener, self._comparer = Latest(document), Latest(document)
        self._pause = Pause(document, seconds=REST_S, action=self._compare)
        self.dropper = Dropper(taken=self._taken, refused=self._fail)
        self.start = seconds_entry("from [s]", 0.0, self._changed)
        self.span = seconds_entry("length [s]", FIRST_SPAN_S, self._changed)
        self.selects: dict[str, Any] = {}
        self._words = html(_INVITATION, MESSAGE_CSS)
        self._scores = html("", STRIP_CSS, margin=(4, 0))
        self._choices = flow(margin=(4, 0), gap="8px")
        self.board = Board(theme)
        self.view = column(
            self.dropper, self._words, self._choices, self._scores, self.board.view,
            sizing_mode="stretch_both", margin=(8, 0), visible=False, stylesheets=[FILLING],
        )  # fmt: skip

    def show(self, shown: bool) -> None:
        """Open or close the view; a log named at the start is opened when one first looks."""
        self._shown = shown
        self.view.visible = shown
        if not shown:
            return
        # Not before: a large log takes seconds to survey, and most visits are for the charts.
        if self._path is not None:
            path, self._path = self._path, None
            self._opener.submit(partial(self._tools.open_log, path, path.name, False), self._opened)
        elif self._log is not None:
            self._compare()

    def follow(self) -> None:
        """Compare again after a rest, when somebody looks."""
        if self._shown and self._log is not None:
            self._pause.touch()

    def close(self) -> None:
        """End, and let go of the log."""
        self.dropper.close()
        self._opener.close()
        self._comparer.close()
        self._close_log()

    def _taken(self, name: str, path: Path) -> None:
        self._words.object = f"<p>reading {path.stat().st_size / 1e6:.1f} MB …</p>"
        self._opener.submit(partial(self._open_dropped, name, path), self._opened)

    def _open_dropped(self, name: str, path: Path) -> MeasuredLog:
        # On the thread, where waiting for a disk harms nobody.
        try:
            return self._tools.open_log(path, name, True)
        except ChladniError:
            path.unlink(missing_ok=True)
            raise

    def _opened(self, future: "Future[MeasuredLog]") -> None:
        error = future.exception()
        if error is not None:
            self._fail(told(error))
            return
        self._let_go()
        self._log = future.result()
        self._words.object = message("", self._log.damage)
        if self._offer_choices(self._log):
            self._compare()

    def _let_go(self) -> None:
        """Close the log that was, and take away what was said about it: it would pass for the next one's."""
        # One log at a time: a dropped one would otherwise lie on the disk until the page is closed.
        self._close_log()
        self.selects = {}
        with pn.io.hold(self._document):
            self._scores.object = ""
            self._choices.objects = []
            self.board.show(())

    def _close_log(self) -> None:
        if self._log is not None:
            self._log.close()
        self._log = None

    def _fail(self, line: str) -> None:
        """Say why there is no log; the name where it was dropped is already that of the one that failed."""
        self._let_go()
        self._refuse(line)

    def _refuse(self, line: str) -> None:
        self._words.object = message(line, self._log.damage if self._log is not None else ())

    def _offer_choices(self, log: MeasuredLog) -> bool:
        """Offer the log's channels for the model's signals, and say whether there are any."""
        try:
            model = self._desk.instrument.model(self._desk.good.values, self._desk.good.options)
            terminals, assigned = self._tools.terminals(model), self._tools.assign(model, log.channels)
        except ChladniError as error:
            self._refuse(told(error))
            return False
        # An hour of log is no start; the user may ask for more.
        self.span.value = min(FIRST_SPAN_S, round(log.duration_s, 3))
        names = {visible(name): name for name in (NOT_MEASURED, *(channel.name for channel in log.channels))}
        self.selects = self._selects(terminals, names, assigned)
        self._choices.objects = [*self.selects.values(), self.start, self.span]
        return True

    def _selects(self, terminals: Terminals, names: dict[str, str], assigned: Assignment) -> dict[str, Any]:
        made = {}
        for words, group in zip(("input", "output"), terminals, strict=True):
            for terminal in group:
                label, chosen = (
                    f"{words} {terminal.name} [{terminal.unit}]",
                    assigned.get(terminal.name, NOT_MEASURED),
                )
                made[terminal.name] = choice(label, names, chosen, self._changed, width=210, margin=0)
        return made

    def _changed(self, _event: Any) -> None:
        self.follow()

    def _compare(self) -> None:
        if self._log is None:
            return
        assignment = {name: select.value for name, select in self.selects.items() if select.value != NOT_MEASURED}
        # The last good setting: what the other view shows.
        setting = self._desk.good
        self._comparer.submit(
            partial(self._job, setting.values, setting.options, self._log, assignment),
            partial(self._compared, self._log),
        )

    def _job(self, values: Values, options: Options, log: MeasuredLog, assignment: Assignment) -> InstrumentReading:
        model = self._desk.instrument.model(values, options)
        return self._tools.compare(model, log, assignment, self.start.value or 0.0, self.span.value or FIRST_SPAN_S)

    def _compared(self, log: MeasuredLog, future: "Future[InstrumentReading]") -> None:
        # An answer may be on its way while another log is dropped.
        if log is not self._log:
            return
        error = future.exception()
        if error is not None:
            # The comparison that stands stays, with the line that says why there is no new one.
            self._refuse(told(error))
            return
        reading = future.result()
        with pn.io.hold(self._document):
            self._words.object = message("", (*log.damage, *reading.flags))
            self._scores.object = quantity_strip(reading.quantities)
            self.board.show(reading.charts)


_INVITATION = (
    "<p>Drop a log or data file here, or choose one, to see it beside the simulation. It stays on this computer.</p>"
)
