"""How much of an effect is left once the model's numbers have been tuned inside their tolerances.

An effect that a little more stiffness imitates can't be found by anybody; such a case would test luck. The machine is
linearised in its numbers, and their best change, believed as far as the tolerances say, is taken off.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from chladni.gap.blind.excitation_draw import Drive
from chladni.gap.blind.noise import SensorNoise
from chladni.gap.blind.performance import measured, perform, rms
from chladni.gap.blind.plan import Bench

Matrix = NDArray[np.float64]
#: Numbers are moved by this part of a sigma for their sensitivities, and believed within so many.
_STEP, _BOUND = 0.02, 3.0
_EVERY = 4


def left_after_tuning(bench: Bench, numbers: Mapping[str, float], drive: Drive, change: Mapping[str, Matrix],
                      clean: Mapping[str, Matrix], noise: Mapping[str, SensorNoise]) -> float:  # fmt: skip
    """RMS over all outputs of what is left of a change, in units of each one's noise.

    Parameters
    ----------
    numbers
        About which the machine is linearised.
    change
        Of each output, ``[sample]``.
    clean
        Outputs at `numbers`, simulated with the steps that `perform` chooses itself.
    """
    names = measured(bench)
    weight = {name: 1.0 / (noise[name].share * rms(clean[name])) for name in names}
    # Every fourth sample says enough of a smooth sensitivity, and of what is left besides it.
    left = np.concatenate([weight[name] * change[name][::_EVERY] for name in names])
    columns = []
    for name, tolerance in bench.plan.tolerance.items():
        if tolerance > 0 and numbers[name] != 0:
            sigma = tolerance * bench.plan.numbers[name]
            moved = perform(bench, {**numbers, name: numbers[name] + _STEP * sigma}, drive)
            parts = [weight[each] * (moved[each] - clean[each])[::_EVERY] / _STEP for each in names]
            columns.append(np.concatenate(parts))
    return _residual(left, np.column_stack(columns))


def _residual(left: Matrix, sensitivity: Matrix) -> float:
    """RMS of `left` without what numbers explain; each further sigma costs as much as one sample's noise."""
    # Thinning the samples thins the evidence too: the belief is thinned likewise.
    belief = np.eye(sensitivity.shape[1]) / np.sqrt(_EVERY)
    found = lsq_linear(np.vstack([sensitivity, belief]), np.concatenate([left, np.zeros(belief.shape[0])]),
                       bounds=(-_BOUND, _BOUND))  # fmt: skip
    return float(np.sqrt(np.mean((left - sensitivity @ found.x) ** 2)))
