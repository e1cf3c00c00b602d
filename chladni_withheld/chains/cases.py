"""Cases of chains, trees and drives: which words they hide, and how each is drawn.

A bench, a drive, true numbers, hidden effects of the asked severity, and noise are drawn until they fit each other.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from itertools import cycle, islice

import numpy as np
from numpy.typing import NDArray

from chladni.signals.errors import EstimateError
from chladni_withheld.case import Generator, HiddenEffect, Kind, LoggedChannel, WithheldCase
from chladni_withheld.chains.benches import Footing, draw_drive_bench, draw_numbers, draw_structure
from chladni_withheld.chains.effects import BODY_DRAFTS, INPUT_DRAFTS, JOINT_DRAFTS, OUTPUT_DRAFTS
from chladni_withheld.chains.excitations import Drive, SensorNoise, draw_drive, draw_noise
from chladni_withheld.chains.plan import Bench, Hidden, Input, Output, model_text
from chladni_withheld.chains.scene import Scene
from chladni_withheld.chains.severity import all_act, converted, left_after_tuning, sized
from chladni_withheld.chains.simulation import measured, perform, pooled_change, rms, settled
from chladni_withheld.chains.sites import DRAWN, OUTSIDE_DRAWN, draw_draft

Matrix = NDArray[np.float64]
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
#: Cases of each kind in two hundred. A share of 5 % can't be told of fewer than twenty pairs, or faint effects.
DEFAULT: Mapping[Kind, int] = {
    "effect": 78, "none": 52, "parameters": 8, "two": 20, "three": 0, "faint": 20, "leave_out": 14, "outside": 8,
}  # fmt: skip
#: Share of cases whose noise is coloured; of those without an effect it's half, exactly.
_COLOURED = 0.4
#: Share of ordinary cases that leave words out too, so that the list tells nothing.
_DECOYS = 0.25


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


def orders(counts: Mapping[Kind, int], rng: np.random.Generator) -> list[Order]:
    """Give the orders of a campaign, in random order; every word comes up about equally often."""
    made: list[Order] = []
    for kind, number in counts.items():
        drawn = _words(kind, number, rng)
        for place, words in enumerate(drawn):
            # Every other case without an effect is coloured, the others by chance.
            coloured = place % 2 == 1 if kind in ("none", "parameters") else bool(rng.random() < _COLOURED)
            made.append(Order(kind=kind, words=words, coloured=coloured, leave_out=_left_out(kind, words, rng)))
    return [made[place] for place in rng.permutation(len(made))]


def _words(kind: Kind, number: int, rng: np.random.Generator) -> list[tuple[str, ...]]:
    if kind in ("none", "parameters"):
        return [()] * number
    if kind == "two":
        return [_pair(place, rng) for place in range(number)]
    if kind == "three":
        return [_triple(rng) for _ in range(number)]
    words = OUTSIDE_DRAWN if kind == "outside" else DRAWN
    # A new order for each round, so that a short campaign doesn't always hold the same words.
    rounds = (str(word) for _ in cycle([0]) for word in rng.permutation(words))
    return [(word,) for word in islice(rounds, number)]


def _pair(place: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Two joints, or a joint, body or input and a sensor."""
    if place % 3 == 0:
        joints = list(JOINT_DRAFTS)
        return str(rng.choice(joints)), str(rng.choice(joints))
    return _acting_and_sensor(rng)


def _acting_and_sensor(rng: np.random.Generator) -> tuple[str, str]:
    acting = [*JOINT_DRAFTS, *BODY_DRAFTS, *(word for word in INPUT_DRAFTS if word not in ("ripple", "gain_error"))]
    acting.remove("tonal_disturbance")
    return str(rng.choice(acting)), str(rng.choice([word for word in OUTPUT_DRAFTS if word != "tonal_disturbance"]))


def _triple(rng: np.random.Generator) -> tuple[str, ...]:
    """A joint, body or input, and a sensor, with another joint."""
    return (*_acting_and_sensor(rng), str(rng.choice(list(JOINT_DRAFTS))))


def _left_out(kind: Kind, words: tuple[str, ...], rng: np.random.Generator) -> tuple[str, ...]:
    others = [word for word in DRAWN if word not in words]
    decoy = (str(rng.choice(others)),) if rng.random() < _DECOYS else ()
    return (*(words if kind == "leave_out" else ()), *decoy)


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


def _withheld(case: Case) -> WithheldCase:
    ratios = case.ratios or (None,) * len(case.effects)
    tuned = case.ratios_tuned or (case.ratio_tuned,) * len(case.effects)
    return WithheldCase(
        kind=case.order.kind, model=model_text(case.bench.plan), sample_rate_hz=case.bench.rate_hz,
        channels=channels_of(case), off=case.off, parameters=case.numbers,
        effects=tuple(
            HiddenEffect(effect=one.effect, site=one.site, law=one.law, parameters=one.numbers,
                         source=one.source or None, severity=ratio, severity_tuned=left)
            for one, ratio, left in zip(case.effects, ratios, tuned, strict=True)
        ),
        noise={name: asdict(one) for name, one in case.noise.items()}, coloured=case.order.coloured,
        change=case.change, ratio=case.ratio, ratio_tuned=case.ratio_tuned, noise_share=case.noise_share,
        excitation=case.drive.words, starts_in_motion=case.drive.before > 0, modes_hz=case.bench.modes_hz,
        leave_out=case.order.leave_out, further={"steps": case.steps},
    )  # fmt: skip


def channels_of(case: Case) -> tuple[LoggedChannel, ...]:
    """What the log holds: driving signals, then outputs with their noise."""
    plan, before = case.bench.plan, case.drive.before
    terminals: list[Input | Output] = [*plan.inputs, *plan.outputs]
    channels = {one.name: (one.channel, one.unit) for one in terminals}
    if plan.loop is not None:
        channels[plan.loop.name] = (plan.loop.reference, channels[plan.loop.feedback][1])
    driven = {name: row[before : before + case.bench.samples] for name, row in
              zip(plan.driven(), case.drive.signals, strict=True)}  # fmt: skip
    rows = [*((name, row, True) for name, row in driven.items()),
            *((name, case.recorded[name], False) for name in measured(case.bench))]  # fmt: skip
    return tuple(
        LoggedChannel(name=channels[name][0], unit=channels[name][1], samples=row, drives=drives)
        for name, row, drives in rows
    )


def draws(counts: Mapping[Kind, int], seed: int) -> list[Callable[[], WithheldCase]]:
    """Give what draws each case of a campaign, see `Generator`."""
    planned = orders(counts, np.random.default_rng([seed, 0]))
    return [partial(_drawn, order, (seed, place)) for place, order in enumerate(planned, start=1)]


def _drawn(order: Order, seed: tuple[int, int]) -> WithheldCase:
    return _withheld(draw_case(order, np.random.default_rng(seed)))


CHAINS = Generator(composition=DEFAULT, draws=draws)
