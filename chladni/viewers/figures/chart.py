"""Charts of virtual instruments as figures."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from chladni.models.core.reading import Chart, Curve
from chladni.signals.unit_text import printed_unit
from chladni.viewers.figures.log_axis import logarithmic, power_of_ten
from chladni.viewers.figures.panes import pages
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.style import ON_LIGHT

HEIGHT_IN = 2.3
# A map of poles or a Nyquist plot needs room in both directions.
SQUARE_IN = 3.6
CHARTS_A_SHEET = 3
# Markers in turn: poles are crosses and zeros circles, as everywhere in the field.
_MARKERS = {"poles": "x", "zeros": "o"}


def chart_figure(chart: Chart) -> Figure:
    """Draw one chart with its title, axes with units, and a legend where it has several curves."""
    return charts_figure([chart])


def charts_figure(charts: Sequence[Chart]) -> Figure:
    """Draw several charts on one sheet, one under another."""
    with look():
        figure, stack = sheet([chart_height_in(chart) for chart in charts])
        for axes, chart in zip(stack, charts, strict=True):
            draw_chart(axes, chart)
    return figure


def chart_height_in(chart: Chart) -> float:
    """Inches that a chart is high."""
    return SQUARE_IN if chart.equal or _is_map(chart) else HEIGHT_IN


def chart_figures(charts: Sequence[Chart], *, name: str) -> Iterator[tuple[str, Figure]]:
    """Draw charts on as few sheets as they fit on, each with its name.

    Charts of one kind (the part of their names before the dot) stay together.
    """
    kinds: dict[str, list[Chart]] = {}
    for chart in charts:
        kinds.setdefault(chart.name.partition(".")[0], []).append(chart)
    for kind, group in kinds.items():
        for label, rows in pages(len(group), CHARTS_A_SHEET):
            yield f"{name} {kind}{label}", charts_figure([group[row] for row in rows])


def draw_chart(axes: Axes, chart: Chart) -> None:
    """Draw the curves of a chart."""
    colours: dict[str, int] = {}
    for curve in chart.curves:
        # The points of a setting have the colour of its lines.
        place = colours.setdefault(_setting(curve.label), len(colours))
        _draw_curve(axes, curve, paint(ON_LIGHT[place % len(ON_LIGHT)]), faint=place > 0 and not _is_map(chart))
    _scale(axes, chart)
    if _is_map(chart) or chart.equal:
        axes.axhline(0, color="#888888", linewidth=0.6, zorder=0)
        axes.axvline(0, color="#888888", linewidth=0.6, zorder=0)
    if chart.equal:
        axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(plain(printed_unit(chart.x_label)))
    axes.set_ylabel(plain(printed_unit(chart.y_label)))
    several = len(chart.curves) > 1
    if several:
        legend(axes)
    axes.set_title(plain(printed_unit(chart.title)), loc="left", pad=_title_pad(axes) if several else None)


def _draw_curve(axes: Axes, curve: Curve, colour: tuple[float, float, float], *, faint: bool) -> None:
    label = plain(curve.label)
    if curve.points:
        marker = next((mark for word, mark in _MARKERS.items() if word in curve.label), "o")
        axes.plot(curve.x, curve.y, marker, color=colour, markersize=5, markerfacecolor="none", label=label)
    else:
        # What is compared with stands back behind what is.
        width = 0.8 if faint else 1.2
        axes.plot(curve.x, curve.y, color=colour, linewidth=width, zorder=2 if faint else 3, label=label)


def _scale(axes: Axes, chart: Chart) -> None:
    if chart.x_scale == "log":
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(numticks=8))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
        axes.xaxis.set_minor_formatter(FuncFormatter(lambda *_: ""))
    if chart.y_scale == "log":
        values = np.concatenate([curve.y[np.isfinite(curve.y) & (curve.y > 0)] for curve in chart.curves])
        if values.size:
            logarithmic(axes, float(values.min()) / 1.5, float(values.max()) * 1.5)


def _title_pad(axes: Axes) -> float:
    """Points that the legend takes between the axes and the title."""
    handles, _ = axes.get_legend_handles_labels()
    return 6.0 + 13.0 * -(-len(handles) // 3)


def _setting(label: str) -> str:
    for word in _MARKERS:
        label = label.removeprefix(word).strip()
    return label


def _is_map(chart: Chart) -> bool:
    return chart.name in ("poles", "root-locus")
