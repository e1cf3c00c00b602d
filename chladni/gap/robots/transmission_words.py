"""Words of what lies between a motor and its link: a spring, or play.

The motor turns ahead of its link by ``u = torque / stiffness``, or by half the play to the side that presses. Its
loop works on its own angle, and its rotor follows that, while the log may read either side (M. W. Spong, Journal of
Dynamic Systems, Measurement, and Control 109 (1987) 310).
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from chladni.gap.robots.motion import rms
from chladni.gap.robots.term import PART, Number, Term, at_row, formed, length, rotor_at, usual
from chladni.gap.robots.torques import Torques
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Real

#: Of the pose's error under the usual torque of a spring, and of play, before a log is seen: rad (m).
_GIVES = 0.03
#: Of its link's inertia: less of a rotor isn't felt.
LEAST_ROTOR = 0.05
#: Quantiles of the angle by which a loop is pulled aside at which play is tried: a loop that works spends little time
#: inside, one that bears nothing much.
_PLAYS = (0.03, 0.1, 0.3, 0.6)
AT_LINK, AT_MOTOR = "encoder at the link", "encoder at the motor"


def transmissions(torques: Torques) -> Iterator[Term]:
    """Springs and play between motors and links."""
    for row, joint in torques.rows:
        soft = Number(name="compliance", unit=_over(joint), scale=_GIVES / usual(torques, row), least=0.0)
        # What motion needs shakes with its encoder, which a law of it would explain: measured torques don't.
        passed = torques.drive[row] if torques.by_effort else torques.wanted[row]
        yield from _between(torques, row, joint, "joint_elasticity", passed, soft)
        drive = torques.fast_drive[row]
        if not (drive.min() < 0.0 < drive.max()):
            continue
        play = Number(name="gap", unit=length(joint), scale=_GIVES, least=0.0)
        side = torques.smooth(0.5 * np.tanh(drive / (2.0 * torques.highest_noise[row])))
        known = _loop_is_known(torques, row)
        for term in _between(torques, row, joint, "backlash", side, play):
            if term.variant == AT_MOTOR or not known:
                yield term
        if known:
            yield from _play(torques, row, joint, passed, soft)


def _loop_is_known(torques: Torques, row: int) -> bool:
    said = torques.kp[row] > 0 and torques.joints[row].name not in torques.guessed
    return (torques.two_sided or not torques.by_effort) and bool(said)


def _over(joint: RobotJoint) -> str:
    return "rad/(N m)" if joint.kind == "hinge" else "m/N"


def _rotor(torques: Torques, row: int, joint: RobotJoint) -> Number:
    scale = usual(torques, row) / rms(torques.acceleration[row])
    # A motor has a rotor, here or in the description.
    least = 0.0 if joint.armature else LEAST_ROTOR * float(torques.usual_inertia[row])
    return Number(
        name="inertia", unit="kg m^2" if joint.kind == "hinge" else "kg", scale=scale, least=least,
        nominal=joint.armature, is_exact=True,
    )  # fmt: skip


def _between(torques: Torques, row: int, joint: RobotJoint, word: str, ahead: Real, number: Number) -> Iterator[Term]:
    """Give the law for either side that the log may read; `ahead` is the motor's lead a unit of the number."""
    rotor = _rotor(torques, row, joint)
    both = Number(name="both", unit="1", scale=number.scale * rotor.scale, least=0.0)
    numbers: tuple[Number, ...] = (rotor, both)
    rows = tuple(dict.fromkeys([row, torques.servo_row(row)]))
    known = _loop_is_known(torques, row)
    if known:
        # A loop that yields with its motor asks for less than one whose motor stands where the link is.
        numbers = (number, *numbers, *[PART] * bool(np.any(torques.over_limit[row])))
    if known or torques.by_effort:
        make = partial(_at_link, torques, row, ahead, loop_is_known=known)
        turning = partial(rotor_at, torques, row, numbers.index(rotor), len(numbers))
        yield Term(
            word=word, site=joint.name, make=make, numbers=numbers, rows=rows, variant=AT_LINK, rare=True,
            inertia=turning,
        )  # fmt: skip
    yield Term(
        word=word, site=joint.name, make=partial(_at_motor, torques, row, ahead), numbers=(rotor, number),
        rows=(row,), variant=AT_MOTOR, rare=True, plainer="armature", inertia=partial(rotor_at, torques, row, 0, 2),
    )  # fmt: skip


def _at_link(torques: Torques, row: int, ahead: Real, *, loop_is_known: bool) -> Real:
    rate = torques.coarse_rate(ahead)
    columns = at_row(torques, row, torques.acceleration[row], torques.coarse_rate(rate))
    if not loop_is_known:
        return columns
    loop = _at_loop(torques, row, ahead)
    over = torques.over_limit[row]
    beyond = [at_row(torques, torques.servo_row(row), -over)] * bool(np.any(over))
    return np.concatenate([at_row(torques, torques.servo_row(row), loop), columns, *beyond])


def _at_loop(torques: Torques, row: int, ahead: Real) -> Real:
    """Torque that a loop asks for less, as it works on the motor's angle."""
    return np.asarray(torques.kp[row] * ahead + torques.kd[row] * torques.coarse_rate(ahead))


def _at_motor(torques: Torques, row: int, ahead: Real) -> Real:
    rate = torques.coarse_rate(ahead)
    behind = torques.turned(row, -ahead, -rate, -torques.coarse_rate(rate))
    return np.concatenate([at_row(torques, row, torques.acceleration[row])[:, : len(behind)], behind[None]])


def _play(torques: Torques, row: int, joint: RobotJoint, passed: Real, soft: Number) -> Iterator[Term]:
    """Play before a link that the log reads: inside it nothing holds the motor, which follows its loop.

    Its teeth yield to what they pass on.
    """
    asked, kp, kd = torques.fast_served[row], float(torques.kp[row]), float(torques.kd[row])
    step_s = 1.0 / torques.log.sample_rate_hz
    rows = tuple(dict.fromkeys([row, torques.servo_row(row)]))
    rotor = _rotor(torques, row, joint)

    def make(gap: float) -> Term:
        def columns() -> Real:
            ahead = _inside(asked, 0.5 * gap, kp, kd, step_s)
            pulled = torques.smooth(kp * ahead + kd * np.gradient(ahead, step_s))
            turning = torques.acceleration[row] + torques.coarse_rate(torques.coarse_rate(torques.smooth(ahead)))
            loop = pulled - torques.over_limit[row], _at_loop(torques, row, passed)
            given, teeth = at_row(torques, torques.servo_row(row), *loop)[:, None]
            return np.concatenate([given, at_row(torques, row, turning), teeth])

        return Term(
            word="backlash", site=joint.name, make=columns, numbers=(PART, rotor, soft), rows=rows, variant=AT_LINK,
            takes=True, rare=True, plainer="joint_elasticity", adds_form=True,
            inertia=partial(rotor_at, torques, row, 1, 3),
        )  # fmt: skip

    grid = 2.0 * np.quantile(np.abs(asked), _PLAYS) / kp
    if grid[0] > 0 and np.all(np.diff(grid) > 0):
        yield from formed(make, grid, name="gap", unit=length(joint), scale=_GIVES)


def _inside(asked: Real, half: float, kp: float, kd: float, step_s: float) -> Real:
    """Give a motor's lead inside its play: ``kp u + kd du/dt`` is what its loop asks for, up to either side."""
    share = step_s / (kd + step_s * kp)
    path, lead = [], 0.0
    for each in asked.tolist():
        lead = min(max(lead + share * (each - kp * lead), -half), half)
        path.append(lead)
    return np.array(path)
