"""Uniformly sampled channels on one clock."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.channel import (
    UNKNOWN,
    Channel,
    Names,
    Units,
    as_names,
    channel_names,
    find_channel,
    find_channels,
    made_channels,
    numbered,
)
from chladni.signals.errors import EstimateError
from chladni.signals.value import Coordinate, Value, of_channel, require_shape
from chladni.signals.wording import counted

NS_PER_S = 1_000_000_000
_CENTURIES_NS = 2**63
"""What nanoseconds of 64 bits count to, either way from 1970."""


@runtime_checkable
class Frame(Protocol):
    """A table of pandas or polars: a channel in each column, time down the rows."""

    @property
    def columns(self) -> Iterable[Any]:
        """Names of the columns."""

    def __getitem__(self, name: Any, /) -> Any:
        """Give a column."""


#: Numbers of one channel or of several, ``[channel, sample]``, or those of each channel by its name.
Arrays = ArrayLike | Mapping[str, ArrayLike] | Frame


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

    AXES: ClassVar = {"values": ("channels", "time_s")}
    ROWS: ClassVar = "time_s"
    UNITS: ClassVar = {"values": of_channel}

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
            f"{counted(len(self.channels), 'channel')}",
        )
        if not abs(self.start_time_ns) + self.duration_s * NS_PER_S < _CENTURIES_NS:
            raise EstimateError(
                f"{counted(self.samples, 'sample')} at {self.sample_rate_hz:g} Hz from {self.start_time_ns} ns on "
                "end farther from 1970 than nanoseconds of 64 bits count; check the rate and the start"
            )
        if self.valid is not None:
            require_shape("valid", self.valid, self.values.shape, "the shape of values")
        names = [channel.name for channel in self.channels]
        if len(set(names)) != len(names):
            raise EstimateError(f"channel names must be unique, got {', '.join(names)}")
        self._freeze()

    @classmethod
    def from_arrays(
        cls,
        values: Arrays,
        *,
        sample_rate_hz: float,
        names: Names | None = None,
        units: Units = UNKNOWN,
        references: Names = (),
        start_time_ns: int = 0,
    ) -> Self:
        """Make a series of numbers in memory.

        Parameters
        ----------
        values
            ``[channel, sample]``, ``[sample]`` of one channel, the samples of each channel by its name, or a table of
            pandas or polars with a channel in each column. What is NaN, infinite or masked is a sample that is
            missing, and is marked so.
        sample_rate_hz
            Samples a second.
        names
            Of the channels; ``ch1``, ``ch2``, ... by default.
        units
            Of all channels, of each, or by name; values are converted to SI: of ``g`` they become ``m/s^2``. ``1``,
            the default, is a unit that isn't known.
        references
            Names of the channels that excite.
        start_time_ns
            Time of the first sample, nanoseconds since the Unix epoch.

        Raises
        ------
        EstimateError
            When the values are no real numbers of that shape, or names and units don't fit them.
        SetupError
            When a unit isn't known.

        Examples
        --------
        >>> arrays = {"f": [1.0, 2.0], "a": [0.0, 1.0]}
        >>> series = TimeSeries.from_arrays(arrays, sample_rate_hz=100.0, units={"a": "g"})
        >>> [(channel.name, channel.unit) for channel in series.channels], float(series.values[1, 1])
        ([('f', '1'), ('a', 'm/s^2')], 9.80665)
        """
        table, given = _table(values, None if names is None else as_names(names))
        channels, factors = made_channels(given, units, references=references)
        # Not multiplied by one: a gigabyte is viewed, not copied.
        if any(factor != 1 for factor in factors):
            table = table * np.array(factors)[:, np.newaxis]
        missing = ~np.isfinite(table)
        return cls(
            values=table,
            sample_rate_hz=sample_rate_hz,
            channels=channels,
            start_time_ns=start_time_ns,
            valid=~missing if missing.any() else None,
        )

    @property
    def samples(self) -> int:
        """Samples of each channel."""
        return int(self.values.shape[1])

    @property
    def duration_s(self) -> float:
        """Number of samples over the rate."""
        return self.samples / self.sample_rate_hz

    def coordinate(self, axis: str) -> Coordinate:
        """Give the seconds since the first sample, or the names of the channels."""
        return self.times_s() if axis == "time_s" else Value.coordinate(self, axis)

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

    def names(self, words: Names) -> tuple[str, ...]:
        """Names of the channels that words name: whole names, unique endings, patterns; `EstimateError` when none."""
        return channel_names(self.channels, words)

    def select(self, names: Names) -> Self:
        """Give the channels that words name, in the order asked for."""
        rows = find_channels(self.channels, names)
        if rows == list(range(len(self.channels))):
            return self
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
        return self.samples_between(first, last)

    def samples_between(self, first: int, last: int) -> Self:
        """Give the samples from number `first` to before number `last`, with their time; no copy."""
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


def _table(values: Arrays, names: tuple[str, ...] | None) -> tuple[NDArray[np.floating], tuple[str, ...]]:
    """Give numbers as ``[channel, sample]``, and the name of each channel."""
    if isinstance(values, Frame):
        values = _columns(values)
    if isinstance(values, Mapping):
        if names is not None:
            raise EstimateError("values come with names already; leave names out")
        names, values = tuple(map(str, values)), [_channel(name, one) for name, one in values.items()]
    table = np.atleast_2d(_real(values))
    if table.ndim != 2 or not table.size:
        raise EstimateError(
            f"values have shape {table.shape}, but must be [channel, sample], or [sample] of one channel"
        )
    count, samples = table.shape
    # Records are longer than they're wide; the other way round time runs down the rows.
    if count > samples and (names is None or len(names) != count):
        told = f"{counted(count, 'channel')} of {counted(samples, 'sample')}"
        raise EstimateError(f"values are [channel, sample], so these are {told}; give values.T, or name each channel")
    return table, numbered("ch", count, names)


def _columns(frame: Frame) -> dict[str, ArrayLike]:
    """Give the columns of a table by their names."""
    names = [str(name) for name in frame.columns]
    if len(set(names)) != len(names):
        raise EstimateError(f"channel names must be unique, got {', '.join(names)}")
    try:
        return {name: frame[column] for name, column in zip(names, frame.columns, strict=True)}
    except TypeError:
        # A lazy frame of polars has names and no numbers.
        raise EstimateError(
            f"a {type(frame).__name__} holds no numbers yet; give what .collect() makes of it"
        ) from None


def _channel(name: object, values: ArrayLike) -> NDArray[np.floating]:
    try:
        array = _real(values)
    except EstimateError as error:
        raise EstimateError(f"{name}: {error}") from None
    if array.size > max(array.shape, default=1):
        raise EstimateError(f"{name}: values have shape {array.shape}, but a channel by its name must be [sample]")
    return array.ravel()


def _real(values: ArrayLike | Iterable[ArrayLike]) -> NDArray[np.floating]:
    if isinstance(values, np.ma.MaskedArray) and values.dtype.kind in "iubf":
        # What is masked wasn't measured, whatever stands there.
        exact = values.data if values.dtype.kind == "f" else values.data.astype(np.float64)
        return np.where(np.ma.getmaskarray(values), exact.dtype.type(np.nan), exact)
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise EstimateError("values must be [channel, sample], with as many samples in each channel") from error
    if array.dtype.kind in "iub":
        return array.astype(np.float64)
    if not np.issubdtype(array.dtype, np.floating):
        raise EstimateError(f"values are of type {array.dtype}, but samples are real numbers")
    return array
