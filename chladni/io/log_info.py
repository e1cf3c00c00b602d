"""What `chladni info` tells of a log."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Any, Final, Literal

from chladni.io.clock.time_base import TimeBase
from chladni.io.gathering import LostMessages
from chladni.io.loss import Loss, Unread
from chladni.io.stamps import StampKind
from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.visible import visible
from chladni.signals.wording import counted

INFO_FORMAT: Final = "chladni.info/1"
SampleTime = StampKind | Literal["column", "rate"]
"""Time of a message; or, in a data file, a column of times, or a rate and nothing else."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ChannelInfo:
    """What was found out about one channel.

    Attributes
    ----------
    channel
        The channel.
    encoding
        How its messages are encoded; of a data file its kind, such as ``csv``.
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
    untimed
        Messages left out because their stamp is no time, or contradicts the count of those around it.
    publishers
        How many publish the channel's topic at once.
    """

    channel: Channel
    encoding: str
    samples: int
    stamp: SampleTime
    stamp_reason: str
    time_base: TimeBase
    gaps: tuple[tuple[float, float], ...]
    breaks_s: tuple[float, ...]
    clipped: int
    untimed: int = 0
    publishers: int = 1

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
            "untimed": self.untimed,
            "publishers": self.publishers,
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
        From there to the end of the last sample, without breaks; of a log without samples that of its messages.
    channels
        In the order of the file.
    damage
        What was lost.
    findings
        Sentences about the log's soundness, the worst first.
    unread
        Topics, and fields of topics, or parts of a data file, that no channel was made of.
    functions
        Frequency responses that the file holds ready-made, or None.
    """

    file: str
    start_time_ns: int
    duration_s: float
    channels: tuple[ChannelInfo, ...]
    damage: tuple[Loss, ...]
    findings: tuple[str, ...]
    unread: tuple[Unread, ...] = ()
    functions: FrequencyResponse | None = None

    def to_json(self) -> dict[str, Any]:
        """Give the content of ``chladni info --json``."""
        return {
            "format": INFO_FORMAT,
            "start_time_ns": self.start_time_ns,
            "duration_s": self.duration_s,
            "channels": [one.to_json() for one in self.channels],
            "damage": [_loss_json(one) for one in self.damage],
            "findings": list(self.findings),
            "unread": [one.to_json() for one in self.unread],
            **({} if self.functions is None else {"functions": _functions_json(self.functions)}),
        }


def _loss_json(loss: Loss) -> dict[str, Any]:
    return {
        "what": loss.what,
        "where": {"offset": loss.offset, "record": loss.record},
        "lost_messages": loss.lost_messages,
    }


def _functions_json(functions: FrequencyResponse) -> list[dict[str, Any]]:
    return [
        {
            "response": response.name,
            "reference": reference.name,
            "unit": functions.unit(row, column),
            "lines": functions.frequency_hz.size,
            "low_hz": float(functions.frequency_hz[0]),
            "high_hz": float(functions.frequency_hz[-1]),
        }
        for row, response in enumerate(functions.responses)
        for column, reference in enumerate(functions.references)
    ]


def _positive(number: float) -> float | None:
    return number if isfinite(number) and number > 0 else None


def some_of(names: Sequence[str], *, count: int = 3) -> str:
    """Name the first few, as they are shown, and count the rest.

    Examples
    --------
    >>> some_of(["a", "b", "c", "d", "e"])
    'a, b, c and 2 more'
    """
    more = f" and {len(names) - count} more" if len(names) > count else ""
    return ", ".join(map(visible, names[:count])) + more


def unread_sentences(unread: Iterable[Unread]) -> tuple[str, ...]:
    """Say what was left out and why, all that share a reason together.

    Examples
    --------
    >>> unread_sentences([Unread(topic="/a", reason="holds no number", messages=9)])
    ('/a (9 messages): holds no number',)
    """
    groups: dict[str, list[Unread]] = {}
    for one in unread:
        groups.setdefault(one.reason, []).append(one)
    return tuple(f"{_counted_names(group)}: {reason}" for reason, group in groups.items())


def _counted_names(group: Sequence[Unread]) -> str:
    known = [one.messages for one in group if one.messages is not None]
    messages = f" ({counted(sum(known), 'message')})" if len(known) == len(group) else ""
    return f"{some_of([one.name for one in group])}{messages}"


def oddities(lost: LostMessages) -> tuple[str, ...]:
    """Say what is odd about messages that were read all the same."""
    groups: dict[tuple[str, int], list[str]] = {}
    for (topic, what), messages in lost.told.items():
        groups.setdefault((what, messages), []).append(topic)
    return tuple(f"{some_of(topics)}: {what} ({counted(n, 'message')})" for (what, n), topics in groups.items())
