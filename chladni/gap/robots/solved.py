"""What a robot's description lacks, found on one log: terms, delays, and the torques that they were found in."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from chladni.gap.robots.contest import Contest, Fit
from chladni.gap.robots.search import searched
from chladni.gap.robots.torques import ALL_COMMANDS, Torques
from chladni.gap.robots.words import Term
from chladni.signals.arrays import Real

#: Times that columns are made anew for what was found, until that moves by less than so many seconds and metres.
_SHIFTS, _SETTLED_S, _SETTLED_M = 5, 1e-4, 2e-3
#: Deviations of its mass from which a payload has a place.
_TOLD_BY = 2.0
_PAIR = 2

#: Value, standard deviation and unit by name.
Numbers = dict[str, tuple[float, float, str]]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solved:
    """The answer in numbers.

    Attributes
    ----------
    contest
        Of the torques with commands shifted by what was found.
    best
        Its most probable set.
    """

    contest: Contest
    best: Fit

    @property
    def torques(self) -> Torques:
        """Those of the contest."""
        return self.contest.torques

    def numbers(self, place: int) -> Numbers:
        """Value, standard deviation and unit of a term's numbers, as they're told."""
        term = self.best.terms[place]
        values, deviations = self.best.values(place)
        if term.word in _TOLD:
            return _TOLD[term.word](term, values, deviations)
        gain = self._gain(term)
        sense = {} if len(term.rows) < _PAIR else {"sense": (1.0 if term.variant == "sum" else -1.0, 0.0, "1")}
        return sense | {
            number.name: (float(value * gain), float(deviation * gain), number.unit)
            for number, value, deviation in zip(term.numbers, values, deviations, strict=True)
        }

    def _gain(self, term: Term) -> float:
        """Of the drive that a law was found at: its numbers are in units of what was asked."""
        sites = {self.torques.joints[row].name for row in term.rows}
        for place, other in enumerate(self.best.terms):
            if other.site in sites and other.word in ("gain_error", "controller_gain"):
                return 1.0 / float(self.best.values(place)[0][0])
        return 1.0


def solved(torques: Torques, left_out: frozenset[str], progress: Callable[[float], None]) -> Solved:
    """Search, and search on with the columns of delays and payloads exact for what they were found to be.

    Parameters
    ----------
    left_out
        Words that don't take part.
    """
    contest = Contest(torques, left_out)
    best = searched(contest, progress=progress)
    for _ in range(_SHIFTS):
        late, centres = _guesses(torques, best)
        leveled = contest.torques.with_level(np.array([one.over_noise for one in best.left]))
        if contest.torques.level is not None and _is_settled(leveled, late, centres):
            break
        contest = Contest(leveled.with_guesses(late, centres), left_out)
        best = searched(contest, contest.again(best), progress=progress)
    return Solved(contest=contest, best=best)


def _guesses(torques: Torques, fit: Fit) -> tuple[dict[str, float], dict[str, Real]]:
    """Delays beyond the described one, and centres of payloads whose mass is told."""
    late, centres = {}, {}
    for place, term in enumerate(fit.terms):
        values, deviations = fit.values(place)
        if term.word == "delay":
            late[term.site] = float(values[0]) - torques.robot.delay_s * (term.site == ALL_COMMANDS)
        elif term.word == "payload" and values[0] > _TOLD_BY * deviations[0]:
            centres[term.site] = np.asarray(values[1:] / values[0])
    return late, centres


def _is_settled(torques: Torques, late: dict[str, float], centres: dict[str, Real]) -> bool:
    if late.keys() != torques.late_s.keys() or centres.keys() != torques.centre_m.keys():
        return False
    return all(abs(late[one] - torques.late_s[one]) < _SETTLED_S for one in late) and all(
        float(np.max(np.abs(centres[one] - torques.centre_m[one]))) < _SETTLED_M for one in centres
    )


def _gain_error(_: Term, values: Real, deviations: Real) -> Numbers:
    gain = 1.0 / float(values[0])
    return {"gain": (gain, float(deviations[0]) * gain**2, "1")}


def _controller_gain(_: Term, values: Real, deviations: Real) -> Numbers:
    kp = 1.0 / float(values[0])
    return {
        "kp": (kp, float(deviations[0]) * kp**2, "1"),
        "kd": (
            1.0 + float(values[1]) * kp,
            float(np.hypot(deviations[1] * kp, values[1] * deviations[0] * kp**2)),
            "1",
        ),
    }


def _payload(_: Term, values: Real, deviations: Real) -> Numbers:
    mass = float(values[0])
    found = {"mass": (mass, float(deviations[0]), "kg")}
    for axis, moment, deviation in zip("xyz", values[1:], deviations[1:], strict=True):
        # Where the mass is hardly known, so is its place.
        spread = float(np.hypot(deviation, moment * deviations[0] / mass) / abs(mass)) if mass else np.inf
        found[axis] = (float(moment) / mass if mass else 0.0, spread, "m")
    return found


def _saturation(term: Term, _values: Real, _deviations: Real) -> Numbers:
    limit, unit = str(term.variant).split(" ", 1)
    return {"limit": (float(limit), 0.0, unit)}


def _spring(term: Term, values: Real, deviations: Real) -> Numbers:
    stiffness, constant = map(float, values)
    rest = -constant / stiffness if stiffness else 0.0
    spread = float(np.hypot(deviations[1], rest * deviations[0]) / abs(stiffness)) if stiffness else np.inf
    unit = "rad" if "rad" in term.numbers[0].unit else "m"
    return {"stiffness": (stiffness, float(deviations[0]), term.numbers[0].unit), "rest": (rest, spread, unit)}


_TOLD = {
    "gain_error": _gain_error,
    "controller_gain": _controller_gain,
    "payload": _payload,
    "saturation": _saturation,
    "joint_spring": _spring,
}
