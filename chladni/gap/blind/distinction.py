"""How much of an effect is left once the model's numbers have been tuned inside their tolerances.

An effect that a little more stiffness imitates can't be found by anybody; such a case would test luck.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from chladni.gap.blind.excitation_draw import Drive
from chladni.gap.blind.hidden_signals import ON_SAMPLES
from chladni.gap.blind.noise import SensorNoise
from chladni.gap.blind.performance import measured, perform, rms
from chladni.gap.blind.plan import Bench, Hidden
from chladni.gap.blind.severity import SEARCH_STEPS, converted

Matrix = NDArray[np.float64]
#: Numbers are believed within so many sigma of their nominal value.
_BOUND = 3.0
#: Part of a sigma by which numbers are moved for their sensitivities, and rounds of refinement.
_STEP, _ROUNDS = 0.01, 8
#: Part of what is left by which the last round may still have lowered it.
_SETTLED = 0.02
_EVERY = 4
#: Numbers of another effect that stay as they are; unit of the others' logarithms, and how far those may go.
_SHAPES = frozenset({"side", "exponent", "sharpness", "beta", "gamma"})
_SIZE, _FAR = 0.1, 10.0


def left_after_tuning(bench: Bench, numbers: Mapping[str, float], drive: Drive, change: Mapping[str, Matrix],
                      clean: Mapping[str, Matrix], noise: Mapping[str, SensorNoise], *,
                      beside: tuple[Hidden, ...] = ()) -> float:  # fmt: skip
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
    beside
        Other effects that are known, but for how large their numbers are; they are in `clean`.
    """
    names = measured(bench)
    # Every fourth sample says enough of what is smooth, and of what is left besides it.
    weight = {name: 1.0 / (noise[name].share * rms(clean[name])) for name in names}
    wanted = np.concatenate([weight[name] * (clean[name] + change[name])[::_EVERY] for name in names])
    tuned = [name for name, tolerance in bench.plan.tolerance.items() if tolerance > 0 and numbers[name] != 0]
    sigma = np.array([bench.plan.tolerance[name] * bench.plan.numbers[name] for name in tuned])
    begun = np.array([numbers[name] - bench.plan.numbers[name] for name in tuned]) / sigma

    # A law at a joint may be sharp; what is linear needs no more steps than the machine.
    joints = {joint.name for joint in bench.plan.joints}
    steps = SEARCH_STEPS if any(one.site in joints for one in beside) else None
    free = [
        (place, name) for place, one in enumerate(beside) if one.law not in ON_SAMPLES
        for name, value in one.numbers.items() if value and name not in _SHAPES
    ]  # fmt: skip

    def shown_by(z: Matrix, sizes: Matrix) -> Mapping[str, Matrix]:
        values = {name: bench.plan.numbers[name] + each for name, each in zip(tuned, z * sigma, strict=True)}
        larger = dict(zip(free, sizes, strict=True))
        known = tuple(_resized(one, {name: size for (at, name), size in larger.items() if at == place})
                      for place, one in enumerate(beside))  # fmt: skip
        moved = perform(bench, {**numbers, **values}, drive, known, steps=steps)
        return converted(moved, known, names)

    def misfit(unknown: Matrix) -> Matrix:
        z = unknown[: begun.size]
        found = shown_by(z, unknown[begun.size :])
        shown = np.concatenate([weight[name] * found[name][::_EVERY] for name in names])
        # Thinning the samples thins the evidence; the belief is thinned likewise.
        return np.concatenate([shown - wanted, z / np.sqrt(_EVERY)])

    inside = np.clip(begun, -_BOUND + 1e-9, _BOUND - 1e-9)
    start = np.concatenate([inside, np.zeros(len(free))])
    bound = np.concatenate([np.full(begun.size, _BOUND), np.full(len(free), _FAR)])
    found = least_squares(
        misfit, start, bounds=(-bound, bound), diff_step=np.full(start.size, _STEP), max_nfev=_ROUNDS, ftol=_SETTLED
    )
    return float(np.sqrt(np.mean(found.fun[: wanted.size] ** 2)))


def _resized(hidden: Hidden, sizes: Mapping[str, float]) -> Hidden:
    """Give an effect with some of its numbers larger, by parts of a tenth of them on a logarithmic scale."""
    larger = {name: hidden.numbers[name] * float(np.exp(_SIZE * size)) for name, size in sizes.items()}
    return replace(hidden, numbers={**hidden.numbers, **larger})
