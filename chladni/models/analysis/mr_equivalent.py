"""The magnetorheological damper as the viscous one that dissipates as much, to be placed like one."""

from math import pi

import numpy as np

from chladni.models.analysis.damper_placement import Damper
from chladni.models.core.port_law import PortLaw
from chladni.models.drives.mr_coefficients import MrCoefficients
from chladni.models.drives.mr_damper import mr_damper_at
from chladni.models.drives.mr_shipped import MEASURED_DAMPER
from chladni.signals.errors import ModelError

# The second period from rest has closed to a hundredth of its height.
PERIODS, SAMPLES, SUBSTEPS = 2, 200, 8


def mr_damper_of(
    *, amplitude_m: float, frequency_hz: float, coefficients: MrCoefficients = MEASURED_DAMPER, size: float = 1.0
) -> Damper:
    """Give the range of viscous coefficients that a magnetorheological damper has between no and its largest current.

    ``c = W/(pi omega X^2)`` with W the energy of one period of a sinus of amplitude X (Inman 2014, section 2.7). The
    force hardly depends on speed, so c holds for this amplitude and frequency only.

    Parameters
    ----------
    amplitude_m, frequency_hz
        Of the joint's motion at the resonance to be damped.
    coefficients
        Of the damper; the measured one when not given.
    size
        Every force relative to them.

    Raises
    ------
    ModelError
        For an amplitude, frequency or size that is not above zero.
    """
    if not (0 < amplitude_m < np.inf and 0 < frequency_hz < np.inf):
        raise ModelError(f"amplitude {amplitude_m:g} m and frequency {frequency_hz:g} Hz must lie above zero")
    ends = [
        _equivalent(
            mr_damper_at("joint", current_a=current, coefficients=coefficients, size=size).coefficients.law(current),
            amplitude_m,
            2 * pi * frequency_hz,
        )
        for current in (coefficients.lowest_current_a, coefficients.highest_current_a)
    ]
    return Damper(name="MR", low=min(ends), high=max(ends))


def _equivalent(law: PortLaw, amplitude: float, omega: float) -> float:
    # Imported here: it brings the compiler of laws, which other dampers have no use for.
    from chladni.models.integrator.known_motion import force_along_motion

    t = np.linspace(0.0, PERIODS * 2 * pi / omega, PERIODS * SAMPLES + 1)
    x, v = amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)
    force = force_along_motion(law, x, v, t, substeps=SUBSTEPS)
    last = slice(-SAMPLES - 1, None)
    # The loop closes on itself, so that the trapezoidal rule goes once around it.
    return float(np.trapezoid(force[last], x[last])) / (pi * omega * amplitude**2)
