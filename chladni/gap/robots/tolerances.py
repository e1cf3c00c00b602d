"""What a robot's tolerances allow for, as columns of missing torque."""

from collections.abc import Iterator

import numpy as np

from chladni.gap.robots.motion import rms
from chladni.gap.robots.term import at_row, usual
from chladni.gap.robots.torques import ALL_COMMANDS, Torques
from chladni.robots.dynamics import inertial_numbers
from chladni.robots.robot import Robot
from chladni.signals.arrays import Real

#: Zero-g offset of an accelerometer, m/s^2, one sigma: sensors of robots are within two or three hundredths of g.
_ZERO_G = 0.1
#: The same of its delay, s: low-pass filters of such sensors take 2 to 20 ms by their data sheets.
_IMU_S = 0.005
#: Half the period of a loop at 1 kHz, s.
LOOP_S = 5e-4


def tolerances(torques: Torques) -> tuple[Real, list[str]]:
    """Give columns ``[number, joint, coarse]``, of a standard deviation each, and names of what tolerances allow."""
    tolerance = torques.robot.tolerance
    found = list(_of_links(torques))
    served = (torques.two_sided or not torques.by_effort) and torques.log.command_kind == "position"
    for row, joint in torques.rows:
        if joint.armature > 0:
            own = joint.armature * torques.acceleration[row]
            found.append((f"{joint.name}.armature", tolerance.inertia * at_row(torques, row, own)[0]))
        if tolerance.friction > 0:
            found.append((f"{joint.name}.friction", tolerance.friction * at_row(torques, row, torques.sign[row])[0]))
        doubts = np.array(torques.gain_doubts(row))
        if doubts[0] > 0 and served:
            damped = torques.damped[row]
            both = at_row(torques, torques.servo_row(row), torques.answered[row] + damped, damped)
            both *= doubts[:, None, None]
            found += zip((f"{joint.name}.kp", f"{joint.name}.kd"), both, strict=True)
    if torques.base is not None:
        # What an accelerometer reads at rest is off by a constant, and filters of an IMU take their time.
        found += zip(("imu.x", "imu.y", "imu.z"), _ZERO_G * torques.carried[:3], strict=True)
        found.append(("imu.late", _IMU_S * torques.late_base))
    if served:
        # A digital servo holds what it reads for a period.
        found.append(("loop", -LOOP_S * torques.at_servos(torques.loop)))
        # Commands wait for the loop's next turn.
        common = torques.guesses.late_s.get(ALL_COMMANDS, 0.0)
        found.append(("turn", LOOP_S * torques.at_servos(torques.late(common, 0.0))))
    command = torques.log.command if torques.log.command_kind == "position" else None
    if torques.two_sided:
        # Between efforts commands may come any time that leaves the efforts as they are.
        found.append(("later", torques.doubt_s * torques.later))
        found += ((f"{one.name}.within", at_row(torques, row, torques.within[row])[0]) for row, one in torques.rows)
    elif torques.by_effort and command is not None:
        # Efforts are sampled while commands are held: always just after a step, or just before it.
        half_s = 0.5 / torques.log.sample_rate_hz
        between = torques.smooth(np.nan_to_num(torques.mean_command(0.0, half_s) - command))
        for row, joint in torques.rows:
            stiffness = torques.kp[row] or usual(torques, row) / rms(
                torques.position[row] - np.mean(torques.position[row])
            )
            found.append((f"{joint.name}.hold", at_row(torques, row, stiffness * between[row])[0]))
    columns = np.zeros((len(found), *torques.missing.shape))
    for place, (_, column) in enumerate(found):
        columns[place, : len(column)] = column
    return columns, [name for name, _ in found]


def _of_links(torques: Torques) -> Iterator[tuple[str, Real]]:
    """Relative errors of mass, centre of mass and moments of inertia of every link that moves."""
    regressor = torques.of_joints(np.moveaxis(torques.need.regressor, (2, 3), (0, 1)))
    for changes, columns, link in zip(tolerated_inertia(torques.robot), regressor, torques.robot.links, strict=True):
        if np.any(changes) and np.any(columns):
            for name, column in zip(INERTIAL_NAMES, np.einsum("np,pjk->njk", changes, columns), strict=True):
                yield f"{link}.{name}", column


INERTIAL_NAMES = ("mass", "x", "y", "z", "xx", "yy", "zz", "xy", "xz", "yz")


def tolerated_inertia(robot: Robot) -> Real:
    """Give ``[link, number, 10]``: by how much each of `INERTIAL_NAMES` may change the inertial numbers, one sigma.

    The mass changes them all; a first moment or an inertia itself alone.
    """
    found = np.zeros((len(robot.links), len(INERTIAL_NAMES), len(INERTIAL_NAMES)))
    for changes, own in zip(found, inertial_numbers(robot), strict=True):
        # About the link's origin; a body is as long as its inertia over its mass says.
        mass, inertia = own[0], float(np.sum(own[4:7])) / 2.0
        if mass > 0:
            np.fill_diagonal(changes, [0.0, *[np.sqrt(mass * inertia)] * 3, *[inertia] * 6])
            changes[0] = own
    return robot.tolerance.inertia * found
