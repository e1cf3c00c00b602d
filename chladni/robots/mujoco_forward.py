"""MuJoCo runs a machine from a log's poses with the log's commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.signal import lfilter

from chladni.robots.dynamics import inertial_numbers
from chladni.robots.floating_base import floating_base
from chladni.robots.joint_laws import Between, followed, further_laws, tooth_of
from chladni.robots.loading import made_of
from chladni.robots.machine import about_centre
from chladni.robots.mujoco_motion import gravity_of, inertia_rms

if TYPE_CHECKING:
    from chladni.robots.description import Description
    from chladni.robots.floating_base import BaseMotion
    from chladni.robots.machine import Machine, MachineJoint
    from chladni.signals.arrays import Index, Real

#: What joints without a place in the log are held by: the inertia of a house.
_HELD: Final = 1e6
_LONGEST_S: Final = 1e-3
_SHORTEST_S: Final = 1e-4
#: Phase that the stiffest servo's oscillation goes on by in a step.
_PHASE: Final = 0.3

#: Sum of squares of all speeds, rad^2/s^2, that no robot has.
_ASTRAY: Final = 1e8

Step = Callable[["Real", "Real"], None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Driven:
    """What drives the joints of a log, on a grid of steps.

    Attributes
    ----------
    asked
        ``[joint, step]``: command (or measured effort) as it arrives where each step begins, a mean over half a step
        before and after; of all runs, one after another.
    kind
        Of each joint: what is asked of it.
    position, velocity
        ``[joint, run]``: as the log reads them where each run starts.
    passed
        ``[2, joint, run]``: torque that moves the links where each run starts, and its rate; None at rest, where it's
        what the drives give.
    steps
        ``[run]``: how many each lasts, a multiple of `every`.
    every
        Steps from one sample that is given back to the next.
    step_s
        Of the simulation.
    base
        How a base that floats moves, at the steps of `asked`; None of one that is fixed.
    """

    asked: Real
    kind: tuple[str, ...]
    position: Real
    velocity: Real
    steps: Index
    every: int
    step_s: float
    base: BaseMotion | None = None
    passed: Real | None = None


def longest_step_s(machine: Machine, names: Sequence[str]) -> float:
    """Give the step at which no servo of these joints turns stiff, at most a millisecond."""
    model = model_of(machine, names)
    inertia = np.diag(inertia_rms(model, np.asarray(model.qpos0, dtype=np.float64)[:, None]))
    found = _LONGEST_S
    for one in _chosen(machine, names):
        stiffness = one.gains()[0] + one.stiffness + sum(each.stiffness for each in one.stops)
        stiffness += sum(each.stiffness_at(one.joint.name) for each in machine.couplings)
        own = float(inertia[one.joint.dof])
        if one.transmission is not None:
            stiffness, own = max(stiffness, tooth_of(one.transmission, own)), min(own, one.transmission.inertia)
        if stiffness > 0:
            found = min(found, _PHASE * float(np.sqrt(own / stiffness)))
    return max(found, _SHORTEST_S)


def model_of(machine: Machine, names: Sequence[str]) -> Any:
    """Give MuJoCo's model of a machine without its drives; joints that aren't named are held where they are."""
    import mujoco

    model = _coupled(machine) if machine.couplings else copy(machine.robot.model)
    flags = mujoco.mjtDisableBit
    # What drives the joints comes from the log. Shapes of descriptions often overlap, and logs go beyond their stops.
    for name in ("ACTUATION", "CONTACT", "LIMIT", "AUTORESET"):
        # Some versions can't be told not to begin anew.
        model.opt.disableflags |= int(getattr(flags, f"mjDSBL_{name}", 0))
    model.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
    _set_inertials(model, machine)
    follow = {one.name for one in machine.robot.joints if one.follows in names}
    held = np.ones(model.nv, dtype=bool)
    for one in machine.joints:
        dof = one.joint.dof
        _damping(model)[dof] = one.damping
        model.dof_frictionloss[dof] = one.friction
        model.dof_armature[dof] += one.armature - one.joint.armature
        held[dof] = one.joint.name not in names and one.joint.name not in follow
        if one.stiffness or one.torque:
            _set_spring(model, one)
    model.dof_armature[held] += _HELD
    # A base that floats is carried by what it feels, gravity included.
    model.opt.gravity[:] = gravity_of(model, machine.tilt) if machine.robot.base == "fixed" else 0.0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _coupled(machine: Machine) -> Any:
    """Compile the description anew with tendons, which rub and pull as gears and cables of two joints do."""
    import mujoco

    def compiled(found: Description) -> Any:
        spec = mujoco.MjSpec.from_string(found.xml)
        for each in machine.couplings:
            tendon = spec.add_tendon()
            for joint, share in zip(each.joints, (1.0, each.ratio), strict=True):
                tendon.wrap_joint(joint, share)
            tendon.frictionloss = each.friction
            tendon.damping = _linear(tendon.damping, each.damping)
            if each.stiffness:
                tendon.stiffness = _linear(tendon.stiffness, each.stiffness)
                tendon.springlength = [each.rest, each.rest]
        return spec.compile()

    robot = machine.robot
    return made_of(robot.description, None if robot.robot_file is None else robot.base, compiled, meshes=False)


def _linear(before: Any, number: float) -> Any:
    """Give a coefficient as this version has it: some have those of higher order beside it."""
    size = np.size(before)
    return [number, *np.zeros(size - 1)] if size > 1 else number


def _set_inertials(model: Any, machine: Machine) -> None:
    import mujoco

    as_described = inertial_numbers(machine.robot)
    for link, (numbers, old) in enumerate(zip(machine.inertial, as_described, strict=True), start=1):
        if numbers[0] <= 0 or np.allclose(numbers, old, rtol=1e-12, atol=0.0):
            continue
        mass, centre, inertia = about_centre(numbers)
        moments, axes = np.linalg.eigh(inertia)
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        model.body_mass[link], model.body_ipos[link] = mass, centre
        model.body_inertia[link] = np.maximum(moments, 0.0)
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, axes.ravel())
        model.body_iquat[link] = quaternion
        # What MuJoCo saves itself where frames agree and inertias are constant no longer holds.
        model.body_sameframe[link] = model.body_simple[link] = 0
        first = model.body_dofadr[link]
        model.dof_simplenum[: first + model.body_dofnum[link]] = 0


def _set_spring(model: Any, one: MachineJoint) -> None:
    """Join a spring and a constant with the description's spring, as far as they pull."""
    joint, place = model.dof_jntid[one.joint.dof], one.joint.position
    own = float(np.ravel(model.jnt_stiffness[joint])[0])
    pull = own * float(model.qpos_spring[place]) - one.torque
    stiffness = own + one.stiffness
    if stiffness > 0:
        model.jnt_stiffness[joint] = stiffness
        model.qpos_spring[place] = pull / stiffness


def run(machine: Machine, names: Sequence[str], driven: Driven) -> Real:
    """Give ``[joint, sample]``: what the log would read, run after run; infinite from where a run goes astray."""
    import mujoco

    # What goes astray is told by the result: MuJoCo would warn in a file of the working directory.
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _: None)
    try:
        return _Run(machine, names, driven).readings()
    finally:
        mujoco.set_mju_user_warning(before)


class _Run:
    def __init__(self, machine: Machine, names: Sequence[str], driven: Driven) -> None:
        import mujoco

        self._mujoco, self._driven = mujoco, driven
        self._joints = _chosen(machine, names)
        self._model = model_of(machine, names)
        self._model.opt.timestep = driven.step_s
        self._data = mujoco.MjData(self._model)
        self._places = _slice([one.joint.position for one in self._joints])
        self._dofs = _slice([one.joint.dof for one in self._joints])
        self._between = Between.of(self._joints, self._inertia(), driven.step_s)
        self._set_drives()
        self._laws = [*self._friction_laws(), *self._pulls(), *further_laws(self._joints, self._data, self._dofs)]
        self._base = floating_base(machine.robot)

    def _row(self, name: str) -> Real:
        return np.array([getattr(one, name) for one in self._joints], dtype=np.float64)

    def _set_drives(self) -> None:
        kind = np.array(self._driven.kind)
        kp, kd, limit = np.array([one.gains() for one in self._joints]).T
        positions, velocities = kind == "position", kind == "velocity"
        asked = self._driven.asked - (positions * (self._row("reading") + self._row("drive_reading")))[:, None]
        factor = np.where(positions, kp, np.where(velocities, kd, self._row("gain")))
        self._forward = factor[:, None] * self._filtered(asked)
        self._kp, self._kd = kp * positions, kd * (positions | velocities)
        self._limit, self._lag_s = limit, self._row("lag_s")
        # A step's torque is that at its begin: half of the damping is implicit, as by the trapezoidal rule, and more
        # where that is too stiff. What a limit or a lag takes from it is given back.
        stiff = self._kd - self._inertia() / self._driven.step_s
        implicit = np.maximum(0.5 * self._kd, stiff)
        self._implicit = np.where((self._lag_s > 0) | self._between.soft, 0.0, implicit)
        _damping(self._model)[self._dofs] += self._implicit

    def _filtered(self, asked: Real) -> Real:
        """Follow commands as drives do that filter them, from rest at the first command of a run."""
        found = asked.copy()
        for row, one in enumerate(self._joints):
            if np.isfinite(one.rate) and self._driven.kind[row] == "position":
                for run in self._spans():
                    found[row, run] = followed(asked[row, run], one.rate * self._driven.step_s)
            if one.servo is not None and one.servo.lag_s > 0:
                share = -np.expm1(-self._driven.step_s / one.servo.lag_s)
                for run in self._spans():
                    start = [(1.0 - share) * found[row, run.start]]
                    found[row, run] = lfilter([share], [1.0, share - 1.0], found[row, run], zi=start)[0]
        return found

    def _spans(self) -> list[slice]:
        edges = np.concatenate([[0], np.cumsum(self._driven.steps)]).tolist()
        return [slice(a, b) for a, b in pairwise(edges)]

    # --- laws that MuJoCo hasn't got, step by step ---

    def _friction_laws(self) -> list[Step]:
        load, rise = self._row("load"), self._row("rise")
        uneven = [(row, one.uneven) for row, one in enumerate(self._joints) if one.uneven is not None]
        if not load.any() and not rise.any() and not uneven:
            return []
        model, data, dofs = self._model, self._data, self._dofs
        friction, fading, kd = self._row("friction"), self._row("fading"), self._implicit

        def law(position: Real, speed: Real) -> None:
            carried = np.abs(data.qfrc_applied[dofs] + data.qfrc_constraint[dofs] - kd * speed)
            found = friction + load * carried + rise * np.exp(-((speed / fading) ** 2))
            for row, one in uneven:
                found[row] += np.interp(position[row], one.places, one.beyond)
            model.dof_frictionloss[dofs] = np.maximum(found, 0.0)

        return [law]

    def _pulls(self) -> list[Step]:
        """Laws that resist by a torque: of the square of the speed, and constants that no spring gives."""
        quadratic = self._row("quadratic")
        stiffness = np.ravel(self._model.jnt_stiffness.reshape(self._model.njnt, -1)[:, 0])
        sprung = np.array([stiffness[self._model.dof_jntid[one.joint.dof]] > 0 for one in self._joints])
        constant = np.where(sprung, 0.0, self._row("torque"))
        if not quadratic.any() and not constant.any():
            return []
        applied, dofs = self._data.qfrc_applied, self._dofs

        def law(_: Real, speed: Real) -> None:
            applied[dofs] -= quadratic * speed * np.abs(speed) + constant

        return [law]

    # --- runs ---

    def readings(self) -> Real:
        """Run all."""
        driven, found = self._driven, []
        for place, span in enumerate(self._spans()):
            self._start(place, self._forward[:, span.start])
            path = self._path(span)[:: driven.every]
            path[np.logical_or.accumulate(~np.isfinite(path).all(axis=1))] = np.inf
            found.append(path)
        return np.concatenate(found).T + self._row("reading")[:, None]

    def _inertia(self) -> Real:
        diagonal = np.diag(inertia_rms(self._model, np.asarray(self._model.qpos0, dtype=np.float64)[:, None]))
        return diagonal[[one.joint.dof for one in self._joints]]

    def _start(self, place: int, ahead: Real) -> None:
        self._mujoco.mj_resetData(self._model, self._data)
        driven = self._driven
        truth = driven.position[:, place] - self._row("reading")
        torque = ahead - self._kp * truth
        passed, rate = (torque, 0.0 * torque) if driven.passed is None else driven.passed[..., place]
        link, speed = self._between.start(truth, driven.velocity[:, place], torque, self._kp, passed, rate)
        self._data.qpos[self._places], self._data.qvel[self._dofs] = link, speed

    def _path(self, span: slice) -> Real:
        """Step through a run; ``[step, joint]``, NaN from where it goes astray."""
        data, model, step = self._data, self._model, self._mujoco.mj_step
        qpos, qvel, applied = data.qpos, data.qvel, data.qfrc_applied
        places, dofs, kp, laws, between = self._places, self._dofs, self._kp, self._laws, self._between
        ahead = np.ascontiguousarray(self._forward[:, span].T)
        path = np.full_like(ahead, np.nan)
        bound, carry, is_soft = self._bound(), self._carried(span), between.any
        for place in range(len(ahead)):
            if carry is not None:
                carry(place)
            position, velocity = qpos[places], qvel[dofs]
            if is_soft:
                path[place] = between.logged(position)
                turned, turning = between.motor(position, velocity)
                torque = bound(ahead[place] - kp * turned, turning)
                applied[dofs] = between.passed(torque, position, velocity)
            else:
                path[place] = position
                applied[dofs] = bound(ahead[place] - kp * position, velocity)
            for law in laws:
                law(position, velocity)
            step(model, data)
            # What isn't finite, or turns faster than any joint, went astray: further steps would only warn.
            if not abs(float(qvel @ qvel)) < _ASTRAY or data.time < place * self._driven.step_s:
                break
        return path

    def _carried(self, span: slice) -> Callable[[int], None] | None:
        """Give what makes a base that floats feel at each step what it felt: it's as heavy as what holds it."""
        base, moved = self._base, self._driven.base
        if base is None or moved is None:
            return None
        turn, data = self._mujoco.mju_rotVecQuat, self._data
        quaternion, speed, push = (
            data.qpos[base.position + 3 : base.position + 7],
            data.qvel[base.dof : base.dof + 6],
            data.qfrc_applied[base.dof : base.dof + 6],
        )
        quaternion[:] = (1.0, 0.0, 0.0, 0.0)
        force, spin = (np.ascontiguousarray(one[:, span].T) for one in (moved.force, moved.angular_acceleration))
        turning, felt = np.ascontiguousarray(moved.angular_velocity[:, span].T), np.zeros(3)

        def carry(place: int) -> None:
            turn(felt, force[place], quaternion)
            # Uniform motion is not felt.
            speed[:3], speed[3:] = 0.0, turning[place]
            push[:3], push[3:] = _HELD * felt, _HELD * spin[place]

        return carry

    def _bound(self) -> Callable[[Real, Real], Real]:
        """Give what limits and lags make of a torque whose damping is implicit."""
        limit, kd, implicit, lag_s = self._limit, self._kd, self._implicit, self._lag_s
        dead = self._row("dead") * self._row("gain")
        limited, lagging = bool(np.isfinite(limit).any() or dead.any()), bool((lag_s > 0).any())
        if not limited and not lagging:
            explicit = kd - implicit
            return (
                (lambda torque, velocity: torque - explicit * velocity)
                if explicit.any()
                else lambda torque, _: torque
            )
        share = np.where(lag_s > 0, -np.expm1(-self._driven.step_s / np.maximum(lag_s, 1e-9)), 1.0)
        state: Real | None = None

        def bounded(torque: Real, velocity: Real) -> Real:
            nonlocal state
            asked = torque - kd * velocity
            given = np.minimum(np.maximum(asked - np.clip(asked, -dead, dead), -limit), limit)
            if lagging:
                state = given if state is None else state + share * (given - state)
                given = state
            return np.asarray(given + implicit * velocity)

        return bounded


def _damping(model: Any) -> Any:
    """Linear coefficients of all degrees of freedom, which some versions keep beside those of higher order."""
    return model.dof_damping.reshape(model.nv, -1)[:, 0]


def _chosen(machine: Machine, names: Sequence[str]) -> list[MachineJoint]:
    by_name = {one.joint.name: one for one in machine.joints}
    return [by_name[name] for name in names]


def _slice(places: Sequence[int]) -> Any:
    """Places as a slice where they follow one another: views are faster."""
    first = places[0]
    return (
        slice(first, first + len(places)) if list(places) == list(range(first, first + len(places))) else list(places)
    )
