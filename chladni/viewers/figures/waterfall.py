"""Waterfalls: the density of each channel over time as an image."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from chladni.signals.arrays import Real
from chladni.signals.study import Study
from chladni.signals.time_series import NS_PER_S
from chladni.signals.units import power_density_unit
from chladni.signals.waterfall import Waterfall
from chladni.viewers.drawing import block_maximum, decibels_of_power
from chladni.viewers.figures.sheet import look, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.labels import decibel_unit
from chladni.viewers.style import Style

PIXELS = 1500
DYNAMIC_RANGE_DB = 80.0
MISSING = "#d0d0d0"


def waterfall_figures(study: Study) -> dict[str, Figure]:
    """Draw the waterfalls; one figure for each group of channels of one unit, with one colour scale, by name.

    Slices that touch missing samples are grey. Where a waterfall has more lines than the figure has dots, each dot
    shows the greatest of its lines.
    """
    style = Style.of(study)
    with look():
        return {
            f"waterfall {place} {group.name}": _figure(waterfall, group, style)
            for place, waterfall in enumerate(study.waterfalls, start=1)
            for group in groups(waterfall.channels)
        }


def _figure(waterfall: Waterfall, group: Group, style: Style) -> Figure:
    figure, stack = sheet([1.5] * len(group.rows), sharex=True, sharey=True)
    levels = [level_of(waterfall, row) for row in group.rows]
    # One scale for the figure, so that colours of different channels can be compared.
    limits = colour_limits(levels)
    image = None
    for axes, row, level in zip(stack, group.rows, levels, strict=True):
        image = draw_waterfall(axes, waterfall, level, limits, style)
        axes.set_title(plain(style.labels[waterfall.channels[row].name]), loc="left", pad=2)
        axes.set_ylabel("Frequency [Hz]")
    stack[-1].set_xlabel("Time [s]")
    if image is not None:
        add_scale(image, stack, group)
    return figure


def add_scale(image: AxesImage, stack: list[Axes], group: Group) -> None:
    """Put the colour scale beside the axes that share it."""
    bar = stack[0].figure.colorbar(image, ax=stack, aspect=18 * len(stack), pad=0.02)
    bar.set_label(f"PSD [{decibel_unit(power_density_unit(group.unit))}]")
    bar.outline.set_linewidth(0.0)


def level_of(waterfall: Waterfall, row: int) -> Real:
    """``[slice, line]`` in dB, shortened to what can be seen."""
    shortened, _ = block_maximum(waterfall.values[row], axis=0, limit=PIXELS)
    shortened, _ = block_maximum(shortened, axis=1, limit=PIXELS)
    return decibels_of_power(shortened)


def colour_limits(levels: list[Real]) -> tuple[float, float]:
    """Give the ends of the colour scale that all of these levels share."""
    known = np.concatenate([level[np.isfinite(level)] for level in levels])
    if known.size == 0:
        return -DYNAMIC_RANGE_DB, 0.0
    return max(float(known.min()), float(known.max()) - DYNAMIC_RANGE_DB), float(known.max())


def draw_waterfall(
    axes: Axes, waterfall: Waterfall, level: Real, limits: tuple[float, float], style: Style
) -> AxesImage:
    """Draw the levels of one channel, what is missing in grey."""
    # Grey is in no part of the scale: what is missing can't be taken for a low level.
    colours = mpl.colormaps["viridis"].with_extremes(bad=MISSING)
    start_s = (waterfall.start_time_ns - style.origin_ns) / NS_PER_S
    times, lines = waterfall.time_s + start_s, waterfall.frequency_hz
    # Pixels reach half a step to both sides of the slice and line they show.
    hop, step = _step(times) / 2, _step(lines) / 2
    extent = (times[0] - hop, times[-1] + hop, lines[0] - step, lines[-1] + step)
    axes.grid(visible=False)
    return axes.imshow(
        level.T,
        origin="lower",
        aspect="auto",
        extent=extent,
        cmap=colours,
        vmin=limits[0],
        vmax=limits[1],
        interpolation="nearest",
    )


def _step(axis: Real) -> float:
    return float(axis[1] - axis[0]) if axis.size > 1 else 1.0
