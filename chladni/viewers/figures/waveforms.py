"""Waveforms: one axes for each channel, the same scale for channels of one known unit."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.channel import UNKNOWN
from chladni.signals.study import Study
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import thin
from chladni.viewers.figures.sheet import look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import Style

# Five a pixel at 300 dots an inch: what is left out can't be seen, and a report's plot can be zoomed.
POINTS = 12_000
# Of a study of many channels fewer, or its report would be a file of many megabytes.
POINTS_OF_A_STUDY, FEWEST_POINTS = 300_000, 3000


def waveform_figures(study: Study) -> dict[str, Figure]:
    """Draw the waveforms; one figure for each group of channels of one unit, by name.

    Long records are drawn through the least and the greatest sample of each stretch.
    """
    style = Style.of(study)
    channels = sum(len(series.channels) for series in study.series)
    points = min(POINTS, max(FEWEST_POINTS, POINTS_OF_A_STUDY // max(channels, 1)))
    with look():
        return {
            f"waveforms {place} {group.name}": _figure(series, group, style, points)
            for place, series in enumerate(study.series, start=1)
            for group in groups(series.channels)
        }


def _figure(series: TimeSeries, group: Group, style: Style, points: int) -> Figure:
    # Of a unit that isn't known nobody knows that it's the same in two channels: a hammer would hide the response.
    figure, stack = sheet([0.9] * len(group.rows), sharex=True, sharey=group.unit != UNKNOWN)
    for axes, row in zip(stack, group.rows, strict=True):
        _draw(axes, series, row, style, points)
    start_s = (series.start_time_ns - style.origin_ns) / NS_PER_S
    stack[-1].set_xlim(start_s, start_s + series.duration_s)
    stack[-1].set_xlabel("Time [s]")
    figure.supylabel(f"{group.name} [{printed_unit(group.unit)}]", fontsize=8.5)
    return figure


def _draw(axes: Axes, series: TimeSeries, row: int, style: Style, points: int) -> None:
    channel = series.channels[row]
    values = series.values[row].astype(np.float64)
    if series.valid is not None:
        values[~series.valid[row]] = np.nan
    # Without this an hour would be a file of a hundred megabytes and look the same.
    chosen, _ = thin(values, limit=points)
    start_s = (series.start_time_ns - style.origin_ns) / NS_PER_S
    axes.plot(
        start_s + chosen / series.sample_rate_hz, values[chosen], color=paint(style.on_light(channel)), linewidth=0.6
    )
    axes.set_title(plain(style.labels[channel.name]), loc="left", pad=2)
