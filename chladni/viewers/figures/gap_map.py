"""The gap over band and time, before and after on one scale of colours."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from chladni.gap.records.diagnosis import GapSignals
from chladni.signals.arrays import Real
from chladni.viewers.drawing import block_maximum, decibels_of_power
from chladni.viewers.figures.sheet import look, sheet
from chladni.viewers.gap_band import band_told, shown_hz
from chladni.viewers.gap_evidence import Evidence

PIXELS = 1500
# Less than a spectrum's usual 80 dB: what lies further below the worst of the gap doesn't matter to anyone.
DYNAMIC_RANGE_DB = 50.0
HEIGHT_IN = 1.6


def gap_map_figures(evidence: Evidence) -> dict[str, Figure]:
    """Draw the density of the gap over band and time, by name; none without a map."""
    signals = evidence.signals
    if signals is None or signals.gap_map.size == 0:
        return {}
    with look():
        return {"gap map": _figure(signals, alone=evidence.after is None)}


def _figure(signals: GapSignals, *, alone: bool) -> Figure:
    maps = [("Gap", signals.gap_map)]
    if not alone:
        maps = [("Gap before", signals.gap_map), ("Gap after", signals.gap_map_after)]
    figure, stack = sheet([HEIGHT_IN] * len(maps), sharex=True, sharey=True)
    levels = [decibels_of_power(_shortened(one)) for _, one in maps]
    # One scale, so that the colours of both can be compared.
    known = np.concatenate([level[np.isfinite(level)] for level in levels])
    high = float(known.max()) if known.size else 0.0
    image = None
    # In one title: two on the same line would run into each other.
    low = high - DYNAMIC_RANGE_DB
    # Of a good answer nothing is left that has a colour: black alone looks like no picture.
    titles = [
        title if np.any(level > low) else f"{title} · all of it below {low:.0f} dB"
        for (title, _), level in zip(maps, levels, strict=True)
    ]
    titles[0] = " · ".join(filter(None, (titles[0], band_told(signals))))
    for axes, level, title in zip(stack, levels, titles, strict=True):
        image = _draw(axes, signals, level, high)
        axes.set_title(title, loc="left", pad=2)
        axes.set_ylabel("Frequency [Hz]")
    stack[-1].set_ylim(0, shown_hz(signals))
    stack[-1].set_xlabel("Time [s]")
    if image is not None:
        bar = figure.colorbar(image, ax=stack, aspect=36, pad=0.02)
        bar.set_label("Density [dB re 1/Hz]")
        bar.outline.set_linewidth(0.0)
    return figure


def _shortened(density: Real) -> Real:
    for axis in (0, 1):
        density, _ = block_maximum(density, axis=axis, limit=PIXELS)
    return density


def _draw(axes: Axes, signals: GapSignals, level: Real, high: float) -> AxesImage:
    times, lines = signals.map_time_s, signals.map_frequency_hz
    # Pixels reach half a step to both sides of the slice and line that they show.
    hop, step = _half_step(times), _half_step(lines)
    axes.grid(visible=False)
    return axes.imshow(
        level.T,
        origin="lower",
        aspect="auto",
        extent=(times[0] - hop, times[-1] + hop, max(lines[0] - step, 0.0), lines[-1] + step),
        cmap=mpl.colormaps["magma"].with_extremes(bad="black"),
        vmin=high - DYNAMIC_RANGE_DB,
        vmax=high,
        interpolation="nearest",
    )


def _half_step(axis: Real) -> float:
    return float(axis[1] - axis[0]) / 2 if axis.size > 1 else 0.5
