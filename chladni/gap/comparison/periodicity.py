"""Whether all inputs of a measurement repeat, with which period, and from when on the outputs repeat too."""

from dataclasses import replace

import numpy as np

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
from chladni.spectral.period import self_correlation


def with_period(measurement: Measurement) -> Measurement:
    """Give the measurement with the shortest period after which every input repeats, and the periods that settle.

    A lag is a candidate where the inputs' correlation with themselves has a maximum; it's a period when what
    doesn't repeat is at most 4 % of every input, and as small (within a quarter) as at the best candidate. Any shape
    repeats: multisines, sines, trains of hits. There's none when an input doesn't repeat, none moves, or fewer than
    two periods are there.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> u = np.tile(rng.standard_normal((1, 100)), 5)
    >>> one = Measurement(log="a", sample_rate_hz=1e2, inputs=u, outputs=2 * u, input_names=("f",),
    ...                   output_names=("y",), output_units=("m",))
    >>> found = with_period(one)
    >>> found.period_samples, found.transient_periods
    (100, 0)
    """
    moving = measurement.inputs[np.ptp(measurement.inputs, axis=1) > 0]
    tried = [(lag, _scatter(moving, lag)) for lag in _candidates(moving)] if moving.size else []
    best = min((scatter for _, scatter in tried), default=np.inf)
    enough = min(SAME * NOTICED, SAME * best + UNNOTICED)
    period = next((lag for lag, scatter in tried if scatter <= enough), None)
    transient = 0
    if period is not None:
        transient = transient_periods(np.concatenate([measurement.outputs, moving]), period)
    return replace(measurement, period_samples=period, transient_periods=transient)


def periods_of(signals: Real, period: int) -> Real:
    """Cut ``[signal, sample]`` into ``[signal, period, sample]``; what's left behind the last one is dropped."""
    count = signals.shape[1] // period
    return signals[:, : count * period].reshape(len(signals), count, period)


def steady_periods(signals: Real, measurement: Measurement) -> Real:
    """Cut signals of a measurement with a period as `periods_of` does, and leave the transient ones out."""
    return periods_of(signals, measurement.period_samples or 1)[:, measurement.transient_periods :]


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
    correlation = np.min([self_correlation(row - row.mean()) for row in inputs], axis=0)
    # The last lag is looked at as if what follows were lower: exactly two periods are two periods.
    padded = np.append(correlation, -1.0)
    inner = padded[1:-1]
    peaks = 1 + np.flatnonzero((inner >= padded[:-2]) & (inner > padded[2:]) & (inner > 0))
    peaks = peaks[peaks >= BLOCK]
    if peaks.size > 4 * MANY:
        # Of a narrow band every cycle is a maximum; the highest ones hold the period.
        peaks = np.sort(peaks[np.argsort(-correlation[peaks], kind="stable")[: 4 * MANY]])
    return [int(lag) for lag in peaks]


def _scatter(inputs: Real, lag: int) -> float:
    """Give what doesn't repeat over what does, of the worst input, without the first period where there are more."""
    periods = periods_of(inputs, lag)
    # A force that was measured feels the machine, so it settles with it.
    steady = periods[:, 1:] if periods.shape[1] > 2 else periods
    power = np.var(steady.mean(axis=1), axis=1)
    if np.any(power < SOME * np.var(inputs, axis=1)):
        return np.inf
    return float(np.sqrt(np.max(steady.var(axis=1, ddof=1).mean(axis=1) / power)))
