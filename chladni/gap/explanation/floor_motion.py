"""A floor's motion as numbers: how strong it is, and in which band."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from chladni.gap.location.profile import profile_at
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.records.diagnosis import FittedNumber

Matrix = NDArray[np.float64]
#: Share of the power that is left out at either end of a band: tails there are the estimate's, not the floor's.
_TAIL = 0.05


def floor_motion(problem: LinearProblem, ground: Site, z: Matrix) -> Mapping[str, FittedNumber]:
    """Give the parameters of `base_vibration` that the sensors tell, without a standard deviation.

    The level is the root mean square of the ground's acceleration. The band is that of a flat spectrum with the same
    5th and 95th percentile of its power.

    Parameters
    ----------
    problem
        Of the whole record.
    ground
        The site whose acceleration it is.
    z
        Parameters of the model, in units of their tolerance.
    """
    found = recovered(problem, profile_at(problem, (ground,), z), ground)
    rate_hz = problem.measurement.sample_rate_hz
    low_hz, high_hz = flat_band(found.force, rate_hz)
    unit = next(port.unit for port in problem.view(z).compiled.ports if port.kind == "ground")
    return {
        "level": FittedNumber(value=float(np.sqrt(np.mean(found.force**2))), std=None, unit=unit),
        "band": FittedNumber(value=high_hz, std=None, unit="Hz"),
        "band_start": FittedNumber(value=low_hz, std=None, unit="Hz"),
    }


def flat_band(signal: Matrix, sample_rate_hz: float) -> tuple[float, float]:
    """Give the ends in Hz of the flat band between whose 5th and 95th percentile 90 % of a signal's power lies.

    Examples
    --------
    >>> import numpy as np
    >>> lines = np.zeros(501)
    >>> lines[100:201] = 1.0
    >>> low_hz, high_hz = flat_band(np.fft.irfft(lines), 1000.0)
    >>> f"{low_hz:.0f} to {high_hz:.0f} Hz"
    '100 to 200 Hz'
    """
    power = np.abs(np.fft.rfft(signal)) ** 2
    # A line stands for the frequencies around it.
    edges_hz = (np.arange(power.size + 1) - 0.5) * sample_rate_hz / signal.size
    summed = np.concatenate([[0.0], np.cumsum(power)]) / np.sum(power)
    low_hz, high_hz = np.interp([_TAIL, 1.0 - _TAIL], summed, edges_hz)
    beyond = (high_hz - low_hz) * _TAIL / (1.0 - 2.0 * _TAIL)
    return float(max(low_hz - beyond, 0.0)), float(min(high_hz + beyond, sample_rate_hz / 2.0))
