"""Random vibration of oscillators on a shaken base: RMS by Miles and by integration, peaks by Vanmarcke."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from chladni.io.source import density_of
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.random_vibration import VibrationResponse

# Points of the integral over a resonance: steps of so many a half-power bandwidth, within so many of them.
STEPS_A_BANDWIDTH, BANDWIDTHS = 20, 20


def vibration_response(
    source: PowerSpectralDensity | ArrayLike,
    *,
    frequencies_hz: Real | Sequence[float],
    q: float = 10.0,
    duration_s: float = 60.0,
    probability: float = 0.5,
    frequency_hz: ArrayLike | None = None,
) -> VibrationResponse:
    """Give the shock response spectrum of a random vibration: RMS and peak of oscillators on that base.

    Parameters
    ----------
    source
        Densities of base accelerations, or an array ``[channel, frequency]`` of them; straight between its lines on
        logarithmic axes, nothing outside them.
    frequencies_hz
        Natural frequencies, rising, above 0.
    q
        Amplification at resonance, above 0.5.
    duration_s
        How long the vibration lasts.
    probability
        With which the peak isn't exceeded, between 0 and 1; 0.5 is the median of the highest peak.
    frequency_hz
        Of an array: its lines.

    Returns
    -------
    VibrationResponse
        Of absolute acceleration, in each channel's unit.

    Raises
    ------
    EstimateError
        When an argument is out of its range.

    Notes
    -----
    RMS: the integral of abs(H)^2 G, H = (1 + 2j zeta r)/(1 - r^2 + 2j zeta r). Miles: sqrt(pi/2 f q G(f)) (Miles
    1954, J. Aeronautical Sciences 21(11)); three times that is the usual "3 sigma". Peak: Vanmarcke's law of first
    passages (Vanmarcke 1975, J. Applied Mechanics 42(1)), P(s) = (1 - exp(-s^2/2)) exp(-nu T (1 - exp(-sqrt(pi/2)
    delta^1.2 s))/(exp(s^2/2) - 1)), s in RMS, with nu = sqrt(m2/m0)/pi crossings of either sign and
    delta^2 = 1 - m1^2/(m0 m2) by the spectral moments m.

    Examples
    --------
    >>> lines = np.linspace(1, 5000, 5000)
    >>> found = vibration_response(np.ones(5000), frequency_hz=lines, frequencies_hz=[100.0])
    >>> round(float(found.rms[0, 0]), 1), round(float(found.miles[0, 0]), 1)
    (39.8, 39.6)
    """
    density = density_of(source, frequency_hz=frequency_hz)
    natural_hz = np.atleast_1d(np.asarray(frequencies_hz, dtype=np.float64))
    if not (natural_hz.size and np.all(np.diff(natural_hz, prepend=0.0) > 0) and np.all(np.isfinite(natural_hz))):
        raise EstimateError("natural frequencies must rise, above 0 Hz")
    if not 0.5 < q < np.inf:
        raise EstimateError(f"q is {q:g}; it must be finite and above 0.5, such as 10 for 5 % damping")
    if not (0 < duration_s < np.inf and 0 < probability < 1):
        raise EstimateError(
            f"a peak within {duration_s:g} s with probability {probability:g}; give a time above 0 and a probability "
            "between 0 and 1"
        )
    shape = (len(density.channels), natural_hz.size)
    rms, miles, peak = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for row, values in enumerate(density.values):
        for place, one_hz in enumerate(natural_hz.tolist()):
            moments = _moments(density.frequency_hz, values, one_hz, q)
            rms[row, place] = np.sqrt(moments[0])
            peak[row, place] = rms[row, place] * _peak_factor(moments, duration_s, probability)
            miles[row, place] = np.sqrt(np.pi / 2 * one_hz * q * _between(density.frequency_hz, values, one_hz))
    return VibrationResponse(
        frequency_hz=natural_hz,
        rms=rms,
        miles=miles,
        peak=peak,
        q=q,
        duration_s=duration_s,
        probability=probability,
        channels=density.channels,
    )


def _between(axis: Real, values: Real, frequency_hz: Real | float) -> Real:
    """Density between its lines, straight on logarithmic axes; 0 outside."""
    known = (axis > 0) & (values > 0)
    if not known.any():
        return np.zeros(np.shape(frequency_hz))
    inside = (frequency_hz >= axis[known][0]) & (frequency_hz <= axis[known][-1])
    log_f = np.log(np.where(inside, frequency_hz, axis[known][0]))
    found = np.exp(np.interp(log_f, np.log(axis[known]), np.log(values[known])))
    return np.where(inside, found, 0.0)


def _moments(axis: Real, values: Real, natural_hz: float, q: float) -> Real:
    """Spectral moments m0, m1, m2 of the response, in powers of rad/s."""
    width = natural_hz / q
    near = natural_hz + width * np.arange(-BANDWIDTHS, BANDWIDTHS, 1 / STEPS_A_BANDWIDTH)
    grid = np.unique(np.concatenate([axis, near[(near > axis[0]) & (near < axis[-1])]]))
    grid = grid[grid > 0]
    ratio = grid / natural_hz
    gain = (1 + (ratio / q) ** 2) / ((1 - ratio**2) ** 2 + (ratio / q) ** 2)
    response = gain * _between(axis, values, grid)
    return np.array([np.trapezoid(response * (2 * np.pi * grid) ** power, grid) for power in range(3)])


def _peak_factor(moments: Real, duration_s: float, probability: float) -> float:
    from scipy.optimize import brentq

    if not moments[0] > 0:
        return 0.0
    crossings = np.sqrt(moments[2] / moments[0]) / np.pi * duration_s
    delta = np.sqrt(max(1 - moments[1] ** 2 / (moments[0] * moments[2]), 0.0))

    def log_chance(s: float) -> float:
        clumped = -np.expm1(-np.sqrt(np.pi / 2) * delta**1.2 * s)
        return float(np.log(-np.expm1(-(s**2) / 2)) - crossings * clumped / np.expm1(s**2 / 2))

    return float(brentq(lambda s: log_chance(s) - np.log(probability), 1e-3, 30.0))
