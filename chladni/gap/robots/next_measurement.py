"""Which motion of a robot would tell apart what a log leaves open, as a sentence with the command that makes it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from shlex import quote

import numpy as np

from chladni.gap.calibration import CLOSE, LEAST_SHARE
from chladni.gap.design.experiment import Design
from chladni.gap.records.diagnosis import PARAMETER, Candidate
from chladni.gap.records.robot import site_words
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.joint_noise import steps_and_noise
from chladni.gap.robots.search import alternatives
from chladni.gap.robots.term import Term
from chladni.gap.robots.torques import FormKey, Torques
from chladni.gap.robots.wider_laws import not_told_apart
from chladni.gap.robots.words import ROBOT_WORDS, all_terms
from chladni.models.effects.catalogue import spoken_effect
from chladni.robots.excite import random_motion
from chladni.robots.joint_log import JointLog
from chladni.robots.motion_limits import FREE_TURN, USUAL_SPEED, Shares
from chladni.robots.mujoco_motion import loaded
from chladni.robots.robot import Robot, RobotJoint
from chladni.robots.trajectory import Trajectory
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import ChladniError
from chladni.signals.visible import visible

#: What is tried: shares of the limits of velocity and of the way to the stops.
_USUAL, _SMALL, _SLOW, _FAST = Shares(), Shares(travel=0.1), Shares(speed=0.05), Shares(speed=1.0)
#: Of each joint's range: another pose.
_ELSEWHERE = 0.25
#: Of the mass of all links: most arms carry more (Franka, UR, iiwa: 0.17 to 0.5).
_CARRIED = 0.1
#: Length, s; samples a second, Hz, at most: eight times the cutoff of torques.
_LENGTH_S, _MOST_HZ = 10.0, 64.0
#: What could stand in place of a term.
_RIVALS = 6
#: The largest that are looked at.
_DOUBTS = 2

#: Words with their sites.
Beside = frozenset[tuple[str, str]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """A motion that could be made next.

    Attributes
    ----------
    words
        What to do.
    joints
        That move; all of them when empty.
    shares
        Of the limits.
    pose
        Start by joint.
    payload
        Mass that the last link carries more, kg.
    """

    words: str
    joints: tuple[str, ...] = ()
    shares: Shares = _USUAL
    pose: Mapping[str, float] = field(default_factory=dict)
    payload: float = 0.0

    def command(self, robot: Robot) -> str:
        """Give the line that makes it."""
        parts = ["chladni excite", quote(str(robot.robot_file or robot.description)), "--out motion.csv"]
        if self.joints:
            parts.append(f"--joints {quote(','.join(self.joints))}")
        for name in ("travel", "speed"):
            share = getattr(self.shares, name)
            parts += [] if share == getattr(_USUAL, name) else [f"--{name} {share:g}"]
        parts += [f"--pose {quote(f'{name}={value:.3g}')}" for name, value in self.pose.items()]
        return " ".join(parts)

    def made(self, robot: Robot, rate_hz: float) -> Trajectory:
        """Give such a motion."""
        return random_motion(
            robot, length_s=_LENGTH_S, rate_hz=rate_hz, joints=self.joints, pose=self.pose, shares=self.shares
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Doubt:
    """Two sets of terms that a log leaves close: the best one, and the one that comes nearest.

    Attributes
    ----------
    one, other
        As fitted to the log.
    terms
        What they say differently; the second is None for nothing.
    names
        The same in words.
    beside
        Word and site of what the log leaves close, too.
    now
        Nats between them.
    """

    one: Fit
    other: Fit
    terms: tuple[Term, Term | None]
    names: tuple[Candidate, Candidate | None]
    beside: Beside
    now: float

    @property
    def rows(self) -> tuple[int, ...]:
        """Of joints whose laws they say differently."""
        return tuple(dict.fromkeys(row for term in self.terms if term is not None for row in term.rows))


def next_measurement(
    contest: Contest, best: Fit, named: Sequence[tuple[int, Candidate, float]], unexplained: Sequence[str]
) -> str | None:
    """Say which motion would tell the largest part that is in doubt.

    Every motion is laid out as a log of the machine as described, with the noise of the log at hand. What either set
    of terms predicts to be missing there is given to a contest, which says how sure it would be of that set.

    Parameters
    ----------
    contest, best
        The most probable set, and what it was fitted in.
    named
        Place among its terms, name and share of the torque of each.
    unexplained
        Joints at which something acts that no word explains.

    Returns
    -------
    str or None
        None where nothing is in doubt, or no motion can be made.
    """
    robot = contest.torques.robot
    largest = sorted((one for one in named if one[2] >= LEAST_SHARE), key=lambda one: -one[2])
    doubts = filter(None, (_doubt(contest, best, place, name) for place, name, _ in largest))
    sentences = []
    for doubt in islice(doubts, _DOUBTS):
        if found := _designs(contest, doubt):
            sentences.append(_sentence(robot, doubt, found))
            if found[-1][1].tells:
                return sentences[-1]
    if sentences:
        return sentences[0]
    most = np.argsort(-contest.unknowns(best), kind="stable")
    torques = contest.torques
    rows = [row for row in most.tolist() if torques.name_of(row) in unexplained]
    return _look_first(robot, [torques.joints[row % len(torques.joints)] for row in rows])


def _doubt(contest: Contest, best: Fit, place: int, name: Candidate) -> Doubt | None:
    """Give what comes nearest in place of a term, where it comes close."""
    term = best.terms[place]
    without, *others = alternatives(contest, best, place, _RIVALS)
    # Another form of the law says the same, and one that holds it as a special case where its number is told.
    rivals = [without, *(one for one in others if one.terms[-1].key != term.key and not one.terms[-1].holds(term))]
    behind = [(max(best.nats - one.nats, 0.0), one) for one in rivals]
    behind += [(max(-nats, 0.0), one) for one, nats in not_told_apart(contest, best, place)]
    close = sorted((one for one in behind if one[0] < CLOSE), key=lambda one: one[0])
    if not close:
        return None
    now, other = close[0]
    rival = None if other is without else other.terms[-1]
    return Doubt(
        one=best, other=other, terms=(term, rival), now=now,
        names=(name, None if rival is None else Candidate(effect=rival.word, site=rival.site)),
        beside=frozenset(one.terms[-1].key for _, one in close[1:] if one is not without),
    )  # fmt: skip


def _designs(contest: Contest, doubt: Doubt) -> list[tuple[Motion, Design]]:
    """Motions and what they bring, the least effort first, up to one that tells."""
    found: list[tuple[Motion, Design]] = []
    for effort, motion in enumerate(_motions(contest.torques, doubt)):
        nats = _apart(contest, doubt, motion)
        if nats is not None:
            design = Design(
                change="level", words=motion.words, effort=float(effort), nats=doubt.now + nats, now_nats=doubt.now,
            )  # fmt: skip
            found.append((motion, design))
            if design.tells:
                break
    return found


def _motions(torques: Torques, doubt: Doubt) -> Iterator[Motion]:
    """As usual, at other speeds, over another way, from another pose, and with a load; joints alone before all."""
    robot = torques.robot
    # Rows of loops lie behind those of the joints.
    joints = dict.fromkeys(row % len(torques.joints) for row in doubt.rows)
    alone = [_alone(torques.joints[joint]) for joint in joints]
    yield from (one[0] for one in alone)
    yield Motion(words="move all joints")
    yield from (motion for one in alone for motion in one[1:])
    yield Motion(words="move all joints fast", shares=_FAST)
    pose = {one.name: _elsewhere(robot, one) for one in robot.joints if one.kind == "hinge" or one.range is not None}
    yield Motion(words="move all joints from another pose", pose=pose)
    carried = float(f"{_CARRIED * float(np.sum(robot.model.body_mass[1:])):.1g}")
    words = f"move all joints with {carried:g} kg more on {visible(robot.links[-1])}, and add it to the description"
    yield Motion(words=words, payload=carried)


def _elsewhere(robot: Robot, joint: RobotJoint) -> float:
    rest = float(robot.model.qpos0[joint.position])
    low, high = joint.range or (rest - FREE_TURN, rest + FREE_TURN)
    return low + _ELSEWHERE * (high - low)


def _alone(joint: RobotJoint) -> list[Motion]:
    """As usual, slowly, fast, and over a short way."""
    most, unit = joint.velocity_limit or USUAL_SPEED[joint.kind], "rad/s" if joint.kind == "hinge" else "m/s"

    def motion(shares: Shares) -> Motion:
        how = " over a tenth of its way" if shares is _SMALL else f" at up to {shares.speed * most:.2g} {unit}"
        return Motion(words=f"move {visible(joint.name)} alone{how}", joints=(joint.name,), shares=shares)

    return [motion(shares) for shares in (_USUAL, _SLOW, _FAST, _SMALL)]


def _apart(contest: Contest, doubt: Doubt, motion: Motion) -> float | None:
    """Nats by which the truth would be ahead, whichever it is; None when the motion can't be made."""
    torques = contest.torques
    robot = replace(torques.robot, model=loaded(torques.robot.model, motion.payload))
    one, other = doubt.terms
    # What isn't there is no more than simpler, whatever moves; so is a law beside one that holds it.
    truths = [] if other is not None and other.holds(one) else [(doubt.one, one, other)]
    truths += [] if other is None else [(doubt.other, other, one)]
    try:
        made = motion.made(robot, min(torques.log.sample_rate_hz, _MOST_HZ))
        # What laws aren't linear in stays as it was found.
        forms = {
            (term.word, term.site, term.variant): term.form_value
            for fit in (doubt.other, doubt.one)
            for term in fit.terms
            if term.form is not None
        }
        laid = _laid(torques, robot, _log_of(torques, made), forms)
        left_out = _left_out(contest, doubt)
        here = all_terms(laid, left_out)
        ahead = []
        for fit, own, rival in truths:
            lacking = _lacking(torques, laid, _predicted(fit, here, laid), made)
            ahead.append(_ahead(Contest(lacking, left_out), fit, own, rival, doubt.beside))
            # Laws hold the torques that hold them.
            lacking.memory.clear()
        laid.memory.clear()
    except (ChladniError, KeyError):
        return None
    return max(min(ahead), 0.0)


def _left_out(contest: Contest, doubt: Doubt) -> frozenset[str]:
    """Give all but the terms of both sets, and the words that they differ in at every site."""
    keys = {term.key for fit in (doubt.one, doubt.other) for term in fit.terms}
    words = {word for word, _ in keys}
    differ = {term.word for term in doubt.terms if term is not None}
    elsewhere = {f"{one.word}@{one.site}" for one in contest.terms if one.word not in differ and one.key not in keys}
    return (frozenset({*ROBOT_WORDS, PARAMETER}) - words) | elsewhere


def _laid(torques: Torques, robot: Robot, log: JointLog, forms: Mapping[FormKey, float]) -> Torques:
    """Give the torques of another log, with what was guessed of the first one."""
    return Torques(
        robot=robot, log=log, cutoff_hz=torques.cutoff_hz, guesses=replace(torques.guesses, forms=forms),
        level=torques.level, guessed=torques.guessed,
    )  # fmt: skip


def _lacking(torques: Torques, laid: Torques, missing: Real, made: Trajectory) -> Torques:
    """Give the torques of a machine that lacks ``[row, coarse]`` in the same motion: its drives give that more."""
    time_s = laid.log.time_s
    fast = np.array([np.interp(time_s, time_s[laid.kept], row) for row in missing])
    found = _laid(torques, laid.robot, _log_of(torques, made, fast), laid.guesses.forms)
    return found.moving_as(laid).lacking(laid.missing + missing)


def _predicted(fit: Fit, here: Sequence[Term], laid: Torques) -> Real:
    """``[row, coarse]``: what a set of terms says is missing."""
    found = np.zeros_like(laid.missing)
    for place, term in enumerate(fit.terms):
        told = dict(zip((one.name for one in term.numbers), fit.values(place)[0].tolist(), strict=True))
        # Where a motion asks for less than a limit a law has no part beyond it.
        like = _like(here, term)
        numbers = np.array([told.get(one.name, one.about) - one.nominal for one in like.numbers])
        for row, part in like.explains(numbers).items():
            found[row] += part
    return found


def _ahead(then: Contest, truth: Fit, own: Term, rival: Term | None, beside: Beside) -> float:
    """Nats between a true set and what stands in place of a term of it: the rival, or a word of the two elsewhere."""
    rest = [_like(then.terms, one) for one in truth.terms if one is not own]
    both = [own] if rival is None else [own, rival]
    words, keys = {one.word for one in both}, {one.key for one in (*truth.terms, *both)}
    best = then.fit([*rest, _like(then.terms, own)])
    without = then.fit(rest, best)
    promised = [one for _, one in then.promise(without) if one.word in words and one.key not in keys | beside]
    instead = rest if rival is None else [*rest, _like(then.terms, rival)]
    others = [[*rest, one] for one in promised[:_RIVALS]]
    return best.nats - max(then.fit(one, best).nats for one in (instead, *others))


def _log_of(torques: Torques, made: Trajectory, beyond: Real | None = None) -> JointLog:
    """Lay a motion out as a log like the one at hand; ``[row, sample]`` is needed beyond the description."""
    log, rate, rng = torques.log, made.sample_rate_hz, np.random.default_rng(0)
    rows = [[one.name for one in made.joints].index(name) for name in log.joints]
    position, velocity, torque = (values[rows] for values in (made.position, made.velocity, made.torque))
    if beyond is not None:
        torque = torque + beyond[: len(rows)]
    # Rows of loops hold what is asked for beyond what arrives.
    wanted = torque if beyond is None or len(beyond) == len(rows) else torque + beyond[len(rows) :]
    time_s = np.arange(position.shape[1]) / rate

    def noise(density: Real) -> Real:
        return np.sqrt(density * rate / 2.0)[:, None] * rng.standard_normal(position.shape)

    asked = _command(torques, position, velocity, wanted)
    command = None if log.command is None else np.where(_known(log.command), asked, np.nan)
    effort = None
    if log.effort is not None:
        shaken = steps_and_noise(np.nan_to_num(log.effort), log.sample_rate_hz, torques.stretches)[1]
        effort = np.where(_known(log.effort), torque + noise(shaken), np.nan)
    # Each command arrives such that its hold has the sample in its middle.
    sent = time_s - torques.robot.delay_s - 0.5 / rate
    none = np.zeros(0)
    return replace(
        log, sample_rate_hz=rate, time_s=time_s, breaks=(), velocity=None, effort=effort, command=command, imu=None,
        position=position + noise(2.0 * torques.reading_noise**2 / log.sample_rate_hz),
        command_rate_hz=None if command is None else rate,
        command_messages=None if command is None else tuple(
            (sent, row) if np.isfinite(row[0]) else (none, none) for row in command
        ),
    )  # fmt: skip


def _known(rows: Real) -> Mask:
    """``[row, 1]``: whether a row holds anything."""
    return np.asarray(np.any(np.isfinite(rows), axis=1, keepdims=True))


def _command(torques: Torques, position: Real, velocity: Real, torque: Real) -> Real:
    """Give what makes the drives as described give a torque."""
    kp, kd = torques.kp[:, None], torques.kd[:, None]
    if torques.log.command_kind == "position":
        return np.asarray(position + (torque + kd * velocity) / np.where(kp > 0, kp, np.inf))
    if torques.log.command_kind == "velocity":
        return np.asarray(velocity + torque / np.where(kd > 0, kd, np.inf))
    return torque


def _like(here: Sequence[Term], term: Term) -> Term:
    """Give the term of the same word, site and kind, of the form that is nearest; or a plain one in its place."""
    there = [one for one in here if one.key == term.key]
    same = [one for one in there if one.variant == term.variant] or [one for one in there if one.variant is None]
    if not same:
        raise KeyError(term.key)
    return min(same, key=lambda one: 0.0 if term.form is None else abs(one.form_value - term.form_value))


def _sentence(robot: Robot, doubt: Doubt, found: Sequence[tuple[Motion, Design]]) -> str:
    motion, design = max(found, key=lambda one: (one[1].tells, one[1].nats))
    now, then = f"{design.now_sigmas:.2g}", f"{design.sigmas:.2g}"
    if not design.tells:
        return (
            f"No motion that was tried tells {_apart_words(doubt)}: the best, '{motion.words}', would bring {then} "
            f"sigma (now {now}). Take them as one answer."
        )
    return f"To tell {_apart_words(doubt)}, {motion.words}: {then} sigma then (now {now}). {motion.command(robot)}"


def _apart_words(doubt: Doubt) -> str:
    one, other = doubt.names
    if other is None:
        return f"whether there is {_spoken(one)}"
    if one.site == other.site and PARAMETER not in (one.effect, other.effect):
        return f"{spoken_effect(one.effect)} from {spoken_effect(other.effect)} at {visible(site_words(one.site))}"
    return f"{_spoken(one)} from {_spoken(other)}"


def _spoken(one: Candidate) -> str:
    site = visible(site_words(one.site))
    return f"another value of {site}" if one.effect == PARAMETER else f"{spoken_effect(one.effect)} at {site}"


def _look_first(robot: Robot, unexplained: Sequence[RobotJoint]) -> str | None:
    """Ask for slow and fast motions where no word explains: poses that return tell what it follows."""
    for joint in unexplained:
        _, slow, fast, _ = _alone(joint)
        try:
            slow.made(robot, _MOST_HZ)
        except ChladniError:
            continue
        return (
            f"No word explains what is missing at {visible(joint.name)}: {slow.words}, then with --speed "
            f"{fast.shares.speed:g}, and diagnose both logs. {slow.command(robot)}"
        )
    return None
