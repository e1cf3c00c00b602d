"""One chart on the page: a figure whose curves are replaced while it stands."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, CustomJSTickFormatter, HoverTool, NoOverlap
from bokeh.models.annotations import Legend, LegendItem
from bokeh.plotting import figure

from chladni.models.core.reading import Chart, Curve
from chladni.viewers.bench.curve_points import inline, straightened, thinned
from chladni.viewers.bench.theme import Theme
from chladni.viewers.bench.words import printed

Data = dict[str, Any]

#: More would turn a chart into a carpet, and a legend into a book.
LEGEND_FROM, LEGEND_INSIDE, LEGEND_TO = 2, 3, 8
TICKS = 5
#: Writes a tick of an axis. Bokeh writes 8.000e-5 and -1.000e-4, too wide to stand side by side under a small chart.
TICK_JS = """
const size = Math.abs(tick);
const step = ticks.length > 1 ? Math.abs(ticks[ticks.length - 1] - ticks[0]) / (ticks.length - 1) : size;
const digits = step > 0 ? Math.ceil(Math.log10(Math.max(size, step) / step)) + 2 : 6;
const short = Number(tick.toPrecision(Math.min(Math.max(digits, 2), 12)));
if (size > 0 && (size < 1e-3 || size >= 1e5)) {
  return short.toExponential().replace("e+", "e").replace(/-/g, "\u2212");
}
return String(short).replace("-", "\u2212");
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ghost:
    """A kept variant, as a tile draws it."""

    label: str
    colour: str
    chart: Chart


class Tile:
    """A figure of a `Chart`; `show` puts other curves on the same axes."""

    def __init__(self, chart: Chart, theme: Theme) -> None:
        self._theme = theme
        self.key = key_of(chart)
        self._scales = (chart.x_scale, chart.y_scale)
        self.lines, self.points = ColumnDataSource(_no_lines()), ColumnDataSource(_no_points())
        self.ghost_lines, self.ghost_points = ColumnDataSource(_no_lines()), ColumnDataSource(_no_points())
        self.figure = _figure(chart)
        self._draw(chart)
        self.show(chart)

    def show(self, chart: Chart) -> None:
        """Replace the curves."""
        # By place, so that a curve keeps its colour while a knob turns.
        colours = [self._theme.palette[place % len(self._theme.palette)] for place in range(len(chart.curves))]
        labels = [curve.label for curve in chart.curves]
        lines, points = self._data(chart.curves, labels, colours)
        _replace(self.lines, lines)
        _replace(self.points, points)
        # A single curve is named by the chart.
        drawn = len({label for label in labels if label})
        self.legend.visible = LEGEND_FROM <= drawn <= LEGEND_TO

    def show_ghosts(self, ghosts: Sequence[Ghost]) -> None:
        """Replace the faded curves of kept variants."""
        curves = [(curve, ghost) for ghost in ghosts for curve in ghost.chart.curves]
        labels = [f"{ghost.label}: {curve.label}" if curve.label else ghost.label for curve, ghost in curves]
        lines, points = self._data([curve for curve, _ in curves], labels, [ghost.colour for _, ghost in curves])
        _replace(self.ghost_lines, lines)
        _replace(self.ghost_points, points)

    def _draw(self, chart: Chart) -> None:
        # Ghosts first: what moves now lies on top.
        self.figure.multi_line(
            "xs", "ys", source=self.ghost_lines, line_color="colour", line_width=1.3, line_alpha=0.55
        )
        self.figure.scatter(
            "x", "y", source=self.ghost_points, marker="marker", size=8, color="colour", alpha=0.5, fill_alpha=0.0
        )
        line = self.figure.multi_line("xs", "ys", source=self.lines, line_color="colour", line_width=1.8)
        point = self.figure.scatter(
            "x", "y", source=self.points, marker="marker", size=9, color="colour", fill_alpha=0.0, line_width=1.8
        )
        items = [LegendItem(label={"field": "label"}, renderers=[one]) for one in (line, point)]
        # Many labels would hide what they name: they stand beside the curves.
        beside = len(chart.curves) > LEGEND_INSIDE
        self.legend = Legend(items=items, location="top_left" if beside else "top_right")
        self.figure.add_layout(self.legend, "right" if beside else "center")
        self.figure.add_tools(HoverTool(renderers=[line, point], tooltips=[("", "@label"), ("", "$x, $y")]))

    def _data(self, curves: Sequence[Curve], labels: Sequence[str], colours: Sequence[str]) -> tuple[Data, Data]:
        """Give columns of the lines and columns of the points."""
        lines, points = _no_lines(), _no_points()
        for curve, label, colour in zip(curves, labels, colours, strict=True):
            if curve.points:
                points["x"].append(curve.x)
                points["y"].append(curve.y)
                points["label"] += [label] * curve.x.size
                points["colour"] += [colour] * curve.x.size
                points["marker"] += [_marker(curve.label)] * curve.x.size
            else:
                x, y = straightened(*thinned(curve.x, curve.y), *self._scales)
                lines["xs"].append(inline(x))
                lines["ys"].append(inline(y))
                lines["label"].append(label)
                lines["colour"].append(colour)
        for name in ("x", "y"):
            points[name] = inline(np.concatenate(points[name]) if points[name] else np.empty(0))
        return lines, points


def key_of(chart: Chart) -> tuple[str, ...]:
    """What a tile can't change while it stands."""
    return (chart.name, chart.x_label, chart.y_label, chart.x_scale, chart.y_scale, str(chart.equal))


def _figure(chart: Chart) -> Any:
    made: Any = figure(
        x_axis_label=printed(chart.x_label),
        y_axis_label=printed(chart.y_label),
        x_axis_type=chart.x_scale,
        y_axis_type=chart.y_scale,
        match_aspect=chart.equal,
        sizing_mode="stretch_both",
        min_width=160,
        min_height=150,
        tools="pan,box_zoom,wheel_zoom,reset",
        output_backend="canvas",
    )
    made.toolbar.autohide = True
    made.toolbar.logo = None
    # A range that follows the data would tell the server of every change, thirty times a second.
    for axis_range in (made.x_range, made.y_range):
        axis_range.syncable = False
        axis_range.range_padding = 0.04
    if any(curve.points for curve in chart.curves):
        # A cross on the frame could be taken for one that goes on outside.
        made.x_range.range_padding = made.y_range.range_padding = 0.2
        # Two poles one above the other differ in their real parts by rounding, which is no reason to magnify it.
        made.x_range.min_interval = (
            0.05 * max(float(np.abs(curve.x).max(initial=0)) for curve in chart.curves) or None
        )
    elif not chart.equal:
        made.x_range.range_padding = 0.0
    for axis, scale in ((made.xaxis, chart.x_scale), (made.yaxis, chart.y_scale)):
        axis.formatter = CustomJSTickFormatter(code=TICK_JS)
        axis.major_label_policy = NoOverlap()
        if scale == "linear":
            axis.ticker.desired_num_ticks = TICKS
    return made


def _replace(source: ColumnDataSource, data: Data) -> None:
    # What stays as it is needs no message, such as poles while a gain turns.
    if not _same(source.data, data):
        source.data = data


def _same(one: Any, other: Data) -> bool:
    if one["label"] != other["label"] or one["colour"] != other["colour"]:
        return False
    if "x" in other:
        return all(np.array_equal(one[name], other[name]) for name in ("x", "y"))
    pairs = (pair for name in ("xs", "ys") for pair in zip(one[name], other[name], strict=True))
    return all(np.array_equal(first, second, equal_nan=True) for first, second in pairs)


def _marker(label: str) -> str:
    """Poles are crosses and zeros circles, as everywhere in the field."""
    word = label.lower()
    if "zero" in word:
        return "circle"
    return "x" if "pole" in word else "diamond"


def _no_lines() -> Data:
    return {"xs": [], "ys": [], "label": [], "colour": []}


def _no_points() -> Data:
    return {"x": [], "y": [], "label": [], "colour": [], "marker": []}
