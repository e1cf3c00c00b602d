"""Words of what acts at joints: friction, loops, springs, stops, ripple, rotors."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import accumulate

import numpy as np

from chladni.gap.robots.motion import rms
from chladni.gap.robots.term import Form, Number, Term, at_row, formed, law, length, rotor_at, units, usual
from chladni.gap.robots.torques import Torques
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Real

#: Of its usual speed: where Stribeck's rise ends, in turn.
_STRIBECK = (0.05, 0.15, 0.4)
#: Of a joint's motion: over which friction of either way builds up. A joint that yields less slides.
_SLIDES, _YIELDS = (0.01, 0.03, 0.08), (0.16, 0.32, 0.64)
#: Variants of friction.
ALONG_THE_WAY, PRESLIDING = "along the way", "presliding"
#: Quantiles of a joint's way at which a stop begins.
_STOPS = (0.6, 0.75, 0.85, 0.93)
#: Friction that grows with the load, before a log is seen.
_BY_LOAD = 0.3
#: Fewest waves of a ripple that a joint passes, lines between two that can be told apart, highest peaks tried.
_WAVES, _FINE, _PEAKS = 3.0, 4, 2
#: Waves over a joint's way that are looked for at most.
_MOST_WAVES = 128


def friction(torques: Torques) -> Iterator[Term]:
    """Friction of single joints."""
    for row, joint in torques.rows:
        dry = _dry(torques, row, joint)
        by_load = Number(name="coefficient", unit="1", scale=_BY_LOAD, least=0.0)
        yield from _plain(torques, row, joint, dry, by_load)
        yield _uneven(torques, row, dry)
        yield from _stribeck(torques, row, joint, torques.fast_sign[row])
        yield from _loops(torques, row, joint, dry, by_load)


def _plain(torques: Torques, row: int, joint: RobotJoint, dry: Number, by_load: Number) -> Iterator[Term]:
    """Friction by the speed and the load of the moment."""
    often, speed = usual(torques, row), rms(torques.velocity[row])
    force, damping, _ = units(joint)
    sign, fast = torques.sign[row], torques.fast_velocity[row]
    one = partial(law, torques, row)
    yield one("coulomb_friction", lambda: (sign,), dry)
    wet = Number(name="coefficient", unit=damping, scale=often / speed, least=-joint.damping, nominal=joint.damping)
    yield one("viscous_friction", lambda: (torques.velocity[row],), wet)
    unit = f"{force} s^2/rad^2" if joint.kind == "hinge" else "N s^2/m^2"
    square = Number(name="coefficient", unit=unit, scale=often / speed**2, least=0.0)
    yield one("quadratic_damping", lambda: (torques.smooth(fast * np.abs(fast)),), square)
    # What the drive gives holds the friction itself: the load is what the motion needs.
    yield one("load_friction", lambda: (sign, _load(torques, row) * sign), dry, by_load, plainer="coulomb_friction")


def bristles(torques: Torques) -> Iterator[Term]:
    """Stribeck's law with friction that builds up over a short way, as it was found for Coulomb's."""
    for row, joint in torques.rows:
        usual_way = _SLIDES[0] * _motion(torques, row)
        yields = torques.guesses.forms.get(("coulomb_friction", joint.name, PRESLIDING), usual_way)
        built_up = _dahl(torques.fast_position[row], yields, torques.stretches)
        yield from _stribeck(torques, row, joint, built_up, PRESLIDING)


def _dry(torques: Torques, row: int, joint: RobotJoint) -> Number:
    return Number(
        name="force", unit=units(joint)[0], scale=usual(torques, row), least=-joint.friction, nominal=joint.friction
    )


def _uneven(torques: Torques, row: int, dry: Number) -> Term:
    """Friction that changes along a joint's way, as that of knees behind linkages: by places it's linear between."""
    fast, places = torques.fast_position[row], way_of(torques, row)

    def midway_lowest_highest() -> tuple[Real, ...]:
        shapes = np.eye(len(places))[[1, 0, 2]]
        return tuple(torques.smooth(torques.fast_sign[row] * np.interp(fast, places, one)) for one in shapes)

    return law(
        torques, row, "coulomb_friction", midway_lowest_highest, dry, replace(dry, name="at_lowest"),
        replace(dry, name="at_highest"), variant=ALONG_THE_WAY, rare=True,
    )  # fmt: skip


def way_of(torques: Torques, row: int) -> tuple[float, float, float]:
    """Lowest, middle and highest position that a log holds of a joint."""
    lowest, highest = float(np.min(torques.position[row])), float(np.max(torques.position[row]))
    return lowest, 0.5 * (lowest + highest), highest


def _stribeck(torques: Torques, row: int, joint: RobotJoint, sign: Real, variant: str | None = None) -> list[Term]:
    """Friction that is higher when slow, along ``[sample]`` that says which way."""
    fast, unit = torques.fast_velocity[row], "rad/s" if joint.kind == "hinge" else "m/s"
    dry = _dry(torques, row, joint)
    rise = Number(name="rise", unit=dry.unit, scale=dry.scale, least=0.0)

    def make(speed: float) -> Term:
        def columns() -> tuple[Real, ...]:
            return torques.smooth(sign), torques.smooth(sign * np.exp(-((fast / speed) ** 2)))

        return law(torques, row, "stribeck_friction", columns, dry, rise, variant=variant, plainer="coulomb_friction")

    grid = np.array(_STRIBECK) * rms(torques.velocity[row])
    return formed(make, grid, name="speed", unit=unit)


def _load(torques: Torques, row: int) -> Real:
    """``[coarse]``: what the motion needs."""
    return np.asarray(np.abs(torques.of_joints(torques.need.torque)[row]))


def _motion(torques: Torques, row: int) -> float:
    return float(np.std(torques.position[row])) + 1e-12


def _loops(torques: Torques, row: int, joint: RobotJoint, dry: Number, by_load: Number) -> Iterator[Term]:
    """Dahl's loop: friction that builds up over a way (Dahl 1968), a short one where a joint slides."""
    loop = replace(dry, least=0.0, nominal=0.0)
    for word, shares, numbers, variant in (
        ("coulomb_friction", _SLIDES, (dry,), PRESLIDING),
        ("load_friction", _SLIDES, (dry, by_load), PRESLIDING),
        ("hysteresis", _YIELDS, (loop,), None),
    ):

        def make(
            yields: float, word: str = word, numbers: tuple[Number, ...] = numbers, variant: str | None = variant
        ) -> Term:
            def columns() -> tuple[Real, ...]:
                built_up = torques.smooth(_dahl(torques.fast_position[row], yields, torques.stretches))
                return (built_up, _load(torques, row) * built_up)[: len(numbers)]

            plainer = "coulomb_friction" if len(numbers) > 1 else None
            return law(torques, row, word, columns, *numbers, variant=variant, rare=variant is None, plainer=plainer)

        yield from formed(make, np.array(shares) * _motion(torques, row), name="yield", unit=length(joint))


def _dahl(position: Real, yields: float, stretches: tuple[tuple[int, int], ...]) -> Real:
    """Friction over its level, by how a joint moved: exact between reversals."""
    found = np.zeros_like(position)
    for first, last in stretches:
        steps = np.diff(position[first:last])
        turns = np.concatenate([[0], np.flatnonzero(np.diff(np.sign(steps)) != 0) + 1])
        counts = np.diff([*turns, steps.size])
        sense, begin = np.sign(steps[turns]), np.repeat(position[first + turns], counts)
        # What is left, of how far it was from its level where the joint turned.
        left = np.exp(-np.abs(position[first + 1 : last] - begin) / yields)
        states = accumulate(
            zip(sense.tolist(), left[turns + counts - 1].tolist(), strict=True),
            lambda state, way: way[0] - (way[0] - state) * way[1],
            initial=0.0,
        )
        begun = np.fromiter(states, np.float64, turns.size + 1)[:-1]
        found[first + 1 : last] = np.repeat(sense, counts) - np.repeat(sense - begun, counts) * left
    return found


def springs(torques: Torques) -> Iterator[Term]:
    """Springs beside a joint, and stops inside its way."""
    for row, joint in torques.rows:
        pull, constant = spring_numbers(joint, torques.position[row], usual(torques, row))
        yield law(torques, row, "joint_spring", partial(_line, torques.position[row]), pull, constant)
        for side in (1.0, -1.0):
            yield from _stop(torques, row, joint, side, pull)


def spring_numbers(joint: RobotJoint, way: Real, often: float) -> tuple[Number, Number]:
    """Give stiffness and constant of a spring over a way ``[coarse]`` whose torque is often so large."""
    mean = float(np.mean(way))
    travel = rms(way - mean)
    force, _, stiffness = units(joint)
    return (
        Number(name="stiffness", unit=stiffness, scale=often / travel, least=0.0),
        Number(name="torque", unit=force, scale=often * (1.0 + abs(mean) / travel), places=True),
    )


def _line(position: Real) -> tuple[Real, ...]:
    return position, np.ones_like(position)


def _stop(torques: Torques, row: int, joint: RobotJoint, side: float, pull: Number) -> list[Term]:
    way = side * torques.fast_position[row]
    variant = "above" if side > 0 else "below"

    def make(clearance: float) -> Term:
        def pressed() -> tuple[Real, ...]:
            return (torques.smooth(side * np.maximum(way - clearance, 0.0)),)

        return law(torques, row, "one_sided_stop", pressed, pull, variant=variant, rare=True)

    grid = np.quantile(side * torques.position[row], _STOPS)
    if np.any(np.diff(grid) <= 0):
        return []
    return formed(make, grid, name="clearance", unit=length(joint), count=2 * len(_STOPS))


def inertia(torques: Torques) -> Iterator[Term]:
    """Rotors."""
    for row, joint in torques.rows:
        number = Number(
            name="inertia", unit="kg m^2" if joint.kind == "hinge" else "kg", least=-joint.armature,
            nominal=joint.armature, scale=usual(torques, row) / rms(torques.acceleration[row]),
        )  # fmt: skip
        make = partial(at_row, torques, row, torques.acceleration[row])
        turning = partial(rotor_at, torques, row, 0, 1)
        yield Term(word="armature", site=joint.name, make=make, numbers=(number,), inertia=turning)


def ripple(torques: Torques) -> Iterator[Term]:
    """Torque that is periodic in the angle (cogging, gear mesh), of the periods that the rest holds most of."""
    for row, joint in torques.rows:
        periods, count = _periods(torques, row)
        position = torques.fast_position[row]
        number = partial(Number, unit=units(joint)[0], scale=usual(torques, row))

        def make(period: float, row: int = row, position: Real = position, number: partial[Number] = number) -> Term:
            def waves() -> tuple[Real, ...]:
                turns = 2.0 * np.pi / period * position
                return torques.smooth(np.sin(turns)), torques.smooth(np.cos(turns))

            return law(torques, row, "ripple", waves, number(name="sine"), number(name="cosine"), rare=True)

        way = float(np.ptp(torques.position[row]))
        for place, period in enumerate(periods):
            # Where one can be told from the next.
            near = 0.5 * period**2 / way
            form = Form(
                name="period", unit=length(joint), value=period, place=place, low=period - near, high=period + near,
                count=count, make=make,
            )  # fmt: skip
            yield form.term()


def _periods(torques: Torques, row: int) -> tuple[list[float], int]:
    """Periods whose waves hold most of the rest at a joint, and how many could be told apart."""
    q, rest = torques.position[row], torques.rest[row]
    way, speed = float(np.ptp(q)), rms(torques.velocity[row])
    lowest, highest = 2.0 * np.pi * _WAVES / way, 2.0 * np.pi * torques.cutoff_hz / speed
    if not lowest < highest:
        return [], 1
    waves = np.arange(lowest, highest, 2.0 * np.pi / way / _FINE)[: _MOST_WAVES * _FINE]
    # What moves with the joint as other words do is none.
    moves = torques.velocity[row], torques.acceleration[row], torques.sign[row], torques.wanted[row]
    smooth = [np.ones_like(q), q, q**2, q**3, *moves]
    there = torques.moving[row]
    basis, _ = np.linalg.qr(np.array(smooth)[:, there].T)
    turns = torques.waves(row, waves)[:, there]
    parts = np.stack([turns.real, turns.imag], axis=1)
    parts -= (parts @ basis) @ basis.T
    alone = rest[there] - basis @ (basis.T @ rest[there])
    right = parts @ alone
    gram = np.einsum("wpk,wqk->wpq", parts, parts) + 1e-9 * np.eye(2)
    held = np.einsum("wp,wp->w", right, np.linalg.solve(gram, right[..., None])[..., 0])
    inner = np.flatnonzero((held >= np.roll(held, 1)) & (held >= np.roll(held, -1)))
    best = inner[np.argsort(held[inner])[::-1][:_PEAKS]]
    return (2.0 * np.pi / waves[best]).tolist(), max(waves.size // _FINE, 1)
