"""Words of what lies between a motor and its link: a spring, or play.

The motor turns ahead of its link by ``u = torque / stiffness``, or by half the play to the side that presses. Its
loop works on its own angle, and its rotor follows that, while the log may read either side (M. W. Spong, Journal of
Dynamic Systems, Measurement, and Control 109 (1987) 310).
"""

from collections.abc import Iterator

import numpy as np
from scipy.interpolate import CubicSpline

from chladni.gap.robots.term import Number, Term, at_row, length, usual
from chladni.gap.robots.torques import Torques, rms
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Real

#: Of the pose's error under the usual torque of a spring, and of play, before a log is seen: rad (m).
_GIVES = 0.02
AT_LINK, AT_MOTOR = "encoder at the link", "encoder at the motor"


def transmissions(torques: Torques) -> Iterator[Term]:
    """Springs and play between motors and links."""
    for row, joint in torques.rows:
        often = usual(torques, row)
        torque = torques.wanted[row]
        soft = Number(name="compliance", unit=_over(joint), scale=_GIVES / often, least=0.0)
        yield from _between(torques, row, joint, "joint_elasticity", torque, soft)
        if np.any(np.diff(np.sign(torque))):
            play = Number(name="gap", unit=length(joint), scale=_GIVES, least=0.0)
            yield from _between(torques, row, joint, "backlash", _side(torques, row), play)


def _over(joint: RobotJoint) -> str:
    return "rad/(N m)" if joint.kind == "hinge" else "m/N"


def _between(torques: Torques, row: int, joint: RobotJoint, word: str, ahead: Real, number: Number) -> Iterator[Term]:
    """Give the law for either side that the log may read; `ahead` is the motor's lead a unit of the number."""
    rate, acceleration = torques.coarse_rate(ahead), torques.coarse_rate(torques.coarse_rate(ahead))
    scale = usual(torques, row) / rms(torques.acceleration[row])
    rotor = Number(name="inertia", unit="kg m^2" if joint.kind == "hinge" else "kg", scale=scale, least=0.0)
    both = Number(name="both", unit="1", scale=number.scale * scale, least=0.0)
    if torques.by_effort:
        columns = (acceleration, torques.acceleration[row])
        numbers: tuple[Number, ...] = (both, rotor)
    else:
        columns = (torques.kp[row] * ahead + torques.kd[row] * rate, torques.acceleration[row], acceleration)
        numbers = (number, rotor, both)
    yield Term(
        word=word, site=joint.name, columns=at_row(torques, row, *columns), numbers=numbers, rows=(row,),
        variant=AT_LINK,
    )  # fmt: skip
    behind = torques.turned(row, -ahead, -rate, -acceleration)
    whole = np.concatenate([-behind[None], at_row(torques, row, torques.acceleration[row])])
    yield Term(word=word, site=joint.name, columns=whole, numbers=(number, rotor), rows=(row,), variant=AT_MOTOR)


def _side(torques: Torques, row: int) -> Real:
    """Half a unit of play, to the side on which the motor presses."""
    time_s = torques.log.time_s
    fast = CubicSpline(time_s[torques.kept], torques.wanted[row])(time_s)
    return torques.smooth(0.5 * np.tanh(fast / (2.0 * torques.highest_noise[row])))
