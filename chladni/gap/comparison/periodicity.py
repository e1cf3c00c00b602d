"""Whether all inputs of a measurement repeat, with which period, and from when on the outputs repeat too."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import fft

from chladni.gap.calibration import (
    BLOCK,
    FAR,
    FEWEST,
    GRANTED,
    MANY,
    NOTICED,
    SAME,
    SOME,
    TRANSIENT,
    UNNOTICED,
)
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True, kw_only=True)
class Repetition:
    """How a measurement repeats.

    Attributes
    ----------
    period_samples
        Length of a period.
    periods
        Whole periods in the log, transient ones included.
    transient_periods
        Periods at the start in which the outputs (or inputs) haven't settled.
    input_scatter
        RMS of what doesn't repeat over RMS of what does, the largest of all inputs.
    """

    period_samples: int
    periods: int
    transient_periods: int
    input_scatter: float


def find_repetition(measurement: Measurement) -> Repetition | None:
    """Find the shortest whole number of samples after which every input repeats.

    A lag is a candidate where the inputs' correlation with themselves has a maximum; it's a period when what
    doesn't repeat is at most 4 % of every input, and as small (within a quarter) as at the best candidate. Any shape
    repeats: multisines, sines, trains of hits.

    Returns
    -------
    Repetition or None
        None when an input doesn't repeat, none moves, or fewer than two periods are there. With two periods of
        which the first hasn't settled, ``transient_periods`` is 1 and no scatter is known.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> u = np.tile(rng.standard_normal((1, 100)), 5)
    >>> one = Measurement(log="a", sample_rate_hz=1e2, inputs=u, outputs=2 * u, input_names=("f",),
    ...                   output_names=("y",), output_units=("m",))
    >>> found = find_repetition(one)
    >>> found.period_samples, found.periods, found.transient_periods
    (100, 5, 0)
    """
    moving = measurement.inputs[np.ptp(measurement.inputs, axis=1) > 0]
    if not moving.size:
        return None
    tried = [(lag, _scatter(moving, lag)) for lag in _candidates(moving)]
    repeating = [(lag, scatter) for lag, scatter in tried if scatter <= SAME * NOTICED]
    if not repeating:
        return None
    best = min(scatter for _, scatter in repeating)
    period, scatter = next(one for one in repeating if one[1] <= SAME * best + UNNOTICED)
    return Repetition(
        period_samples=period,
        periods=measurement.samples // period,
        transient_periods=transient_periods(np.concatenate([measurement.outputs, moving]), period),
        input_scatter=scatter,
    )


def with_period(measurement: Measurement) -> Measurement:
    """Give the measurement with its period and transient periods filled in, where its inputs repeat."""
    found = find_repetition(measurement)
    if found is None:
        return replace(measurement, period_samples=None, transient_periods=0)
    return replace(measurement, period_samples=found.period_samples, transient_periods=found.transient_periods)


def periods_of(signals: Real, period: int) -> Real:
    """Cut ``[signal, sample]`` into ``[signal, period, sample]``; what's left behind the last one is dropped."""
    count = signals.shape[1] // period
    return signals[:, : count * period].reshape(len(signals), count, period)


def transient_periods(signals: Real, period: int) -> int:
    """Count leading periods that differ, in any of ``[signal, sample]``, from the next more than later ones do."""
    periods = periods_of(signals, period)
    if periods.shape[1] == 2:
        return int(_fades(periods[:, 0] - periods[:, 1], periods[:, 1]))
    # From period to period, so that a machine that drifts slowly all the time isn't taken for one that settles.
    steps = np.mean(np.diff(periods, axis=1) ** 2, axis=2)
    floor = GRANTED * np.var(periods, axis=(1, 2))
    usual = steps[:, steps.shape[1] // 2 :].mean(axis=1)
    unsettled = np.any(steps > (TRANSIENT * usual + floor)[:, None], axis=0)
    settled = np.flatnonzero(~unsettled)
    return int(settled[0]) if settled.size else periods.shape[1] - 2


def _fades(difference: Real, steady: Real) -> bool:
    """Whether the difference of two periods is larger at its begin than at its end."""
    samples = difference.shape[1] // FEWEST
    parts = difference[:, : samples * FEWEST].reshape(len(difference), FEWEST, samples)
    power = np.mean(parts**2, axis=2)
    floor = GRANTED * np.var(steady, axis=1)
    return bool(np.any(power[:, 0] > FAR * power[:, -1] + floor))


def _candidates(inputs: Real) -> list[int]:
    """Give lags at which all inputs together correlate with themselves, shortest first."""
    samples = inputs.shape[1]
    lags = samples // 2 + 1
    if lags <= BLOCK:
        return []
    correlation = np.min([_self_correlation(row - row.mean(), lags) for row in inputs], axis=0)
    # The last lag is looked at as if what follows were lower: exactly two periods are two periods.
    padded = np.append(correlation, -1.0)
    inner = padded[1:-1]
    peaks = 1 + np.flatnonzero((inner >= padded[:-2]) & (inner > padded[2:]) & (inner > 0))
    peaks = peaks[peaks >= BLOCK]
    if peaks.size > 4 * MANY:
        # Of a narrow band every cycle is a maximum; the highest ones hold the period.
        peaks = np.sort(peaks[np.argsort(-correlation[peaks], kind="stable")[: 4 * MANY]])
    return [int(lag) for lag in peaks]


def _self_correlation(signal: Real, lags: int) -> Real:
    """Correlate a signal with itself at lags from 0, over the power of the parts compared."""
    size = fft.next_fast_len(signal.size + lags, real=True)
    spectrum = fft.rfft(signal, size)
    products = fft.irfft(spectrum.real**2 + spectrum.imag**2, size)[:lags]
    power = np.concatenate([[0.0], np.cumsum(signal**2)])
    shift = np.arange(lags)
    norm = np.sqrt(power[signal.size - shift] * (power[-1] - power[shift]))
    return np.asarray(np.divide(products, norm, out=np.zeros(lags), where=norm > 0), dtype=np.float64)


def _scatter(inputs: Real, lag: int) -> float:
    """Give what doesn't repeat over what does, of the worst input, without the first period where there are more."""
    periods = periods_of(inputs, lag)
    # A force that was measured feels the machine, so it settles with it.
    steady = periods[:, 1:] if periods.shape[1] > 2 else periods
    power = np.var(steady.mean(axis=1), axis=1)
    if np.any(power < SOME * np.var(inputs, axis=1)):
        return np.inf
    return float(np.sqrt(np.max(steady.var(axis=1, ddof=1).mean(axis=1) / power)))
