"""Noise as a fit has to see it: no law follows a machine to the last digit, whatever the noise's colour says."""

from dataclasses import replace

import numpy as np
from scipy import fft
from scipy.linalg import solve_toeplitz

from chladni.gap.calibration import GRID, LAW_ERROR
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Real


def with_law_error(noise: NoiseFloor, scale: Real) -> NoiseFloor:
    """Give the floor with the colour of noise and of an error of the law together.

    Where noise is faint in a band, an exact whitening makes a fit follow that band and give the others up: drift of
    1 % and a quiet rest weigh the corners of a force a thousand times its plateaus. A law's error has no known colour
    and is taken as white, with `LAW_ERROR` of each output. Only the filter is theirs; its level remains that of the
    noise alone, so that noise still has a whitened mean square of 1.

    Parameters
    ----------
    scale
        ``[output]`` RMS of what was measured.

    Returns
    -------
    The same floor where the noise is white, or loud in all bands.
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
