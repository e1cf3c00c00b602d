"""Band-limited resampling to any rate and offset, with the error stated; the kernel is the anti-alias filter.

Windowed-sinc interpolation (Oppenheim & Schafer, Discrete-Time Signal Processing, 3rd ed., sections 4.6 and 7.5.3;
Kaiser's formulas for length and shape).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from math import ceil, inf, isfinite, pi

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import NS_PER_S, TimeSeries

#: Share of the lower Nyquist frequency up to which a resampled signal is true.
USABLE_SHARE = 0.8
_ATTENUATION_DB = 100.0
# Points of the kernel's table for each zero crossing; linear interpolation between them errs by 3e-8.
_TABLE_STEP = 4096
_LARGEST_PERIOD = 1024
_BLOCK_WEIGHTS = 1 << 17


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Resampled:
    """A series on another grid, and how true it is.

    Attributes
    ----------
    series
        The samples; NaN and not valid where the kernel reached beyond the input or touched an invalid sample.
    usable_hz
        The error holds from 0 to this frequency.
    error
        Largest error of a sine below `usable_hz`, relative to its amplitude, over all phases; when samples were
        only copied, that of a nanosecond's rounding or 0.
    attenuation_db
        Least attenuation of what would alias into the usable band.
    held
        Why each channel that was held between its samples was; empty where none was.
    """

    series: TimeSeries
    usable_hz: float
    error: float
    attenuation_db: float
    held: Mapping[str, str] = field(default_factory=dict)


def resample(
    series: TimeSeries,
    *,
    sample_rate_hz: float,
    start_time_ns: int | None = None,
    samples: int | None = None,
) -> Resampled:
    """Give the series at another rate and offset.

    Parameters
    ----------
    series
        Source.
    sample_rate_hz
        New rate, any ratio to the old one.
    start_time_ns
        Time of the first new sample; by default the first whose kernel lies inside the series.
    samples
        New samples; by default as many as have their kernel inside the series.

    Raises
    ------
    EstimateError
        When the rate isn't finite and positive, or the series is shorter than the kernel.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> t = np.arange(2000) / 1000
    >>> x = TimeSeries(values=np.sin(60 * t)[None], sample_rate_hz=1000.0, channels=(Channel(name="a"),))
    >>> y = resample(x, sample_rate_hz=700.0)
    >>> t = y.series.times_s() + y.series.start_time_ns * 1e-9
    >>> bool(np.abs(y.series.values[0] - np.sin(60 * t)).max() <= y.error)
    True
    """
    if not (isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise EstimateError(f"sample rate {sample_rate_hz} Hz must be finite and positive")
    if sample_rate_hz == series.sample_rate_hz and shift_ns(series, start_time_ns) <= 1:
        return _copied(series, start_time_ns, samples)
    # Positions of new samples are counted in old ones from here on.
    kernel = Kernel.between(series.sample_rate_hz, sample_rate_hz)
    low, high = kernel.supported(series.samples)
    per_sample_ns = NS_PER_S / series.sample_rate_hz
    start_ns = series.start_time_ns + ceil(low * per_sample_ns) if start_time_ns is None else start_time_ns
    first = (start_ns - series.start_time_ns) / per_sample_ns
    ratio = series.sample_rate_hz / sample_rate_hz
    count = int(np.floor((high - first) / ratio + 1e-9)) + 1 if samples is None else samples
    if count < 1:
        raise EstimateError(
            f"{series.samples} samples at {series.sample_rate_hz:g} Hz are too few for {sample_rate_hz:g} Hz: the "
            f"kernel spans {2 * kernel.reach} samples; read more, or ask for a higher rate"
        )
    values, valid = _interpolated(series, kernel, first, ratio, count)
    return Resampled(
        series=TimeSeries(
            values=values,
            sample_rate_hz=sample_rate_hz,
            start_time_ns=start_ns,
            channels=series.channels,
            valid=None if valid.all() else valid,
        ),
        usable_hz=kernel.usable_hz,
        error=_worst_error(kernel),
        attenuation_db=_ATTENUATION_DB,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Kernel:
    """Low-pass h(t) = r sinc(r t) w(r t/half), t in input samples, r = lower rate over input rate."""

    input_hz: float
    narrowing: float
    half: int
    beta: float

    @classmethod
    def between(cls, input_hz: float, output_hz: float) -> "Kernel":
        """Give the kernel from one rate to another."""
        narrowing = min(1.0, output_hz / input_hz)
        # Transition from 0.8 to 1.2 of the lower Nyquist frequency: what folds back stays above the usable band.
        width = 2 * pi * (1 - USABLE_SHARE)
        taps = (_ATTENUATION_DB - 7.95) / (2.285 * width)
        return cls(input_hz=input_hz, narrowing=narrowing, half=ceil(taps / 2), beta=0.1102 * (_ATTENUATION_DB - 8.7))

    @property
    def reach(self) -> int:
        """Input samples that the kernel needs on either side."""
        return ceil(self.half / self.narrowing)

    @property
    def usable_hz(self) -> float:
        """Pass-band edge."""
        return USABLE_SHARE * self.narrowing * self.input_hz / 2

    def supported(self, samples: int) -> tuple[float, float]:
        """First and last position, in input samples, whose kernel lies inside."""
        return self.reach - 1.0, samples - self.reach - 1e-3

    def weights(self, fraction: Real) -> Real:
        """``[position, tap]`` weights of the samples floor(p) - reach + 1 ... floor(p) + reach at fraction of p."""
        offset = np.arange(1 - self.reach, self.reach + 1) - fraction[:, None]
        table, slope = _kernel_table(self.half, self.beta)
        scaled = np.abs(offset) * (self.narrowing * _TABLE_STEP)
        place = np.minimum(scaled.astype(np.int32), slope.size - 1)
        weights: Real = table[place] + slope[place] * (scaled - place)
        # Beyond its last zero crossing the kernel is zero.
        weights *= self.narrowing * (scaled < slope.size)
        return weights


@lru_cache(maxsize=4)
def _kernel_table(half: int, beta: float) -> tuple[Real, Real]:
    """Values of the kernel at each table point, and the differences to the next."""
    position = np.arange(half * _TABLE_STEP + 1) / _TABLE_STEP
    window = np.i0(beta * np.sqrt(np.maximum(0.0, 1 - (position / half) ** 2))) / np.i0(beta)
    table = np.sinc(position) * window
    return table[:-1], np.diff(table)


@lru_cache(maxsize=64)
def _worst_error(kernel: Kernel) -> float:
    """Largest error of a sine in the usable band, over fractions and frequencies."""
    # A narrow kernel has many taps to the zero crossing, and hardly depends on the fraction.
    fraction = np.linspace(0, 1, 17 if kernel.reach < 10 * kernel.half else 3)
    angle = 2 * pi * np.linspace(0, kernel.usable_hz, 65) / kernel.input_hz
    offset = np.arange(1 - kernel.reach, kernel.reach + 1) - fraction[:, None]
    error = 0.0
    for row, taps in zip(offset, kernel.weights(fraction), strict=True):
        gain = np.exp(1j * np.outer(angle, row)) @ taps
        error = max(error, float(np.abs(gain - 1).max()))
    # A tenth more for what lies between the points tried.
    return 1.1 * error


def _interpolated(
    series: TimeSeries, kernel: Kernel, first: float, ratio: float, count: int
) -> tuple[NDArray[np.floating], Mask]:
    known = np.isfinite(series.values) if series.valid is None else series.valid & np.isfinite(series.values)
    reach = kernel.reach
    # Zeros beyond the ends keep the indexing simple; what they touch is marked.
    source = np.pad(np.where(known, series.values, 0.0), ((0, 0), (reach, reach)))
    unknown = np.pad(~known, ((0, 0), (reach, reach)), constant_values=True)
    missing = np.concatenate((np.zeros((len(known), 1), np.int64), np.cumsum(unknown, axis=1)), axis=1)
    values = np.empty((len(known), count), dtype=series.values.dtype)
    valid = np.zeros((len(known), count), dtype=bool)
    windows = sliding_window_view(source, 2 * reach, axis=1)
    for block, start, weights in _blocks(kernel, first, ratio, count):
        # Position p has the samples from floor(p) - reach + 1, which the padding moves up by reach.
        inside = (start >= -1) & (start < series.samples)
        begin = np.clip(start + 1, 0, series.samples)
        values[:, block] = np.einsum("cpt,pt->cp", windows[:, begin], weights)
        touched = missing[:, begin + 2 * reach] - missing[:, begin]
        valid[:, block] = inside & (touched == 0)
    values[~valid] = np.nan
    return values, valid


def _blocks(kernel: Kernel, first: float, ratio: float, count: int) -> Iterator[tuple[slice, Whole, Real]]:
    """Give runs of output samples, with the input sample before each and its weights."""
    length = max(1, _BLOCK_WEIGHTS // (2 * kernel.reach))
    period = _period(ratio, count)
    repeated = kernel.weights(_split(first + ratio * np.arange(period, dtype=np.float64))[1]) if period else None
    for begin in range(0, count, length):
        number = np.arange(begin, min(begin + length, count))
        start, fraction = _split(first + ratio * number.astype(np.float64))
        weights = kernel.weights(fraction) if repeated is None else repeated[number % period]
        yield slice(begin, int(number[-1]) + 1), start, weights


def _period(ratio: float, count: int) -> int:
    """After how many output samples the fractions repeat; 0 when that's too long to be worth a table."""
    near = Fraction(ratio).limit_denominator(_LARGEST_PERIOD)
    repeats = abs(float(near) - ratio) * count < 1e-9 and near.denominator < count
    return near.denominator if repeats else 0


def _split(position: Real) -> tuple[Whole, Real]:
    # A billionth of a sample below a whole number is rounding.
    start = np.floor(position + 1e-9)
    return start.astype(np.int64), np.maximum(position - start, 0.0)


def shift_ns(series: TimeSeries, start_time_ns: int | None) -> float:
    """Distance of a start from the grid of the series."""
    if start_time_ns is None:
        return 0.0
    position = (start_time_ns - series.start_time_ns) * series.sample_rate_hz / NS_PER_S
    return abs(position - round(position)) * NS_PER_S / series.sample_rate_hz


def _copied(series: TimeSeries, start_time_ns: int | None, samples: int | None) -> Resampled:
    start_ns = series.start_time_ns if start_time_ns is None else start_time_ns
    first = round((start_ns - series.start_time_ns) * series.sample_rate_hz / NS_PER_S)
    count = max(0, series.samples - first) if samples is None else samples
    source = np.arange(first, first + count)
    there = (source >= 0) & (source < series.samples)
    values = np.full((len(series.channels), count), np.nan, dtype=series.values.dtype)
    values[:, there] = series.values[:, source[there]]
    valid = np.zeros(values.shape, dtype=bool)
    valid[:, there] = True if series.valid is None else series.valid[:, source[there]]
    copied = replace(series, values=values, start_time_ns=start_ns, valid=None if valid.all() else valid)
    nyquist_hz = series.sample_rate_hz / 2
    error = 2 * pi * nyquist_hz * shift_ns(series, start_time_ns) / NS_PER_S
    return Resampled(series=copied, usable_hz=nyquist_hz, error=error, attenuation_db=inf)
