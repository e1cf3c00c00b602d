"""A figure as a grid of plots: axes, ranges that are shared, titles, legends."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from bokeh.layouts import group_tools
from bokeh.models import (
    BoxZoomTool,
    DataRange1d,
    FixedTicker,
    GridPlot,
    LinearAxis,
    LogAxis,
    LogScale,
    LogTicker,
    PrintfTickFormatter,
    Range1d,
    Toolbar,
    ToolProxy,
)
from bokeh.models.annotations import ColorBar, Legend
from bokeh.plotting import figure as bokeh_figure
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateFormatter, ConciseDateFormatter, DateFormatter
from matplotlib.figure import Figure
from matplotlib.ticker import FixedFormatter, FixedLocator, FuncFormatter

from chladni.viewers.figures.log_axis import DecibelFormatter
from chladni.viewers.interactive.artists import (
    MS_A_DAY,
    Target,
    UntranslatableError,
    bar_name,
    draw_artists,
    mapper_of,
)
from chladni.viewers.interactive.inert import inert
from chladni.viewers.screen_colours import FAINT, INK, SOFT

# Pixels of an inch on paper, and what stands around the frame.
PIXELS_AN_INCH = 88
TITLE, LEGEND, AXIS, AXIS_NAME, TOP = 20, 24, 22, 20, 8
LEFT, RIGHT, BAR = 74, 16, 62
# Room for names inside the top of the frame.
NAMES_SHARE, UPRIGHT_SHARE = 0.10, 0.22
SQUARE = 400
# Room for a legend, beside what frames it: of a plot that fills two thirds of a narrow page, and of a square one.
LEGEND_WIDTH, SQUARE_LEGEND_WIDTH = 660, SQUARE - LEFT - RIGHT
# Height of a word, what lies around it, and so of each further line.
WORD_HEIGHT, AROUND_WORD = 12, 14
LEGEND_LINE = WORD_HEIGHT + AROUND_WORD
# Of a word in it besides its letters: its look, and what lies between.
MOST_COLUMNS, BESIDE_WORD = 8, 40
PIXELS_A_LETTER = 5.6
COLOUR_BAR = "<colorbar>"


@dataclass(frozen=True, kw_only=True)
class Translated:
    """A plot with the pixels that it's high, and wide where it doesn't fill the page."""

    grid: GridPlot
    height: int
    width: int | None


def translated(figure: Figure, *, cells: int) -> Translated:
    """Draw a figure as plots that zoom and read out.

    Parameters
    ----------
    figure
        Drawn by matplotlib, not yet rendered.
    cells
        Most cells of an image.

    Raises
    ------
    UntranslatableError
        When it holds what these plots can't show.
    """
    shown = [axes for axes in figure.axes if axes.get_label() != COLOUR_BAR]
    if not shown or any(axes.get_subplotspec() is None or not axes.axison for axes in shown):
        raise UntranslatableError("no axes, or axes that aren't shown")
    places = [_place(axes) for axes in shown]
    firsts = [axes for axes, place in zip(shown, places, strict=True) if place not in places[: shown.index(axes)]]
    plots: dict[int, Any] = {}
    square = len(firsts) == 1 and firsts[0].get_aspect() == 1
    children: list[Any] = []
    for axes in firsts:
        # Axes behind others in one place are numbered on the right.
        stacked = [one for one, place in zip(shown, places, strict=True) if place == _place(axes)]
        plot = _plot(figure, stacked, plots, cells=cells, legend=_has_legend(figure, axes, firsts), square=square)
        plots[id(axes)] = plot
        row, column, rows, columns = _place(axes)
        children.append((plot, row, column, rows, columns))
    for plot, *_ in children:
        plot.toolbar_location = None
    grid = GridPlot(
        children=children, toolbar=_toolbar([plot for plot, *_ in children]), toolbar_location="above",
        sizing_mode=None if square else "stretch_width",
    )  # fmt: skip
    heights: dict[int, int] = {}
    for plot, row, *_ in children:
        heights[row] = max(heights.get(row, 0), plot.height)
    for plot, row, _, rows, _ in children:
        # Beside a plot that has a legend above, others end at the same line.
        if rows == 1:
            plot.height = heights[row]
    return Translated(grid=grid, height=sum(heights.values()) + 30, width=SQUARE if square else None)


def _toolbar(plots: Sequence[Any]) -> Toolbar:
    tools = [tool for plot in plots for tool in plot.tools]
    # One button for the same tool of all plots.
    grouped: list[Any] = group_tools(tools)
    zoom = next(tool for tool in grouped if isinstance(_first(tool), BoxZoomTool))
    return Toolbar(tools=grouped, active_drag=zoom, active_scroll=None, logo=None)


def _first(tool: Any) -> Any:
    return tool.tools[0] if isinstance(tool, ToolProxy) else tool


def _place(axes: Axes) -> tuple[int, int, int, int]:
    """Row, column, and how many of both, in a grid fine enough for grids in grids."""
    spec = axes.get_subplotspec()
    if spec is None or (
        spec.get_topmost_subplotspec() is not spec
        and spec.get_gridspec() is not spec.get_topmost_subplotspec().get_gridspec()
    ):
        raise UntranslatableError("a grid in a grid")
    rows, columns = spec.rowspan, spec.colspan
    return rows.start, columns.start, len(rows), len(columns)


def _has_legend(figure: Figure, axes: Axes, firsts: Sequence[Axes]) -> bool:
    return axes.get_legend() is not None or (bool(figure.legends) and axes is firsts[0])


def _plot(
    figure: Figure, stacked: Sequence[Axes], plots: dict[int, Any], *, cells: int, legend: bool, square: bool
) -> Any:
    axes = stacked[0]
    numbered = bool(axes.xaxis.get_tick_params().get("labelbottom", True))
    title = _title(figure, axes)
    plot: Any = bokeh_figure(
        x_axis_type="datetime" if _has_dates(axes) else _scale(axes.get_xscale()),
        y_axis_type=_y_type(axes),
        tools="box_zoom,xbox_zoom,pan,xwheel_zoom,wheel_zoom,reset,save,crosshair",
        active_drag="box_zoom",
        active_scroll=None,
        min_border_left=LEFT,
        min_border_right=RIGHT,
        title=title,
        output_backend="canvas",
    )
    _set_ranges(plot, axes, plots, square=square)
    _dress(plot, axes, figure, numbered=numbered)
    lines = int(legend)
    # Behind first: what leads lies on top.
    for one in sorted(stacked, key=lambda each: each.get_zorder()):
        target = _target(plot, one, axes, cells=cells)
        draw_artists(one, target)
        if legend and target.items and one is axes:
            lines = _add_legend(plot, target, width=SQUARE_LEGEND_WIDTH if square else LEGEND_WIDTH)
    bars = _add_bars(plot, axes)
    name = bool(plot.xaxis[0].axis_label)
    around = TOP + AXIS * numbered + AXIS_NAME * name + TITLE * bool(plot.title.text) + _legend_height(lines)
    height = round(_frame_in(figure, axes) * PIXELS_AN_INCH) + around
    if square:
        plot.width, plot.height = SQUARE, SQUARE + _legend_height(lines) - _legend_height(int(legend))
    else:
        plot.height, plot.sizing_mode = height, "stretch_width"
    if bars:
        plot.min_border_right = BAR
    return plot


def _target(plot: Any, axes: Axes, first: Axes, *, cells: int) -> Target:
    formatter = axes.yaxis.get_major_formatter()
    right = axes is not first
    if right:
        low, high = _limits(axes)
        plot.extra_y_ranges = {**plot.extra_y_ranges, "right": Range1d(start=low, end=high)}
        kind = LogAxis if axes.get_yscale() == "log" else LinearAxis
        plot.extra_y_scales = {"right": LogScale()} if axes.get_yscale() == "log" else {}
        plot.add_layout(_dressed(kind(y_range_name="right", axis_label=inert(axes.get_ylabel()))), "right")
    return Target(
        plot=plot,
        range_name="right" if right else "default",
        decade_db=formatter.decade_db if isinstance(formatter, DecibelFormatter) else None,
        x_name=_x_name(axes) or ("date" if _has_dates(axes) else "x"),
        y_name=inert(axes.get_ylabel() or _supported(axes)) or "y",
        cells=cells,
        dates=_has_dates(axes),
    )


def _has_dates(axes: Axes) -> bool:
    return isinstance(axes.xaxis.get_major_formatter(), AutoDateFormatter | ConciseDateFormatter | DateFormatter)


def _supported(axes: Axes) -> str:
    root = axes.figure
    return str(root.get_supylabel()) if isinstance(root, Figure) else ""


def _x_name(axes: Axes) -> str:
    """Name of the x axis, which may stand below another that shares it."""
    root = axes.figure
    others = [one for one in root.axes if axes.get_shared_x_axes().joined(axes, one)]
    found = next((one.get_xlabel() for one in (axes, *others) if one.get_xlabel()), "")
    return inert(found or (root.get_supxlabel() if isinstance(root, Figure) else ""))


def _title(figure: Figure, axes: Axes) -> str:
    parts = [axes.get_title(loc=side) for side in ("left", "center", "right")]
    if figure.axes[0] is axes:
        # What holds for all axes of a figure is told above the first.
        parts = [figure.get_suptitle(), *parts, bar_name(axes)]
    return inert(" · ".join(one for one in parts if one))


def _scale(name: str) -> Any:
    if name not in ("linear", "log"):
        raise UntranslatableError(f"a scale {name}")
    return name


def _y_type(axes: Axes) -> Any:
    return "linear" if isinstance(axes.yaxis.get_major_formatter(), DecibelFormatter) else _scale(axes.get_yscale())


def _limits(axes: Axes) -> tuple[float, float]:
    low, high = axes.get_ylim()
    formatter = axes.yaxis.get_major_formatter()
    if isinstance(formatter, DecibelFormatter):
        low, high = (formatter.decade_db * float(np.log10(end)) for end in (low, high))
    # Names that stand above the frame on paper stand inside its top here.
    above = [
        one
        for one in axes.texts
        if float(getattr(one, "xy", one.get_position())[1]) >= 1.0 and not _in_data(one, axes)
    ]
    if above:
        share = UPRIGHT_SHARE if any(one.get_rotation() == 90 for one in above) else NAMES_SHARE
        if _y_type(axes) == "log":
            high *= (high / low) ** share
        else:
            high += share * (high - low)
    return float(low), float(high)


def _in_data(text: Any, axes: Axes) -> bool:
    if hasattr(text, "xycoords"):
        return bool(text.xycoords == "data")
    return bool(text.get_transform().contains_branch_seperately(axes.transData)[1])


def _set_ranges(plot: Any, axes: Axes, plots: dict[int, Any], *, square: bool) -> None:
    if square:
        # Equal scales, or the circle of a resonance would be an ellipse.
        plot.match_aspect = True
        plot.x_range, plot.y_range = DataRange1d(), DataRange1d()
        return
    if axes.get_aspect() != "auto":
        raise UntranslatableError("equal scales beside others")
    figure = axes.figure
    for shared, name, limits in (
        (axes.get_shared_x_axes(), "x_range", np.asarray(axes.get_xlim()) * (MS_A_DAY if _has_dates(axes) else 1)),
        (axes.get_shared_y_axes(), "y_range", _limits(axes)),
    ):
        other = next((plots[id(one)] for one in figure.axes if id(one) in plots and shared.joined(axes, one)), None)
        setattr(
            plot,
            name,
            Range1d(start=float(limits[0]), end=float(limits[1])) if other is None else getattr(other, name),
        )


def _dress(plot: Any, axes: Axes, figure: Figure, *, numbered: bool) -> None:
    plot.background_fill_alpha = plot.border_fill_alpha = 0.0
    plot.outline_line_color = None
    plot.title.text_color, plot.title.text_font_size = INK, "12.5px"
    plot.title.text_font_style = "normal"
    plot.xgrid.grid_line_color = plot.ygrid.grid_line_color = FAINT
    plot.xaxis.axis_label = inert(axes.get_xlabel()) or None
    if axes.get_yscale() == "log":
        # Numbers of a single decade, 1 to 10, would stand on each other.
        plot.yaxis.ticker = LogTicker(mantissas=[1, 2, 5], desired_num_ticks=5)
    elif axes.get_yscale() == "linear":
        # Bokeh's own writes small numbers with three zeros and an exponent, 0 among them.
        plot.yaxis.formatter = PrintfTickFormatter(format="%.8g")
    plot.yaxis.axis_label = _fitted(inert(axes.get_ylabel() or _supported(axes)), _frame_in(figure, axes)) or None
    for axis in (*plot.xaxis, *plot.yaxis):
        _dressed(axis)
    if not numbered:
        plot.xaxis.axis_label = None
    for axis, of_figure in ((plot.xaxis, axes.xaxis), (plot.yaxis, axes.yaxis)):
        formatter = of_figure.get_major_formatter()
        if isinstance(of_figure.get_major_locator(), FixedLocator) and isinstance(
            formatter, FixedFormatter | FuncFormatter
        ):
            ticks = [float(tick) for tick in of_figure.get_majorticklocs()]
            names = [inert(formatter(tick, place)) for place, tick in enumerate(ticks)]
            axis.ticker = FixedTicker(ticks=ticks)
            axis.major_label_overrides = dict(zip(ticks, names, strict=True))
    if not numbered:
        _unnumber(plot.xaxis)
    if not axes.yaxis.get_tick_params().get("labelleft", True):
        # Numbered where the row begins.
        _unnumber(plot.yaxis)


def _unnumber(axis: Any) -> None:
    axis.major_label_text_font_size = "0px"
    # Powers with raised exponents have no size at this one, and the plot isn't drawn.
    axis.formatter = PrintfTickFormatter(format="%g")


def _fitted(name: str, height_in: float) -> str:
    """Shorten the name of an axis to its first line, and to its unit, until it fits beside the frame."""
    first = name.split("\n")[0]
    letters = height_in * PIXELS_AN_INCH / PIXELS_A_LETTER
    for candidate in (name, first):
        if max(map(len, candidate.split("\n")), default=0) <= letters:
            return candidate
    return first[first.find("[") :] if "[" in first else first


def _dressed(axis: Any) -> Any:
    axis.axis_line_color = axis.major_tick_line_color = SOFT
    axis.minor_tick_line_color = None
    axis.major_label_text_color, axis.axis_label_text_color = SOFT, INK
    axis.axis_label_text_font_style, axis.axis_label_text_font_size = "normal", "12px"
    axis.axis_label_standoff = 4
    return axis


def _add_legend(plot: Any, target: Target, *, width: float) -> int:
    """Put the legend above the frame, in as many lines as its words need; say how many."""
    longest = max(len(word) for word in target.words) * PIXELS_A_LETTER + BESIDE_WORD
    columns = min(len(target.items), MOST_COLUMNS, max(int(width / longest), 1))
    plot.add_layout(
        Legend(
            items=target.items,
            orientation="horizontal",
            ncols=columns,
            click_policy="hide",
            background_fill_alpha=0.0,
            border_line_color=None,
            inactive_fill_color=FAINT,
            label_text_color=INK,
            label_text_font_size="11.5px",
            margin=0,
            location="left",
            glyph_width=16,
            label_height=WORD_HEIGHT,
            spacing=AROUND_WORD,
            glyph_height=WORD_HEIGHT,
        ),
        "above",
    )
    return ceil(len(target.items) / columns)


def _legend_height(lines: int) -> int:
    return LEGEND + LEGEND_LINE * (lines - 1) if lines else 0


def _add_bars(plot: Any, axes: Axes) -> bool:
    """Put the scale of an image beside it; say whether there is one."""
    (images, others) = axes.images, [one for one in axes.collections if getattr(one, "colorbar", None)]
    if others:
        raise UntranslatableError("colours of other things than images")
    for image in images:
        plot.add_layout(
            ColorBar(
                color_mapper=mapper_of(image), width=10, padding=4, background_fill_alpha=0.0,
                major_label_text_color=SOFT, major_tick_line_color=SOFT,
            ),
            "right",
        )  # fmt: skip
    return bool(images)


def _frame_in(figure: Figure, axes: Axes) -> float:
    """Inches that the frame is high on paper, its share of the sheet's rows."""
    spec = axes.get_subplotspec()
    if spec is None:
        raise UntranslatableError("axes outside the grid")
    ratios = np.asarray(spec.get_gridspec().get_height_ratios(), dtype=np.float64)
    share = float(ratios[spec.rowspan.start : spec.rowspan.stop].sum() / ratios.sum())
    return float(figure.get_size_inches()[1]) * share
