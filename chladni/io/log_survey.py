"""One pass over a whole log, to learn whether it is sound."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.catalog import Catalog
from chladni.io.channel_source import UNKNOWN_UNIT
from chladni.io.gathering import Gathering, LostMessages, windowed
from chladni.io.log_info import ChannelInfo, LogInfo, some_of
from chladni.io.loss import Loss, losses
from chladni.io.mcap.container import McapContainer
from chladni.io.placement import Placement
from chladni.io.stream import read_pieces
from chladni.signals.time_series import NS_PER_S

#: Samples of a channel that are looked at together for clipping, dropouts and spikes.
STRETCH = 1 << 18


@dataclass(slots=True, kw_only=True)
class _Monitor:
    """Stamps of one stream, and counts of what is wrong with its samples."""

    gathering: Gathering
    samples: int = 0
    nonfinite: NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        self.nonfinite = np.zeros(len(self.gathering.stream.sources), np.int64)

    def watch(self, values: NDArray[np.floating[Any]]) -> None:
        """Look at the samples of one piece."""
        self.samples += values.shape[1]
        self.nonfinite += values.shape[1] - np.count_nonzero(np.isfinite(values), axis=1)


def survey(container: McapContainer, content: Catalog, lost: LostMessages) -> LogInfo:
    """Read every channel listed once.

    Stamps are kept (8 bytes a message), samples aren't.
    """
    streams = content.streams(content.channels)
    monitors = [_Monitor(gathering=Gathering(stream=stream)) for stream in streams]
    pass_lost = LostMessages()
    for index, piece in windowed(streams, read_pieces(container, streams), pass_lost, window_ns=(None, None)):
        monitors[index].gathering.add(piece, with_values=False)
        monitors[index].watch(piece.values)
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
    content: Catalog, monitors: Sequence[_Monitor], placements: Sequence[Placement]
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
                    samples=monitor.samples - int(monitor.nonfinite[row]),
                    stamp=stream.choice.kind,
                    stamp_reason=stream.choice.reason,
                    time_base=base,
                    gaps=gaps,
                    clipped=0,
                ),
            )


def _duration_s(content: Catalog, monitors: Sequence[_Monitor], placements: Sequence[Placement]) -> float:
    """From the log's start to the end of its last sample."""
    ends = [
        monitor.gathering.end_ns(placement.time_base.rate_hz)
        for monitor, placement in zip(monitors, placements, strict=True)
        if monitor.samples
    ]
    return max(0, max(ends, default=content.start_ns) - content.start_ns) / NS_PER_S


# --- findings ----------------------------------------------------------------------------------------------------


def _findings(
    content: Catalog, monitors: Sequence[_Monitor], placements: Sequence[Placement], damage: Sequence[Loss]
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
        yield f"{stream.label}: no messages"
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


def _sample_findings(monitor: _Monitor) -> Iterator[str]:
    stream = monitor.gathering.stream
    for channel, count in zip(stream.channels, monitor.nonfinite.tolist(), strict=True):
        if count:
            yield f"{channel.name}: {count} of {monitor.samples} samples are no finite number; they count as missing"


def _content_findings(content: Catalog) -> Iterator[str]:
    for topic, reason in content.refused.items():
        yield f"{topic}: can't be decoded: {reason}"
    for name, channels in content.topics.items():
        for leaf in channels.skipped_arrays():
            yield f"{name}.{leaf}: an array this long isn't listed; single elements can be read by path"
    unknown = [source.channel.name for source in content.channels if source.channel.unit == UNKNOWN_UNIT]
    if unknown:
        yield f"the log gives no unit for {some_of(unknown)}; a setup file can"
