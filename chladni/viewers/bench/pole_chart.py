"""The stabilisation chart of a page, in which poles are clicked, with measured and synthesised functions below it."""

from collections.abc import Callable
from math import ceil, floor, log10, nan
from typing import Any

import numpy as np
from bokeh.models import (
    ColumnDataSource,
    CustomJSTickFormatter,
    FixedTicker,
    HoverTool,
    LogAxis,
    LogScale,
    Range1d,
    TapTool,
)
from bokeh.models.annotations import Legend, LegendItem
from bokeh.plotting import figure

from chladni.models.core.reading import Scale
from chladni.signals.arrays import Real
from chladni.signals.mode_set import ModeSet
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.unit_text import printed_unit
from chladni.viewers.bench.curve_points import inline, thinned
from chladni.viewers.bench.theme import Theme
from chladni.viewers.bench.tile import TICK_JS
from chladni.viewers.overlays import Overlay
from chladni.viewers.stabilisation import frequency_range, order_range, title
from chladni.viewers.style import STATUS_ON_DARK, STATUS_ON_LIGHT

# In the order of POLE_STATUSES.
MARKERS = ("circle", "triangle", "square", "circle")
STATUSES = ("new", "stable in frequency", "in frequency and damping", "in frequency, damping and vector")
POLE_SIZE, RING_SIZE = 6, 11
SIDE_PX = 84
#: Between the words of a legend and the next sign.
LEGEND_PX = 14
#: Of curves on a logarithmic axis: what lies further below the highest says nothing.
DECADES = 6.0
#: Up to so many, 2 and 5 of each find room.
FEW_DECADES = 3


class PoleChart:
    """Poles over the indicator; a click at one tells its row.

    Parameters
    ----------
    clicked
        Called with the row of the pole in its diagram.
    """

    def __init__(self, modes: ModeSet, look: Theme, *, clicked: Callable[[int], None]) -> None:
        self._look, self._clicked = look, clicked
        diagram = _diagram(modes)
        self.poles, self.rings = ColumnDataSource(_poles(diagram, look)), ColumnDataSource(_no_poles())
        self.modes, self.wanted = ColumnDataSource({"x": []}), ColumnDataSource({"x": []})
        self.curves = ColumnDataSource({"xs": [], "ys": []})
        self.figure = _frame("Model order", frequency_range(modes.frequency_hz, diagram), order_range(diagram))
        self._draw(diagram)
        self.poles.selected.on_change("indices", self._on_selection)
        self.show(modes)

    def show(self, modes: ModeSet) -> None:
        """Replace poles, rings and lines."""
        diagram = _diagram(modes)
        poles = _poles(diagram, self._look)
        # The table of poles is nearly always the same; then nothing is sent.
        if not _alike(poles, self.poles.data):
            self.poles.data = poles
        taken = diagram.mode >= 0
        self.rings.data = {
            "x": inline(diagram.frequency_hz[taken]),
            "y": inline(diagram.order[taken].astype(np.float64)),
        }
        self.modes.data = {"x": inline(modes.frequency_hz)}
        self.wanted.data = {"x": []}

    def expect(self, frequencies_hz: tuple[float, ...]) -> None:
        """Mark frequencies that are asked for and not fitted yet."""
        self.wanted.data = {"x": inline(np.array(frequencies_hz))}

    def _on_selection(self, _name: str, _old: Any, rows: list[int]) -> None:
        if not rows:
            return
        # Not a selection that stays: the next click at the same pole must be told too.
        self.poles.selected.indices = []
        # Of poles one above the other the one drawn last is seen.
        self._clicked(int(rows[-1]))

    def _draw(self, diagram: StabilisationDiagram) -> None:
        chart = self.figure
        low, high = _levels(diagram)
        chart.extra_y_ranges = {"indicator": _range(low, high)}
        chart.extra_y_scales = {"indicator": LogScale()}
        unit = printed_unit(diagram.indicator_unit)
        beside: Any = LogAxis(y_range_name="indicator", axis_label=f"{title(diagram)} [{unit}]")
        beside.ticker = _decade_ticks(low, high)
        chart.add_layout(beside, "right")
        self.curves.data = _curves(diagram)
        chart.multi_line(
            "xs", "ys", source=self.curves, y_range_name="indicator", line_color=self._look.soft, line_alpha=0.55
        )
        chart.vspan(x="x", source=self.wanted, line_color=self._look.warning, line_dash="dashed", line_width=1.5)
        chart.vspan(x="x", source=self.modes, line_color=self._look.text, line_width=1.0, line_alpha=0.55)
        chart.scatter(
            "x", "y", source=self.rings, marker="circle", size=RING_SIZE, fill_color=None,
            line_color=self._look.text, line_width=1.4,
        )  # fmt: skip
        poles = chart.scatter(
            "x", "y", source=self.poles, marker="marker", size=POLE_SIZE, color="colour",
            nonselection_alpha=1.0, nonselection_color="colour",
        )  # fmt: skip
        # Glyphs that lie nowhere: a legend made of the poles would name the statuses in the order of their places.
        items = [
            LegendItem(
                label=words, renderers=[chart.scatter([nan], [nan], marker=marker, size=POLE_SIZE, color=colour)]
            )
            for words, marker, colour in zip(STATUSES, MARKERS, _colours(self._look), strict=True)
        ]
        chart.add_layout(Legend(items=items, orientation="horizontal", spacing=LEGEND_PX), "above")
        told = [("", "@x{0.000} Hz, damping @damping{0.00} %"), ("", "order @y, @status")]
        chart.add_tools(HoverTool(renderers=[poles], tooltips=told), TapTool(renderers=[poles]))


class FunctionChart:
    """One function, measured and synthesised, over the same frequencies as the poles."""

    def __init__(self, look: Theme, beside: Any) -> None:
        self.measured, self.synthesised = ColumnDataSource({"x": [], "y": []}), ColumnDataSource({"x": [], "y": []})
        self.figure = _frame("|H|", beside.x_range, None, scale="log")
        self.figure.line("x", "y", source=self.measured, line_color=look.palette[0], line_width=2.2, line_alpha=0.65,
                         legend_label="measured")  # fmt: skip
        self.figure.line("x", "y", source=self.synthesised, line_color=look.text, line_width=1.3, line_dash=[5, 3],
                         legend_label="synthesised")  # fmt: skip
        self.figure.legend.location = "top_left"
        self.figure.legend.orientation = "horizontal"
        self.figure.legend.spacing = LEGEND_PX
        self.figure.add_layout(self.figure.legend[0], "above")

    def show(self, overlay: Overlay | None, unit: str) -> None:
        """Replace both curves; none without an overlay."""
        if overlay is None:
            # The measured function stays where it was: nothing synthesises it.
            self.synthesised.data = {"x": [], "y": []}
            return
        self.figure.yaxis[0].axis_label = f"|H| [{printed_unit(unit)}]"
        measured, made = np.abs(overlay.measured), np.abs(overlay.synthesised)
        self.measured.data = _line(overlay.measured_hz, measured)
        self.synthesised.data = _line(overlay.frequency_hz, made)
        known = np.concatenate([measured, made])
        low, high = _decades(known[np.isfinite(known) & (known > 0)])
        self.figure.y_range.update(start=low, end=high)


def _diagram(modes: ModeSet) -> StabilisationDiagram:
    assert modes.stabilisation is not None  # noqa: S101  # a picking has one
    return modes.stabilisation


def _frame(label: str, x_range: Any, y_range: Any, scale: Scale = "linear") -> Any:
    made: Any = figure(
        x_axis_label="Frequency [Hz]",
        y_axis_label=label,
        y_axis_type=scale,
        x_range=_range(*x_range) if isinstance(x_range, tuple) else x_range,
        y_range=_range(*(y_range or (0.1, 1.0))),
        sizing_mode="stretch_both",
        min_height=200,
        # The same on both sides of both charts, so that a frequency stands below itself.
        min_border_left=SIDE_PX,
        min_border_right=SIDE_PX,
        tools="pan,box_zoom,xwheel_zoom,reset",
        output_backend="canvas",
    )
    made.toolbar.logo = None
    made.toolbar.autohide = True
    for axis in (made.xaxis, made.yaxis) if scale == "linear" else (made.xaxis,):
        axis.formatter = CustomJSTickFormatter(code=TICK_JS)
    return made


def _range(low: float, high: float) -> Any:
    return Range1d(start=low, end=high, syncable=False)


def _no_poles() -> dict[str, Any]:
    return {"x": [], "y": []}


def _poles(diagram: StabilisationDiagram, look: Theme) -> dict[str, Any]:
    words = _colours(look)
    return {
        "x": inline(diagram.frequency_hz),
        "y": inline(diagram.order.astype(np.float64)),
        "damping": inline(100 * diagram.damping_ratio),
        "colour": [words[status] for status in diagram.status],
        "marker": [MARKERS[status] for status in diagram.status],
        "status": [STATUSES[status] for status in diagram.status],
    }


def _colours(look: Theme) -> list[str]:
    colours = STATUS_ON_LIGHT if look.ground == "light" else STATUS_ON_DARK
    return ["#{:02x}{:02x}{:02x}".format(*colour) for colour in colours]


def _alike(one: dict[str, Any], other: Any) -> bool:
    return all(np.array_equal(one[name], other[name]) for name in ("x", "y", "damping")) and (
        one["status"] == other["status"]
    )


def _curves(diagram: StabilisationDiagram) -> dict[str, Any]:
    lines = [thinned(diagram.indicator_hz, np.where(curve > 0, curve, np.nan)) for curve in diagram.indicator]
    return {"xs": [inline(x) for x, _ in lines], "ys": [inline(y) for _, y in lines]}


def _levels(diagram: StabilisationDiagram) -> tuple[float, float]:
    return _decades(diagram.indicator[diagram.indicator > 0])


def _decades(values: Real) -> tuple[float, float]:
    if not values.size:
        return 0.1, 1.0
    high = float(values.max())
    return max(float(values.min()), high * 10**-DECADES) / 1.5, high * 1.5


def _decade_ticks(low: float, high: float) -> FixedTicker:
    """Mark decades, and 2 and 5 of them where there are few; Bokeh's own marks stop at the highest decade's tenth."""
    first, last = floor(log10(low)), ceil(log10(high))
    of_each = (1, 2, 5) if last - first <= FEW_DECADES else (1,)
    return FixedTicker(ticks=[one * 10.0**decade for decade in range(first, last + 1) for one in of_each])


def _line(x: Real, y: Real) -> dict[str, Any]:
    x, y = thinned(x, np.where(y > 0, y, np.nan))
    return {"x": inline(x), "y": inline(y)}
