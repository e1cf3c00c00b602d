"""Influence coefficients of the setting on the page, computed when one looks and rests."""

from functools import partial
from typing import TYPE_CHECKING, Any

from bokeh.document import Document

from chladni.viewers.bench.desk import Desk
from chladni.viewers.bench.errors import told
from chladni.viewers.bench.latest import Latest
from chladni.viewers.bench.parts import column, html
from chladni.viewers.bench.pause import Pause
from chladni.viewers.bench.tools import Tools
from chladni.viewers.bench.words import INFLUENCE_CSS, MESSAGE_CSS, influence_table, message

if TYPE_CHECKING:
    from concurrent.futures import Future

    from chladni.models.core.reading import InfluenceTable

#: A table takes some tens of readings: it waits until the knob rests.
REST_S = 0.4


class InfluenceView:
    """The table; `follow` says that the setting changed."""

    def __init__(self, desk: Desk, tools: Tools, document: Document | None) -> None:
        self._desk, self._tools = desk, tools
        self._latest = Latest(document)
        self._pause = Pause(document, seconds=REST_S, action=self._compute)
        self._shown = False
        self._pane = html("", INFLUENCE_CSS, MESSAGE_CSS)
        self.view = column(self._pane, margin=(8, 0), visible=False)

    def show(self, shown: bool) -> None:
        """Open or close the view."""
        self._shown = shown
        self.view.visible = shown
        if shown:
            self._pane.object = self._pane.object or "<p>computing …</p>"
            self._compute()

    def follow(self) -> None:
        """Compute again after a rest, when somebody looks."""
        # Tens of readings for a table that nobody looks at would slow down the knobs.
        if self._shown:
            self._pause.touch()

    def close(self) -> None:
        """End."""
        self._latest.close()

    def _compute(self) -> None:
        setting = self._desk.good
        self._latest.submit(
            partial(self._tools.influence, self._desk.instrument, setting.values, setting.options), self._answered
        )

    def _answered(self, future: "Future[InfluenceTable]") -> None:
        error: Any = future.exception()
        self._pane.object = message(told(error), ()) if error is not None else influence_table(future.result())
