"""What `chladni info` tells of a log."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

from chladni.io.loss import Loss
from chladni.io.stamps import StampKind
from chladni.signals.channel import Channel
from chladni.signals.time_base import TimeBase

INFO_FORMAT: Final = "chladni.info/1"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChannelInfo:
    """What was found out about one channel.

    Attributes
    ----------
    channel
        The channel.
    encoding
        How its messages are encoded.
    samples
        Samples in the log.
    stamp, stamp_reason
        Which time is taken, and why.
    time_base
        What the stamps say about the clock.
    gaps
        (start, end) in seconds from the log's start: last sample before and first one after; the longest ones.
    breaks_s
        Seconds from the log's start at which a stretch begins that doesn't follow on the one before: the clock was
        set, or leapt ahead.
    clipped
        Samples at the sensor's limit.
    """

    channel: Channel
    encoding: str
    samples: int
    stamp: StampKind
    stamp_reason: str
    time_base: TimeBase
    gaps: tuple[tuple[float, float], ...]
    breaks_s: tuple[float, ...]
    clipped: int

    def to_json(self) -> dict[str, Any]:
        """Give plain lists, numbers and texts; null where nothing is known."""
        return {
            "name": self.channel.name,
            "unit": self.channel.unit,
            "encoding": self.encoding,
            "rate_hz": _positive(self.time_base.rate_hz),
            "rate_std_hz": self.time_base.rate_std_hz if isfinite(self.time_base.rate_std_hz) else None,
            "samples": self.samples,
            "stamp": self.stamp,
            "stamp_reason": self.stamp_reason,
            "jitter_s": self.time_base.jitter_s if isfinite(self.time_base.jitter_s) else None,
            "gaps": [list(gap) for gap in self.gaps],
            "breaks": list(self.breaks_s),
            "longest_stretch_s": _positive(self.time_base.longest_stretch_s),
            "duplicates": self.time_base.duplicates,
            "clipped": self.clipped,
        }


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogInfo:
    """What was found out about a log by reading all of it once.

    Attributes
    ----------
    file
        Its name.
    start_time_ns
        Time of the earliest sample, nanoseconds since the Unix epoch.
    duration_s
        From there to the end of the last sample, without breaks.
    channels
        In the order of the file.
    damage
        What was lost.
    findings
        Sentences about the log's soundness, the worst first.
    """

    file: str
    start_time_ns: int
    duration_s: float
    channels: tuple[ChannelInfo, ...]
    damage: tuple[Loss, ...]
    findings: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Give the content of ``chladni info --json``."""
        return {
            "format": INFO_FORMAT,
            "start_time_ns": self.start_time_ns,
            "duration_s": self.duration_s,
            "channels": [one.to_json() for one in self.channels],
            "damage": [_loss_json(one) for one in self.damage],
            "findings": list(self.findings),
        }


def _loss_json(loss: Loss) -> dict[str, Any]:
    return {
        "what": loss.what,
        "where": {"offset": loss.offset, "record": loss.record},
        "lost_messages": loss.lost_messages,
    }


def _positive(number: float) -> float | None:
    return number if isfinite(number) and number > 0 else None


def some_of(names: Sequence[str], *, count: int = 3) -> str:
    """Name the first few and count the rest.

    Examples
    --------
    >>> some_of(["a", "b", "c", "d", "e"])
    'a, b, c and 2 more'
    """
    more = f" and {len(names) - count} more" if len(names) > count else ""
    return ", ".join(names[:count]) + more
