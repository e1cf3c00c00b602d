"""One pass over a whole log, to learn whether it is sound."""

from collections.abc import Iterator, Sequence

from chladni.io.catalog import Catalog
from chladni.io.gathering import Gathering, LostMessages, windowed
from chladni.io.log_findings import log_findings
from chladni.io.log_info import ChannelInfo, LogInfo
from chladni.io.loss import losses
from chladni.io.mcap.container import McapContainer
from chladni.io.placement import Placement
from chladni.io.sample_monitor import SampleMonitor
from chladni.io.stream import read_pieces
from chladni.signals.time_series import NS_PER_S


def survey(container: McapContainer, content: Catalog, lost: LostMessages) -> LogInfo:
    """Read every channel listed once.

    Stamps are kept (8 bytes a message), samples only as long as they're being judged.
    """
    streams = content.streams(content.channels)
    monitors = [SampleMonitor(gathering=Gathering(stream=stream), start_ns=content.start_ns) for stream in streams]
    pass_lost = LostMessages()
    for index, piece in windowed(streams, read_pieces(container, streams), pass_lost, window_ns=(None, None)):
        monitors[index].watch(piece)
    for monitor in monitors:
        monitor.judge()
    lost.merge(pass_lost)
    placements = [monitor.gathering.place() for monitor in monitors]
    found = dict(_channels(content, monitors, placements))
    damage = losses(container.damage, lost)
    return LogInfo(
        file=content.file,
        start_time_ns=content.start_ns,
        duration_s=_duration_s(content, monitors, placements),
        channels=tuple(found[source.channel.name] for source in content.channels),
        damage=damage,
        findings=tuple(log_findings(content, monitors, placements, damage)),
    )


def _channels(
    content: Catalog, monitors: Sequence[SampleMonitor], placements: Sequence[Placement]
) -> Iterator[tuple[str, ChannelInfo]]:
    for monitor, placement in zip(monitors, placements, strict=True):
        stream, base = placement.stream, placement.time_base
        first_ns = monitor.gathering.first_ns(content.start_ns)
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
                    clipped=monitor.clipped(channel.name),
                ),
            )


def _duration_s(content: Catalog, monitors: Sequence[SampleMonitor], placements: Sequence[Placement]) -> float:
    """From the log's start to the end of its last sample."""
    ends = [
        monitor.gathering.end_ns(placement.time_base.rate_hz)
        for monitor, placement in zip(monitors, placements, strict=True)
        if monitor.samples
    ]
    return max(0, max(ends, default=content.start_ns) - content.start_ns) / NS_PER_S
