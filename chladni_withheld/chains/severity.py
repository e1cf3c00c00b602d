"""How far an effect moves the outputs: as far as asked, more than tuning imitates, and as its word says.

An effect that a little more stiffness imitates can't be found by anybody; such a case would test luck.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from chladni.signals.errors import EstimateError
from chladni_withheld.chains.excitations import Drive, SensorNoise
from chladni_withheld.chains.hidden_effects import ON_SAMPLES, on_samples
from chladni_withheld.chains.plan import Bench, Hidden
from chladni_withheld.chains.scene import Draft, Scene
from chladni_withheld.chains.simulation import measured, perform, pooled_change, rms

Matrix = NDArray[np.float64]
_TRIES, _CLOSE = 9, 1.12
#: Steps a sample while the size is searched for; what is kept is simulated finer.
SEARCH_STEPS = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Sized:
    """An effect of a size, and how far it moves the outputs (pooled RMS over each output's own)."""

    hidden: Hidden
    change: float


def converted(outputs: Mapping[str, Matrix], effects: tuple[Hidden, ...], names: list[str]) -> dict[str, Matrix]:
    """Give samples behind the converters of the sensors."""
    behind = {name: outputs[name] for name in names}
    for hidden in effects:
        if hidden.law in ON_SAMPLES:
            behind[hidden.site] = on_samples(hidden, behind[hidden.site])
    return behind


def sized(draft: Draft, scene: Scene, drive: Drive, clean: Mapping[str, Matrix], target: float) -> Sized | None:
    """Search the size at which the effect moves the outputs by `target`; None when no size does.

    Parameters
    ----------
    clean
        Outputs without the effect.
    target
        Pooled RMS change over each output's own RMS.
    """
    names = measured(scene.bench)
    size, nearest = min(max(1.0, draft.least), draft.most), None
    for _ in range(_TRIES):
        found = _tried(draft.hidden(size), scene, drive, clean, names)
        if found is None:
            size = max(draft.least, 0.3 * size)
            continue
        if nearest is None or abs(log(found.change / target)) < abs(log(nearest.change / target)):
            nearest = found
        if 1 / _CLOSE < found.change / target < _CLOSE:
            break
        # Most changes grow about in proportion; a step too far is taken back by the next.
        wanted = min(max(size * (target / found.change) ** 0.9, draft.least), draft.most)
        if wanted == size:
            break
        size = wanted
    return nearest


def _tried(hidden: Hidden, scene: Scene, drive: Drive, clean: Mapping[str, Matrix], names: list[str]) -> Sized | None:
    try:
        moved = clean if hidden.law in ON_SAMPLES else perform(
            scene.bench, scene.numbers, drive, (hidden,), steps=SEARCH_STEPS
        )  # fmt: skip
    except EstimateError:
        return None
    change = pooled_change(scene.bench, clean, converted(moved, (hidden,), names))
    return Sized(hidden=hidden, change=change) if np.isfinite(change) and change > 0 else None


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


#: Of the way from end to end: a yield, half of it to either side, from which on part of a loop opens, since the first
#: of sliders in parallel gives way at a quarter of their mean; two periods of a ripple, from which on it's seen to
#: repeat, and before which it's a spring that bends.
_WAY: Mapping[str, tuple[str, float]] = {"hysteresis": ("yield", 1.0), "ripple": ("period", 2.0)}


def all_act(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden], *,
            steps: int | None = None) -> bool:  # fmt: skip
    """Whether each hysteresis moves far enough to yield, and each ripple over two of its periods, with all effects.

    How far they would move without them says little: a loop itself holds a free axis, and teeth catch what is slow.
    """
    acting = [one for one in effects if one.effect in _WAY]
    if not acting:
        return True
    moved = perform(bench, numbers, drive, effects, steps=steps, watched=True)
    return all(_acts(one, float(np.ptp(moved[_displacement(bench, one.site)]))) for one in acting)


def _acts(one: Hidden, way: float) -> bool:
    """Whether an effect does what it's called over a way from end to end, m or rad."""
    number, times = _WAY[one.effect]
    return way > times * one.numbers[number]


def _displacement(bench: Bench, site: str) -> str:
    """Name of what `perform` watches there."""
    return f"{site}.x" if site in {one.name for one in bench.plan.inputs} else f"{site}.d"
