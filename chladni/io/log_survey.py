"""One pass over a whole log, to learn whether it is sound."""

from collections.abc import Iterator, Sequence

import numpy as np

from chladni.io.catalog import Catalog
from chladni.io.clocks import clocks_of
from chladni.io.gathering import Gathering, LostMessages, place_all, windowed
from chladni.io.log_findings import log_findings
from chladni.io.log_info import ChannelInfo, LogInfo
from chladni.io.loss import losses
from chladni.io.mcap.container import McapContainer
from chladni.io.placement import Placement, StatedRate
from chladni.io.sample_monitor import SampleMonitor
from chladni.io.stream import read_pieces
from chladni.signals.time_series import NS_PER_S


def survey(
    container: McapContainer, content: Catalog, lost: LostMessages, *, rate_hz: float | None = None
) -> LogInfo:
    """Read every channel listed once; `rate_hz` is a sampling rate that the user states.

    Stamps are kept (8 bytes a message, and as much to compare samples by), samples only as long as they're being
    judged.
    """
    streams = content.streams(content.channels)
    monitors = [SampleMonitor(gathering=Gathering(stream=stream)) for stream in streams]
    pass_lost = LostMessages()
    for index, piece in windowed(streams, read_pieces(container, streams), pass_lost, window_ns=(None, None)):
        monitors[index].watch(piece)
    for monitor in monitors:
        monitor.judge()
    lost.merge(pass_lost)
    stated = None if rate_hz is None else StatedRate(hz=rate_hz, named=False)
    placements = place_all([monitor.gathering for monitor in monitors], clocks_of, stated=stated)
    found = dict(_channels(content, monitors, placements))
    damage = losses(container.damage, lost)
    return LogInfo(
        file=content.file,
        start_time_ns=content.start_ns,
        duration_s=_duration_s(content, placements),
        channels=tuple(found[source.channel.name] for source in content.channels),
        damage=damage,
        findings=tuple(log_findings(content, monitors, placements, damage)),
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
                    samples=monitor.samples - (int(monitor.missing[row]) if monitor.samples else 0),
                    stamp=stream.choice.kind,
                    stamp_reason=stream.choice.reason,
                    time_base=base,
                    gaps=gaps,
                    breaks_s=tuple((base.breaks_s[:, 1] + offset_s).tolist()),
                    clipped=monitor.clipped(channel.name),
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
