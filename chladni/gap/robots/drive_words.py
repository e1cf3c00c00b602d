"""Words of drives: gains, delays, lags, limits, dead zones."""

from collections.abc import Callable, Iterator
from functools import cache, partial

import numpy as np

from chladni.gap.robots.term import PART, Number, Term, at_row, formed, units
from chladni.gap.robots.torques import ALL_COMMANDS, LEAST_OVER, Torques
from chladni.robots.joint_laws import followed
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Real

#: Quantiles of the drive's torque (of the command's speed) at which a limit is tried, and a dead zone.
_LIMITS, _WIDTHS = (0.8, 0.9, 0.96), (0.15, 0.3, 0.5)
#: Standard deviations before a log is seen: a gain, a delay (s), a lag (s).
_GAIN, _DELAY_S, _LAG_S = 0.3, 0.01, 0.02
#: Delays at which their column is tried beside that of a short one.
_SECANTS_S = (0.01, 0.03)
#: Of its length: the shortest delay that a secant stands for.
_OF_SECANT = 0.4


def drives(torques: Torques) -> Iterator[Term]:
    """Give what drives do otherwise than their servos say."""
    for row, joint in torques.told_rows:
        # In units of what was asked the motion needs 1/gain times its torque: so no gain explains all by being small.
        over = Number(name="over_gain", unit="1", scale=_GAIN, least=LEAST_OVER - 1.0, nominal=1.0)
        answered = (torques.answered if torques.gives else torques.wanted)[row]
        make = partial(at_row, torques, _limited(torques, row), answered)
        yield Term(word="gain_error", site=joint.name, make=make, numbers=(over,), over_gain=True)
        if not torques.by_effort or torques.gives or torques.log.effort_kind != "measured":
            yield from _saturation(torques, row, joint)
            yield from _dead_zone(torques, row, joint)
    if torques.two_sided or not torques.by_effort:
        yield from _loops(torques)


def _limited(torques: Torques, row: int) -> int:
    """Row at which what arrives is held against what is asked for."""
    return torques.servo_row(row) if torques.gives else row


def _loops(torques: Torques) -> Iterator[Term]:
    commands = torques.command() if torques.log.command_kind == "position" else None
    for row, joint in torques.told_rows:
        lag = Number(name="time_constant", unit="s", scale=_LAG_S, least=0.0)
        yield Term(word="lag", site=joint.name, make=partial(_lagging, torques, row), numbers=(lag,))
        if commands is not None:
            yield from _rate_limit(torques, row, joint, commands[row])
    if commands is not None:
        yield from _gains(torques)


def _lagging(torques: Torques, row: int) -> Real:
    rate = torques.smooth(np.gradient(torques.fast_drive[row], 1.0 / torques.log.sample_rate_hz))
    return at_row(torques, torques.servo_row(row), rate)


def _saturation(torques: Torques, row: int, joint: RobotJoint) -> Iterator[Term]:
    asked = torques.fast_asked[row]

    def make(limit: float) -> Term:
        return _of_drive(torques, _limited(torques, row), "saturation", lambda: asked - np.clip(asked, -limit, limit))

    yield from _limits(make, np.quantile(np.abs(asked), _LIMITS), "limit", units(joint)[0])


def _dead_zone(torques: Torques, row: int, joint: RobotJoint) -> Iterator[Term]:
    asked = torques.fast_asked[row]

    def make(width: float) -> Term:
        return _of_drive(torques, _limited(torques, row), "dead_zone", lambda: np.clip(asked, -width, width))

    yield from _limits(make, np.quantile(np.abs(asked), _WIDTHS), "width", units(joint)[0])


def _rate_limit(torques: Torques, row: int, joint: RobotJoint, command: Real) -> Iterator[Term]:
    """A reference that follows ``[sample]`` commands no faster than so, as drives with a profile do."""
    if not np.all(np.isfinite(command)):
        return
    rates = np.abs(np.diff(command)) * torques.log.sample_rate_hz
    # Commands that are held step; what they go at is what smooth ones would.
    smooth = np.abs(torques.coarse_rate(torques.smooth(command)))
    if not np.any(rates > 0):
        return

    def make(rate: float) -> Term:
        def not_given() -> Real:
            behind = np.zeros_like(command)
            for a, b in torques.stretches:
                behind[a:b] = command[a:b] - followed(command[a:b], rate / torques.log.sample_rate_hz)
            return np.asarray(torques.kp[row] * behind)

        return _of_drive(torques, torques.servo_row(row), "rate_limit", not_given)

    unit = "rad/s" if joint.kind == "hinge" else "m/s"
    yield from _limits(make, np.quantile(smooth, _LIMITS), "rate", unit)


def _limits(make: Callable[[float], Term], grid: Real, name: str, unit: str) -> Iterator[Term]:
    """Give the terms at quantiles that differ."""
    if grid[0] > 0 and np.all(np.diff(grid) > 0):
        yield from formed(make, grid, name=name, unit=unit)


def _of_drive(torques: Torques, row: int, word: str, not_given: Callable[[], Real]) -> Term:
    """Give the law of a drive that doesn't give ``[sample]`` of what it's asked for."""
    return Term(
        word=word, site=torques.joints[row % len(torques.joints)].name, numbers=(PART,), takes=True,
        make=lambda: at_row(torques, row, torques.smooth(not_given())), rare=word != "saturation",
    )  # fmt: skip


def _gains(torques: Torques) -> Iterator[Term]:
    for row, joint in torques.told_rows:
        damped = torques.damped[row]
        yield Term(
            word="controller_gain", site=joint.name,
            make=partial(at_row, torques, torques.servo_row(row), torques.answered[row] + damped, damped),
            numbers=(
                Number(name="over_kp", unit="1", scale=_GAIN, least=LEAST_OVER - 1.0, nominal=1.0),
                Number(name="kd_over_kp", unit="1", scale=_GAIN),
            ),
            over_gain=True,
        )  # fmt: skip


def delays(torques: Torques) -> Iterator[Term]:
    """Commands that come late: all of them, or those of a joint beside them."""
    if torques.log.command_kind != "position" or (torques.by_effort and not torques.two_sided):
        return
    believed, late_s = torques.robot.delay_s, torques.guesses.late_s
    common = late_s.get(ALL_COMMANDS, 0.0)
    for secant_s in (None, *_SECANTS_S):
        # A secant says nothing of delays that are much shorter.
        least = -np.inf if secant_s is None else _OF_SECANT * secant_s
        delay = Number(name="delay", unit="s", scale=_DELAY_S, least=max(least, -believed), nominal=believed)
        own = Number(name="delay", unit="s", scale=_DELAY_S, least=max(least, -believed - common))
        variant = None if secant_s is None else f"over {secant_s:g} s"
        # About what was found already a slope is exact.
        if secant_s is None or ALL_COMMANDS not in late_s:
            make = partial(_at_all_servos, torques, common if secant_s is None else secant_s)
            yield Term(word="delay", site=ALL_COMMANDS, make=make, numbers=(delay,), variant=variant)
        late = cache(partial(torques.late, common, secant_s or 0.0))
        for row, joint in torques.rows:
            found = late_s.get(joint.name, 0.0)
            if secant_s is not None and found:
                continue
            make = partial(_late_at, torques, row, partial(torques.late, common, found) if found else late)
            # One line carries the commands of all.
            yield Term(word="delay", site=joint.name, make=make, numbers=(own,), variant=variant, rare=True)


def _at_all_servos(torques: Torques, late_s: float) -> Real:
    return torques.at_servos(torques.late(0.0, late_s))[None]


def _late_at(torques: Torques, row: int, late: Callable[[], Real]) -> Real:
    return at_row(torques, torques.servo_row(row), late()[row])
