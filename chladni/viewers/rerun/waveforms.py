"""Waveforms over the log's time."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.study import Study
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import thin, without_repeated_gaps
from chladni.viewers.groups import Group, groups
from chladni.viewers.labels import part_of_several, thinned
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.rerun.several_logs import GroupView, over_one_another
from chladni.viewers.rerun.timelines import send_scalars, time_axis, time_index
from chladni.viewers.style import Style

# The viewer holds every row in memory, sixteen bytes and more each; above this only extremes are written.
ROWS_OF_A_CHANNEL = 2_000_000
ROWS_OF_A_STUDY = 16_000_000
# A little shows through, so that a weak channel isn't lost behind a strong one.
OPACITY = 190


def draw_waveforms(recording: rr.RecordingStream, study: Study, style: Style) -> list[rrb.View]:
    """Write the waveforms and give a view for each group of channels.

    A series of more samples than a viewer can hold is written as the least and the greatest sample of each stretch,
    and the view's name says so.
    """
    # One budget for the study: twenty short channels weigh as much as one long one.
    channels = sum(len(series.channels) for series in study.series)
    limit = min(ROWS_OF_A_CHANNEL, ROWS_OF_A_STUDY // max(channels, 1))
    return over_one_another(
        study,
        [
            _draw_group(recording, study, series, group, style, limit=limit, place=place)
            for place, series in enumerate(study.series, start=1)
            for group in groups(series.channels)
        ],
    )


def waveform_view(study: Study, style: Style, name: str) -> rrb.View | None:
    """Give a view of one channel's waveform, drawn already, or None when the study has none of it."""
    for place, series in enumerate(study.series, start=1):
        for group in groups(series.channels):
            for row in group.rows:
                if series.channels[row].name == name:
                    origin = channel_entity(folder("waveforms", str(place), group.name), series.channels[row])
                    title = f"{style.labels[name]} [{printed_unit(group.unit)}]"
                    return _view(series, origin, title, style, legend=False)
    return None


def _draw_group(
    recording: rr.RecordingStream,
    study: Study,
    series: TimeSeries,
    group: Group,
    style: Style,
    *,
    limit: int,
    place: int,
) -> GroupView:
    parent = folder("waveforms", str(place), group.name)
    part = part_of_several(place, len(study.series), f"{series.sample_rate_hz:g} Hz") * (not study.logs)
    stretch = max(_draw_channel(recording, series, row, parent, style, limit) for row in group.rows)
    view = _view(series, parent, f"{group.title}{part}{thinned(stretch)}", style, legend=True)
    return GroupView(group=group, view=view, end=series.start_time_ns + series.duration_s * NS_PER_S)


def _view(series: TimeSeries, origin: str, name: str, style: Style, *, legend: bool) -> rrb.View:
    start_ns = series.start_time_ns - style.origin_ns
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        axis_x=time_axis(start_ns + round(series.duration_s * NS_PER_S), start_ns=start_ns),
        plot_legend=rrb.PlotLegend(visible=legend, corner=rrb.Corner2D.LeftTop),
    )


def _draw_channel(
    recording: rr.RecordingStream, series: TimeSeries, row: int, parent: str, style: Style, limit: int
) -> int:
    channel = series.channels[row]
    path = channel_entity(parent, channel)
    lines = rr.SeriesLines(
        names=style.labels[channel.name],
        colors=[(*style.on_dark(channel), OPACITY)],
        widths=1.0,
        # The default averages neighbours when zoomed out, which makes a vibration look like silence.
        aggregation_policy="MinMax",
    )
    recording.log(path, lines, static=True)
    # A copy, one channel at a time: the series stays as it is, and memory stays bounded.
    values = series.values[row].astype(np.float64)
    if series.valid is not None:
        values[~series.valid[row]] = np.nan
    chosen, stretch = thin(values, limit=limit)
    chosen = chosen[without_repeated_gaps(values[chosen])]
    start_ns = series.start_time_ns - style.origin_ns
    # From the index, so that no rounding error adds up over an hour.
    offsets_ns = np.rint(chosen / series.sample_rate_hz * NS_PER_S).astype(np.int64) + start_ns
    send_scalars(recording, path, time_index(offsets_ns), values[chosen])
    return stretch
