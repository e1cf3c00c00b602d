"""What a source gives at a time, and what every source of messages can do."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from chladni.io.mcap.channel_registry import McapChannel
from chladni.io.mcap.message_batch import MessageBatch
from chladni.signals.time_series import TimeSeries


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reception:
    """Messages that came since the last time.

    Attributes
    ----------
    batches
        In the order in which they came.
    told
        Sentences on what is wrong or has changed: a cut file, a lost connection, messages left out.
    ended
        Whether nothing more can come.
    """

    batches: tuple[MessageBatch, ...] = ()
    told: tuple[str, ...] = ()
    ended: bool = False


ToldKind = Literal["source", "topic", "gap", "clock", "late", "silent", "back", "skipped"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """Something that happened to the samples on their way.

    Attributes
    ----------
    kind
        ``source``: of the file, the connection or the instrument; ``topic``: of a topic that appeared or can't be
        read; ``gap``: samples missing; ``clock``: a clock that was set; ``late``: messages left out; ``silent`` and
        ``back``: a topic that gives nothing, and one that gives again; ``skipped``: dropped since the computer
        couldn't follow.
    text
        A sentence.
    time_ns
        When, by the stamps; None where that isn't known.
    samples
        How many are missing or were dropped.
    """

    kind: ToldKind
    text: str
    time_ns: int | None = None
    samples: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """Blocks of samples that came since the last time.

    Attributes
    ----------
    blocks
        In order of time; several sampling grids may alternate.
    told
        What happened to them.
    ended
        As in `Reception`.
    """

    blocks: tuple[TimeSeries, ...] = ()
    told: tuple[Told, ...] = ()
    ended: bool = False


class MessageSource(ABC):
    """Messages as they come, from a file that grows, a pipe or a server."""

    name: str

    @property
    @abstractmethod
    def channels(self) -> Mapping[int, McapChannel]:
        """Channels of messages known so far, by id; more may come, none goes."""

    @abstractmethod
    def receive(self, timeout_s: float, /) -> Reception:
        """Give what has come, at the latest after `timeout_s`, which may be nothing."""

    @abstractmethod
    def close(self) -> None:
        """Let go of file or connection."""
