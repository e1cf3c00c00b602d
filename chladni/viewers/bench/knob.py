"""A knob: symbol and meaning, slider, entry with unit."""

from collections.abc import Callable
from html import escape
from typing import Any

from chladni.models.core.parameter import Parameter
from chladni.signals.errors import ChladniError
from chladni.viewers.bench.knob_scale import KnobScale
from chladni.viewers.bench.parts import WIDE, column, entry, html, row, slider
from chladni.viewers.bench.words import printed, symbol

Turned = Callable[[str, float], None]
Refused = Callable[[str], None]

_LABEL_CSS = """
div.knob { display: flex; gap: 6px; align-items: baseline; white-space: nowrap; overflow: hidden; }
.knob i { color: var(--c-accent); font-weight: 600; }
.knob sub { font-size: 75%; line-height: 0; }
.knob span { overflow: hidden; text-overflow: ellipsis; }
.knob small { color: var(--c-soft); margin-left: auto; padding-left: 6px; }
"""
_SLIDER_CSS = """
.bk-slider-title { display: none; }
.noUi-horizontal { height: 4px; margin-top: 10px; top: 5px; }
.noUi-horizontal .noUi-handle { width: 14px; height: 14px; top: -6px; right: -7px; }
"""
_ENTRY_CSS = "input { text-align: right; }"


class Knob:
    """One parameter to turn, by mouse, by arrow keys, or by typing a number (with any fitting unit).

    Parameters
    ----------
    turned
        Called with name and value (SI) when the user turned it.
    refused
        Called with one line when what was typed is no possible value; the entry then shows the last value again.
    """

    def __init__(self, parameter: Parameter, *, turned: Turned, refused: Refused) -> None:
        self.parameter = parameter
        self.scale = KnobScale.of(parameter)
        self.value = parameter.value
        self._turned, self._refused = turned, refused
        self._showing = self._behind = False
        # Both widgets stand for one value, and each follows the other; `_showing` tells our changes from the user's.
        self.slider = self._slider()
        self.entry = entry(self.scale.text(self.value), _ENTRY_CSS, width=84)
        self.slider.param.watch(self._on_slider, "value")
        self.entry.param.watch(self._on_entry, "value")

    def view(self) -> Any:
        """Lay the knob out."""
        return column(
            html(self._label(), _LABEL_CSS), row(self.slider, self.entry, sizing_mode=WIDE), margin=(0, 0, 5, 0)
        )

    def show(self, value: float) -> None:
        """Show a value (SI) that didn't come from this knob."""
        self.value = value
        self._showing = True
        try:
            self.slider.value = self.scale.place(value)
            self.entry.value = self.scale.text(value)
        finally:
            self._showing = False

    def echo(self) -> None:
        """Let the entry say what the slider was turned to."""
        # Twenty knobs stand still while one turns.
        if not self._behind:
            return
        self._behind = False
        self._showing = True
        self.entry.value = self.scale.text(self.value)
        self._showing = False

    def _slider(self) -> Any:
        return slider(
            self.parameter.name,
            _SLIDER_CSS,
            start=self.scale.start,
            end=self.scale.end,
            step=self.scale.step,
            value=self.scale.place(self.value),
            margin=(0, 12, 0, 7),
            height=24,
        )

    def _label(self) -> str:
        name = self.parameter.name.replace("_", " ")
        letter = f"<i>{symbol(self.parameter.symbol)}</i>" if self.parameter.symbol else ""
        # A tooltip rather than a line of its own: twenty knobs have to fit.
        told = "; ".join(filter(None, (self.parameter.meaning, self.scale.usual_range())))
        return (
            f'<div class="knob" title="{escape(told)}">{letter}<span>{escape(name)}</span>'
            f"<small>{escape(printed(self.scale.unit))}</small></div>"
        )

    def _on_slider(self, event: Any) -> None:
        if not self._showing:
            # The entry follows with the curves, see `echo`: a message of its own would come before them.
            self._behind = True
            self._accept(self.scale.value(event.new))

    def _on_entry(self, event: Any) -> None:
        if self._showing:
            return
        try:
            value = self.scale.read(event.new)
        # What was typed is gone, so that the page never shows a value that isn't in its curves.
        except ChladniError as error:
            self._refused(str(error))
            self.show(self.value)
        else:
            self.show(value)
            self._accept(value)

    def _accept(self, value: float) -> None:
        self.value = value
        self._turned(self.parameter.name, value)
