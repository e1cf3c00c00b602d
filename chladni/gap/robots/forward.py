"""The machine that a fit says a description stands for, and its runs from the log's poses by its commands."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.joint_words import ALONG_THE_WAY, way_of
from chladni.gap.robots.term import Term
from chladni.gap.robots.tolerances import INERTIAL_NAMES, LOOP_S, tolerated_inertia
from chladni.gap.robots.torques import ALL_COMMANDS, Torques
from chladni.gap.robots.transmission_words import AT_MOTOR, LEAST_ROTOR
from chladni.robots.dynamics import inertial_numbers
from chladni.robots.floating_base import BaseMotion
from chladni.robots.machine import (
    Coupling,
    Loop,
    Machine,
    MachineJoint,
    Ripple,
    Stop,
    Transmission,
    Uneven,
    as_described,
    physical,
)
from chladni.signals.arrays import Real

_ROUNDING = 1e-6
#: Standard deviations of a tolerance that a value may stand aside.
_INSIDE = 3.0
_ANGLES = ("gravity_tilt", "misalignment")


def machine_of(contest: Contest, fit: Fit) -> Machine:
    """Give the machine that a fit says the description stands for, as far as it holds together as one.

    Numbers within their tolerances are set, too; inertias only as far as a body can have them.
    """
    return _Reading(contest, fit).machine()


class _Reading:
    """Reads a machine off the numbers of a fit."""

    def __init__(self, contest: Contest, fit: Fit) -> None:
        self._torques, self._fit, self._contest = contest.torques, fit, contest
        self._robot = contest.torques.robot
        described = as_described(self._robot)
        self._described = {one.joint.name: one for one in described.joints}
        self._joints = dict(self._described)
        self._terms = [(term, fit.values(place)[0]) for place, term in enumerate(fit.terms)]
        # What stands farther aside is no tolerance any more.
        within = contest.tolerances(fit)
        self._within = {name: float(np.clip(value, -_INSIDE, _INSIDE)) for name, (value, _) in within.items()}

    def machine(self) -> Machine:
        for name in self._torques.log.joints:
            self._set_within(name)
        self._set_delays()
        for term, values in self._terms:
            law = _LAWS.get(term.word)
            if law is not None and term.site in self._joints:
                self._joints[term.site] = law(self._joints[term.site], term, values, self._torques)
        for name in self._torques.log.joints:
            self._set_drive(name)
        found = {term.word: values.tolist() for term, values in self._terms if term.word in _ANGLES}
        about_x, about_y = found.get("gravity_tilt", (0.0, 0.0))
        turned_x, turned_y, turned_z = found.get("misalignment", (0.0, 0.0, 0.0))
        return Machine(
            robot=self._robot,
            joints=tuple(self._joints[one.name] for one in self._robot.joints),
            inertial=self._inertial(),
            tilt=(about_x, about_y),
            couplings=tuple(self._couplings()),
            imu_turned=(turned_x, turned_y, turned_z),
        )

    def _set_within(self, name: str) -> None:
        """Set friction and armature within their tolerances."""
        one, tolerance = self._joints[name], self._robot.tolerance
        armature = one.armature * (1.0 + tolerance.inertia * self._within.get(f"{name}.armature", 0.0))
        friction = one.friction + tolerance.friction * self._within.get(f"{name}.friction", 0.0)
        self._joints[name] = replace(one, armature=armature, friction=friction)

    def _set_delays(self) -> None:
        late = {term.site: float(values[0]) for term, values in self._terms if term.word == "delay"}
        common = self._robot.delay_s + LOOP_S * self._within.get("turn", 0.0)
        if ALL_COMMANDS in late:
            common = self._contest.delay_of_all(self._fit)[0]
        for name in self._torques.log.joints:
            delay_s = max(common + late.get(name, 0.0), 0.0)
            self._joints[name] = replace(self._joints[name], delay_s=delay_s)

    def _set_drive(self, name: str) -> None:
        """Set the gains; what was found in units of torque that was asked, give in units of torque that arrives."""
        one, described = self._joints[name], self._described[name]
        found = {term.word: values for term, values in self._terms if term.site == name}
        torques, row = self._torques, self._torques.log.joints.index(name)
        over_kp, kd_over_kp = found.get("controller_gain", np.array([1.0, 0.0])).tolist()
        gain = 1.0 / float(found["gain_error"][0]) if "gain_error" in found else 1.0
        kp, kd = torques.gains(
            row, (self._within.get(f"{name}.kp", 0.0), self._within.get(f"{name}.kd", 0.0)), over_kp, kd_over_kp
        )
        share = (gain if torques.in_asked("gain_error") else 1.0) * (
            kp / float(torques.kp[row]) if torques.kp[row] and torques.in_asked("controller_gain") else 1.0
        )
        one = replace(
            one,
            gain=gain,
            friction=max(_towards(described.friction, one.friction, share), 0.0),
            damping=max(_towards(described.damping, one.damping, share), 0.0),
            armature=max(_towards(described.armature, one.armature, share), 0.0),
        ).with_share(share)
        if one.servo is not None and (one.servo.kp or one.servo.kd):
            # What is read late by a part of the loop's period takes from the damping.
            kd -= kp * LOOP_S * self._within.get("loop", 0.0)
            one = replace(one, servo=replace(one.servo, kp=None if one.servo.kp is None else kp, kd=kd))
        self._joints[name] = one

    def _inertial(self) -> Real:
        """``[link, 10]``: first what bodies can have for certain, then within tolerances as far as they can."""
        found = inertial_numbers(self._robot)
        spread = tolerated_inertia(self._robot)
        for link, name in enumerate(self._robot.links):
            own = found[link].copy()
            for term, values in self._terms:
                if term.word == "parameter" and term.site == f"{name}.mass":
                    own *= max(1.0 + float(values[0]), 0.0)
                if term.word == "payload" and term.site == name and values[0] > 0:
                    own += _carried(values)
            change = np.array([self._within.get(f"{name}.{each}", 0.0) for each in INERTIAL_NAMES]) @ spread[link]
            found[link] = physical(own, own + change) if own[0] > 0 else own
        return found

    def _couplings(self) -> Iterator[Coupling]:
        for term, values in self._terms:
            if term.ratio is None:
                continue
            one, _, other = term.site.partition("~")
            numbers = dict(zip(_COUPLED[term.word], values.tolist(), strict=True))
            yield Coupling(joints=(one, other), ratio=term.ratio, **numbers)


def _towards(described: float, found: float, share: float) -> float:
    return described + share * (found - described)


def _carried(values: Real) -> Real:
    """Numbers of a mass with a first moment, and an inertia of its own about any axis."""
    mass, moment = float(values[0]), values[1:4]
    inertia = (moment @ moment * np.eye(3) - np.outer(moment, moment)) / mass + max(float(values[4]), 0.0) * np.eye(3)
    return np.concatenate([values[:4], inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])


#: Of what two joints share: where the numbers of a word go.
_COUPLED = {
    "coulomb_friction": ("friction",),
    "viscous_friction": ("damping",),
    "joint_spring": ("stiffness", "torque"),
}

Law = Callable[[MachineJoint, Term, Real, Torques], MachineJoint]


def _coulomb(one: MachineJoint, term: Term, values: Real, torques: Torques) -> MachineJoint:
    midway = float(values[0])
    if term.variant != ALONG_THE_WAY:
        return replace(one, friction=midway)
    places = way_of(torques, torques.log.joints.index(term.site))
    beyond = (float(values[1]) - midway, 0.0, float(values[2]) - midway)
    return replace(one, friction=midway, uneven=Uneven(places=places, beyond=beyond))


def _stribeck(one: MachineJoint, term: Term, values: Real, _: Torques) -> MachineJoint:
    return replace(one, friction=float(values[0]), rise=float(values[1]), fading=term.form_value)


def _saturation(one: MachineJoint, term: Term, _values: Real, _torques: Torques) -> MachineJoint:
    return one if one.servo is None else replace(one, servo=replace(one.servo, limit=term.form_value))


def _hysteresis(one: MachineJoint, term: Term, values: Real, _: Torques) -> MachineJoint:
    return replace(one, loop=Loop(force=float(values[0]), yields=term.form_value))


def _ripple(one: MachineJoint, term: Term, values: Real, _: Torques) -> MachineJoint:
    return replace(one, ripple=Ripple(sine=float(values[0]), cosine=float(values[1]), period=term.form_value))


def _stop(one: MachineJoint, term: Term, values: Real, _: Torques) -> MachineJoint:
    side = 1.0 if term.variant == "above" else -1.0
    stop = Stop(stiffness=float(values[0]), clearance=term.form_value, side=side)
    return replace(one, stops=(*one.stops, stop))


def _transmission(one: MachineJoint, term: Term, values: Real, torques: Torques) -> MachineJoint:
    found = {number.name: float(value) for number, value in zip(term.numbers, values, strict=True)}
    if term.form is not None:
        found[term.form.name] = term.form.value
    # The described rotor stays where it is.
    rotor = max(found["inertia"] - one.joint.armature, 0.0)
    first = "gap" if term.word == "backlash" else "compliance"
    # Where the log has efforts its product with the rotor is told.
    gives = found[first] if first in found else found["both"] / rotor if rotor else 0.0
    # A motor without a rotor can't be run.
    rotor = max(rotor, LEAST_ROTOR * float(torques.usual_inertia[torques.log.joints.index(one.joint.name)]))
    yields = max(found.get("compliance", 0.0) if first == "gap" else gives, 0.0)
    made = Transmission(
        stiffness=1.0 / yields if yields else np.inf, gap=max(gives, 0.0) if first == "gap" else 0.0, inertia=rotor,
        logs_motor=term.variant == AT_MOTOR,
    )  # fmt: skip
    return replace(one, transmission=made)


def _offset(one: MachineJoint, term: Term, values: Real, _torques: Torques) -> MachineJoint:
    if term.variant == "of the drive":
        return replace(one, drive_reading=float(values[0]))
    return replace(one, reading=float(values[0]))


_LAWS: Mapping[str, Law] = {
    "coulomb_friction": _coulomb,
    "viscous_friction": lambda one, _term, values, _: replace(one, damping=float(values[0])),
    "quadratic_damping": lambda one, _term, values, _: replace(one, quadratic=float(values[0])),
    "load_friction": lambda one, _term, values, _: replace(one, friction=float(values[0]), load=float(values[1])),
    "stribeck_friction": _stribeck,
    "joint_spring": lambda one, _term, values, _: replace(one, stiffness=float(values[0]), torque=float(values[1])),
    "armature": lambda one, _term, values, _: replace(one, armature=float(values[0])),
    "lag": lambda one, _term, values, _: replace(one, lag_s=max(float(values[0]), 0.0)),
    "saturation": _saturation,
    "dead_zone": lambda one, term, _values, _: replace(one, dead=term.form_value),
    "rate_limit": lambda one, term, _values, _: replace(one, rate=term.form_value),
    "hysteresis": _hysteresis,
    "ripple": _ripple,
    "one_sided_stop": _stop,
    "joint_elasticity": _transmission,
    "backlash": _transmission,
    "encoder_offset": _offset,
}


def simulated(machine: Machine, torques: Torques, runs: list[tuple[int, int]]) -> Real:
    """Give ``[joint, sample]``: what the log would read of a machine, run between samples from the log's poses.

    NaN where no run is, and between samples that are nearer to one another than the step; infinite where a run went
    astray.
    """
    from chladni.robots.mujoco_forward import Driven, longest_step_s, run

    log, names = torques.log, torques.log.joints
    interval_s, longest_s = 1.0 / log.sample_rate_hz, longest_step_s(machine, names)
    # A step divides a sample, or takes several.
    every, skip = (
        max(int(np.ceil(interval_s / longest_s - _ROUNDING)), 1),
        max(int(longest_s / interval_s + _ROUNDING), 1),
    )
    step_s = interval_s * skip / every
    samples = [np.arange(a, b, skip) for a, b in runs]
    at_s = [log.time_s[a] + step_s * np.arange(one.size * every) for (a, _), one in zip(runs, samples, strict=True)]
    starts = [a for a, _ in runs]
    driven = Driven(
        asked=_asked(machine, torques, np.concatenate(at_s), step_s), kind=_kinds(torques), every=every,
        step_s=step_s,
        position=torques.fast_position[:, starts], velocity=torques.fast_velocity[:, starts],
        steps=np.array([one.size for one in at_s]), base=_base(machine, torques, np.concatenate(at_s)),
        passed=torques.passed_at(log.time_s[starts]),
    )  # fmt: skip
    found = np.full_like(log.position, np.nan)
    found[:, np.concatenate(samples)] = run(machine, names, driven)
    return found


def by_effort(torques: Torques) -> bool:
    """Whether runs are driven by efforts: where loops are known they hold the joints near where they were."""
    return torques.by_effort and not (torques.two_sided and bool(np.all(np.isfinite(torques.by_row("kp")))))


def _base(machine: Machine, torques: Torques, at_s: Real) -> BaseMotion | None:
    """How a base that floats moves, as fast as joints are followed."""
    moved = torques.base_motion(torques.fast_hz, machine.imu_turned)
    if moved is None:
        return None

    def at(rows: Real) -> Real:
        return np.array([np.interp(at_s, torques.log.time_s, row) for row in rows])

    return BaseMotion(
        force=at(moved.force), angular_velocity=at(moved.angular_velocity),
        angular_acceleration=at(moved.angular_acceleration),
    )  # fmt: skip


def _kinds(torques: Torques) -> tuple[str, ...]:
    kind = "effort" if by_effort(torques) else torques.log.command_kind or "effort"
    return (kind,) * len(torques.log.joints)


def _asked(machine: Machine, torques: Torques, at_s: Real, step_s: float) -> Real:
    """``[joint, step]``: commands as they arrive, held, over half a step before and after; or measured efforts."""
    log = torques.log
    if by_effort(torques):
        return np.array([np.interp(at_s, log.time_s, row) for row in torques.unlimited])
    late = {one.joint.name: one.delay_s for one in machine.joints}
    found = np.zeros((len(log.joints), at_s.size))
    for row, (name, (starts, values)) in enumerate(zip(log.joints, log.command_messages or (), strict=True)):
        for aside in (-0.25, 0.25):
            place = np.searchsorted(starts, at_s + aside * step_s - late[name], side="right") - 1
            found[row] += 0.5 * values[np.maximum(place, 0)]
    return found
