"""Random error of a frequency response: that of H1 and H2 from coherence, that of periods from their scatter."""

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError


def response_std(residual_power: Real, inverse_reference_power: Real, *, averages: float, references: int) -> Real:
    """Give one sigma of the magnitude of least-squares frequency responses.

    With q references and n effective averages,

        var |H_yi| = (1 - coherence) G_yy [G_xx^-1]_ii / (2 (n - q)),

    which for one reference is Bendat & Piersol (2010), eq. 9.90, with n - 1 in place of n: the coherence is
    estimated from the same n averages, and one of them is spent on H.

    Parameters
    ----------
    residual_power
        (1 - multiple coherence) G_yy, unit_y^2/Hz, at least 0.
    inverse_reference_power
        Diagonal elements of the inverse reference matrix, Hz/unit_x^2; broadcasts against `residual_power`.
    averages
        Effective averages.
    references
        Number q of references.

    Returns
    -------
    ndarray
        Infinite when there are too few averages to tell, n <= q.
    """
    # One number of each pair of real and imaginary error lies along H, hence the 2.
    variance = residual_power * inverse_reference_power
    if averages <= references:
        return np.full(variance.shape, np.inf)
    return np.asarray(np.sqrt(variance / (2 * (averages - references))), dtype=np.float64)


def periodic_response_std(spectra: CrossSpectra, values: Complex, reference: int, responses: list[int]) -> Real:
    """Give one sigma of the magnitude of mean response over mean reference, from the scatter between periods.

        var H = |H|^2 / M (s_yy/|Y|^2 + s_xx/|X|^2 - 2 Re(s_xy/(conj(X) Y)))

    with the covariances s of one period and M periods (Pintelon & Schoukens 2012, chapter 2); half of it is in the
    magnitude, half in the phase.

    Parameters
    ----------
    spectra
        Averages over periods, with their scatter.
    values
        ``[response, frequency]`` mean response over mean reference.
    reference, responses
        Rows of the channels.

    Returns
    -------
    ndarray
        ``[response, frequency]``; infinite where the mean reference has no power.
    """
    if spectra.noise_density is None:
        raise EstimateError("the scatter between periods is known for periodic averages only")
    periods = spectra.provenance.averages
    scatter = np.asarray(spectra.noise_density)
    mean = np.asarray(spectra.density) - scatter * ((periods - 1) / periods)
    power = mean[reference, reference].real
    # Written with H instead of Y, so that a response that is zero still has an error.
    own = scatter[responses, responses].real
    common = 2 * (np.conj(values) * scatter[reference, responses]).real
    spread = own + np.abs(values) ** 2 * scatter[reference, reference].real - common
    variance = np.divide(np.maximum(spread, 0.0), power * periods, out=np.full(own.shape, np.inf), where=power > 0)
    return np.asarray(np.sqrt(variance / 2), dtype=np.float64)
