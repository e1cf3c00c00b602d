"""Order maps, and order cuts with their phase."""

from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.arrays import Real
from chladni.signals.channel import labels_of
from chladni.signals.order_spectra import OrderCuts, OrderMap
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import block_maximum, decibels_of_amplitude, phase_wraps, with_breaks
from chladni.viewers.figures.campbell import RPM, campbell_figure, order_title
from chladni.viewers.figures.log_axis import logarithmic
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.figures.waterfall import DYNAMIC_RANGE_DB, MISSING, PIXELS
from chladni.viewers.labels import decibel_unit
from chladni.viewers.style import ON_LIGHT

MAP_IN, CUTS_IN = 3.0, (2.2, 1.2)
# Of the largest amplitude of a channel: below, a phase is mostly that of noise, and hides the others.
LEAST_SHARE = 0.01


def order_figures(maps: Sequence[OrderMap], cuts: Sequence[OrderCuts]) -> dict[str, Figure]:
    """Draw for each channel a map, the cuts with their phase, and the Campbell picture; by name."""
    labels = labels_of(channel for one in maps for channel in one.channels)
    figures = {}
    with look():
        for one in maps:
            for row, channel in enumerate(one.channels):
                figures[f"order map {labels[channel.name]}"] = _map_figure(one, row, labels[channel.name])
        for cut in cuts:
            for row, channel in enumerate(cut.channels):
                figures[f"order cuts {labels[channel.name]}"] = _cuts_figure(cut, row, labels[channel.name])
                figures[f"campbell {labels[channel.name]}"] = campbell_figure(cut, row, labels[channel.name])
    return figures


def _map_figure(found: OrderMap, row: int, label: str) -> Figure:
    figure, (axes,) = sheet([MAP_IN])
    draw_order_map(axes, found, row, label)
    axes.set_xlabel(along(found)[1])
    return figure


def draw_order_map(axes: Axes, found: OrderMap, row: int, label: str) -> None:
    """Draw the map of one channel into given axes, with its scale beside."""
    level = decibels_of_amplitude(found.values[row])
    level, slices = block_maximum(level, axis=0, limit=PIXELS)
    level, lines = block_maximum(level, axis=1, limit=PIXELS)
    where, _ = along(found)
    known = level[np.isfinite(level)]
    high = float(known.max()) if known.size else 0.0
    axes.grid(visible=False)
    image = axes.pcolormesh(
        _edges(where[::slices]),
        _edges(found.order[::lines]),
        level.T,
        cmap=mpl.colormaps["viridis"].with_extremes(bad=MISSING),
        vmin=max(float(known.min()) if known.size else 0.0, high - DYNAMIC_RANGE_DB),
        vmax=high,
        rasterized=True,
    )
    axes.set_ylabel("Order")
    axes.set_title(plain(label), loc="left", pad=2)
    bar = axes.figure.colorbar(image, ax=axes, aspect=18, pad=0.02)
    bar.set_label(f"Peak amplitude [{decibel_unit(found.channels[row].unit)}]")
    bar.outline.set_linewidth(0.0)


def _cuts_figure(cuts: OrderCuts, row: int, label: str) -> Figure:
    figure, (sizes, phases) = sheet(list(CUTS_IN), sharex=True)
    draw_order_sizes(sizes, cuts, row)
    draw_order_phases(phases, cuts, row)
    phases.set_xlabel(f"{along(cuts)[1]}; phases of amplitudes above {LEAST_SHARE:.0%} of the largest")
    order_title(figure, label)
    return figure


def draw_order_sizes(axes: Axes, cuts: OrderCuts, row: int) -> None:
    """Draw the amplitudes of one channel's orders into given axes."""
    where, _ = along(cuts)
    amplitude = np.abs(cuts.values[row])
    shown = amplitude[amplitude > 0]
    if shown.size:
        low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
        logarithmic(axes, max(low, high / 1e4) / 1.5, high * 1.5)
    for place, order in enumerate(cuts.orders.tolist()):
        positive = np.where(amplitude[place] > 0, amplitude[place], np.nan)
        axes.plot(where, positive, color=paint(ON_LIGHT[place % len(ON_LIGHT)]), label=f"order {order:g}")
    axes.set_ylabel(f"Peak amplitude [{printed_unit(cuts.channels[row].unit)}]")
    legend(axes)


def draw_order_phases(axes: Axes, cuts: OrderCuts, row: int) -> None:
    """Draw the phases of one channel's orders into given axes."""
    where, _ = along(cuts)
    amplitude = np.abs(cuts.values[row])
    least = LEAST_SHARE * np.nanmax(amplitude, initial=0.0)
    for place in range(cuts.orders.size):
        phase = np.where(amplitude[place] >= least, np.angle(cuts.values[row, place], deg=True), np.nan)
        line = with_breaks(where, phase, phase_wraps(phase))
        axes.plot(*line, color=paint(ON_LIGHT[place % len(ON_LIGHT)]))
    axes.set_ylabel("Phase [deg]")
    axes.set_ylim(-180, 180)
    axes.set_yticks([-180, -90, 0, 90, 180])


def along(found: OrderMap | OrderCuts) -> tuple[Real, str]:
    """Give what the picture runs along, and its name: speed where that runs one way, time where it doesn't."""
    steps = np.diff(found.speed_hz)
    if steps.size and (np.all(steps > 0) or np.all(steps < 0)):
        return RPM * found.speed_hz, "Speed [rpm]"
    return found.time_s, "Time [s]"


def _edges(middles: Real) -> Real:
    if middles.size < 2:
        return np.array([middles[0] - 0.5, middles[0] + 0.5])
    between = (middles[1:] + middles[:-1]) / 2
    return np.concatenate([[1.5 * middles[0] - 0.5 * middles[1]], between, [1.5 * middles[-1] - 0.5 * middles[-2]]])
