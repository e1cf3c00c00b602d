"""Watching the samples of a stream as they are read, in bounded memory."""

from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.gathering import Gathering
from chladni.io.placement import digests_of
from chladni.io.stream import Piece
from chladni.signals.sensor_quality import SensorFault, sensor_quality
from chladni.signals.stamp_order import arrival_order
from chladni.signals.time_series import TimeSeries

STRETCH_VALUES: Final = 1 << 24
"""Values of a stream that are judged together: 128 MiB in double precision. A longer log is judged in stretches."""


@dataclass(slots=True, kw_only=True)
class SampleMonitor:
    """What is known of one stream's samples so far.

    Attributes
    ----------
    gathering
        Stamps of its messages.
    samples
        Samples seen.
    missing
        ``[channel]``, samples that are no number.
    faults
        By channel and kind.
    """

    gathering: Gathering
    samples: int = 0
    missing: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    faults: dict[tuple[str, str], SensorFault] = field(default_factory=dict)
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
        values = _in_order(self._waiting)
        self._waiting, self._waiting_values = [], 0
        nan = np.isnan(values)
        self.samples += values.shape[1]
        missing = np.count_nonzero(nan, axis=1)
        self.missing = self.missing + missing if self.missing.size else missing
        series = TimeSeries(
            values=values,
            # Rules look at neighbouring samples; where they lie in time doesn't matter.
            sample_rate_hz=1.0,
            channels=self.gathering.stream.channels,
            valid=~nan if missing.any() else None,
        )
        for fault in sensor_quality(series):
            key = (fault.channel, fault.kind)
            known = self.faults.get(key)
            self.faults[key] = fault if known is None else replace(known, count=known.count + fault.count)

    def clipped(self, channel: str) -> int:
        """Samples of a channel at the sensor's limit."""
        fault = self.faults.get((channel, "clipped"))
        return 0 if fault is None else fault.count


def _in_order(pieces: list[Piece]) -> NDArray[np.floating[Any]]:
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
