"""One pass over a whole log, to learn whether it is sound."""

from collections.abc import Iterator, Sequence

from chladni.io.catalog import Catalog
from chladni.io.channel_source import UNKNOWN_UNIT
from chladni.io.gathering import Gathering, LostMessages, windowed
from chladni.io.log_info import ChannelInfo, LogInfo, some_of
from chladni.io.loss import Loss, losses
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
    monitors = [SampleMonitor(gathering=Gathering(stream=stream)) for stream in streams]
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
        findings=tuple(_findings(content, monitors, placements, damage)),
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


# --- findings ----------------------------------------------------------------------------------------------------


def _findings(
    content: Catalog, monitors: Sequence[SampleMonitor], placements: Sequence[Placement], damage: Sequence[Loss]
) -> Iterator[str]:
    if damage:
        known = [one.lost_messages for one in damage if one.lost_messages is not None]
        unknown = " at least" if len(known) < len(damage) else ""
        yield f"damage in {len(damage)} places,{unknown} {sum(known)} messages lost; the first: {damage[0].what}"
    yield from _stamp_findings(placements)
    for placement in placements:
        yield from _clock_findings(placement)
    for monitor in monitors:
        yield from _sample_findings(monitor)
    yield from _content_findings(content)


def _stamp_findings(placements: Sequence[Placement]) -> Iterator[str]:
    """Which topics don't simply go by their own stamps, and why; topics with the same reason together."""
    told: dict[tuple[str, str], list[str]] = {}
    for placement in placements:
        choice = placement.stream.choice
        if placement.time_base.samples and (choice.kind != "header" or choice.shift_ns):
            told.setdefault((choice.kind, choice.reason), []).append(placement.stream.label)
    for (kind, reason), labels in told.items():
        yield f"{some_of(labels)}: {'own stamps are' if kind == 'header' else f'{kind} time is'} used: {reason}"


def _clock_findings(placement: Placement) -> Iterator[str]:
    base, stream = placement.time_base, placement.stream
    if not base.samples:
        yield f"{stream.label}: no usable messages"
        return
    if base.verdict != "regular" or base.gap_count or base.jumps or base.wander_s * base.rate_hz > 1:
        yield f"{stream.label}: {base.advice}"
    if base.jumps:
        steps = ", ".join(f"{jump.step_s:.3g} s" for jump in base.jumps[:3])
        yield f"{stream.label}: the clock jumps {len(base.jumps)} times ({steps})"
    if base.duplicates:
        yield f"{stream.label}: {base.duplicates} messages have the stamp of another"
    if placement.left_out:
        yield f"{stream.label}: {placement.left_out} samples left out: an earlier one has their place on the grid"
    if base.out_of_order:
        yield f"{stream.label}: {base.out_of_order} messages came after later ones; they were put in order"


def _sample_findings(monitor: SampleMonitor) -> Iterator[str]:
    stream = monitor.gathering.stream
    for channel, count in zip(stream.channels, monitor.missing.tolist(), strict=False):
        if count:
            yield f"{channel.name}: {count} of {monitor.samples} samples are not a number; they count as missing"
    dead = [fault for fault in monitor.faults.values() if fault.kind == "dead"]
    yield from (fault.sentence for fault in monitor.faults.values() if fault.kind != "dead")
    if len(dead) > 1:
        # Messages have fields that many sensors don't fill; one sentence for all of them.
        yield f"{some_of([fault.channel for fault in dead])}: constant; fields that aren't measured, or dead sensors"
    yield from (fault.sentence for fault in dead if len(dead) == 1)


def _content_findings(content: Catalog) -> Iterator[str]:
    for topic, reason in content.refused.items():
        yield f"{topic}: can't be decoded: {reason}"
    for name, channels in content.topics.items():
        for leaf in channels.skipped_arrays():
            yield f"{name}.{leaf}: an array this long isn't listed; single elements can be read by path"
    unknown = [source.channel.name for source in content.channels if source.channel.unit == UNKNOWN_UNIT]
    if unknown:
        yield f"the log gives no unit for {some_of(unknown)}; a setup file can"
