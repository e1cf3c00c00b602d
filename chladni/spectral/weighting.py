"""Frequency weightings A and C of sound level meters, after IEC 61672-1:2013."""

from dataclasses import replace
from typing import Literal

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity

Weighting = Literal["A", "C"]
# Pole frequencies of the weightings (IEC 61672-1:2013, annex E, equations E.1 to E.6).
_POLES_HZ = (20.598997, 107.65265, 737.86223, 12194.217)
#: Where both are 0 dB.
REFERENCE_HZ = 1000.0


def weighting_db(frequency_hz: Real, weighting: Weighting) -> Real:
    """Give a frequency weighting of sound level meters, in dB; minus infinity at 0 Hz.

    Notes
    -----
    IEC 61672-1:2013, annex E: C(f) = 20 lg(f4^2 f^2 / ((f^2 + f1^2)(f^2 + f4^2))) - C1000, and A(f) the same times
    f^2 / sqrt((f^2 + f2^2)(f^2 + f3^2)); both are 0 at 1 kHz.

    Examples
    --------
    >>> weighting_db(np.array([31.5, 100.0, 1000.0, 10_000.0]), "A").round(1) + 0.0
    array([-39.5, -19.1,   0. ,  -2.5])
    """
    if weighting not in ("A", "C"):
        raise EstimateError(f"weighting {weighting!r} is none of A, C; leave it out for none")

    def gain(hz: Real) -> Real:
        f1, f2, f3, f4 = _POLES_HZ
        c = f4**2 * hz**2 / ((hz**2 + f1**2) * (hz**2 + f4**2))
        return c if weighting == "C" else c * hz**2 / np.sqrt((hz**2 + f2**2) * (hz**2 + f3**2))

    with np.errstate(divide="ignore"):
        return np.asarray(20 * np.log10(gain(frequency_hz) / gain(np.array(REFERENCE_HZ))), dtype=np.float64)


def weighted(density: PowerSpectralDensity, weighting: Weighting) -> PowerSpectralDensity:
    """Weigh a density line by line: a tone at the edge of a band has the weight of its own frequency."""
    power = 10 ** (weighting_db(density.frequency_hz, weighting) / 10)
    return replace(density, values=density.values * power, std=density.std * power)
