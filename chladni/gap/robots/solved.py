"""What a robot's description lacks, found on one log: terms, delays, and the torques that they were found in."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from chladni.gap.calibration import SAME
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.forms import Forms, refined
from chladni.gap.robots.gains import Gains, guessed_gains, unknown_gains, with_gains
from chladni.gap.robots.payload_words import OF_THE_LOG
from chladni.gap.robots.pushes import PUSHED, Push, paying, price, pushed, pushes_of
from chladni.gap.robots.search import searched
from chladni.gap.robots.term import Term
from chladni.gap.robots.told import TOLD, Numbers
from chladni.gap.robots.tolerances import LOOP_S
from chladni.gap.robots.torques import ALL_COMMANDS, FormKey, Guesses, Torques
from chladni.signals.errors import ModelError

#: Times that columns are made anew for what was found, until that moves by less than so many seconds and metres.
_SHIFTS, _SETTLED_S, _SETTLED_M = 5, 1e-4, 2e-3
#: Deviations of its mass from which a payload has a place, and down to which it keeps it.
_TOLD_BY, _KEPT_BY = 2.0, 1.0
#: Times that gains which nobody says are guessed anew, until they move by less.
_GUESSES, _SETTLED_GAIN = 2, 0.05
#: Of a form: by how little it moves when it has settled.
_SETTLED = 0.01


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Solved:
    """The answer in numbers.

    Attributes
    ----------
    contest
        Of the torques with commands shifted by what was found.
    best
        Its most probable set.
    spread
        Standard deviations of the forms of laws, by word, site and variant.
    pushes
        What pushed for a while; those stretches took no part.
    """

    contest: Contest
    best: Fit
    spread: Mapping[FormKey, float] = field(default_factory=dict)
    pushes: tuple[Push, ...] = ()

    @property
    def torques(self) -> Torques:
        """Those of the contest."""
        return self.contest.torques

    def numbers(self, place: int) -> Numbers:
        """Value, standard deviation and unit of a term's numbers, as they're told."""
        term = self.best.terms[place]
        values, deviations = self.best.values(place)
        if (term.word, term.site) == ("delay", ALL_COMMANDS):
            found = {"delay": (*self.contest.delay_of_all(self.best), "s")}
        elif term.word in TOLD:
            found = TOLD[term.word](term, values, deviations)
        else:
            gain = self._gain(term)
            found = {
                number.name: (float(value * gain), float(deviation * gain), number.unit)
                for number, value, deviation in zip(term.numbers, values, deviations, strict=True)
            }
            if term.ratio is not None and term.form is None:
                found = {"sense": (term.ratio, 0.0, "1"), **found}
        if term.form is not None:
            spread = self.spread.get((term.word, term.site, term.variant), np.inf)
            found[term.form.name] = (term.form.value, float(spread), term.form.unit)
        return found

    def gains(self) -> dict[str, tuple[tuple[float, float], tuple[float, float]]]:
        """Give kp and kd of loops whose gains are in doubt, each with its standard deviation."""
        torques, within, found = self.torques, self.contest.tolerances(self.best), {}
        for row, joint in torques.rows:
            names = f"{joint.name}.kp", f"{joint.name}.kd"
            if names[0] in within:
                doubts = torques.gain_doubts(row)
                (of_kp, spread_kp), (of_kd, spread_kd) = (within[name] for name in names)
                kp, kd = torques.gains(row, (of_kp, of_kd))
                over = float(torques.kp[row]) / kp
                found[joint.name] = (
                    (kp, kp * doubts[0] * spread_kp / over),
                    (max(kd, 0.0), float(torques.kd[row]) * doubts[1] * spread_kd / over),
                )
        return found

    def _gain(self, term: Term) -> float:
        """Of the drive that a law was found at: its numbers are in units of what was asked."""
        sites = {self.torques.joints[row].name for row in term.rows}
        for place, other in enumerate(self.best.terms):
            scales = other.word in ("gain_error", "controller_gain") and self.torques.in_asked(other.word)
            if other.site in sites and scales:
                return 1.0 / float(self.best.values(place)[0][0])
        return 1.0


def solved(torques: Torques, left_out: frozenset[str], progress: Callable[[float], None]) -> Solved:
    """Search, and search on with the columns of delays and payloads exact for what they were found to be.

    Parameters
    ----------
    left_out
        Words, and words at a site (``word@site``), that don't take part.
    """
    names = unknown_gains(torques)
    gains = guessed_gains(torques, names) if names else {}
    if gains:
        torques = _guessing(torques, gains)
    if not np.any(torques.driven):
        raise ModelError(
            f"{torques.robot.name}: no gains of its drives, and {torques.log.log} has no measured effort; give kp "
            "and kd under [control] of a robot file, or record efforts"
        )
    found = _without_pushes(torques, left_out, progress)
    for _ in range(_GUESSES * bool(gains)):
        gains = {name: (kp[0], kd[0]) for name, (kp, kd) in found.gains().items() if name in torques.guessed}
        before = dict(zip(torques.log.joints, torques.kp.tolist(), strict=True))
        if all(abs(kp / before[name] - 1.0) < _SETTLED_GAIN for name, (kp, _) in gains.items()):
            break
        # What was found by the last guess is large, and laws hold the torques that hold them.
        del found
        torques.memory.clear()
        torques = _guessing(torques, gains)
        found = _without_pushes(torques, left_out, progress)
    return found


def _guessing(torques: Torques, gains: Gains) -> Torques:
    robot = with_gains(torques.robot, gains)
    return Torques(robot=robot, log=torques.log, cutoff_hz=torques.cutoff_hz, guessed=frozenset(gains))


def _without_pushes(torques: Torques, left_out: frozenset[str], progress: Callable[[float], None]) -> Solved:
    found = _settled(Contest(torques, left_out), left_out, progress)
    if PUSHED in left_out:
        return found
    for fit in (found.best, found.contest.nothing):
        away = pushed(found.contest, fit)
        if not away:
            continue
        # What pushes for a while would be taken for laws of its joints; without it laws leave others less.
        other = _settled(Contest(found.torques.without(away), left_out), left_out, progress)
        still = paying(other.contest, other.best, away)
        if still and still != away:
            other = _settled(Contest(found.torques.without(still), left_out), left_out, progress)
        if still:
            # What acts for a while hides in the level of noise that it makes: laws are tried at that without it.
            level = (other.torques.noise / found.torques.noise) ** 2
            quiet = Contest(found.torques.with_level(level), left_out)
            law = _settled(quiet, left_out, progress, first=found.best, levels=False)
            nats = other.best.nats - price(found.contest, still) - law.best.nats
            if nats > 0:
                return replace(other, pushes=pushes_of(other.contest, other.best, law.best, nats))
            # As quiet as they leave it.
            return _settled(law.contest, left_out, progress, first=law.best)
    return found


def _settled(
    contest: Contest,
    left_out: frozenset[str],
    progress: Callable[[float], None],
    *,
    first: Fit | None = None,
    levels: bool = True,
) -> Solved:
    """Search until guesses and the noise's level have settled; from the words of a fit, and at the level given."""
    best = searched(contest, *([] if first is None else [contest.again(first)]), progress=progress)
    spread: Forms = {}
    is_still = False
    for _ in range(_SHIFTS):
        forms, spread = refined(contest, best, contest.torques.guesses.forms)
        leveled = contest.torques.with_level(contest.quietest(best)) if levels else contest.torques
        guessed = leveled.with_guesses(_guesses(contest, best, forms), contest.explained(best))
        if _is_settled(contest.torques, guessed):
            break
        # What one search left as it was isn't searched again at the same noise.
        is_still = is_still and _is_as_quiet(contest.torques, guessed)
        contest = Contest(guessed, left_out)
        begin = contest.again(best)
        best = begin if is_still else searched(contest, begin, progress=progress)
        is_still = set(best.terms) == set(begin.terms)
    return Solved(contest=contest, best=best, spread=spread)


def _guesses(contest: Contest, fit: Fit, forms: Forms) -> Guesses:
    """Delays beyond the described one, centres of payloads whose mass is told, offsets, and forms."""
    torques = contest.torques
    late, centres, offset = {}, {}, {}
    for place, term in enumerate(fit.terms):
        values, deviations = fit.values(place)
        if term.word == "delay":
            late[term.site] = float(values[0])
            if term.site == ALL_COMMANDS:
                whole = late[term.site] + _turn_s(contest, fit) - torques.robot.delay_s
                late[term.site] = float(np.mean(torques.same_commands(whole)))
        elif term.word == "payload" and values[0] > _placed_from(torques, term.site) * deviations[0]:
            centres[term.site] = np.asarray(values[1:4] / values[0])
        elif term.word == "encoder_offset" and term.variant == OF_THE_LOG:
            offset[term.site] = float(values[0])
    return Guesses(late_s=late, centre_m=centres, offset=offset, forms=forms)


def _placed_from(torques: Torques, link: str) -> float:
    """Deviations of a payload's mass from which it has a place: what has one makes its mass another."""
    return _KEPT_BY if link in torques.guesses.centre_m else _TOLD_BY


def _turn_s(contest: Contest, fit: Fit) -> float:
    """How long commands wait for the loop's turn: a part of the delay of all, about whose guess it's a slope."""
    return LOOP_S * contest.tolerances(fit)["turn"][0]


def _is_settled(before: Torques, after: Torques) -> bool:
    old, new = before.guesses, after.guesses
    pairs: tuple[tuple[Mapping[Any, Any], Mapping[Any, Any], float], ...] = (
        (old.late_s, new.late_s, _SETTLED_S),
        (old.centre_m, new.centre_m, _SETTLED_M),
        (old.offset, new.offset, _SETTLED_M),
        (_logs(old.forms), _logs(new.forms), _SETTLED),
    )
    return _is_as_quiet(before, after) and all(
        was.keys() == now.keys() and all(np.max(np.abs(now[key] - was[key])) < close for key in now)
        for was, now, close in pairs
    )


def _is_as_quiet(before: Torques, after: Torques) -> bool:
    if before.level is None or after.level is None:
        return False
    return bool(np.all(np.abs(np.log(after.level / before.level)) < np.log(SAME)))


def _logs(forms: Forms) -> dict[FormKey, float]:
    return {key: float(np.log(abs(one) + 1e-30)) for key, one in forms.items()}
