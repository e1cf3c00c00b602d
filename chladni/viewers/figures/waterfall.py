"""Waterfalls: the density of each channel over time as an image."""

from dataclasses import replace
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from chladni.signals.arrays import Real
from chladni.signals.study import Study
from chladni.signals.time_series import NS_PER_S
from chladni.signals.units import power_density_unit
from chladni.signals.waterfall import Waterfall
from chladni.viewers.drawing import block_maximum, colour_range, decibels_of_power
from chladni.viewers.figures.log_axis import USUAL, Scales, logarithmic_lines
from chladni.viewers.figures.sheet import look, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.labels import decibel_unit
from chladni.viewers.style import Style

PIXELS = 1500
DYNAMIC_RANGE_DB = 80.0
MISSING = "#d0d0d0"


def waterfall_figures(study: Study, *, scales: Scales = USUAL) -> dict[str, Figure]:
    """Draw the waterfalls; one figure for each group of channels of one unit, with one colour scale, by name.

    Slices that touch missing samples are grey. Where a waterfall has more lines than the figure has dots, each dot
    shows the greatest of its lines. Colours run over what most cells of the band hold.

    Parameters
    ----------
    study
        What to draw.
    scales
        The band that is shown, and whether frequency has a logarithmic scale.
    """
    style = Style.of(study)
    with look():
        return {
            f"waterfall {place} {group.name}": _figure(_in_band(waterfall, scales), group, style, scales)
            for place, waterfall in enumerate(study.waterfalls, start=1)
            for group in groups(waterfall.channels)
        }


def _in_band(waterfall: Waterfall, scales: Scales) -> Waterfall:
    """Leave out the lines that aren't shown: they must not choose the colours."""
    shown = scales.shown(waterfall.frequency_hz)
    if shown.all() or not shown.any():
        return waterfall
    return replace(waterfall, values=waterfall.values[:, :, shown], frequency_hz=waterfall.frequency_hz[shown])


def _figure(waterfall: Waterfall, group: Group, style: Style, scales: Scales) -> Figure:
    figure, stack = sheet([1.5] * len(group.rows), sharex=True, sharey=True)
    levels = [level_of(waterfall, row) for row in group.rows]
    # One scale for the figure, so that colours of different channels can be compared.
    limits = colour_limits(levels)
    image = None
    for axes, row, level in zip(stack, group.rows, levels, strict=True):
        image = draw_waterfall(axes, waterfall, level, limits, style, scales=scales)
        axes.set_title(plain(style.labels[waterfall.channels[row].name]), loc="left", pad=2)
        axes.set_ylabel("Frequency [Hz]")
    stack[-1].set_xlabel("Time [s]")
    if image is not None:
        add_scale(image, stack, group)
    return figure


def add_scale(image: ScalarMappable, stack: list[Axes], group: Group) -> None:
    """Put the colour scale beside the axes that share it."""
    # Arrows say that some cells lie outside.
    bar = stack[0].figure.colorbar(image, ax=stack, aspect=18 * len(stack), pad=0.02, extend="both")
    bar.set_label(f"PSD [{decibel_unit(power_density_unit(group.unit))}]")
    bar.outline.set_linewidth(0.0)


def level_of(waterfall: Waterfall, row: int) -> Real:
    """``[slice, line]`` in dB, shortened to what can be seen."""
    shortened, _ = block_maximum(waterfall.values[row], axis=0, limit=PIXELS)
    shortened, _ = block_maximum(shortened, axis=1, limit=PIXELS)
    return decibels_of_power(shortened)


def colour_limits(levels: list[Real]) -> tuple[float, float]:
    """Give the ends of the colour scale that all of these levels share."""
    return colour_range(levels, most_db=DYNAMIC_RANGE_DB)


def draw_waterfall(
    axes: Axes,
    waterfall: Waterfall,
    level: Real,
    limits: tuple[float, float],
    style: Style,
    *,
    scales: Scales = USUAL,
) -> ScalarMappable:
    """Draw the levels of one channel, what is missing in grey."""
    # Grey is in no part of the scale: what is missing can't be taken for a low level.
    look: dict[str, Any] = {
        "cmap": mpl.colormaps["viridis"].with_extremes(bad=MISSING),
        "vmin": limits[0],
        "vmax": limits[1],
    }
    start_s = (waterfall.start_time_ns - style.origin_ns) / NS_PER_S
    times, lines = _edges(waterfall.time_s + start_s, level.shape[0]), _edges(waterfall.frequency_hz, level.shape[1])
    axes.grid(visible=False)
    if scales.log_frequency and lines[-1] > 0:
        # Rasterised: as paths the cells make a file of megabytes.
        image = axes.pcolormesh(times, np.maximum(lines, 0.0), level.T, rasterized=True, **look)
        logarithmic_lines(axes, waterfall.frequency_hz)
        return image
    extent = (times[0], times[-1], lines[0], lines[-1])
    return axes.imshow(level.T, origin="lower", aspect="auto", extent=extent, interpolation="nearest", **look)


def _edges(axis: Real, cells: int) -> Real:
    """Edges of so many cells over an axis, each of one value of it or of a run; half a step more at both ends."""
    step = float(axis[1] - axis[0]) if axis.size > 1 else 1.0
    run = -(-axis.size // cells)
    starts = np.minimum(np.arange(cells + 1) * run, axis.size)
    return np.asarray(axis[0] + (starts - 0.5) * step)
