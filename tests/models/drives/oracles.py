"""Transfer functions of drives by block algebra of python-control, and how responses are compared."""

import control
import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.state_space import StateSpace
from chladni.signals.arrays import Complex

S = control.tf("s")
FREQUENCY_HZ = np.geomspace(1e-3, 1e4, 141)


def piston(values: dict[str, float], capacity: float) -> dict[tuple[str, str], control.TransferFunction]:
    """``(output, input)`` of the two balances, solved by hand for velocity and pressure drop."""
    area, mass = values["active_area"], values["reduced_mass"]
    leakage, loss = values["leakage"], values["viscous_loss"]
    # Over c m, so that the coefficients are of like size.
    scale = capacity * mass
    below = S**2 + (capacity * loss + mass * leakage) / scale * S + (area**2 + leakage * loss) / scale
    speed = {"flow": area / scale / below, "load": -(capacity * S + leakage) / scale / below}
    drop = {"flow": (mass * S + loss) / scale / below, "load": area / scale / below}
    found = {}
    for entry in ("flow", "load"):
        found["displacement", entry] = speed[entry] / S
        found["velocity", entry] = speed[entry]
        found["acceleration", entry] = speed[entry] * S
        found["pressure_drop", entry] = drop[entry]
    return found


def response(transfer: control.TransferFunction) -> Complex:
    return np.asarray(transfer(2j * np.pi * FREQUENCY_HZ))


def assert_same_response(
    system: StateSpace | CompiledModel, output: str, entry: str, expected: Complex, rtol: float = 1e-9
) -> None:
    """Relative at every frequency, but for the rounding of terms that cancel: some epsilon of the largest."""
    names = [terminal.name for terminal in system.outputs], [terminal.name for terminal in system.inputs]
    found = system.frequency_response(FREQUENCY_HZ)[names[0].index(output), names[1].index(entry)]
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=1e-15 * np.abs(expected).max())


def named(terminals: tuple) -> list[str]:
    return [terminal.name for terminal in terminals]
