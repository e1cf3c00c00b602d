"""Spread of what a fit found when its residual is no white noise: what a law leaves is nowhere near that."""

import numpy as np
from scipy import fft

from chladni.gap.calibration import LITTLE
from chladni.gap.tuning.fit_problem import Evaluation, FitProblem, Slopes
from chladni.gap.tuning.residual import weights
from chladni.signals.arrays import Mask, Real


def coloured_information(problem: FitProblem, here: Evaluation, slopes: Slopes) -> Real:
    """Variance ``[unknown, unknown]`` of a cost's slope at its least, whatever the residual's colour.

    Were the residual white it would be the curvature M of the cost, and the unknowns' covariance its inverse. With a
    residual that is correlated from sample to sample it's ``sum_j w_j^2 S_j R_j S_j'``, with R_j the autocovariance
    of output j's residual and S_j its change with the unknowns, and the covariance is ``M^-1 (that) M^-1`` (Morelli
    and Klein, *Accuracy of aerodynamic model parameters estimated from flight test data*, J. Guidance, Control, and
    Dynamics 20(1), 1997). The prior belongs to it.
    """
    moved = problem.followed(here, slopes)
    found = problem.prior_information(moved.shape[0])
    per_output = zip(np.moveaxis(moved, 1, 0), here.residual.white, weights(here.residual.power), strict=True)
    for columns, residual, weight in per_output:
        found += weight**2 * _through(_spread_out(columns, problem), _spread_out(residual, problem), problem.training)
    return found


def _spread_out(kept: Real, problem: FitProblem) -> Real:
    """``[..., sample]`` of all samples from training samples, 0 elsewhere."""
    whole = np.zeros((*kept.shape[:-1], problem.training.size))
    whole[..., problem.training] = kept
    return whole


def _through(columns: Real, residual: Real, seen: Mask) -> Real:
    """``C R C'`` with the autocovariance of a residual that is 0 where it isn't seen."""
    size = fft.next_fast_len(2 * residual.size, real=True)
    lags = max(int(LITTLE * residual.size), 1)
    covariance = _products(residual, size)[:lags] / np.maximum(_products(seen.astype(np.float64), size)[:lags], 1.0)
    # A noise that is told to be more than what is left is believed: it's one at least.
    covariance[0] = max(covariance[0], 1.0)
    # Falling to zero (Bartlett), so that no frequency gets a negative power by what long lags lack.
    tapered = covariance * (1.0 - np.arange(lags) / lags)
    ring = np.zeros(size)
    ring[:lags] = tapered
    ring[size - lags + 1 :] = tapered[:0:-1]
    power = np.maximum(fft.rfft(ring).real, 0.0)
    spectra = fft.rfft(columns, size, axis=-1)
    filtered = fft.irfft(spectra * power, size, axis=-1)[..., : residual.size]
    return np.asarray(columns @ filtered.T, dtype=np.float64)


def _products(signal: Real, size: int) -> Real:
    """Sum of products ``[lag]`` of a signal with itself."""
    return np.asarray(fft.irfft(np.abs(fft.rfft(signal, size)) ** 2, size), dtype=np.float64)
