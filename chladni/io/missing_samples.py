"""Samples that were not measured, or are no numbers: how many of each channel, and when."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from chladni.io.log_info import some_of
from chladni.signals.sensor_quality import moments
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.wording import counted

MOST_TOLD = 5


@dataclass(slots=True, kw_only=True)
class _Tally:
    """What one reading of a channel gave: samples in all, those that are missing, the times of the first and last."""

    samples: int = 0
    missing: int = 0
    first_ns: int = 0
    last_ns: int = 0


class MissingSamples:
    """Counts the samples that are missing in what is read, and says so in a sentence.

    Examples
    --------
    >>> series = TimeSeries.from_arrays([[np.nan, 1.0, 2.0, 3.0]], sample_rate_hz=4.0)
    >>> book = MissingSamples()
    >>> for block in book.watch(series):
    ...     pass
    >>> book.sentences(from_ns=0)
    ('ch1: 1 of 4 samples is missing at 0 s; nothing is put in its place',)
    """

    def __init__(self) -> None:
        self._known: dict[str, _Tally] = {}

    def watch(self, blocks: TimeSeries | Iterable[TimeSeries]) -> Iterator[TimeSeries]:
        """Pass blocks on, counting; of several readings of a channel the one that gave most of it counts."""
        fresh: dict[str, _Tally] = {}
        for block in (blocks,) if isinstance(blocks, TimeSeries) else blocks:
            _count(block, fresh)
            for name, tally in fresh.items():
                known = self._known.get(name)
                if known is None or tally.samples >= known.samples:
                    self._known[name] = tally
            yield block

    def sentences(self, *, from_ns: int) -> tuple[str, ...]:
        """Say which channels lack samples, those that lack the same ones together; seconds count from `from_ns`."""
        groups: dict[str, list[str]] = {}
        for name, tally in self._known.items():
            if tally.missing:
                groups.setdefault(_words(tally, from_ns), []).append(name)
        told = [f"{some_of(names)}: {words}" for words, names in groups.items()]
        if len(told) <= MOST_TOLD:
            return tuple(told)
        more = sum(len(names) for names in list(groups.values())[MOST_TOLD:])
        told[MOST_TOLD:] = [f"{counted(more, 'more channel')} with missing samples; chladni info tells of each"]
        return tuple(told)


def missing_notes(series: TimeSeries) -> tuple[str, ...]:
    """Say which channels of a series lack samples."""
    book = MissingSamples()
    for _ in book.watch(series):
        pass
    return book.sentences(from_ns=series.start_time_ns)


def _count(block: TimeSeries, tallies: dict[str, _Tally]) -> None:
    for row, channel in enumerate(block.channels):
        tally = tallies.setdefault(channel.name, _Tally())
        tally.samples += block.samples
        if block.valid is None or block.valid[row].all():
            continue
        places = np.flatnonzero(~block.valid[row])
        first_ns, last_ns = (
            block.start_time_ns + round(int(place) / block.sample_rate_hz * NS_PER_S) for place in places[[0, -1]]
        )
        tally.first_ns = tally.first_ns if tally.missing else first_ns
        tally.last_ns = last_ns
        tally.missing += places.size


def _words(tally: _Tally, from_ns: int) -> str:
    if tally.missing == tally.samples:
        return "not one sample was measured; leave the channel out"
    when = moments(*((one - from_ns) / NS_PER_S for one in (tally.first_ns, tally.last_ns)))
    verb, place = ("is", "its place") if tally.missing == 1 else ("are", "their place")
    return f"{tally.missing} of {counted(tally.samples, 'sample')} {verb} missing {when}; nothing is put in {place}"
