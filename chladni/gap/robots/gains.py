"""Gains of position loops that nobody says, guessed from how far commands lead for the torque that joints need."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import nnls

from chladni.gap.robots.torques import Torques
from chladni.robots.robot import Robot, RobotJoint, Servo
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: Deviations from which a joint tells its stiffness.
_TOLD_BY = 3.0
#: Share of a log in which a joint has to move.
_MOVES = 0.05
#: Share of an effort's power that a position loop leaves.
_FOLLOWS = 0.1
#: Least time by which a loop damps, s: half a millisecond of a digital loop.
_LEAST_S = 5e-4

#: kp and kd by joint.
Gains = Mapping[str, tuple[float, float]]


def unknown_gains(torques: Torques) -> list[str]:
    """Name joints whose positions are commanded by gains that nobody says."""
    log = torques.log
    if log.command is None or log.command_kind != "position":
        return []
    stiffness = torques.by_row("kp")
    commanded = np.all(np.isfinite(torques.mean_command(0.0, 0.5 / log.sample_rate_hz)), axis=1)
    return [
        one.name
        for one, known, there in zip(torques.joints, np.isfinite(stiffness), commanded, strict=True)
        if there and not known
    ]


def guessed_gains(torques: Torques, names: list[str]) -> Gains:
    """Give gains of joints by least squares of how far commands lead; none where efforts say another law.

    Efforts that are known are ``kp lead - kd v`` of a position loop. Else the lead is ``(torque + armature a +
    damping v + friction sgn v)/kp`` and a constant; the stiffness is what the torque of the described masses tells.
    Joints whose load is too small take the mean of all.

    Raises
    ------
    ModelError
        When no joint's load tells its stiffness.
    """
    if torques.by_effort:
        return _by_efforts(torques, names)
    half_s = 0.5 / torques.log.sample_rate_hz
    lead = torques.smooth(torques.mean_command(0.0, half_s) - torques.fast_position)
    found: dict[str, tuple[float, float, float]] = {}
    for row, joint in enumerate(torques.joints):
        if joint.name in names:
            found[joint.name] = _leads(torques, row, lead[row])
    compliance, spread, damps = (np.array(one) for one in zip(*found.values(), strict=True))
    weight = 1.0 / spread**2
    pooled = float(np.sum(weight * compliance) / np.sum(weight)) if np.any(weight > 0) else 0.0
    if not pooled * np.sqrt(np.sum(weight)) > _TOLD_BY:
        raise ModelError(
            f"{torques.robot.name}: no gains of its drives, {torques.log.log} has no measured effort, and no joint "
            "bears enough of its weight to tell its stiffness; give kp and kd under [control] of a robot file"
        )
    kp = 1.0 / np.where(compliance > _TOLD_BY * spread, compliance, pooled)
    kd = kp * np.maximum(damps, _LEAST_S)
    return dict(zip(found, zip(kp.tolist(), kd.tolist(), strict=True), strict=True))


def _by_efforts(torques: Torques, names: list[str]) -> Gains:
    lead = np.nan_to_num(torques.log.command if torques.log.command is not None else 0.0) - torques.log.position
    velocity = torques.fast_velocity if torques.log.velocity is None else torques.log.velocity
    gains = {}
    for row, joint in enumerate(torques.joints):
        effort = torques.fast_drive[row]
        if joint.name not in names or not effort.any():
            continue
        (kp, kd), left = nnls(np.array([lead[row], -np.nan_to_num(velocity[row])]).T, effort)
        # Loops of another kind, and efforts of another unit than the loop's, are looked at by what they move alone.
        if kp > 0 and left**2 < _FOLLOWS * float(effort @ effort):
            gains[joint.name] = kp, max(kd, kp * _LEAST_S)
    return gains


def _leads(torques: Torques, row: int, lead: Real) -> tuple[float, float, float]:
    """Compliance of a loop, rad/(N m), its standard deviation, and its damping over its stiffness, s."""
    there = torques.moves[row]
    if there.mean() < _MOVES:
        return 0.0, np.inf, 0.0
    one = np.ones_like(lead)
    columns = [torques.wanted[row], torques.velocity[row], torques.acceleration[row], torques.sign[row], one, -one]
    table = np.array(columns)[:, there]
    size = np.linalg.norm(table, axis=1) + 1e-30
    numbers, left = nnls((table / size[:, None]).T, lead[there])
    # Neighbouring samples of the coarse grid aren't independent.
    variance = left**2 / max(there.sum() * torques.numbers_a_sample - len(columns), 1.0)
    variance /= torques.numbers_a_sample
    inverse = np.linalg.pinv(table[:5] @ table[:5].T)
    return float(numbers[0] / size[0]), float(np.sqrt(variance * inverse[0, 0])), float(numbers[1] / size[1])


def with_gains(robot: Robot, gains: Gains) -> Robot:
    """Give a robot with position loops of these gains."""

    def served(one: RobotJoint) -> RobotJoint:
        if one.name not in gains:
            return one
        kp, kd = gains[one.name]
        limit = None if one.servo is None else one.servo.limit
        return replace(one, servo=Servo(kind="position", kp=kp, kd=kd, limit=limit, actuator=None))

    return replace(robot, joints=tuple(served(one) for one in robot.joints))
