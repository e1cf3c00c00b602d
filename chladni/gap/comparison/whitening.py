"""Noise floors with the filter that whitens them: from a spectrum, from quiet lines, with a law's error."""

from dataclasses import replace

import numpy as np
from scipy import fft
from scipy.linalg import solve_toeplitz

from chladni.gap.calibration import AR_ORDER, FEWEST_SAMPLES, GRANTED, GRID, LAW_ERROR, ROUNDING, SOME, ZERO
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Mask, Real


def noise_floor_of(
    spectrum: Real,
    *,
    samples: int,
    freedom: Real,
    method: tuple[str, ...],
    upper_bound: Mask,
    scale: Real,
) -> NoiseFloor:
    """Fit an autoregressive model to each output's noise spectrum.

    The autocovariance is the inverse transform of the spectrum, the coefficients solve the Yule-Walker equations,
    and the order (up to 12) minimises ``N ln(innovation variance) + 2 order`` (Ljung, *System Identification*,
    2nd ed., section 16.4).

    Parameters
    ----------
    spectrum
        ``[output, line]`` power density at evenly spaced frequencies from 0 to half the sample rate, both ends
        included, in cycles a sample: its mean over 0..1 is the mean square. Not negative.
    samples
        N, how many samples the spectrum was estimated from.
    freedom
        ``[output]`` degrees of freedom of the mean square, from which its standard deviation follows.
    method, upper_bound
        As in `NoiseFloor`.
    scale
        ``[output]`` RMS of the signal; a floor below 1e-9 of it is lifted there.
    """
    lags = fft.irfft(spectrum, axis=1)[:, : AR_ORDER + 1]
    lags[:, 0] = np.maximum(lags[:, 0], np.maximum(ROUNDING * scale, ZERO) ** 2)
    fitted = [_lowest_aic(row, samples) for row in lags]
    whitening = np.zeros((len(lags), max(row.size for row, _ in fitted)))
    for place, (row, _) in enumerate(fitted):
        whitening[place, : row.size] = row
    return NoiseFloor(
        rms=np.sqrt(lags[:, 0]),
        whitening=whitening,
        innovation_rms=np.sqrt([variance for _, variance in fitted]),
        method=method,
        # The mean square of n independent squares has the relative variance 2/n, its root a quarter of that.
        std=np.sqrt(1 / (2 * np.maximum(freedom, 1.0))),
        upper_bound=upper_bound,
    )


def _lowest_aic(covariance: Real, samples: int) -> tuple[Real, float]:
    """Give the whitening filter, and the innovation variance, of the order that Akaike's criterion chooses."""
    loaded = covariance.copy()
    loaded[0] *= 1 + GRANTED
    models = [_yule_walker(loaded, order) for order in range(covariance.size)]
    variances = np.array([variance for _, variance in models])
    criterion = samples * np.log(variances) + 2 * np.arange(covariance.size)
    return models[int(np.argmin(criterion))]


def _yule_walker(covariance: Real, order: int) -> tuple[Real, float]:
    if order == 0:
        return np.ones(1), float(covariance[0])
    past = solve_toeplitz(covariance[:order], covariance[1 : order + 1])
    variance = float(covariance[0] - past @ covariance[1 : order + 1])
    # Rounding alone can bring it to zero or below.
    return np.concatenate([[1.0], -past]), max(variance, GRANTED * float(covariance[0]))


def with_law_error(noise: NoiseFloor, scale: Real) -> NoiseFloor:
    """Give the floor with the colour of noise and of an error of the law together.

    Where noise is faint in a band, an exact whitening makes a fit follow that band and give the others up: drift of
    1 % and a quiet rest weigh the corners of a force a thousand times its plateaus. A law's error has no known colour
    and is taken as white, with `LAW_ERROR` of each output. Only the filter is theirs; its level remains that of the
    noise alone, so that noise still has a whitened mean square of 1. It's the same floor where the noise is white, or
    loud in all bands.

    Parameters
    ----------
    scale
        ``[output]`` RMS of what was measured.
    """
    if not np.any(noise.whitening[:, 1:]):
        return noise
    lags = noise.whitening.shape[1]
    # Of noise alone, and with the white error, whose covariance is all at lag 0.
    alone = fft.irfft(noise.density(np.linspace(0.0, 0.5, 8 * GRID + 1)), axis=1)[:, :lags]
    whitening = np.array([_filter(one, error) for one, error in zip(alone, (LAW_ERROR * scale) ** 2, strict=True)])
    spread = np.abs(np.subtract.outer(np.arange(lags), np.arange(lags)))
    level = np.einsum("oi,oij,oj->o", whitening, alone[:, spread], whitening)
    return replace(noise, whitening=whitening, innovation_rms=np.sqrt(level))


def _filter(covariance: Real, error: float) -> Real:
    """Whitening filter ``[lag]`` of noise with this autocovariance and a white error (Yule and Walker)."""
    first = covariance[:-1].copy()
    first[0] += error
    return np.concatenate([[1.0], -solve_toeplitz(first, covariance[1:])])


def quiet_floor(measurement: Measurement) -> NoiseFloor:
    """Take the quiet lines of each output for its noise, as if that were white.

    A bound from below where noise has more power where the machine responds. It's for a single sensor beside strong
    distortion, where every other estimate holds the distortion, and hypotheses are compared with each other more
    than with the noise.
    """
    outputs = measurement.outputs - measurement.outputs.mean(axis=1, keepdims=True)
    length = min(GRID, max(FEWEST_SAMPLES // 2, measurement.samples // 8))
    window = np.hanning(length)
    count = measurement.samples // length
    segments = outputs[:, : count * length].reshape(len(outputs), count, length) * window
    density = np.mean(np.abs(np.fft.rfft(segments, axis=2)) ** 2, axis=1) / np.sum(window**2)
    level = np.quantile(density, SOME, axis=1) + GRANTED * np.mean(outputs**2, axis=1)
    return noise_floor_of(
        np.broadcast_to(level[:, None], density.shape),
        samples=measurement.samples,
        freedom=np.full(len(outputs), 2.0 * count),
        method=("quiet band",) * len(outputs),
        upper_bound=np.zeros(len(outputs), dtype=np.bool_),
        scale=np.std(outputs, axis=1),
    )
