"""Watching the samples of a stream as they are read, in bounded memory."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.clock.stamp_order import arrival_order, untangle
from chladni.io.gathering import Gathering
from chladni.io.repeats import digests_of
from chladni.io.stream import Piece
from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel
from chladni.signals.sensor_quality import SensorFault, sensor_quality
from chladni.signals.time_series import NS_PER_S, TimeSeries

STRETCH_VALUES: Final = 1 << 24
"""Values of a stream that are judged together: 128 MiB in double precision. A longer log is judged in stretches."""

Faults = dict[tuple[str, str], SensorFault]
"""By channel and kind."""


@dataclass(slots=True, kw_only=True)
class SampleMonitor:
    """What is known of one stream's samples so far.

    Attributes
    ----------
    gathering
        Stamps of its messages.
    start_ns
        Start of the log, from which seconds are counted.
    samples
        Samples seen.
    missing
        ``[channel]``, samples that are no number.
    faults
        By channel and kind.
    """

    gathering: Gathering
    start_ns: int
    samples: int = 0
    missing: Whole = field(default_factory=lambda: np.zeros(0, np.int64))
    faults: Faults = field(default_factory=dict)
    _waiting: list[Piece] = field(default_factory=list)
    _waiting_values: int = 0

    def watch(self, piece: Piece) -> None:
        """Take the next piece."""
        self.gathering.add(piece, with_values=False)
        if piece.counts is None:
            self.gathering.digests.append(digests_of(piece.values))
        self._waiting.append(piece)
        self._waiting_values += piece.values.size
        if self._waiting_values >= STRETCH_VALUES:
            self.judge()

    def judge(self) -> None:
        """Judge what has been kept back, and let it go."""
        if not self._waiting:
            return
        pieces, values = self._waiting, _in_order(self._waiting)
        self._waiting, self._waiting_values = [], 0

        def seconds(places: Whole) -> Real:
            return np.asarray((_stamps_of(pieces, places) - self.start_ns) / NS_PER_S)

        missing = judge_samples(self.gathering.stream.channels, values, self.faults, seconds)
        self.samples += values.shape[1]
        self.missing = self.missing + missing if self.missing.size else missing

    def clipped(self, channel: str) -> int:
        """Samples of a channel at the sensor's limit."""
        return clipped_samples(self.faults, channel)


def judge_samples(
    channels: Sequence[Channel],
    values: NDArray[np.floating],
    faults: Faults,
    seconds: Callable[[Whole], Real],
) -> Whole:
    """Add what the samples ``[channel, sample]`` of one stretch show to `faults`; count those that are no numbers.

    `seconds` gives the times, from the log's start, of samples that are counted from the stretch's first.
    """
    nan = np.isnan(values)
    missing: Whole = np.count_nonzero(nan, axis=1)
    series = TimeSeries(
        values=values,
        # Rules look at neighbouring samples; where they lie in time is looked up for what is found.
        sample_rate_hz=1.0,
        channels=tuple(channels),
        valid=~nan if missing.any() else None,
    )
    found = sensor_quality(series)
    if not found:
        return missing
    ends_s = seconds(np.array([(fault.first_s, fault.last_s) for fault in found]).astype(np.int64))
    for fault, (first_s, last_s) in zip(found, ends_s, strict=True):
        key = (fault.channel, fault.kind)
        known = faults.get(key)
        faults[key] = (
            replace(fault, first_s=float(first_s), last_s=float(last_s))
            if known is None
            else replace(known, count=known.count + fault.count, last_s=float(last_s))
        )
    return missing


def clipped_samples(faults: Faults, channel: str) -> int:
    """Samples of a channel at the sensor's limit."""
    fault = faults.get((channel, "clipped"))
    return 0 if fault is None else fault.count


def _stamps_of(pieces: list[Piece], places: Whole) -> Whole:
    """Stamps of samples that are counted in the order of time, on a clock that runs on where it was set."""
    tangled = untangle(np.concatenate([piece.stamps_ns for piece in pieces]))
    if pieces[0].counts is None:
        return np.asarray(tangled.time_ns[places])
    counts = np.concatenate([piece.counts for piece in pieces if piece.counts is not None])
    counts = counts if tangled.order is None else counts[tangled.order]
    message = np.searchsorted(np.cumsum(counts), places, side="right")
    later = places - (np.cumsum(counts) - counts)[message]
    return np.asarray(tangled.time_ns[message] + np.rint(later * pieces[0].period_s * NS_PER_S).astype(np.int64))


def _in_order(pieces: list[Piece]) -> NDArray[np.floating]:
    """Samples in the order of their stamps: a late message between two others would look like a spike."""
    values = np.concatenate([piece.values for piece in pieces], axis=1)
    stamps = np.concatenate([piece.stamps_ns for piece in pieces])
    order = arrival_order(stamps)
    if order is None:
        return values
    if pieces[0].counts is None:
        return values[:, order]
    counts = np.concatenate([piece.counts for piece in pieces if piece.counts is not None])
    starts = np.cumsum(counts) - counts
    return np.concatenate([values[:, starts[place] : starts[place] + counts[place]] for place in order], axis=1)
