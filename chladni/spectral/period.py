"""Finds the period of a repeating broadband excitation."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from chladni.signals.arrays import Real
from chladni.signals.time_series import TimeSeries
from chladni.spectral.stretches import Run, valid_runs

# Fewer can't show both that an excitation repeats and how much it scatters.
FEWEST_PERIODS = 3
SHORTEST_PERIOD = 16
# Lead-in and run-out: blocks below this share of the strongest block's RMS, of this many blocks.
QUIET = 0.05
ACTIVITY_BLOCKS = 256
# The correlation of a signal with itself one period later is 1/(1 + noise share): 0.99 for 10 % noise in amplitude.
LEAST_CORRELATION = 0.8
MAIN_LOBE_FOOT = 0.5
MOST_CANDIDATES = 32
PARABOLA_ERROR = 5e-3
# Fewer effective lines are tones (a sine, a stroke and its harmonics), better served by a window.
FEWEST_LINES = 8.0
# A kurtosis above is a train of hits, whose force and response want windows of their own.
LARGEST_KURTOSIS = 30.0
# A period belongs to the repetition when its power around the common one is at most this share.
LARGEST_RESIDUAL = 0.25
# Drift of the period against the sample grid over the whole record that still counts as none: in samples, or in
# cycles at the signal's RMS frequency, whichever is more; it can't be measured better, and does no harm.
LARGEST_DRIFT_SAMPLES = 0.1
LARGEST_DRIFT_CYCLES = 0.01
# A period nearer than this to a whole number of samples won't get whole by taking several of it.
CLEAR_FRACTION = 0.1
# A period is transient when its deviation from the later ones has this many times the power of their own scatter ...
TRANSIENT_RATIO = 5.0
# ... and more than this share of the signal's power, below which noise-free data stop mattering.
TRANSIENT_FLOOR = 1e-8


@dataclass(frozen=True, slots=True, kw_only=True)
class Period:
    """How an excitation repeats.

    Attributes
    ----------
    channel
        Name of the channel it was found in.
    samples
        Length of a period, the nearest whole number of samples.
    period_s
        Length of a period as fitted, seconds.
    drift_samples
        What a period of `samples` drifts against the fitted one over all periods found.
    whole
        Whether that drift is negligible, so that periods can be averaged sample by sample.
    first_sample
        Sample of the series at which averaging starts, transient periods left out.
    count
        Whole steady periods from there in the samples examined.
    dropped
        Transient periods before that.
    noise_share
        Power that doesn't repeat over power that does, in the channel.
    """

    channel: str
    samples: int
    period_s: float
    drift_samples: float
    whole: bool
    first_sample: int
    count: int
    dropped: int
    noise_share: float


def find_period(series: TimeSeries, *, channel: str) -> Period | None:
    """Find the period of a broadband excitation that repeats, and where it's steady.

    The period is the shortest lag at which the channel correlates with itself (at least 0.8, so that noise of half
    the signal's amplitude is forgiven) and whose mean period holds at least 8 effective lines, (sum P)^2/sum P^2,
    without being a train of hits (kurtosis above 30). A sine is periodic too, but whole periods of it have no lines
    between its harmonics to see anything on: None is given for tones, as for random, swept and impact excitation and
    for multisines that never repeat.

    Leading periods are dropped as transient while, in any channel, their power around the mean of the later ones is
    more than 5 times the scatter of those.

    Parameters
    ----------
    series
        Reference and responses, at least 3 periods of them. Only the longest stretch without gaps is looked at.
    channel
        Name of the excitation.

    Returns
    -------
    Period or None
        None when nothing repeats. A period that isn't a whole number of samples is given with ``whole`` False.

    Raises
    ------
    EstimateError
        When there is no such channel.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> one = np.random.default_rng(1).standard_normal(500)
    >>> series = TimeSeries(values=np.tile(one, 6)[np.newaxis], sample_rate_hz=1e3, channels=(Channel(name="x"),))
    >>> period = find_period(series, channel="x")
    >>> period.samples, period.count
    (500, 6)
    """
    return first_period(series, [series.index(channel)])


def first_period(series: TimeSeries, rows: Iterable[int]) -> Period | None:
    """Give the period of the first of the channels in which `find_period` finds one; None when it does in none."""
    run = max(valid_runs(series), key=lambda run: run[1] - run[0], default=(0, 0))
    return next(filter(None, (_period_of(series, row, run) for row in rows)), None)


def _period_of(series: TimeSeries, row: int, run: Run) -> Period | None:
    first, last = _active(series, row, run)
    excitation = np.asarray(series.values[row, first:last], dtype=np.float64)
    if excitation.size < FEWEST_PERIODS * SHORTEST_PERIOD:
        return None
    correlation = self_correlation(excitation - excitation.mean())
    found = None
    for lag in _candidates(correlation):
        length = _refine(correlation, lag)
        candidate = _period(series, row, (first, last), length)
        if candidate is None:
            continue
        if candidate.whole:
            return candidate
        found = found or candidate
        if abs(found.period_s * series.sample_rate_hz - found.samples) < CLEAR_FRACTION:
            return found
    return found


def _period(series: TimeSeries, row: int, active: Run, length: float) -> Period | None:
    samples, first = round(length), active[0]
    own = _cut(series.values[row], active, length)
    begin, end = _repeating(own)
    if end - begin < FEWEST_PERIODS:
        return None
    if not _is_broadband(own[begin:end].mean(axis=0)):
        return None
    # All channels at last: most that are looked at hold no period.
    periods, first = _cut(series.values, active, length)[:, begin:end], first + round(begin * length)
    count, dropped = end - begin, _transients(periods)
    drift = (length - samples) * count
    return Period(
        channel=series.channels[row].name,
        samples=samples,
        period_s=length / series.sample_rate_hz,
        drift_samples=drift,
        whole=abs(drift) <= _tolerated_drift(periods[row].mean(axis=0)),
        first_sample=first + dropped * samples,
        count=count - dropped,
        dropped=dropped,
        noise_share=_noise_share(periods[row, dropped:]),
    )


def _active(series: TimeSeries, row: int, run: Run) -> Run:
    """Give a run without its quiet ends in the channel."""
    first, last = run
    size = max(SHORTEST_PERIOD, (last - first) // ACTIVITY_BLOCKS)
    blocks = (last - first) // size
    if blocks == 0:
        return first, last
    signal = np.asarray(series.values[row, first : first + blocks * size], dtype=np.float64)
    rms = np.sqrt(np.mean((signal - np.median(signal)).reshape(blocks, size) ** 2, axis=1))
    loud = np.flatnonzero(rms > QUIET * rms.max())
    if loud.size == 0:
        return first, first
    return first + int(loud[0]) * size, (last if loud[-1] == blocks - 1 else first + int(loud[-1] + 1) * size)


def self_correlation(signal: Real) -> Real:
    """Correlate a signal with itself at lags up to half its length, each over the power of the parts compared."""
    lags = signal.size // 2 + 1
    padded = fft.next_fast_len(signal.size + lags, real=True)
    spectrum = fft.rfft(signal, padded)
    products = fft.irfft(spectrum.real**2 + spectrum.imag**2, padded)[:lags]
    power = np.concatenate([[0.0], np.cumsum(signal**2)])
    shift = np.arange(lags)
    norm = np.sqrt(power[signal.size - shift] * (power[-1] - power[shift]))
    return np.asarray(np.divide(products, norm, out=np.zeros(lags), where=norm > 0), dtype=np.float64)


def _candidates(correlation: Real) -> list[int]:
    """Give lags of high maxima beyond the main lobe, shortest first."""
    below = np.flatnonzero(correlation < MAIN_LOBE_FOOT)
    if below.size == 0:
        return []
    lobe = max(int(below[0]), SHORTEST_PERIOD)
    tail, before, after = correlation[lobe:-1], correlation[lobe - 1 : -2], correlation[lobe + 1 :]
    lags = lobe + np.flatnonzero((tail > MAIN_LOBE_FOOT) & (tail >= before) & (tail > after))
    # A maximum between samples is higher than the sample next to it.
    heights = [_height(correlation[lag - 1 : lag + 2]) for lag in lags]
    highest = max(heights, default=0.0)
    if highest < LEAST_CORRELATION:
        return []
    # Other maxima of a narrow-band signal stay below the one at its period; noise lowers all of them alike, and the
    # parabola through three samples is right to some thousandths.
    level = max(LEAST_CORRELATION, 1 - 3 * (1 - min(highest, 1.0)) - PARABOLA_ERROR)
    return [int(lag) for lag, height in zip(lags, heights, strict=True) if height > level][:MOST_CANDIDATES]


def _refine(correlation: Real, lag: int) -> float:
    """Fit the period to fractions of a sample at the largest of its multiples 1, 2, 4, ... that is still in sight."""
    length, multiple = float(lag), 1
    while True:
        near = round(length * multiple)
        window = slice(max(near - 2, 1), min(near + 3, correlation.size))
        peak = window.start + int(np.argmax(correlation[window]))
        if not 1 <= peak < correlation.size - 1:
            return length
        length = (peak + _parabola(correlation[peak - 1 : peak + 2])) / multiple
        if 2 * multiple * length > correlation.size - 3:
            return length
        multiple *= 2


def _parabola(three: NDArray[np.floating]) -> float:
    curvature = three[0] - 2 * three[1] + three[2]
    return 0.0 if curvature >= 0 else float(np.clip((three[0] - three[2]) / (2 * curvature), -0.5, 0.5))


def _height(three: NDArray[np.floating]) -> float:
    return float(three[1] - (three[0] - three[2]) * _parabola(three) / 4)


def _cut(values: NDArray[np.floating], active: Run, length: float) -> Real:
    """Cut ``[..., period, sample]``; a period between samples begins at the sample nearest to its begin."""
    samples = round(length)
    starts = active[0] + np.rint(np.arange((active[1] - active[0]) / length + 1) * length).astype(np.intp)
    starts = starts[starts + samples <= active[1]]
    index = starts[:, np.newaxis] + np.arange(samples)
    return np.asarray(values[..., index], dtype=np.float64)


def _repeating(periods: Real) -> Run:
    """Give the longest run of periods that agree with their median."""
    periods = periods - periods.mean()
    if len(periods) < FEWEST_PERIODS:
        return 0, 0
    common = np.median(periods, axis=0)
    residual = np.mean((periods - common) ** 2, axis=1)
    agree = np.concatenate([[False], residual <= LARGEST_RESIDUAL * np.mean(common**2), [False]])
    edges = np.flatnonzero(agree[1:] != agree[:-1])
    runs = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return max(runs, key=lambda run: run[1] - run[0], default=(0, 0))


def _is_broadband(period: Real) -> bool:
    period = period - period.mean()
    lines = np.abs(fft.rfft(period)) ** 2
    effective_lines = lines.sum() ** 2 / np.sum(lines**2)
    kurtosis = np.mean(period**4) / np.mean(period**2) ** 2
    return bool(effective_lines >= FEWEST_LINES and kurtosis <= LARGEST_KURTOSIS)


def _tolerated_drift(period: Real) -> float:
    lines = np.abs(fft.rfft(period - period.mean())) ** 2
    cycles_per_sample = np.sqrt(np.sum((np.arange(lines.size) / period.size) ** 2 * lines) / lines.sum())
    return max(LARGEST_DRIFT_SAMPLES, LARGEST_DRIFT_CYCLES / float(cycles_per_sample))


def _transients(periods: Real) -> int:
    """Count the leading ``[channel, period, sample]`` that differ from the later ones more than those do."""
    power = np.var(periods, axis=(1, 2))
    steady: int = periods.shape[1] - 2
    for dropped in range(steady):
        later = periods[:, dropped + 1 :]
        # The mean of R periods scatters too, with 1/R of their power.
        deviation = np.mean((periods[:, dropped] - later.mean(axis=1)) ** 2, axis=1) / (1 + 1 / later.shape[1])
        scatter = later.var(axis=1, ddof=1).mean(axis=1)
        if np.all(deviation <= TRANSIENT_RATIO * scatter + TRANSIENT_FLOOR * power):
            return dropped
    return steady


def _noise_share(periods: Real) -> float:
    scatter = float(periods.var(axis=0, ddof=1).mean())
    power = float(np.var(periods.mean(axis=0)))
    return scatter / power if power > 0 else inf
