"""Uniformly sampled channels on one clock."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.channel import Channel, find_channel
from chladni.signals.errors import EstimateError
from chladni.signals.value import Value, require_shape

NS_PER_S = 1_000_000_000
_CENTURIES_NS = 2**63
"""What nanoseconds of 64 bits count to, either way from 1970."""


def is_sample_rate(rate_hz: float) -> bool:
    """Whether a number can be a sample rate: finite, positive, its period one that nanoseconds of 64 bits hold.

    Examples
    --------
    >>> [is_sample_rate(rate_hz) for rate_hz in (100.0, 1e-3, 0.0, float("nan"), float("inf"), 1e-320)]
    [True, True, False, False, False, False]
    """
    return NS_PER_S / _CENTURIES_NS < rate_hz < inf


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimeSeries(Value):
    """Samples of one or more channels at one rate.

    Attributes
    ----------
    values
        ``[channel, sample]``, floating point, in each channel's unit; NaN where nothing was measured.
    sample_rate_hz
        Samples a second, finite and positive.
    start_time_ns
        Time of the first sample, nanoseconds since the Unix epoch.
    channels
        One for each row of `values`, names unique.
    valid
        ``[channel, sample]`` boolean, False where nothing (or nothing usable) was measured; None when every sample
        is good. Estimators leave out segments that touch an invalid sample; they never bridge it.

    Raises
    ------
    EstimateError
        When shapes, rate or channel names don't fit together, or times are beyond what nanoseconds hold.

    Examples
    --------
    >>> x = TimeSeries(values=np.zeros((1, 50)), sample_rate_hz=100.0, channels=(Channel(name="a", unit="N"),))
    >>> x.duration_s
    0.5
    """

    values: NDArray[np.floating]
    sample_rate_hz: float
    channels: tuple[Channel, ...]
    start_time_ns: int = 0
    valid: Mask | None = field(default=None)

    def __post_init__(self) -> None:
        if not is_sample_rate(self.sample_rate_hz):
            raise EstimateError(
                f"sample rate {self.sample_rate_hz} Hz must be finite and positive, its period no centuries"
            )
        if self.values.ndim != 2 or not np.issubdtype(self.values.dtype, np.floating):
            raise EstimateError(
                f"values must be floating point [channel, sample], got {self.values.dtype} {self.values.shape}"
            )
        require_shape(
            "values",
            self.values,
            (len(self.channels), self.values.shape[1]),
            f"{len(self.channels)} channels",
        )
        if not abs(self.start_time_ns) + self.duration_s * NS_PER_S < _CENTURIES_NS:
            raise EstimateError(
                f"{self.samples} samples at {self.sample_rate_hz:g} Hz from {self.start_time_ns} ns on end farther "
                "from 1970 than nanoseconds of 64 bits count; check the rate and the start"
            )
        if self.valid is not None:
            require_shape("valid", self.valid, self.values.shape, "the shape of values")
        names = [channel.name for channel in self.channels]
        if len(set(names)) != len(names):
            raise EstimateError(f"channel names must be unique, got {', '.join(names)}")
        self._freeze()

    @property
    def samples(self) -> int:
        """Samples of each channel."""
        return int(self.values.shape[1])

    @property
    def duration_s(self) -> float:
        """Number of samples over the rate."""
        return self.samples / self.sample_rate_hz

    def times_s(self) -> Real:
        """Seconds of each sample since the first, computed from the index so that no error adds up."""
        times: Real = np.arange(self.samples) / self.sample_rate_hz
        return times

    def times_ns(self) -> Whole:
        """Nanoseconds of each sample since the Unix epoch."""
        offsets = np.rint(self.times_s() * NS_PER_S).astype(np.int64)
        return offsets + np.int64(self.start_time_ns)

    def index(self, name: str) -> int:
        """Row of the named channel; `EstimateError` naming the channels there are when it's missing."""
        return find_channel(self.channels, name)

    def select(self, names: Sequence[str]) -> Self:
        """Give the named channels, in the order asked for."""
        rows = [self.index(name) for name in names]
        valid = None if self.valid is None else self.valid[rows]
        return replace(
            self, values=self.values[rows], valid=valid, channels=tuple(self.channels[row] for row in rows)
        )

    def window(self, *, start_s: float | None = None, end_s: float | None = None) -> Self:
        """Give the samples with ``start_s <= t < end_s``, seconds from the first sample; no copy."""
        first = 0 if start_s is None else self._sample_at(start_s)
        last = self.samples if end_s is None else self._sample_at(end_s)
        if first >= last:
            raise EstimateError(
                f"no sample between {start_s} s and {end_s} s; the series is {self.duration_s:g} s long"
            )
        return replace(
            self,
            values=self.values[:, first:last],
            valid=None if self.valid is None else self.valid[:, first:last],
            start_time_ns=self.start_time_ns + round(first / self.sample_rate_hz * NS_PER_S),
        )

    def with_channels(self, channels: Sequence[Channel]) -> Self:
        """Give the same samples under other channel records (units, points, roles)."""
        return replace(self, channels=tuple(channels))

    def all_valid(self) -> bool:
        """Whether no sample is marked missing."""
        return self.valid is None or bool(self.valid.all())

    def _sample_at(self, time_s: float) -> int:
        # A time within a thousandth of a sample of the grid means that sample, whatever floating point says.
        return int(np.clip(np.ceil(time_s * self.sample_rate_hz - 1e-3), 0, self.samples))
