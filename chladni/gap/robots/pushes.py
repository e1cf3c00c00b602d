"""Stretches of a log in which something pushes: a torque of any shape for a while, which no law explains."""

from dataclasses import dataclass
from math import log, log1p, sqrt

import numpy as np
from scipy.ndimage import label, uniform_filter1d
from scipy.special import chdtri, expit

from chladni.gap.calibration import ANOTHER, CLOSE, DETAILS, DOUBTED, FAR, LAPSE, LITTLE, MOST, QUARTER, TEMPER
from chladni.gap.records.diagnosis import Candidate, Cause, FittedNumber
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.term import Term
from chladni.gap.robots.torques import RIGHT, Torques
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Mask, Real

#: Periods of the cutoff over which energy is looked at: what a filter of its length can tell apart.
_WINDOW = 2.0

#: Word of what pushes: a named part of ``unknown``.
PUSHED = "external_force"

#: From the log's start, s.
Stretch = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Push:
    """A torque that acts for a while.

    Attributes
    ----------
    start_s, end_s, spread_s
        From the log's start, and their standard deviation.
    joints
        At which it's felt, most first.
    links
        That may be pushed: what the farthest of these joints moves, then what hangs on it, where a force whose line
        meets the axes between would be felt no farther.
    torque, spread, unit
        Largest at the first of them, N m (N), and the noise's standard deviation there.
    probability
        That something pushed, against all that laws explain.
    others
        Laws of these joints that the log hardly tells from it.
    """

    start_s: float
    end_s: float
    spread_s: float
    joints: tuple[str, ...]
    links: tuple[str, ...]
    torque: float
    spread: float
    unit: str
    probability: float
    others: tuple[Term, ...]

    @property
    def cause(self) -> Cause:
        """The record: the part of ``unknown`` that has a place and a time."""
        return Cause(
            effect=PUSHED,
            site=self.links[0],
            probability=self.probability,
            group=self.links,
            alternatives=tuple(dict.fromkeys(Candidate(effect=law.word, site=law.site) for law in self.others)),
            parameters={
                "start": FittedNumber(value=self.start_s, std=self.spread_s, unit="s"),
                "end": FittedNumber(value=self.end_s, std=self.spread_s, unit="s"),
                "torque": FittedNumber(value=self.torque, std=self.spread, unit=self.unit),
            },
        )


def pushed(contest: Contest, fit: Fit) -> tuple[Stretch, ...]:
    """Give the stretches that hold most of what a fit leaves beyond the noise; none where it's spread."""
    energy, count = contest.course(fit)
    if not count.any():
        return ()
    times = contest.torques.log.time_s[contest.torques.kept]
    size = max(round(_WINDOW / contest.torques.cutoff_hz * contest.torques.rate_hz), 1)
    # Where a log begins, a push is no other than a state that nobody knows: of a motor's spring, of a bristle.
    for first in contest.torques.begins:
        energy[:, first : first + size] = count[:, first : first + size] = 0.0
    # A push on one joint of many is no smaller than on one of few.
    ratio = np.max(_mean(energy, size) / np.maximum(_mean(count, size), np.mean(count) * LITTLE), axis=0)
    chance = _by_chance(size * contest.torques.numbers_a_sample, count.size / size)
    inside = ratio > max(chance, LITTLE * float(np.max(ratio)))
    excess = np.sum(energy - count, axis=0)
    if not inside.any() or inside.mean() > QUARTER or np.sum(excess[inside]) < MOST * np.sum(excess):
        return ()
    marks, found = label(inside)
    bounds = [np.flatnonzero(marks == each + 1)[[0, -1]] for each in range(found)]
    stretches = [(float(times[a]), float(times[b])) for a, b in bounds]
    return tuple(one for one in stretches if _pays(contest, energy - count, one))


def paying(contest: Contest, fit: Fit, stretches: tuple[Stretch, ...]) -> tuple[Stretch, ...]:
    """Give those in which a fit without them leaves more than a torque of any shape costs, and than one errs by."""
    torques, rest = contest.torques, _left(contest, fit)
    energy, count = contest.course(fit)
    # A description errs by most at the highest torque; a law, as where friction holds, by all that it gives; and a
    # loop by what a step of its encoder asks. These come and go: their usual power tells little.
    changes = torques.drive - np.mean(torques.drive, axis=1, keepdims=True)
    errs = RIGHT * np.max(np.abs(changes), axis=1) + np.max(np.abs(contest.of_terms(fit)[: len(rest)]), axis=1)
    errs = np.maximum(errs + torques.kp * torques.resolution, np.sqrt(DOUBTED) * torques.noise[: len(rest)])
    return tuple(
        one
        for one in stretches
        if _pays(contest, energy - count, one)
        and np.any(torques.driven & (np.sqrt(np.mean(rest[:, _inside(torques, one)] ** 2, axis=1)) > errs))
    )


def _pays(contest: Contest, excess: Real, stretch: Stretch) -> bool:
    """Whether what is left in a stretch beyond noise is worth more than a torque of any shape there."""
    beyond = max(float(np.sum(excess[:, _inside(contest.torques, stretch)])) / 2.0, 0.0)
    return DETAILS * log1p(beyond / DETAILS) > price(contest, (stretch,))


def price(contest: Contest, stretches: tuple[Stretch, ...]) -> float:
    """Give the nats that a torque of any shape in some stretches pays."""
    times = contest.torques.log.time_s
    whole = float(times[-1] - times[0])
    # At one of the joints, and of the places that it could be at in a log at about its own length.
    alone = DETAILS - log(ANOTHER) + log(len(contest.torques.joints))
    return sum(alone + log(max(whole / max(b - a, 1e-3), 1.0)) for a, b in stretches)


def pushes_of(contest: Contest, fit: Fit, laws: Fit, nats: float) -> tuple[Push, ...]:
    """Tell of the stretches that were left out of a contest, which brought so many nats more than laws."""
    rest = _left(contest, fit)
    probability = (1.0 - LAPSE) * float(expit(nats / TEMPER))
    found = []
    for stretch in contest.torques.away:
        felt = _felt(contest.torques, rest[:, _inside(contest.torques, stretch)])
        names = {one.name for one, _ in felt}
        joint, torque = felt[0]
        found.append(
            Push(
                start_s=stretch[0],
                end_s=stretch[1],
                # Anywhere in the window that tells of it.
                spread_s=_WINDOW / contest.torques.cutoff_hz / sqrt(12.0),
                joints=tuple(one.name for one, _ in felt),
                # On the farthest joint that feels it the fewest links hang.
                links=min((contest.torques.robot.hanging(one) for one, _ in felt), key=len),
                torque=torque,
                spread=float(contest.torques.noise[contest.torques.joints.index(joint)]),
                unit="N m" if joint.kind == "hinge" else "N",
                probability=probability,
                others=tuple(law for law in laws.terms if law.site in names) if nats < CLOSE else (),
            )
        )
    return tuple(found)


def _felt(torques: Torques, rest: Real) -> list[tuple[RobotJoint, float]]:
    """Joints at which it's felt, most first, with the largest torque at each."""
    over = np.sqrt(np.mean(rest**2, axis=1)) / torques.noise[: len(rest)] * torques.driven
    order = np.argsort(-over)
    felt = [row for row in order.tolist() if over[row] > max(FAR, LITTLE * over[order[0]])] or [int(order[0])]
    return [(torques.joints[row], float(np.max(np.abs(rest[row])))) for row in felt]


def _left(contest: Contest, fit: Fit) -> Real:
    """``[joint, coarse]``: torque that a fit leaves."""
    return np.asarray((contest.torques.missing - contest.explained(fit))[: len(contest.torques.joints)])


def _inside(torques: Torques, stretch: Stretch) -> Mask:
    times = torques.log.time_s[torques.kept]
    return np.asarray((times >= stretch[0]) & (times <= stretch[1]))


def _by_chance(numbers: float, places: float) -> float:
    """Give the noise's power over the usual that one of many places has with a chance of a tenth."""
    return float(chdtri(numbers, ANOTHER / places)) / numbers


def _mean(values: Real, size: int) -> Real:
    return np.asarray(uniform_filter1d(values, size, axis=-1, mode="constant"))
