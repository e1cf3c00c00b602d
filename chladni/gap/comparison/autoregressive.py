"""Noise as an autoregressive process, from its power spectrum."""

import numpy as np
from scipy import fft
from scipy.linalg import solve_toeplitz

from chladni.gap.calibration import AR_ORDER, GRANTED, ROUNDING, ZERO
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
