"""Levels over time: RMS, peak and kurtosis of each channel; severity over the zones of its class."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.arrays import Real
from chladni.signals.levels import Levels, RunningLevels, Severity
from chladni.signals.study import Study
from chladni.signals.time_series import NS_PER_S
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import with_breaks
from chladni.viewers.figures.log_axis import logarithmic
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import Style

HEIGHTS_IN = [2.0, 1.2]
SEVERITY_HEIGHT_IN = 2.6
GAUSSIAN_KURTOSIS = 3.0
PEAK_OPACITY = 0.45
# From green to red, so pale that lines read on all of them.
ZONE_COLOURS = ("#e3f3e6", "#f6f6d8", "#fdebd3", "#fbdcdc")
# Above what is shown, so that a quiet machine's zone is seen with the boundary above it.
HEADROOM = 1.15
# Windows that follow each other are one step apart, but for rounding.
MISSING_STEP = 1.5


def level_figures(study: Study) -> dict[str, Figure]:
    """Draw running levels, one figure for each band and group of channels of one unit, by name.

    Solid lines are RMS, pale ones peaks, each about the mean of its window.
    """
    style = Style.of(study)
    with look():
        return {
            f"levels {place}.{column} {group.name}": _figure(one, column - 1, group, style)
            for place, one in enumerate(study.levels, start=1)
            for column in range(1, len(one.bands_hz) + 1)
            for group in groups(one.channels)
        }


def severity_figures(study: Study) -> dict[str, Figure]:
    """Draw severities over time on the zones of the machine's class, by name."""
    style = Style.of(study)
    with look():
        return {
            f"severity {place}.{page}": _severity_figure(one, group, style)
            for place, one in enumerate(study.severities, start=1)
            for page, group in enumerate(groups(one.channels), start=1)
        }


def _figure(levels: Levels, column: int, group: Group, style: Style) -> Figure:
    figure, (above, below) = sheet(HEIGHTS_IN, sharex=True)
    draw_strength(above, levels=levels, column=column, group=group, style=style)
    draw_kurtosis(below, levels=levels, column=column, group=group, style=style)
    below.set_xlabel(levels_label(levels, column))
    return figure


def draw_strength(axes: Axes, levels: Levels, column: int, group: Group, style: Style) -> None:
    """Draw RMS, and pale the peak, of some channels in one band over time."""
    running, time_s = levels.running, _time_s(levels.running, style)
    for row in group.rows:
        channel = levels.channels[row]
        colour = paint(style.on_light(channel))
        _line(axes, time_s, running.rms[row, column], color=colour, label=plain(style.labels[channel.name]))
        _line(axes, time_s, running.peak[row, column], color=colour, alpha=PEAK_OPACITY, linewidth=0.6)
    axes.plot([], [], color="#555555", alpha=PEAK_OPACITY, linewidth=0.6, label="peak")
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel(f"RMS, peak [{printed_unit(group.unit)}]")
    _span(axes, running, style)
    legend(axes)


def draw_kurtosis(axes: Axes, levels: Levels, column: int, group: Group, style: Style) -> None:
    """Draw the kurtosis of some channels in one band over time, with that of Gaussian noise."""
    running, time_s = levels.running, _time_s(levels.running, style)
    for row in group.rows:
        colour = paint(style.on_light(levels.channels[row]))
        _line(axes, time_s, running.kurtosis[row, column], color=colour)
    # Never below 1; from single blows it reaches hundreds.
    highest = float(np.nanmax(running.kurtosis[list(group.rows), column], initial=0.0))
    logarithmic(axes, 1.0, max(10.0, 1.3 * highest))
    axes.axhline(GAUSSIAN_KURTOSIS, color="#777777", linewidth=0.6, linestyle="--", label="Gaussian noise: 3")
    axes.set_ylabel("Kurtosis")
    _span(axes, running, style)
    legend(axes)


def levels_label(levels: Levels, column: int) -> str:
    """Say what runs along the axis of a picture of levels."""
    low_hz, high_hz = levels.bands_hz[column]
    return f"Time [s], windows of {levels.running.window_s:.3g} s, {low_hz:.4g} to {high_hz:.4g} Hz"


def _severity_figure(severity: Severity, group: Group, style: Style) -> Figure:
    figure, (axes,) = sheet([SEVERITY_HEIGHT_IN])
    draw_severity(axes, severity=severity, group=group, style=style)
    axes.set_xlabel(severity_label(severity))
    return figure


def severity_label(severity: Severity) -> str:
    """Say what runs along the axis of a picture of severity."""
    low_hz, high_hz = severity.band_hz
    zones = f"\nzones A to D of ISO 20816-3: {severity.machine}" if severity.zones else ""
    return f"Time [s], windows of {severity.running.window_s:.3g} s, {low_hz:.4g} to {high_hz:.4g} Hz{zones}"


def draw_severity(axes: Axes, severity: Severity, group: Group, style: Style) -> None:
    """Draw the RMS of velocity over time on the zones of the machine's class; of displacement where that decides."""
    running, boundaries, per_si, label = (
        (severity.running_displacement, severity.boundaries_um, 1e6, "Displacement RMS [µm]")
        if _displaced(severity, group)
        # Levels are in SI; the standard and its readers count in mm/s.
        else (severity.running, severity.boundaries_mm_s, 1e3, "Velocity RMS [mm/s]")
    )
    time_s = _time_s(running, style)
    top = 0.0
    for row in group.rows:
        channel = severity.channels[row]
        rms = per_si * running.rms[row, 0]
        top = max(top, float(np.nanmax(rms, initial=0.0)))
        _line(axes, time_s, rms, color=paint(style.on_light(channel)), label=plain(style.labels[channel.name]))
    _zones(axes, boundaries, top)
    axes.set_ylabel(label)
    _span(axes, running, style)
    legend(axes)


def _displaced(severity: Severity, group: Group) -> bool:
    """Whether the worst zone of these channels is that of a displacement alone."""
    worst = [
        max((zones[row] for row in group.rows), default="")
        for zones in (severity.velocity_zones, severity.displacement_zones)
        if zones
    ]
    return bool(worst) and worst[1] > worst[0]


def _zones(axes: Axes, boundaries: tuple[float, ...], top: float) -> None:
    """Colour the zones up to the next boundary above what is shown, and name them."""
    above = [one for one in boundaries if one > top]
    limit = HEADROOM * (above[0] if above else top or 1.0)
    axes.set_ylim(0.0, limit)
    if not boundaries:
        return
    edges = [0.0, *boundaries, np.inf]
    for zone, colour, low, high in zip("ABCD", ZONE_COLOURS, edges[:-1], edges[1:], strict=True):
        if low < limit:
            shown = min(high, limit)
            axes.axhspan(low, shown, color=colour, linewidth=0, zorder=0)
            axes.text(1.01, (low + shown) / 2, zone, transform=axes.get_yaxis_transform(), va="center")


def _time_s(running: RunningLevels, style: Style) -> Real:
    return running.time_s + (running.start_time_ns - style.origin_ns) / NS_PER_S


def _span(axes: Axes, running: RunningLevels, style: Style) -> None:
    time_s = _time_s(running, style)
    axes.set_xlim(time_s[0] - running.window_s / 2, time_s[-1] + running.window_s / 2)


def _line(axes: Axes, time_s: Real, values: Real, **looks: Any) -> None:
    # Windows without a sample aren't listed: where they're missing the line is, too.
    steps_s = np.diff(time_s)
    breaks = np.flatnonzero(steps_s > MISSING_STEP * np.min(steps_s, initial=np.inf)) + 1
    # A line needs two points.
    axes.plot(*with_breaks(time_s, values, breaks), marker="." if time_s.size == 1 else None, **looks)
