"""Draws one case: a bench, a drive, true numbers, hidden effects of the asked severity, and noise."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from chladni.gap.blind.acting import all_act
from chladni.gap.blind.distinction import left_after_tuning
from chladni.gap.blind.draft import Scene
from chladni.gap.blind.drive_draw import draw_drive_bench
from chladni.gap.blind.excitation_draw import Drive, draw_drive
from chladni.gap.blind.noise import SensorNoise, draw_noise
from chladni.gap.blind.performance import measured, perform, pooled_change, rms, settled
from chladni.gap.blind.plan import Bench, Hidden
from chladni.gap.blind.severity import converted, sized
from chladni.gap.blind.site_draw import draw_draft, draw_numbers
from chladni.gap.blind.structure_draw import Footing, draw_structure
from chladni.signals.errors import EstimateError

Matrix = NDArray[np.float64]
Kind = Literal["effect", "none", "parameters", "two", "three", "faint", "leave_out", "outside"]
_MOST_DRAWS = 200
#: Effect over noise, pooled: of effects that must be found, and of faint ones.
CLEAR, FAINT = (3.3, 60.0), (0.33, 2.8)
#: Share of the outputs' RMS above which a change isn't moderate any more; a wrong sign alone makes two of it.
_LARGEST_CHANGE, _LARGEST_OF_GAIN = 1.0, 2.3
#: How much further several effects may move the outputs together.
_TOGETHER: Mapping[str, float] = {"two": 1.5, "three": 1.8}
_DRIVES = 0.15
_FOOTINGS: Sequence[Footing] = ("grounded", "free", "loop")
_FOOTING_SHARES = (0.64, 0.12, 0.24)
#: What must be left of a change, over the noise, when numbers inside their tolerances have imitated it.
LEAST_LEFT = 1.0
_SETTLED_SHARE = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """What a case shall be.

    Attributes
    ----------
    words
        Effects to hide, in order; a ``parameters`` case has none.
    coloured
        Whether the noise is.
    leave_out
        Words that the catalogue must not hold in the run.
    """

    kind: Kind
    words: tuple[str, ...] = ()
    coloured: bool = False
    leave_out: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A case and all that is true of it.

    Attributes
    ----------
    numbers
        True numbers of the plan.
    clean, recorded
        Outputs without noise (behind the converters), and as the log holds them.
    noise
        Of each output.
    change, ratio
        What the effects change, pooled RMS over each output's own RMS, and that over the pooled noise; None when
        nothing is hidden.
    ratio_tuned
        What is left of the change when the model's numbers are tuned inside their tolerances, RMS in units of noise.
    ratios
        Like `ratio`, of each effect alone.
    ratios_tuned
        Like `ratio_tuned`, of each of several effects when the others are known but for their size.
    off
        Parameter that left its tolerance, and by how many sigma; empty when none did.
    steps
        Runge-Kutta steps a sample.
    """

    order: Order
    bench: Bench
    numbers: Mapping[str, float]
    drive: Drive
    effects: tuple[Hidden, ...]
    clean: Mapping[str, Matrix]
    recorded: Mapping[str, Matrix]
    noise: Mapping[str, SensorNoise]
    steps: int
    change: float | None = None
    ratio: float | None = None
    ratio_tuned: float | None = None
    ratios: tuple[float, ...] = ()
    ratios_tuned: tuple[float, ...] = ()
    off: Mapping[str, float] = field(default_factory=dict)

    @property
    def noise_share(self) -> float:
        """Pooled RMS of the noise over each output's own."""
        return float(np.sqrt(np.mean([one.share**2 for one in self.noise.values()])))


def draw_case(order: Order, rng: np.random.Generator) -> Case:
    """Draw until bench, effect and severity fit each other.

    Raises
    ------
    EstimateError
        When nothing fitted in many draws, which is a defect of the drafts.
    """
    for _ in range(_MOST_DRAWS):
        try:
            case = _attempt(order, rng)
        except EstimateError:
            continue
        if case is not None:
            return case
    raise EstimateError(f"no case of {order} was found in {_MOST_DRAWS} draws; its effects fit no bench")


def _attempt(order: Order, rng: np.random.Generator) -> Case | None:
    bench = _draw_bench(rng)
    drive = draw_drive(rng, bench)
    exact = order.kind == "none" and rng.random() < 0.2
    numbers = dict(bench.plan.numbers) if exact else draw_numbers(rng, bench.plan)
    noise = {name: draw_noise(rng, coloured=order.coloured) for name in measured(bench)}
    share = float(np.sqrt(np.mean([one.share**2 for one in noise.values()])))
    off = _wrong_parameter(bench, rng) if order.kind == "parameters" else {}
    clean = perform(bench, numbers, drive, watched=True)
    if min(rms(clean[name]) for name in measured(bench)) <= 0:
        return None
    scene = Scene(bench=bench, numbers=numbers, moving={name: rms(row) for name, row in clean.items()}, rng=rng)
    found = _effects(order, scene, drive, clean, share)
    if found is None:
        return None
    effects, changes = found
    numbers |= {name: bench.plan.numbers[name] * (1 + z * bench.plan.tolerance[name]) for name, z in off.items()}
    still = settled(bench, numbers, drive, effects, within=_SETTLED_SHARE * share)
    if still is None:
        return None
    (steps, moved), names = still, measured(bench)
    if not all_act(bench, numbers, drive, effects, steps=steps):
        return None
    after = converted(moved, effects, names)
    change = pooled_change(bench, clean, after) if effects or off else None
    if change is not None and not _fits(order, change, share):
        return None
    tuned = _left(bench, numbers, drive, effects, off, clean, after, noise)
    if tuned is not None and order.kind != "faint" and tuned < LEAST_LEFT:
        return None
    beside: list[float] = []
    for place in range(len(effects)) if len(effects) > 1 else ():
        beside.append(_left_beside(bench, numbers, drive, effects, place, noise, steps))
        # Beside the others, too, nobody could find what a little more stiffness, or a larger other effect, imitates.
        if beside[-1] < LEAST_LEFT:
            return None
    return Case(
        order=order, bench=bench, numbers=numbers, drive=drive, effects=effects, clean=after,
        recorded=_recorded(moved, effects, noise, rng), noise=noise, steps=steps, change=change,
        ratio=None if change is None else change / share, ratio_tuned=tuned,
        ratios=tuple(one / share for one in changes), ratios_tuned=tuple(beside), off=off,
    )  # fmt: skip


def _left(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: tuple[Hidden, ...],
          off: Mapping[str, float], clean: Mapping[str, Matrix], after: Mapping[str, Matrix],
          noise: Mapping[str, SensorNoise]) -> float | None:  # fmt: skip
    """What tuning leaves of the effects, or of a number beyond the last three sigma."""
    if not effects and not off:
        return None
    # A wrong number may be tuned as far as its tolerance lets it, from the nominal one.
    near = {name: bench.plan.numbers[name] * (1 + np.sign(z) * 3 * bench.plan.tolerance[name]) for name, z in
            off.items()}  # fmt: skip
    about = {**numbers, **near}
    before = perform(bench, about, drive) if off else clean
    change = {name: after[name] - before[name] for name in noise}
    kept = replace(bench, plan=replace(bench.plan, tolerance={**bench.plan.tolerance, **dict.fromkeys(off, 0.0)}))
    return left_after_tuning(kept, about, drive, change, before, noise)


def _left_beside(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: tuple[Hidden, ...], place: int,
                 noise: Mapping[str, SensorNoise], steps: int) -> float:  # fmt: skip
    """What tuning leaves of one effect when the others are known but for their size, RMS in units of noise."""
    others = (*effects[:place], *effects[place + 1 :])
    without, together = (
        converted(perform(bench, numbers, drive, acting, steps=steps), acting, list(noise))
        for acting in (others, effects)
    )
    change = {name: together[name] - without[name] for name in noise}
    return left_after_tuning(bench, numbers, drive, change, without, noise, beside=others)


def _draw_bench(rng: np.random.Generator) -> Bench:
    if rng.random() < _DRIVES:
        return draw_drive_bench(rng)
    return draw_structure(rng, _FOOTINGS[int(rng.choice(len(_FOOTINGS), p=_FOOTING_SHARES))])


def _fits(order: Order, change: float, share: float) -> bool:
    least, most = (0.3, 3.0) if order.kind == "faint" else (3.0, np.inf)
    gains = any(word == "gain_error" for word in order.words)
    largest = _LARGEST_OF_GAIN if gains else _LARGEST_CHANGE
    return least <= change / share <= most and change <= largest * _TOGETHER.get(order.kind, 1.0)


def _effects(order: Order, scene: Scene, drive: Drive, clean: Mapping[str, Matrix], share: float,
             ) -> tuple[tuple[Hidden, ...], tuple[float, ...]] | None:  # fmt: skip
    """Give the effects and what each changes alone; None when one of them doesn't fit the bench."""
    least, most = FAINT if order.kind == "faint" else CLEAR
    found = []
    for word in order.words:
        draft = draw_draft(scene, word)
        if draft is None:
            return None
        target = scene.about(least, min(most, 0.8 / share) if order.kind != "faint" else most) * share
        one = sized(draft, scene, drive, clean, target)
        if one is None or not (least * 0.85 <= one.change / share) or (one.change / share > most and least < 1):
            return None
        found.append(one)
    sites = [one.hidden.site for one in found]
    if len(set(sites)) < len(sites):
        return None
    return tuple(one.hidden for one in found), tuple(one.change for one in found)


def _wrong_parameter(bench: Bench, rng: np.random.Generator) -> dict[str, float]:
    """A number that left its tolerance; a mass only downwards, since upwards it is an added one."""
    plan = bench.plan
    names = [name for name, tolerance in plan.tolerance.items() if tolerance > 0 and plan.numbers[name] > 0]
    name, masses = str(rng.choice(names)), [plan.inertia_of(body) for body in plan.bodies]
    sigmas = float(rng.uniform(4.0, 8.0))
    down = name in masses or (rng.random() < 0.5 and sigmas * plan.tolerance[name] < 0.7)
    return {name: -sigmas if down else sigmas}


def _recorded(moved: Mapping[str, Matrix], effects: tuple[Hidden, ...], noise: Mapping[str, SensorNoise],
              rng: np.random.Generator) -> dict[str, Matrix]:  # fmt: skip
    """Add noise in front of the converters, as in a real chain."""
    noisy = {
        name: moved[name] + one.share * rms(moved[name]) * one.samples(moved[name].size, rng)
        for name, one in noise.items()
    }
    return converted(noisy, effects, list(noise))
