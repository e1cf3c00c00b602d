"""Trends on a timeline of dates: values less what covariates explain, their level, and changes, as a recording."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.io.atomic import atomic_write
from chladni.signals.arrays import Whole
from chladni.signals.trend import Trend, no_change_sentence
from chladni.signals.unit_text import printed_unit
from chladni.signals.visible import visible
from chladni.viewers.figures.trends import SECTIONS, dates_around
from chladni.viewers.rerun.drawing import new_recording
from chladni.viewers.rerun.entities import folder
from chladni.viewers.style import ON_DARK

DATE, PLACE = "date", "log"
#: More plots than this above one another are too flat to read; the rest goes behind tabs.
STACKED: Final = 4
VALUES, EXPECTED, CHANGED = ON_DARK[0], ON_DARK[7], ON_DARK[1]


def write_trend_rrd(
    trends: Sequence[Trend], changes: Sequence[str], path: str | os.PathLike[str], *, name: str
) -> Path:
    """Write trends to a ``.rrd`` file, whole or not at all.

    Parameters
    ----------
    trends
        What to draw; on a timeline of dates, or of the number of the log where logs have no dates.
    changes
        Sentences on what changed.
    path
        File to write; one that exists is replaced once the new one is complete.
    name
        Of the recording.

    Raises
    ------
    LogError
        When the file can't be written.
    """
    target = Path(path)
    recording = new_recording()
    # Not rerun's own file sink: on a full disk it only logs the loss, and a later flush waits for ever.
    stream = rr.binary_stream(recording)
    with atomic_write(target) as file:
        draw_trends(recording, trends, changes, name=name)
        file.write(stream.read() or b"")
    return target


def draw_trends(recording: rr.RecordingStream, trends: Sequence[Trend], changes: Sequence[str], *, name: str) -> None:
    """Write trends and their blueprint into a recording that is connected already."""
    recording.send_recording_name(visible(name))
    told = "\n".join(f"- {visible(one)}" for one in changes) or no_change_sentence(trends)
    recording.log("/changes", rr.TextDocument(told, media_type="text/markdown"), static=True)
    pages: list[rrb.Container | rrb.View] = []
    for kind, heading in SECTIONS.items():
        views = [_draw(recording, one, place) for place, one in enumerate(trends) if one.kind == kind]
        stacks = [views[first : first + STACKED] for first in range(0, len(views), STACKED)]
        columns = [rrb.Vertical(*stack, name=f"{heading} {n}") for n, stack in enumerate(stacks, 1)]
        if columns:
            pages.append(
                rrb.Tabs(*columns, name=heading) if len(columns) > 1 else rrb.Vertical(*stacks[0], name=heading)
            )
    text = rrb.TextDocumentView(origin="/changes", name="What changed")
    shown = rrb.Vertical(rrb.Tabs(*pages), text, row_shares=[4, 1]) if pages else rrb.Vertical(text)
    # The blueprint goes last: rerun 0.41 has lost rows that followed one in a file (rerun issue 12769).
    recording.flush()
    recording.send_blueprint(rrb.Blueprint(shown, rrb.TimePanel(state="collapsed"), collapse_panels=True),
                             make_active=True, make_default=True)  # fmt: skip
    recording.flush()


def _draw(recording: rr.RecordingStream, trend: Trend, place: int) -> rrb.View:
    # Two names may be one when they are written as paths.
    path = folder("trends", trend.kind, f"{place} {trend.name}")
    index = _index(trend)
    unit = "" if trend.unit == "1" else f" [{printed_unit(trend.unit)}]"
    if trend.covariates:
        measured = rr.SeriesPoints(names="as measured", colors=[(*EXPECTED, 110)], marker_sizes=1.5)
        recording.log(f"{path}/measured", measured, static=True)
        recording.send_columns(f"{path}/measured", [index], rr.Scalars.columns(scalars=trend.values))
    recording.log(f"{path}/values", rr.SeriesPoints(names="each log", colors=[VALUES], marker_sizes=2.5), static=True)
    level = trend.expected - trend.explained
    recording.log(
        f"{path}/expected",
        rr.SeriesLines(names="expected", colors=[EXPECTED], widths=1.5, aggregation_policy="Off"),
        static=True,
    )
    recording.send_columns(f"{path}/values", [index], rr.Scalars.columns(scalars=trend.values - trend.explained))
    recording.send_columns(f"{path}/expected", [index], rr.Scalars.columns(scalars=level))
    places = np.array([one.place for one in trend.changes], dtype=np.int64)
    if places.size:
        recording.log(
            f"{path}/changes",
            rr.SeriesPoints(names="changed", colors=[CHANGED], markers="Diamond", marker_sizes=7.0),
            static=True,
        )
        recording.send_columns(f"{path}/changes", [_index(trend, places)], rr.Scalars.columns(scalars=level[places]))
    return rrb.TimeSeriesView(
        origin=path,
        name=visible(f"{trend.name}{unit}"),
        axis_x=_axis(trend),
        plot_legend=rrb.PlotLegend(visible=False),
    )


def _axis(trend: Trend) -> rr.blueprint.TimeAxis:
    """Give an axis that shows all logs at first; the viewer alone would show the seconds about the first one."""
    boundary = rr.TimeRangeBoundary.absolute
    if not trend.times_ns.all():
        return rr.blueprint.TimeAxis(
            view_range=rr.TimeRange(start=boundary(seq=0), end=boundary(seq=max(len(trend.logs) - 1, 1)))
        )
    first, last = dates_around(trend.times_ns)
    return rr.blueprint.TimeAxis(view_range=rr.TimeRange(start=boundary(nanos=first), end=boundary(nanos=last)))


def _index(trend: Trend, places: Whole | None = None) -> rr.TimeColumn:
    chosen = slice(None) if places is None else places
    if trend.times_ns.all():
        return rr.TimeColumn(DATE, timestamp=trend.times_ns[chosen].astype("datetime64[ns]"))
    return rr.TimeColumn(PLACE, sequence=np.arange(len(trend.logs))[chosen])
