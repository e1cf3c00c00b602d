"""How much of an effect is left once the model's numbers have been tuned inside their tolerances.

An effect that a little more stiffness imitates can't be found by anybody; such a case would test luck.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from chladni.gap.blind.excitation_draw import Drive
from chladni.gap.blind.noise import SensorNoise
from chladni.gap.blind.performance import measured, perform, rms
from chladni.gap.blind.plan import Bench

Matrix = NDArray[np.float64]
#: Numbers are believed within so many sigma of their nominal value.
_BOUND = 3.0
#: Part of a sigma by which numbers are moved for their sensitivities, and rounds of refinement.
_STEP, _ROUNDS = 0.01, 8
_EVERY = 4


def left_after_tuning(bench: Bench, numbers: Mapping[str, float], drive: Drive, change: Mapping[str, Matrix],
                      clean: Mapping[str, Matrix], noise: Mapping[str, SensorNoise]) -> float:  # fmt: skip
    """RMS over all outputs of what is left of a change, in units of each one's noise.

    Output error with the tolerances as prior and three sigma as bound, from the true numbers on; a resonance that has
    to move by many of its widths may keep the search from the best, so this is an upper bound.

    Parameters
    ----------
    numbers
        Where the search begins.
    change
        Of each output, ``[sample]``.
    clean
        Outputs at `numbers` without the effect.
    """
    names = measured(bench)
    # Every fourth sample says enough of what is smooth, and of what is left besides it.
    weight = {name: 1.0 / (noise[name].share * rms(clean[name])) for name in names}
    wanted = np.concatenate([weight[name] * (clean[name] + change[name])[::_EVERY] for name in names])
    tuned = [name for name, tolerance in bench.plan.tolerance.items() if tolerance > 0 and numbers[name] != 0]
    sigma = np.array([bench.plan.tolerance[name] * bench.plan.numbers[name] for name in tuned])
    begun = np.array([numbers[name] - bench.plan.numbers[name] for name in tuned]) / sigma

    def misfit(z: Matrix) -> Matrix:
        values = {name: bench.plan.numbers[name] + each for name, each in zip(tuned, z * sigma, strict=True)}
        found = perform(bench, {**numbers, **values}, drive)
        shown = np.concatenate([weight[name] * found[name][::_EVERY] for name in names])
        # Thinning the samples thins the evidence; the belief is thinned likewise.
        return np.concatenate([shown - wanted, z / np.sqrt(_EVERY)])

    inside = np.clip(begun, -_BOUND + 1e-9, _BOUND - 1e-9)
    found = least_squares(
        misfit, inside, bounds=(-_BOUND, _BOUND), diff_step=np.full(begun.size, _STEP), max_nfev=_ROUNDS
    )
    return float(np.sqrt(np.mean(found.fun[: wanted.size] ** 2)))
