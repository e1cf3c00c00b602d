"""Exciting trajectories: motions inside a robot's limits that tell its inertias and friction apart."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from pathlib import Path
from typing import Final

import numpy as np
from scipy.linalg import qr
from scipy.optimize import NonlinearConstraint, minimize
from scipy.special import logsumexp, softmax

from chladni.robots.dynamics import motion_torque, needed_torque
from chladni.robots.loading import load_robot
from chladni.robots.motion_limits import UNIT, MotionLimits, Shares, effort_limit, motion_limits, moved_joints
from chladni.robots.robot import Robot, RobotJoint
from chladni.robots.trajectory import FourierSeries, JointUse, Trajectory
from chladni.signals.arrays import Index, Real
from chladni.signals.errors import ModelError, SetupError
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.renamed import renamed

#: Samples of a period over its harmonics: while a motion is sought, and where its limits are kept.
_COARSE, _FINE = 8, 64
#: Random motions, which scale the columns and of which the best is where the search begins.
_RANDOM = 16
_STEPS = 60
#: Of the largest speed: below it dry friction isn't taken for constant.
_SLOW = 0.05
#: Over that of the largest column after pivoting: parameters that no motion tells.
_RANK = 1e-7
#: How closely the smooth maximum that bounds the search follows the true one.
_SHARP = 50.0
_STEP = 1e-6
#: Kept away from limits: what lies between the samples of the fine grid (Ehlich & Zeller 1964: 1 - cos(pi/64)).
_BETWEEN = 1.5e-3
HARMONICS: Final = 5
_MOST_HARMONICS, _MOST_SAMPLES = 20, 1_000_000
#: A period of ten seconds is usual (Swevers et al. 1997).
_USUAL_HZ = 0.1

UNCHECKED: Final = (
    "collisions, with itself and with what is around, aren't checked: try it in a simulation, then slowly"
)


@renamed(length_s="duration_s", rate_hz="sample_rate_hz")
@in_one_thread()
def excite(
    robot: Robot | Path | str,
    *,
    duration_s: float = 10.0,
    sample_rate_hz: float = 250.0,
    harmonics: int = HARMONICS,
    base_frequency_hz: float | None = None,
    joints: Iterable[str] = (),
    pose: Mapping[str, float] | None = None,
    travel: float = 0.9,
    speed: float = 0.5,
    torque: float = 0.8,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Make a motion inside a robot's limits that tells its inertias, friction and armatures apart.

    Finite Fourier series (Swevers et al. 1997) that start and end at rest in one pose. They're optimised for the
    condition number of the regressor of base parameters (Gautier & Khalil 1992): inertial parameters of all links,
    Coulomb and viscous friction and armature of each joint that moves. Its Frobenius norm is what is minimised, which
    is smooth (docs/methods/robots.md).

    Parameters
    ----------
    robot
        Loaded, or its file: MJCF, URDF or robot file.
    duration_s
        Whole periods.
    sample_rate_hz
        Samples a second.
    harmonics
        2 to 20.
    base_frequency_hz
        One over the period; by default whole periods of about ten seconds fill the length.
    joints
        Names or patterns such as ``wrist_*``; all by default. The others rest.
    pose
        Start by joint, rad (m); the middle of its range for a joint that isn't named.
    travel, speed, torque
        Shares of the way to the stops, of the limits of velocity and of effort that are used, above 0, at most 1.
    seed
        Of the motions that the search begins with: the same gives the same.
    progress
        Called with the share done, 0 to 1.

    Returns
    -------
    Trajectory
        Positions, velocities, accelerations, torques, and what they use of the limits.

    Raises
    ------
    SetupError
        When a joint doesn't exist, or a number makes no sense.
    ModelError
        When the base floats, a slide has no stops, or the start pose takes all the torque.

    Examples
    --------
    >>> motion = excite("arm.urdf", joints=["elbow"], speed=0.2)  # doctest: +SKIP
    >>> motion.condition < motion.random_condition  # doctest: +SKIP
    True
    """
    chosen = robot if isinstance(robot, Robot) else load_robot(robot, meshes=False)
    series = _series(duration_s, sample_rate_hz, harmonics, base_frequency_hz)
    shares = Shares(travel=travel, speed=speed, torque=torque)
    search, told = _begun(chosen, series, tuple(joints), pose or {}, shares)
    starts = search.random(np.random.default_rng(seed), _RANDOM)
    judge = _Judge.of([search.seen(one) for one in starts])
    found = search.optimised(judge, starts, progress or (lambda _: None))
    random = float(np.median([judge.condition(search.seen(one)) for one in starts]))
    condition = judge.condition(search.seen(found, fine=True))
    samples = round(duration_s * sample_rate_hz) + 1
    return replace(
        search.trajectory(found, sample_rate_hz, samples), condition=condition, random_condition=random,
        parameters=int(judge.base.size), remarks=(*told, UNCHECKED),
    )  # fmt: skip


def random_motion(
    robot: Robot, *, length_s: float, rate_hz: float, joints: Iterable[str], pose: Mapping[str, float], shares: Shares
) -> Trajectory:
    """Give a motion as `excite` begins with, in no time, without condition numbers; arguments and errors as there."""
    search, _ = _begun(robot, _series(length_s, rate_hz, HARMONICS, None), tuple(joints), pose, shares)
    (motion,) = search.random(np.random.default_rng(0), 1)
    return search.trajectory(motion, rate_hz, round(length_s * rate_hz) + 1)


def _begun(
    robot: Robot, series: FourierSeries, joints: tuple[str, ...], pose: Mapping[str, float], shares: Shares
) -> "tuple[_Search, tuple[str, ...]]":
    """Give motions of the joints that were asked for, and sentences on what isn't known."""
    if robot.base == "floating":
        raise ModelError(
            f"{robot.name}: its base floats, and joints move it; fix it in the description (leave out its free "
            "joint) and hang the robot up"
        )
    moved, told = moved_joints(robot, joints)
    limits = motion_limits(robot, moved, pose, shares)
    return _Search(robot, moved, limits, series), (*told, *limits.remarks)


def _series(length_s: float, rate_hz: float, harmonics: int, base_hz: float | None) -> FourierSeries:
    for what, value in (("length", length_s), ("rate", rate_hz), ("base frequency", base_hz or _USUAL_HZ)):
        if not 0.0 < value < inf:
            raise SetupError(f"{what} is {value:g}; must be above 0")
    if not 2 <= harmonics <= _MOST_HARMONICS:
        raise SetupError(f"{harmonics} harmonics; two at least start at rest, and {_MOST_HARMONICS} are the most")
    if length_s * rate_hz > _MOST_SAMPLES:
        raise SetupError(
            f"{length_s:g} s at {rate_hz:g} Hz are more than {_MOST_SAMPLES} samples; repeat a shorter one"
        )
    base = max(round(length_s * _USUAL_HZ), 1) / length_s if base_hz is None else base_hz
    periods = round(length_s * base)
    if periods < 1 or abs(length_s * base - periods) > 1e-6 * periods:
        raise SetupError(
            f"{length_s:g} s are {length_s * base:.4g} periods of {base:g} Hz and must be whole ones; give a length "
            f"of {max(periods, 1) / base:g} s"
        )
    if harmonics * base >= rate_hz / 2.0:
        raise SetupError(
            f"{harmonics} harmonics of {base:g} Hz need a rate above {2.0 * harmonics * base:g} Hz, not {rate_hz:g}"
        )
    return FourierSeries(harmonics=harmonics, base_frequency_hz=base)


@dataclass(frozen=True, slots=True)
class _Seen:
    """``[sample, moved, column]`` of the regressor and ``[dof, sample]`` of the torque along a motion."""

    columns: Real
    torque: Real


@dataclass(frozen=True, slots=True)
class _Judge:
    """Condition number of base parameters; columns and rows are scaled by what random motions make of them.

    Attributes
    ----------
    base
        ``[base]`` columns that span all others.
    column, row
        ``[base]``, ``[moved]`` that they're divided by.
    """

    base: Index
    column: Real
    row: Real

    @classmethod
    def of(cls, seen: Sequence[_Seen]) -> "_Judge":
        """Find base parameters by a pivoted QR of what random motions see (Gautier 1991)."""
        columns = np.concatenate([one.columns for one in seen])
        # What any motion of the joints moves counts in units of what these need.
        row = np.sqrt(np.mean(np.sum(columns**2, axis=2), axis=0)) + 1e-300
        whole = (columns / row[:, None]).reshape(-1, columns.shape[2])
        size = np.linalg.norm(whole, axis=0) / np.sqrt(whole.shape[0])
        there = np.flatnonzero(size > _RANK * np.max(size))
        triangle, order = qr(whole[:, there] / size[there], mode="r", pivoting=True)
        diagonal = np.abs(np.diag(triangle))
        base = np.sort(there[order[: np.count_nonzero(diagonal > _RANK * diagonal[0])]])
        return cls(base, size[base], row)

    def scaled(self, seen: _Seen) -> Real:
        """Give ``[sample, moved, base]``."""
        return seen.columns[..., self.base] / self.column / self.row[:, None]

    def condition(self, seen: _Seen) -> float:
        """Of the 2-norm."""
        return float(np.linalg.cond(self.scaled(seen).reshape(-1, self.base.size)))

    def logarithm(self, seen: _Seen) -> tuple[float, Real]:
        """Give log(||W||_F ||W^+||_F), and its slope by W ``[sample, moved, base]``."""
        columns = self.scaled(seen)
        u, s, v = np.linalg.svd(columns.reshape(-1, self.base.size), full_matrices=False)
        s = np.maximum(s, 1e-12 * s[0])
        power, inverse = float(np.sum(s**2)), float(np.sum(s**-2.0))
        slope = (u * (s / power - s**-3.0 / inverse)) @ v
        return 0.5 * float(np.log(power) + np.log(inverse)), slope.reshape(columns.shape)


class _Search:
    """Motions of some joints of a robot: ``x [moved, free]`` are series at rest, in units of the speed limit."""

    def __init__(
        self, robot: Robot, moved: tuple[RobotJoint, ...], limits: MotionLimits, series: FourierSeries
    ) -> None:
        self._robot, self._moved, self._limits, self._series = robot, moved, limits, series
        self._dofs = np.array([one.dof for one in moved])
        self._speed = limits.speed[self._dofs]
        start = limits.start[self._dofs]
        #: ``[moved, 1]``: way up and down.
        self._room = (limits.high[self._dofs] - start)[:, None], (start - limits.low[self._dofs])[:, None]
        self._bounded = np.flatnonzero(np.isfinite(limits.torque))
        self._friction = np.zeros(robot.model.nv)
        self._friction[[one.dof for one in robot.joints]] = [one.friction for one in robot.joints]
        self._coarse = self._basis(_COARSE)

    def _basis(self, density: int) -> Real:
        """``[3, free, sample]`` of one period."""
        time_s = self._series.period(density * self._series.harmonics)
        return np.asarray(np.einsum("hf,dhk->dfk", self._series.at_rest, self._series.basis(time_s)))

    @cached_property
    def _fine(self) -> Real:
        return self._basis(_FINE)

    def _motion(self, x: Real, basis: Real) -> Real:
        """``[3, moved, sample]``: displacement, velocity, acceleration."""
        return np.asarray(np.einsum("mf,dfk->dmk", x * self._speed[:, None], basis))

    def seen(self, x: Real, *, fine: bool = False) -> _Seen:
        """Look along a motion."""
        return self._look(self._motion(x, self._fine if fine else self._coarse))

    def _whole(self, motion: Real) -> Real:
        """``[3, dof, sample]``: position, velocity and acceleration of all."""
        found = np.zeros((3, self._robot.model.nv, motion.shape[2]))
        found[0] = self._limits.start[:, None]
        found[:, self._dofs] += motion
        return found

    def _torque(self, motion: Real) -> Real:
        """``[dof, sample]``."""
        torque = motion_torque(self._robot, *self._whole(motion))
        torque[self._dofs] += self._friction[self._dofs, None] * np.sign(motion[1])
        return torque

    def _look(self, motion: Real) -> _Seen:
        need = needed_torque(self._robot, *self._whole(motion))
        links = np.moveaxis(need.regressor[self._dofs], 1, 0)
        sign = np.tanh(motion[1] / (_SLOW * self._speed[:, None]))
        laws = [np.einsum("mk,mn->kmn", own, np.eye(len(self._moved))) for own in (sign, motion[1], motion[2])]
        columns = np.concatenate([links.reshape(*links.shape[:2], -1), *laws], axis=2)
        torque = need.torque.copy()
        torque[self._dofs] += self._friction[self._dofs, None] * np.sign(motion[1])
        return _Seen(columns, torque)

    def random(self, rng: np.random.Generator, count: int) -> list[Real]:
        """Give random motions inside the limits."""
        size = (len(self._moved), self._coarse.shape[1])
        drawn = [rng.standard_normal(size) for _ in range(count)]
        return [self._inside(one / self._used(one, self._coarse), self._coarse) for one in drawn]

    def _used(self, x: Real, basis: Real) -> Real:
        """``[moved, 1]``: share of the nearer of position's and velocity's limits."""
        displacement, velocity, _ = self._motion(x, basis)
        up, down = self._room
        used = [np.max(displacement / up, axis=1), np.max(-displacement / down, axis=1)]
        used.append(np.max(np.abs(velocity), axis=1) / self._speed)
        return np.asarray(np.max(used, axis=0)[:, None])

    def _inside(self, x: Real, basis: Real) -> Real:
        """Make a motion smaller until it's inside the limits, as the start pose is."""
        x = (1.0 - _BETWEEN) * x / np.maximum(self._used(x, basis), 1.0)
        most = self._limits.torque[self._bounded, None]

        def over(share: float) -> bool:
            torque = self._torque(self._motion(share * x, basis))
            return bool(np.any(np.abs(torque[self._bounded]) > (1.0 - _BETWEEN) * most))

        low, high = 0.0, 1.0
        if not self._bounded.size or not over(high):
            return x
        while high - low > 0.01:
            middle = (low + high) / 2.0
            low, high = (low, middle) if over(middle) else (middle, high)
        return low * x

    def optimised(self, judge: _Judge, starts: Sequence[Real], progress: Callable[[float], None]) -> Real:
        """Give the motion that steps from the best of random ones lead to, inside the limits of the fine grid."""
        shape = starts[0].shape
        begin = min(starts, key=lambda one: judge.logarithm(self.seen(one))[0])
        kept: dict[bytes, tuple[float, Real, Real, Real]] = {}

        def at(flat: Real) -> tuple[float, Real, Real, Real]:
            key = flat.tobytes()
            if key not in kept:
                kept[key] = self._slopes(judge, flat.reshape(shape))
                progress(min(len(kept) / _STEPS, 1.0))
            return kept[key]

        def objective(flat: Real) -> tuple[float, Real]:
            return at(flat)[:2]

        room = NonlinearConstraint(lambda flat: at(flat)[2], 0.0, np.inf, jac=lambda flat: at(flat)[3])
        found = minimize(
            objective, begin.reshape(begin.size), jac=True, method="SLSQP", constraints=room,
            options={"maxiter": _STEPS, "ftol": 1e-4},
        )  # fmt: skip
        ends = [self._inside(one, self._fine) for one in (begin, found.x.reshape(shape))]
        return min(ends, key=lambda one: judge.condition(self.seen(one)))

    def _slopes(self, judge: _Judge, x: Real) -> tuple[float, Real, Real, Real]:
        """Give the objective and its slope, the room that is left to limits and its slope, by x.

        What is seen at a sample depends on the motion there alone, so that three changes a joint give all slopes.
        """
        motion = self._motion(x, self._coarse)
        here = self._look(motion)
        value, by_columns = judge.logarithm(here)
        slope, by_motion = np.empty(motion.shape), np.empty((self._bounded.size, *motion.shape))
        for joint in range(len(self._moved)):
            changed = np.repeat(motion[:, :, None], 3, axis=2)
            changed[np.arange(3), joint, np.arange(3)] += _STEP
            there = self._look(changed.reshape(3, len(self._moved), -1))
            columns = there.columns.reshape(3, *here.columns.shape) - here.columns
            torque = there.torque[self._bounded].reshape(-1, 3, motion.shape[2]) - here.torque[self._bounded, None]
            slope[:, joint] = np.einsum("kmb,zkmb->zk", by_columns, judge.scaled(_Seen(columns, torque))) / _STEP
            by_motion[:, :, joint] = torque / _STEP
        room, of_room = self._left(motion, here.torque[self._bounded], by_motion)
        return value, self._by_x(slope[None])[0], room, of_room

    def _by_x(self, slopes: Real) -> Real:
        """``[number, moved free]`` of ``[number, 3, moved, sample]``."""
        found = np.einsum("ndmk,dfk->nmf", slopes, self._coarse) * self._speed[:, None]
        return np.asarray(found.reshape(len(slopes), -1))

    def _left(self, motion: Real, torque: Real, by_motion: Real) -> tuple[Real, Real]:
        """Smooth room to the limits of positions, velocities and torques, and its slope by x."""
        (displacement, velocity, _), (up, down) = motion, self._room
        count, samples = displacement.shape
        each, speed = np.arange(count), self._speed[:, None]
        used, slopes = [], []
        for share, place, by_own in (
            (displacement / up, 0, 1.0 / up), (-displacement / down, 0, -1.0 / down),
            (velocity / speed, 1, 1.0 / speed), (-velocity / speed, 1, -1.0 / speed),
        ):  # fmt: skip
            slope = np.zeros((count, 3, count, samples))
            slope[each, place, each] = by_own
            used.append(share)
            slopes.append(slope)
        most = self._limits.torque[self._bounded, None]
        for sign in (1.0, -1.0):
            used.append(sign * torque / most)
            slopes.append(sign / most[:, None, None] * by_motion)
        shares = _SHARP * np.concatenate(used)
        near = softmax(shares, axis=1)[:, None, None]
        return 1.0 - logsumexp(shares, axis=1) / _SHARP, -self._by_x(near * np.concatenate(slopes))

    def trajectory(self, x: Real, rate_hz: float, samples: int) -> Trajectory:
        """Give the record of a motion, not yet judged."""
        joints = self._robot.joints
        rows = np.array([one.dof for one in joints])
        coefficients = np.zeros((self._robot.model.nv, 2 * self._series.harmonics))
        coefficients[self._dofs] = (x * self._speed[:, None]) @ self._series.at_rest.T
        # Periods repeat to the last digit.
        time_s = np.mod(np.arange(samples) / rate_hz, 1.0 / self._series.base_frequency_hz)
        position, velocity, acceleration = np.einsum("jh,dhk->djk", coefficients, self._series.basis(time_s))
        position += self._limits.start[:, None]
        motion = np.stack([position - self._limits.start[:, None], velocity, acceleration])[:, self._dofs]
        return Trajectory(
            robot=self._robot.name, joints=joints, moved=tuple(one.name for one in self._moved),
            sample_rate_hz=rate_hz, position=position[rows], velocity=velocity[rows], acceleration=acceleration[rows],
            torque=self._torque(motion)[rows], base_frequency_hz=self._series.base_frequency_hz,
            harmonics=self._series.harmonics, coefficients=coefficients[rows],
            use=self._use(x, self._torque(self._motion(x, self._fine))),
        )  # fmt: skip

    def _use(self, x: Real, torque: Real) -> tuple[JointUse, ...]:
        displacement, velocity, _ = self._motion(x, self._fine)
        found = []
        for row, joint in enumerate(self._moved):
            position = self._limits.start[joint.dof] + displacement[row]
            most = effort_limit(joint)
            found.append(
                JointUse(
                    joint=joint.name, unit=UNIT[joint.kind], low=float(position.min()), high=float(position.max()),
                    range=joint.range, speed=float(np.max(np.abs(velocity[row]))), speed_limit=joint.velocity_limit,
                    torque=float(np.max(np.abs(torque[joint.dof]))), torque_limit=None if most == inf else most,
                )
            )  # fmt: skip
        return tuple(found)
