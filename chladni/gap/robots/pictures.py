"""What pictures of a diagnosed robot are made from: torques before and after, motion, and torques over motion."""

from collections.abc import Iterator, Sequence

import numpy as np

from chladni.gap.comparison.shares import gap_map
from chladni.gap.records.diagnosis import GapSignals
from chladni.gap.records.robot import JointMotion, Over, TorqueMap
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.term import Term
from chladni.gap.robots.torques import Torques
from chladni.gap.robots.trial import Confirmed
from chladni.robots.robot import RobotJoint
from chladni.signals.arrays import Index, Real

#: Poses a second, as many as a screen shows, and the most of them.
_POSES_HZ, _MOST_POSES = 50.0, 20_000
#: Steps between poses beyond which one is a gap.
_GAP = 2.5
#: Words that follow the speed; all other laws of a joint follow its position or its past.
_BY_SPEED = frozenset(
    ("coulomb_friction", "viscous_friction", "quadratic_damping", "load_friction", "stribeck_friction")
)
#: Independent samples that a bin holds at least, and how many bins a picture can tell apart: of each direction of
#: motion, and of positions, where ripple is fine.
_IN_A_BIN, _SPEEDS, _PLACES = 10.0, 8, 36


def torque_signals(torques: Torques, explained: Real) -> GapSignals:
    """Give torques of the drives beside what the motion needs: as described, and with what was found.

    Parameters
    ----------
    explained
        ``[row, coarse]``: missing torque that was found.
    """
    drive, after = torques.asked, torques.wanted + torques.whole(explained)
    noise = np.sqrt(torques.whole(torques.noise**2))
    rate = torques.rate_hz
    lines = drive.shape[1] // 2 + 1
    seconds = torques.log.time_s[torques.kept]
    time_s, frequency_hz, density = gap_map(torques.whole(torques.missing), drive, rate)
    return GapSignals(
        log=torques.log.log,
        sample_rate_hz=rate,
        output_names=tuple(one.name for one in torques.joints),
        output_units=tuple("N m" if one.kind == "hinge" else "N" for one in torques.joints),
        measured=drive,
        before=torques.wanted,
        after=after,
        noise_rms=noise,
        noise_density=np.repeat((noise**2 / (rate / 2.0))[:, None], lines, axis=1),
        map_time_s=torques.at_s(time_s),
        map_frequency_hz=frequency_hz,
        gap_map=density,
        gap_map_after=gap_map(drive - after, drive, rate)[2],
        window_starts=torques.begins if len(torques.begins) > 1 else (),
        time_s=seconds,
    )


def joint_motion(torques: Torques, found: Confirmed | None, *, named: bool) -> JointMotion:
    """Give positions, measured and simulated, at no more poses than a screen shows.

    Parameters
    ----------
    found
        None where nothing can be run.
    """
    log = torques.log
    before, after = (None, None) if found is None else _courses(found, named=named)
    courses = [one for one in (before, after) if one is not None]
    run = np.flatnonzero(np.isfinite(np.array([log.position, *courses])).all(axis=(0, 1)))
    time_s = log.time_s[run]
    step_s = max(1.0 / _POSES_HZ, float(np.ptp(time_s)) / _MOST_POSES)
    # Half a step early, for a stamp that is late by less than that.
    ticks = np.searchsorted(time_s, np.arange(time_s[0], time_s[-1] + step_s, step_s) - step_s / 2)
    kept = run[np.unique(np.minimum(ticks, run.size - 1))]
    apart = np.diff(log.time_s[kept]) > _GAP * max(step_s, 1.0 / log.sample_rate_hz)
    return JointMotion(
        joints=log.joints,
        units=tuple("rad" if one.kind == "hinge" else "m" for one in torques.joints),
        time_s=log.time_s[kept],
        measured=log.position[:, kept],
        before=None if before is None else before[:, kept],
        after=None if after is None else after[:, kept],
        gaps=tuple(np.flatnonzero(apart).tolist()),
        horizon_s=None if found is None else found.horizon_s,
    )


def _courses(found: Confirmed, *, named: bool) -> tuple[Real | None, Real | None]:
    """Simulations before and after; None of one that is farther from the log than a robot that stands still."""
    errors = (found.before, found.after if named else found.tuned)
    courses = (found.course_before, found.course_after if named else found.course_tuned)
    before, after = (one.whole if error <= 1.0 else None for error, one in zip(errors, courses, strict=True))
    return before, after


def torque_maps(contest: Contest, best: Fit, named: Sequence[Term]) -> tuple[TorqueMap, ...]:
    """Give the torques of the joints over what they follow.

    Parameters
    ----------
    best
        The most probable set: what it explains beside a law is taken out.
    named
        Those of its terms that are named.
    """
    return tuple(_Maps(contest, best, named).all())


class _Maps:
    def __init__(self, contest: Contest, best: Fit, named: Sequence[Term]) -> None:
        self._torques, self._named = contest.torques, {(one.word, one.site) for one in named}
        self._laws = [(term, *best.values(place)) for place, term in enumerate(best.terms) if term.rows]
        self._left = self._torques.missing - contest.explained(best)

    def all(self) -> Iterator[TorqueMap]:
        pairs = {(term.rows, _over(term)): term for term, *_ in self._laws if term.is_coupling}
        for row, joint in self._torques.rows:
            yield from self._of_joint(row, joint)
            yield from (self._of_pair(term) for (rows, _), term in pairs.items() if max(rows) == row)

    def _of_joint(self, row: int, joint: RobotJoint) -> Iterator[TorqueMap]:
        torques = self._torques
        if not torques.moving[row].any():
            return
        speed = torques.velocity[row]
        described = joint.friction * torques.sign[row] + joint.damping * speed
        courses: tuple[tuple[Over, Real, Real], ...] = (
            ("velocity", speed, described), ("position", torques.position[row], np.zeros_like(speed)),
        )  # fmt: skip
        own = [one for one in self._laws if one[0].rows[0] == row and not one[0].is_coupling]
        for over, motion, has in courses:
            laws = [one for one in own if _over(one[0]) == over]
            yield self._map(joint.name, over, row, motion, has, laws)

    def _of_pair(self, term: Term) -> TorqueMap:
        """What acts on the motion of two joints together, as the outer one feels it."""
        (inner, outer), over, ratio = term.rows, _over(term), term.ratio or 1.0
        motions = self._torques.velocity if over == "velocity" else self._torques.position
        motion = motions[inner] + ratio * motions[outer]
        laws = [one for one in self._laws if one[0].site == term.site and _over(one[0]) == over]
        return self._map(term.site, over, outer, motion, 0.0 * motion, laws, ratio)

    def _map(
        self,
        site: str,
        over: Over,
        row: int,
        motion: Real,
        described: Real,
        laws: Sequence[tuple[Term, Real, Real]],
        ratio: float | None = None,
    ) -> TorqueMap:
        torques, by = self._torques, ratio or 1.0
        own = sum((_added(term, values, row) for term, values, _ in laws), start=np.zeros_like(motion))
        moving = np.flatnonzero(torques.moving[row])
        rows = (motion, (self._left[row] + own) / by + described, own / by + described, described)
        x, torque, law, has = (one[moving] for one in rows)
        bins = list(_bins(x, over, torques.numbers_a_sample))

        def means(values: Real) -> Real:
            return np.array([np.mean(values[one]) for one in bins])

        def scatter(values: Real) -> Real:
            return np.array([_about_line(x[one], values[one]) for one in bins])

        independent = np.array([one.size for one in bins]) * torques.numbers_a_sample
        hinge = torques.joints[row].kind == "hinge"
        unit = "rad" if hinge else "m"
        return TorqueMap(
            site=site, over=over, motion=x, torque=torque,
            load=torques.of_joints(torques.need.torque)[row][moving],
            motion_unit=unit if over == "position" else f"{unit}/s", torque_unit="N m" if hinge else "N",
            centre=means(x), mean=means(torque), error=scatter(torque) / np.sqrt(np.maximum(independent, 1.0)),
            described=means(has), law=means(law) if laws else None, spread=scatter(law) if laws else None,
            is_named=bool(laws) and all((term.word, term.site) in self._named for term, *_ in laws),
            ratio=ratio,
        )  # fmt: skip


def _over(term: Term) -> Over:
    return "velocity" if term.word in _BY_SPEED else "position"


def _added(term: Term, values: Real, row: int) -> Real | float:
    """``[coarse]``: missing torque that a law explains at a joint."""
    return term.explains(values - term.nominal).get(row, 0.0)


def _about_line(x: Real, y: Real) -> float:
    """Standard deviation about a straight line: the slope within a bin is no scatter."""
    x, y = x - np.mean(x), y - np.mean(y)
    power = float(x @ x)
    return float(np.std(y - (x @ y / power if power > 0 else 0.0) * x))


def _bins(motion: Real, over: Over, numbers_a_sample: float) -> Iterator[Index]:
    """Samples of each bin by rising motion, as many in each; of the two directions of a motion apart."""
    order = np.argsort(motion)
    speeds = over == "velocity"
    for part in np.split(order, [int(np.searchsorted(motion[order], 0.0))]) if speeds else [order]:
        count = min(int(part.size * numbers_a_sample / _IN_A_BIN), _SPEEDS if speeds else _PLACES)
        if count:
            yield from np.array_split(part, count)
