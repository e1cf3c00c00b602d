"""One way to see a series, a stream of blocks, and a record that several computers share."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, Protocol

from numpy.typing import NDArray

from chladni.signals.channel import require_channels
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import TimeSeries

Source = TimeSeries | Iterable[TimeSeries]
Numbers = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Margins:
    """What a part of a record needs beside its own samples, so that parts together give what the whole gives.

    Attributes
    ----------
    hop
        Parts are cut at whole multiples of it, counted from the start of each run of valid samples.
    before, after
        Samples of its neighbours, at least.
    """

    hop: int = 1
    before: int = 0
    after: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Own:
    """Samples of a record that a part counts.

    Attributes
    ----------
    start_time_ns
        Of the record.
    first, last
        Numbers of the first one and of the one past the last, counted from the record's first.
    """

    start_time_ns: int
    first: int
    last: int


class Accumulator(Protocol):
    """Sums blocks, in parts of a record that are then put together."""

    @property
    def margins(self) -> Margins:
        """What a part needs of its neighbours."""

    def begin(self, own: Own) -> None:
        """Be told before all else which samples of the record are to be counted: those of a part, or all."""

    def update(self, block: TimeSeries) -> None:
        """Take in the next block."""

    def numbers(self) -> Numbers:
        """Give what was summed of a part; nothing may follow."""

    def add_numbers(self, found: Numbers) -> None:
        """Take in what another one gave, of the next part in time."""

    def settle(self, runs: Sequence[tuple[int, int]]) -> None:
        """Be told, after the last part, the record's runs of samples that are valid in all channels."""


class Divided(ABC):
    """Blocks of a record that several computers share: each sums its part, and the sums are put together."""

    @abstractmethod
    def __iter__(self) -> Iterator[TimeSeries]:
        """Refuse: what takes blocks in any other way than by sums needs the whole record."""

    @abstractmethod
    def lead(self, samples: int) -> tuple[TimeSeries, ...]:
        """Give the record's first blocks, as `leading_part` does."""

    @abstractmethod
    def sum_up(self, accumulators: Sequence[Accumulator]) -> None:
        """Let accumulators have what all parts summed."""


def sum_up(source: Iterable[TimeSeries], *accumulators: Accumulator) -> None:
    """Let accumulators take in all blocks of a source, or what others summed of them."""
    if isinstance(source, Divided):
        source.sum_up(accumulators)
        return
    for block in source:
        for one in accumulators:
            one.update(block)


def leading_part(source: Source, samples: int) -> tuple[tuple[TimeSeries, ...], Iterable[TimeSeries]]:
    """Give the first blocks, together at least `samples` long if there are as many, and all blocks from the first.

    When the first blocks are shorter than `samples`, they are all there are. All blocks can be read once; those of a
    record that is shared can only be summed, see `sum_up`.

    Raises
    ------
    EstimateError
        When the source holds no sample or no channel.
    """
    if isinstance(source, Divided):
        return source.lead(samples), source
    blocks = iter((source,) if isinstance(source, TimeSeries) else source)
    lead: list[TimeSeries] = []
    length = 0
    # The first blocks are kept and handed out again, so that a source that can be read once is read once.
    for block in blocks:
        lead.append(block)
        length += block.samples
        if length >= samples:
            break
    if length == 0:
        raise EstimateError("there is no sample to average; choose a time window in which the log has data")
    require_channels(lead[0].channels)
    return tuple(lead), chain(lead, blocks)


def samples_known(source: Source, lead: tuple[TimeSeries, ...], enough: int) -> int | None:
    """Give the length of the whole source, or None for a stream that goes on after `enough` samples."""
    # A stream of exactly `enough` samples can't be told from a longer one without reading on.
    length = sum(block.samples for block in lead)
    return length if isinstance(source, TimeSeries) or length < enough else None
