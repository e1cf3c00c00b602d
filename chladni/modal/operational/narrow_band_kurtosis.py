"""Kurtosis of responses in narrow bands, and the chance that Gaussian noise gives one so low."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.special

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import require_in_range
from chladni.signals.time_series import TimeSeries
from chladni.spectral.accumulator import require_finite
from chladni.spectral.segment_spectra import segment_spectra
from chladni.spectral.segmentation import Segmentation
from chladni.spectral.stretches import valid_runs
from chladni.spectral.windows import window_samples

SINE_KURTOSIS = 1.5
NOISE_KURTOSIS = 3.0
# Samples of all channels that are transformed together.
SAMPLES_TOGETHER = 1 << 21
# Steps of the window's own correlation, finer than anything that a mode does within a segment.
CORRELATION_STEPS = 256


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NarrowBands:
    """Mean power and kurtosis of every line of overlapping Hann segments, each line a narrow band.

    Attributes
    ----------
    frequency_hz
        ``[line]``.
    power
        ``[channel, line]`` mean squared magnitude, unscaled.
    kurtosis
        ``[channel, line]`` of the band-passed response, freed of its bias for noise; NaN where there is no power.
    segments
        Number of segments.
    segment_s
        Length of one in seconds; a band is 1.5 lines of 1/segment_s wide.
    """

    frequency_hz: Real
    power: Real
    kurtosis: Real
    segments: int
    segment_s: float


def narrow_bands(series: TimeSeries, samples: int) -> NarrowBands:
    """Measure the kurtosis in each line of half-overlapping Hann segments of `samples`.

    The complex amplitude of a line is the response band-passed around it and brought down to 0 Hz, once a hop.
    With z such an amplitude, the real response in the band has the kurtosis 1.5 mean(|z|^4) / mean(|z|^2)^2: 3 for
    Gaussian noise, 1.5 for a sine (Jacobsen, Andersen & Brincker 2007; Antoni's spectral kurtosis, 2006).

    Raises
    ------
    EstimateError
        When no unbroken run of valid samples holds two segments, or a sample isn't finite.
    """
    plan = Segmentation(samples=samples, hop=samples // 2, window="hann", detrend="linear")
    window = window_samples("hann", samples)
    runs = valid_runs(series)
    require_in_range(series.channels, require_finite(series, runs))
    # Sums only: the segments of a long record would take as much memory as the record.
    second = np.zeros((samples // 2 + 1, len(series.channels)))
    fourth, count = np.zeros_like(second), 0
    together = max(1, SAMPLES_TOGETHER // (len(series.channels) * samples))
    for first, last in runs:
        segments = plan.count(last - first)
        for start in range(0, segments, together):
            begin = first + start * plan.hop
            part = series.values[:, begin : begin + plan.length_of(min(together, segments - start))]
            power = np.abs(segment_spectra(part, plan, window)) ** 2
            second += power.sum(axis=1)
            fourth += np.einsum("fsc,fsc->fc", power, power)
        count += segments
    if count < 2:
        raise EstimateError(f"no run of valid samples holds two segments of {samples}; take a longer record")
    with np.errstate(divide="ignore", invalid="ignore"):
        # The mean of the ratio over Gaussian noise is 2 n/(n + 1) for n independent segments, not 2.
        kurtosis = SINE_KURTOSIS * (count + 1) * fourth / second**2
    return NarrowBands(
        frequency_hz=np.asarray(np.arange(samples // 2 + 1) * (series.sample_rate_hz / samples), dtype=np.float64),
        power=second.T / count,
        kurtosis=kurtosis.T,
        segments=count,
        segment_s=samples / series.sample_rate_hz,
    )


def independent_samples(bands: NarrowBands, least_damping: float) -> Real:
    """Segments of each line that count as independent if a mode with `least_damping` rings in it.

    With rho_m the correlation of the amplitudes of two segments m hops apart, the variance of the kurtosis grows
    by 1 + 2 sum rho_m^4: it's made of the second Laguerre polynomial of |z|^2, whose correlation is |rho|^4. The
    response of a mode to white noise has the correlation exp(-zeta omega tau), seen through the window.

    Returns
    -------
    ndarray
        ``[line]``, at most the number of segments.
    """
    # Every line has another decay, but the inflation is smooth in its logarithm.
    decay = 2 * np.pi * least_damping * bands.frequency_hz * bands.segment_s
    grid = np.geomspace(1e-6, 1e3, 400)
    inflation = np.interp(np.log(np.maximum(decay, grid[0])), np.log(grid), _inflation(grid))
    return np.asarray(np.maximum(bands.segments / inflation, 1.0), dtype=np.float64)


def chance_of_kurtosis(kurtosis: Real, samples: Real) -> Real:
    """Chance that Gaussian noise shows a kurtosis this low or lower in so many independent samples.

    By Sanov's theorem the chance that n exponential numbers u show mean(u^2)/mean(u)^2 <= g falls like
    exp(-n I(g)), with I the entropy of the exponential distribution, 1, less that of the most disordered one with
    the moments 1 and g: a Gaussian cut off at 0. The signed root sqrt(2 n I) is taken as a standard normal number.
    Against simulation: right within a factor of 1.4 from 100 samples on, too high (up to ten times) with 16.

    Returns
    -------
    ndarray
        As broadcast; 1 where the kurtosis is NaN.

    Examples
    --------
    >>> chance = chance_of_kurtosis(np.array([1.55, 2.9]), np.array([30.0, 30.0]))
    >>> bool(chance[0] < 1e-12), bool(chance[1] > 0.1)
    (True, True)
    """
    # Beyond either end of the table the chance stays what it is there, which is on the safe side.
    ratio, rate = _rate_function()
    found = np.interp(kurtosis / SINE_KURTOSIS, ratio, rate)
    chance = scipy.special.ndtr(-np.sqrt(2 * samples * found))
    return np.asarray(np.where(np.isfinite(kurtosis), chance, 1.0), dtype=np.float64)


def window_autocorrelation() -> tuple[Real, Real]:
    """Autocorrelation of the Hann window: lags in segments, -1 to 1, and its values, 1 at 0."""
    window = window_samples("hann", CORRELATION_STEPS)
    correlation = np.correlate(window, window, mode="full")
    lags = np.arange(1 - CORRELATION_STEPS, CORRELATION_STEPS) / CORRELATION_STEPS
    return lags, correlation / correlation.max()


def _inflation(decay: Real) -> Real:
    """1 + 2 sum rho_m^4 for envelopes that decay by exp(-decay) in the time of a segment."""
    lags, window = window_autocorrelation()
    own = np.exp(-decay[:, None] * np.abs(lags)) @ window
    next_one = np.exp(-decay[:, None] * np.abs(lags - 0.5)) @ window
    # From the second hop on segments don't overlap, and the correlation falls by the same factor each hop.
    second = np.exp(-decay[:, None] * (1 - lags)) @ window
    later = (second / own) ** 4 / -np.expm1(-2 * decay)
    return np.asarray(1 + 2 * ((next_one / own) ** 4 + later), dtype=np.float64)


@lru_cache(maxsize=1)
def _rate_function() -> tuple[Real, Real]:
    """I of g, as a table over the truncated Gaussians; alpha is where they are cut off, in their sigma."""
    alpha = np.linspace(-1000.0, 30.0, 40_000)
    hazard = np.sqrt(2 / np.pi) / scipy.special.erfcx(alpha / np.sqrt(2))
    mean = hazard - alpha
    ratio = 1 + (1 + alpha * hazard - hazard**2) / mean**2
    entropy = 0.5 * np.log(2 * np.pi * np.e) - np.log(mean) + scipy.special.log_ndtr(-alpha) + alpha * hazard / 2
    # The exponential itself closes the table: at noise, and above, the rate is 0.
    return np.append(ratio, 2.0), np.append(1 - entropy, 0.0)
