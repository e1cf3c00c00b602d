"""Levels in octave bands, each as wide as its band."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from chladni.signals.arrays import Real
from chladni.signals.levels import OctaveLevels
from chladni.signals.study import Study
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import decibels_of_power, level_limits
from chladni.viewers.figures.log_axis import logarithmic
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import Style

HEIGHT_IN = 2.7
# Numbers of bands that have room side by side.
MOST_NUMBERS = 12
# Of sound, below the highest band.
DECIBELS_SHOWN = 100.0


def octave_figures(study: Study) -> dict[str, Figure]:
    """Draw the levels in octave bands; one figure for each group of channels of one unit, by name."""
    style = Style.of(study)
    with look():
        return {
            f"octaves {place} {group.name}": _figure(one, group, style)
            for place, one in enumerate(study.octaves, start=1)
            for group in groups(one.channels)
        }


def _figure(found: OctaveLevels, group: Group, style: Style) -> Figure:
    figure, (axes,) = sheet([HEIGHT_IN])
    draw_octaves(axes, found=found, group=group, style=style)
    axes.set_xlabel(octaves_label(found))
    return figure


def octaves_label(found: OctaveLevels) -> str:
    """Say what runs along the axis of a picture of octave bands."""
    return f"{'Octave' if found.fraction == 1 else f'1/{found.fraction} octave'} bands [Hz]"


def draw_octaves(axes: Axes, found: OctaveLevels, group: Group, style: Style) -> None:
    """Draw the levels of some channels, each as wide as its band."""
    weighted = f", {found.weighting}-weighted" if found.weighting else ""
    rows = list(group.rows)
    if group.unit == "Pa":
        levels = found.decibels()[rows]
        known = levels[np.isfinite(levels)]
        top, lowest = (float(known.max()), float(known.min())) if known.size else (DECIBELS_SHOWN, 0.0)
        # 0 dB is the threshold of hearing.
        axes.set_ylim(max(lowest, 0.0, top - DECIBELS_SHOWN) - 5.0, top + 5.0)
        axes.set_ylabel(f"Level{weighted} [dB re 20 µPa]")
    else:
        levels = found.bands.rms[rows]
        low, high = level_limits(decibels_of_power(levels**2))
        logarithmic(axes, 10 ** (low / 20), 10 ** (high / 20))
        axes.set_ylabel(f"RMS{weighted} [{printed_unit(group.unit)}]")
    edges_hz = np.append(found.bands.low_hz, found.bands.high_hz[-1])
    bottom = axes.get_ylim()[0]
    for row, level in zip(rows, levels, strict=True):
        channel = found.channels[row]
        shown = np.where(np.isfinite(level), np.maximum(level, bottom), bottom)
        axes.stairs(shown, edges_hz, baseline=None, color=paint(style.on_light(channel)), linewidth=1.1,
                    label=plain(style.labels[channel.name]))  # fmt: skip
    _band_axis(axes, found.mid_hz, found.nominal_hz, edges_hz)
    legend(axes)


def _band_axis(axes: Axes, mid_hz: Real, nominal_hz: Real, edges_hz: Real) -> None:
    """Call bands by their nominal frequencies, every so many where there are many."""
    step = -(-mid_hz.size // MOST_NUMBERS)
    axes.set_xscale("log")
    axes.set_xlim(edges_hz[0], edges_hz[-1])
    names = {float(mid): f"{nominal:g}" for mid, nominal in zip(mid_hz, nominal_hz, strict=True)}
    axes.xaxis.set_major_locator(FixedLocator(list(names)[::step]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: names.get(float(value), "")))
    axes.xaxis.set_minor_locator(NullLocator())
