"""One pass over a whole log, to learn whether it is sound."""

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from chladni.io.catalog import Catalog
from chladni.io.clock.shared_clocks import clocks_of
from chladni.io.clock.time_base import TimeBase
from chladni.io.files.contents import FileContents
from chladni.io.files.formats import MCAP, told_by_content
from chladni.io.gathering import Gathering, LostMessages, place_all, windowed
from chladni.io.log_findings import fault_findings, log_findings, missing_sentence, together, unit_findings
from chladni.io.log_info import ChannelInfo, LogInfo, oddities, unread_sentences
from chladni.io.loss import Unread, losses
from chladni.io.mcap.container import McapContainer
from chladni.io.placement import Placement, StatedRate
from chladni.io.sample_monitor import STRETCH_VALUES, Faults, SampleMonitor, clipped_samples, judge_samples
from chladni.io.stream import read_pieces
from chladni.signals.arrays import Real, Whole
from chladni.signals.time_series import NS_PER_S, TimeSeries


def survey(
    container: McapContainer, content: Catalog, lost: LostMessages, *, rate_hz: float | None = None
) -> LogInfo:
    """Read every channel listed once; `rate_hz` is a sampling rate that the user states.

    Stamps and log times are kept (some 20 bytes a message, and 8 to compare samples by), samples only as long as
    they're being judged.
    """
    streams = content.streams(content.channels)
    monitors = [SampleMonitor(gathering=Gathering(stream=stream), start_ns=content.start_ns) for stream in streams]
    pass_lost = LostMessages()
    for index, piece in windowed(streams, read_pieces(container, streams), pass_lost, window_ns=(None, None)):
        monitors[index].watch(piece)
    for monitor in monitors:
        monitor.judge()
    stated = None if rate_hz is None else StatedRate(hz=rate_hz, named=False)
    placements = place_all([monitor.gathering for monitor in monitors], clocks_of, stated=stated)
    pass_lost.add_untimed(placements)
    lost.merge(pass_lost)
    found = dict(_channels(content, monitors, placements))
    damage = losses(container.damage, lost)
    odd = (*told_by_content(container.path, MCAP), *oddities(lost))
    return LogInfo(
        file=content.file,
        start_time_ns=content.start_ns,
        duration_s=_duration_s(content, placements) or _logged_s(container),
        channels=tuple(found[source.channel.name] for source in content.channels),
        damage=damage,
        findings=tuple(log_findings(content, monitors, placements, damage, odd)),
        unread=content.unread,
    )


def _channels(
    content: Catalog, monitors: Sequence[SampleMonitor], placements: Sequence[Placement]
) -> Iterator[tuple[str, ChannelInfo]]:
    for monitor, placement in zip(monitors, placements, strict=True):
        stream, base = placement.stream, placement.time_base
        first_ns = content.start_ns if placement.first_ns is None else placement.first_ns
        offset_s = (first_ns - content.start_ns) / NS_PER_S
        gaps = tuple((start + offset_s, end + offset_s) for start, end in base.gaps)
        for row, channel in enumerate(stream.channels):
            yield (
                channel.name,
                ChannelInfo(
                    channel=channel,
                    encoding=stream.topic.encoding,
                    samples=base.samples - (int(monitor.missing[row]) if monitor.samples else 0),
                    stamp=stream.choice.kind,
                    stamp_reason=stream.choice.reason,
                    time_base=base,
                    gaps=gaps,
                    breaks_s=tuple((base.breaks_s[:, 1] + offset_s).tolist()),
                    clipped=monitor.clipped(channel.name),
                    publishers=max(placement.publishers, content.publishing_with(stream.topic.name)),
                    untimed=placement.without_time + monitor.gathering.untimed,
                ),
            )


def _duration_s(content: Catalog, placements: Sequence[Placement]) -> float:
    """From the log's start to the end of its last sample, without the breaks of the stream that has it."""
    return max((_lasts_s(one, content.start_ns) for one in placements), default=0.0)


def _lasts_s(placement: Placement, start_ns: int) -> float:
    if placement.end_ns is None:
        return 0.0
    base = placement.time_base
    # From the last sample to the first after a break, one is as long as ever.
    period_s = 1 / base.rate_hz if base.rate_hz > 0 else 0.0
    broken_s = float((np.diff(base.breaks_s)[:, 0] - period_s).sum())
    return max(0.0, (placement.end_ns - start_ns) / NS_PER_S - broken_s)


def _logged_s(container: McapContainer) -> float:
    """From the first message to the end of the last one, which stands for a period as a sample does."""
    counts, range_ns = container.message_counts(), container.time_range_ns
    if range_ns is None:
        return 0.0
    most = max(counts.values(), default=0) if counts is not None else 0
    period = 1 / (most - 1) if most > 1 else 0.0
    return (range_ns[1] - range_ns[0]) * (1 + period) / NS_PER_S


# --- data files --------------------------------------------------------------------------------------------------


def survey_file(
    file: str, kind: str, contents: FileContents, *, notes: Sequence[str], unread: tuple[Unread, ...]
) -> LogInfo:
    """Look at the samples of a data file once.

    Parameters
    ----------
    file, kind
        Its name, and what it is.
    contents
        What was read of it.
    notes, unread
        Sentences about that, and what isn't read.
    """
    faults: Faults = {}
    begin_ns = min((part.start_time_ns for part in contents.series), default=0)
    end_ns = max((_end_ns(part) for part in contents.series), default=0)
    bases = contents.time_bases or (None,) * len(contents.series)
    channels, missing = [], []
    for part, base in zip(contents.series, bases, strict=True):
        offset_s = (part.start_time_ns - begin_ns) / NS_PER_S
        lost = _judged(part, faults, offset_s)
        channels += _file_channels(part, base, kind, lost, faults, offset_s)
        beyond = _beyond_gaps(part, base or _stated_rate(part)).tolist()
        missing += [
            (channel.name, missing_sentence(count, part.samples))
            for channel, count in zip(part.channels, beyond, strict=True)
            if count
        ]
    told = (
        notes,
        unread_sentences(unread),
        together(missing),
        fault_findings(list(faults.values())),
        unit_findings([one.channel for one in channels]),
    )
    return LogInfo(
        file=file,
        start_time_ns=begin_ns,
        duration_s=(end_ns - begin_ns) / NS_PER_S,
        channels=tuple(channels),
        damage=(),
        findings=tuple(chain.from_iterable(told)),
        unread=unread,
        functions=contents.functions,
    )


def _end_ns(series: TimeSeries) -> int:
    return series.start_time_ns + round(series.duration_s * NS_PER_S)


def _judged(series: TimeSeries, faults: Faults, offset_s: float) -> Whole:
    """Judge the samples in stretches, and count those of each channel that are missing."""
    lost = np.zeros(len(series.channels), np.int64)
    length = max(1, STRETCH_VALUES // max(1, len(series.channels)))
    for first in range(0, series.samples, length):
        values, valid = series.values[:, first : first + length], None
        if series.valid is not None:
            valid = series.valid[:, first : first + length]
            values = np.where(valid, values, np.nan)

        def seconds(places: Whole, first: int = first) -> Real:
            return offset_s + (first + places) / series.sample_rate_hz

        lost += judge_samples(series.channels, values, faults, seconds)
    return lost


def _file_channels(
    series: TimeSeries, base: TimeBase | None, kind: str, lost: Whole, faults: Faults, offset_s: float
) -> list[ChannelInfo]:
    clock = base or _stated_rate(series)
    reason = "the file's own times" if base else f"samples follow one another at {series.sample_rate_hz:.9g} Hz"
    return [
        ChannelInfo(
            channel=channel,
            encoding=kind,
            samples=series.samples - count,
            stamp="column" if base else "rate",
            stamp_reason=reason,
            time_base=clock,
            gaps=tuple((start + offset_s, end + offset_s) for start, end in clock.gaps),
            breaks_s=tuple((clock.breaks_s[:, 1] + offset_s).tolist()),
            clipped=clipped_samples(faults, channel.name),
        )
        for channel, count in zip(series.channels, lost.tolist(), strict=True)
    ]


def _beyond_gaps(series: TimeSeries, clock: TimeBase) -> Whole:
    """Samples of each channel that are missing, besides those in the gaps that the clock has."""
    if series.valid is None:
        return np.zeros(len(series.channels), np.int64)
    expected = np.ones(series.samples, np.bool_)
    for start_s, end_s in clock.gaps:
        first, last = (round(one * series.sample_rate_hz) for one in (start_s, end_s))
        expected[first + 1 : last] = False
    # Where any channel has a sample there is no gap, whatever the clock makes of the times.
    expected |= series.valid.any(axis=0)
    beyond: Whole = np.count_nonzero(~series.valid & expected, axis=1)
    return beyond


def _stated_rate(series: TimeSeries) -> TimeBase:
    """Give the clock of samples without times: exact, with a gap wherever all channels lack samples."""
    gaps: list[tuple[float, float]] = []
    there = None if series.valid is None else np.flatnonzero(series.valid.any(axis=0))
    if there is not None and there.size:
        before = np.flatnonzero(np.diff(there) > 1)
        ends = np.stack((there[before], there[before + 1]), axis=1) / series.sample_rate_hz
        gaps = [(float(start), float(end)) for start, end in ends]
    return TimeBase(
        rate_hz=series.sample_rate_hz,
        rate_std_hz=0.0,
        start_ns=series.start_time_ns,
        samples=series.samples,
        verdict="regular",
        advice="",
        jitter_s=float("nan"),
        gaps=tuple(gaps),
        gap_count=len(gaps),
        knots_ns=np.empty(0, np.int64),
        knots_index=np.empty(0),
    )
