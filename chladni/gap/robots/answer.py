"""From the torques that were explained to the records of a diagnosis."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from chladni.gap.calibration import CLOSE, COVERAGE, LAPSE, LEAST_SHARE, NAMED, SIGMAS, TEMPER
from chladni.gap.comparison.shares import Variable, band_shares, regime_shares, relative_residual, time_shares
from chladni.gap.records.diagnosis import (
    PARAMETER,
    Candidate,
    Cause,
    ChannelGap,
    Closing,
    Diagnosis,
    FittedNumber,
    HeldOut,
    Ranked,
    SiteShare,
    Verdict,
    Where,
)
from chladni.gap.robots.contest import Contest
from chladni.gap.robots.fit import Fit
from chladni.gap.robots.forward import machine_of
from chladni.gap.robots.next_measurement import next_measurement
from chladni.gap.robots.pictures import joint_motion, torque_maps, torque_signals
from chladni.gap.robots.pushes import Push
from chladni.gap.robots.remarks import remarks_on
from chladni.gap.robots.search import alternatives
from chladni.gap.robots.solved import Solved
from chladni.gap.robots.term import Term
from chladni.gap.robots.torques import Torques
from chladni.gap.robots.trial import Confirmed, Trial
from chladni.gap.robots.tuned import tuned_parameters
from chladni.gap.robots.wider_laws import adds, not_told_apart
from chladni.robots.dynamics import inertial_numbers
from chladni.signals.arrays import Mask, Real

if TYPE_CHECKING:
    from chladni.gap.robots.rival import Rival

#: Others that are weighed in place of each cause, and blocks of the log of which every other one judges.
_OTHERS, _BLOCKS = 6, 16
#: Samples that lie farther apart than so many intervals are of two stretches.
_GAP = 1.5
#: Times the noise from which an error is clear of it.
_CLEAR = 2.0
#: Of the error without: what an answer leaves that simulation confirms.
_HALF = 0.5
#: Of its share where it acts most: joints with less don't tell of it.
_ACTS = 0.1
#: What a description states and a joint may have less of: then it's a value that is wrong.
_STATED = {"coulomb_friction": "frictionloss", "viscous_friction": "damping", "armature": "armature"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """The records of what was found on one log."""

    solved: Solved

    @property
    def _contest(self) -> Contest:
        return self.solved.contest

    @property
    def _best(self) -> Fit:
        return self.solved.best

    @cached_property
    def weighed(self) -> tuple["Weighed", ...]:
        """Each term of the best set, by falling probability."""
        found = [_weighed(self.solved, place) for place in range(len(self._best.terms))]
        return tuple(sorted(found, key=lambda one: (-one.probability, -one.share)))

    @property
    def named(self) -> tuple["Weighed", ...]:
        """Those that torques name, without what a simulation denies."""
        return self._confirmed[0]

    @property
    def denied(self) -> Confirmed | None:
        """What simulation says of the names that torques suggest, when it's better without them all."""
        return self._confirmed[1] if self._suggested and not self.named else None

    @cached_property
    def to_leave_out(self) -> frozenset[str]:
        """What simulation confirms least, as ``word@site``: others that fit those torques may follow the motion."""
        if not self._suggested or self.simulated is None or self.is_confirmed():
            return frozenset()
        left = _without_worst(self._suggested, self.simulated)
        return frozenset(f"{one.term.word}@{one.term.site}" for one in self._suggested if one not in left)

    def is_confirmed(self) -> bool:
        """Whether simulation takes more than half of the error away."""
        found = self.simulated
        return bool(self.named) and found is not None and found.after < _HALF * found.tuned

    @property
    def simulated(self) -> Confirmed | None:
        """What simulation says of the names; None where it can't be run, or runs go astray."""
        return self._confirmed[1]

    @cached_property
    def _confirmed(self) -> tuple[tuple["Weighed", ...], Confirmed | None, Confirmed | None]:
        """The names with which positions are simulated no worse than without, that simulation, and any run."""
        named, first, trial = self._suggested, None, Trial(torques=self.solved.torques)
        while True:
            found = trial.of([one.term for one in named])
            if found is None or not np.all(np.isfinite([found.before, found.tuned, found.after])):
                return named if _is_better(_of_torques(self.solved, [one.term for one in named])) else (), None, found
            first = first or found
            if not named:
                return (), first, first
            kept = _without_worst(named, found) if found.denies else _without_worse(named, found)
            if kept == named:
                return named, found, found
            named = kept

    @cached_property
    def _suggested(self) -> tuple["Weighed", ...]:
        """Those that are more probable than not, and explain more than rounding."""
        return tuple(
            one
            for one in self.weighed
            if one.of_any_law >= NAMED and one.share >= LEAST_SHARE and one.is_told and one.is_felt
        )

    @cached_property
    def unexplained(self) -> tuple[int, ...]:
        """Rows of joints at which something acts that no word explains."""
        # Where a term isn't named, what it stands for is unknown.
        doubted = {
            row
            for one in self.weighed
            if one not in self.named and one.gain > TEMPER and one.is_felt
            for row in one.acts
        }
        left = self._contest.over_rounding(self._best.energy)
        beyond = np.flatnonzero((self._contest.unknowns(self._best) > TEMPER) & (left > 1.0))
        named = {row for one in self.named for row in one.acts}
        return tuple(sorted({*beyond.tolist(), *(doubted - named)}))

    @cached_property
    def verdict(self) -> Verdict:
        """A name, a value, nothing, or something without a name."""
        if self.named:
            return "parameters" if all(one.candidate.effect == PARAMETER for one in self.named) else "effect"
        return "unknown" if self.unexplained or self.denied is not None or self.solved.pushes else "none"

    @cached_property
    def closing(self) -> Closing:
        """How far the gap closes: of positions, simulated from the log's poses; of torques where runs go astray."""
        if self.simulated is not None:
            return _of_positions(self.solved.torques, self.simulated, named=bool(self.named))
        return _of_torques(self.solved, [one.term for one in self.named])

    def _next_measurement(self, unexplained: Sequence[str]) -> str | None:
        # What a simulation denies as a whole isn't told apart by its parts.
        weighed = self.weighed if self.denied is None else ()
        named = [(self._best.terms.index(one.term), one.candidate, one.share) for one in weighed]
        return next_measurement(self._contest, self._best, named, unexplained)

    def _cause(self, one: "Weighed", rival: "Rival | None") -> Cause:
        """Give a cause, less sure as far as another answer without it comes close."""
        if rival is None or one.candidate in {each.candidate for each in rival.answer.named}:
            return one.cause
        there = [each.candidate for each in rival.answer.named if set(each.acts) & set(one.acts)]
        return replace(
            one.cause, probability=one.probability / (1.0 + float(np.exp(-rival.behind / TEMPER))),
            alternatives=tuple(dict.fromkeys([*one.others, *(there if rival.behind < CLOSE else [])])),
        )  # fmt: skip

    def diagnosis(self, rival: "Rival | None" = None) -> Diagnosis:
        """Give the record.

        Parameters
        ----------
        rival
            An answer that is less probable, of other words.
        """
        solved = self.solved
        joints = [solved.torques.name_of(row) for row in self.unexplained]
        told = self._contest.fit([one.term for one in self.named])
        return Diagnosis(
            model=solved.torques.robot.name,
            logs=(solved.torques.log.log,),
            verdict=self.verdict,
            causes=tuple(self._cause(one, rival) for one in self.named) or tuple(one.cause for one in solved.pushes),
            ranking=tuple(_ranking(self.weighed)),
            where=_where(solved, self._contest.nothing),
            left=_where(solved, self._best) if self.verdict == "unknown" else None,
            gap=self.closing,
            tuned_parameters=tuned_parameters(solved),
            next_measurement=self._next_measurement(joints),
            remarks=remarks_on(solved, joints, named=bool(self.named)),
            advice=_advice(self.verdict, joints, self.denied, self.solved.pushes),
            signals=torque_signals(solved.torques, self._contest.explained(told)),
            machine=machine_of(self._contest, told),
            motion=joint_motion(solved.torques, self._confirmed[2], named=bool(self.named)),
            torque_maps=torque_maps(self._contest, self._best, [one.term for one in self.named]),
            answer_set=tuple(dict.fromkeys(each for one in self.weighed for each in (one.candidate, *one.others))),
            coverage=COVERAGE,
        )


def _is_better(torques: Closing) -> bool:
    """Whether no more torque is missing than without what was found, nor than there is: as of positions."""
    return torques.after <= min(torques.tuned, 1.0)


def _without_worst(named: tuple["Weighed", ...], found: Confirmed) -> tuple["Weighed", ...]:
    """Leave out what acts where the error grew most, the least probable before others."""
    grew = found.per_joint_after**2 - found.per_joint_tuned**2
    worst = int(np.nanargmax(np.where(np.isfinite(grew), grew, np.nan)))
    there = [one for one in named if worst in {row % len(found.joints) for row in one.acts}] or list(named)
    return tuple(one for one in named if one is not there[-1])


def _without_worse(named: tuple["Weighed", ...], found: Confirmed) -> tuple["Weighed", ...]:
    """Leave out the least probable word at a joint that came out worse, though the robot as a whole didn't."""
    worse = {name for name, is_worse in zip(found.joints, found.worse, strict=True) if is_worse}
    there = [one for one in named if worse.intersection(one.term.site.split("~"))]
    return tuple(one for one in named if not there or one is not there[-1])


@dataclass(frozen=True, slots=True, kw_only=True)
class Weighed:
    """A term with its probability.

    Attributes
    ----------
    term, candidate
        The term, and what it's called.
    probability, of_any_law
        Of the word, and of it or a wider law that the log doesn't tell from it: either way something is named.
    acts
        Rows of the joints that it changes.
    is_told
        Whether any of its numbers but its place is beyond its uncertainty, and not at the edge of what it can be.
    is_felt
        Whether more torque would be missing without it than any rigid description rounds.
    nats, gain
        That it's worth beside the others, and beside nothing.
    """

    term: Term
    candidate: Candidate
    probability: float
    of_any_law: float
    share: float
    acts: tuple[int, ...]
    group: tuple[str, ...]
    others: tuple[Candidate, ...]
    parameters: dict[str, FittedNumber]
    is_told: bool
    is_felt: bool
    nats: float
    gain: float

    @property
    def cause(self) -> Cause:
        """The record."""
        return Cause(
            effect=self.candidate.effect,
            site=self.candidate.site,
            probability=self.probability,
            group=self.group,
            alternatives=self.others,
            parameters=self.parameters,
            variant=self.term.variant if self.term.word == "encoder_offset" else None,
            share=self.share,
        )


def _weighed(solved: Solved, place: int) -> Weighed:
    contest, best = solved.contest, solved.best
    term = best.terms[place]
    rest = contest.fit([*best.terms[:place], *best.terms[place + 1 :]], best)
    # A law that holds this one as a special case says the same where it's told to need no more of it.
    found = alternatives(contest, best, place, _OTHERS)
    others = [
        found[0],
        *(
            one
            for one in found[1:]
            if not one.terms[-1].holds(term) or (adds(solved, one, -1) and one.nats > best.nats - TEMPER)
        ),
    ]
    # What is unknown elsewhere is so with the term, too.
    free = [float(np.sum(np.maximum(contest.unknowns(one), 0.0))) for one in (rest, best)]
    unknown = rest.nats + free[0] - free[1]
    nats = np.array([best.nats, rest.nats, unknown, *(one.nats for one in others[1:])])
    weight = np.exp((nats - nats.max()) / TEMPER)
    # The same word at sites that the log can't tell from this one is no doubt of the word.
    candidate = _candidate(solved, place)
    words = {term.word, candidate.effect}
    near = [one.terms[-1] for one in others[1:] if one.nats > best.nats - CLOSE]
    same = sum(
        float(part)
        for one, part in zip(others[1:], weight[3:], strict=True)
        if one.terms[-1].word in words and one.terms[-1] in near
    )
    # Where the log leaves open whether a law needs more, it's either word.
    open_laws = {fit.terms[-1]: nats for fit, nats in not_told_apart(contest, best, place)}
    named = float(weight[0]) + same
    wider = named * sum(float(np.exp(nats / TEMPER)) for nats in open_laws.values())
    near += [one for one, nats in open_laws.items() if nats > -CLOSE]
    whole = (float(np.sum(weight)) + wider) / (1.0 - LAPSE)
    lost = rest.energy - best.energy
    # What tolerances take over when they're stretched is felt, too.
    strained = rest.strain - best.strain
    shares = contest.shares(best, place)
    acts = np.flatnonzero(shares > _ACTS * np.max(shares))
    return Weighed(
        term=term,
        candidate=candidate,
        probability=named / whole,
        of_any_law=(named + wider) / whole,
        share=float(min(np.max(shares), 1.0)),
        acts=tuple(int(row) for row in (term.rows or acts)),
        group=tuple(dict.fromkeys([candidate.site, *(one.site for one in near if one.word in words)])),
        others=tuple(
            dict.fromkeys(Candidate(effect=one.word, site=one.site) for one in near if one.word not in words)
        ),
        parameters=_parameters(solved, place, candidate),
        is_told=bool(np.any(_told(best, place) & [not one.places for one in term.numbers])),
        is_felt=bool(np.max(contest.over_rounding(np.maximum(lost, 0.0))) > 1.0) or strained > TEMPER,
        nats=best.nats - max(rest.nats, unknown),
        gain=best.nats - rest.nats,
    )


def _told(best: Fit, place: int) -> Mask:
    """``[number]``: whether it's beyond its uncertainty, and not at the edge of what it can be.

    None at all of what a description states is no edge.
    """
    values, deviations = best.values(place)
    term = best.terms[place]
    moved = values - term.nominal
    inside = (moved > term.least + 1e-3 * term.scale) | ((term.nominal > 0) & (term.least == -term.nominal))
    return np.asarray((np.abs(moved) > SIGMAS * deviations) & inside)


def _candidate(solved: Solved, place: int) -> Candidate:
    """What a term is called.

    A law whose last number (or form) isn't told is called as the one without; less friction, damping or armature than
    the description has is a wrong value of it.
    """
    term = solved.best.terms[place]
    word = term.word if term.plainer is None or adds(solved, solved.best, place) else term.plainer
    if word in _STATED and not term.is_coupling and solved.best.values(place)[0][0] < term.nominal[0]:
        return Candidate(effect=PARAMETER, site=f"{term.site}.{_STATED[word]}")
    return Candidate(effect=word, site=term.site)


def _parameters(solved: Solved, place: int, candidate: Candidate) -> dict[str, FittedNumber]:
    term, numbers = solved.best.terms[place], solved.numbers(place)
    if term.word == PARAMETER:
        link = solved.torques.robot.links.index(term.site.removesuffix(".mass"))
        mass = float(inertial_numbers(solved.torques.robot)[link, 0])
        ((value, deviation, unit),) = numbers.values()
        return {"value": FittedNumber(value=mass * (1.0 + value), std=mass * deviation, unit=unit, nominal=mass)}
    if candidate.effect == term.plainer and term.form is not None and term.adds_form:
        numbers.pop(term.form.name)
    elif candidate.effect == term.plainer or candidate.effect == PARAMETER:
        numbers = {term.numbers[0].name: numbers[term.numbers[0].name]}
    nominal = float(term.nominal[0]) if {candidate.effect, term.word} & _STATED.keys() else None
    told = {
        name: FittedNumber(value=value, std=deviation if np.isfinite(deviation) else None, unit=unit, nominal=nominal)
        for name, (value, deviation, unit) in numbers.items()
    }
    return {"value": told[term.numbers[0].name]} if candidate.effect == PARAMETER else told


def _ranking(weighed: Sequence[Weighed]) -> Iterator[Ranked]:
    for one in weighed:
        yield Ranked(effect=one.candidate.effect, site=one.candidate.site, probability=one.probability, gap=None,
                     log_evidence=one.nats)  # fmt: skip


def _where(solved: Solved, fit: Fit) -> Where:
    torques = solved.torques
    rows = [row for row, _ in torques.rows]
    residual, drive = torques.whole(torques.missing - solved.contest.explained(fit))[rows], torques.asked[rows]
    power, usual = np.mean(relative_residual(residual, drive) ** 2, axis=1), _usual(torques)[rows]
    shares = power / power.sum() if power.sum() > 0 else power
    rate = torques.rate_hz
    names = [joint.name for _, joint in torques.rows]
    speeds = {
        f"{joint.name}.velocity": Variable(torques.velocity[row], "rad/s" if joint.kind == "hinge" else "m/s")
        for row, joint in torques.rows
    }
    return Where(
        channels=tuple(
            ChannelGap(name=name, gap=float(np.sqrt(np.mean(row**2)) / size), noise=float(noise / size),
                       noise_from="what encoders (and effort sensors) round and shake by")
            for name, row, size, noise in zip(names, residual, usual, solved.contest.noise(fit)[rows], strict=True)
        ),
        bands=band_shares(residual, drive, sample_rate_hz=rate),
        sites=tuple(
            SiteShare(name=name, share=float(share))
            for share, name in sorted(zip(shares, names, strict=True), key=lambda one: -one[0])
        ),
        regimes=regime_shares(residual, drive, speeds),
        times=tuple(
            replace(one, start_s=float(at_s[0]), end_s=float(at_s[1]))
            for one in time_shares(residual, drive, sample_rate_hz=rate)
            for at_s in [torques.at_s([one.start_s, one.end_s])]
        ),
    )  # fmt: skip


def _of_torques(solved: Solved, named: Sequence[Term]) -> Closing:
    """How much of the missing torque the answer explains, on every other block of the log, which no fit saw."""
    torques = solved.torques
    judge = _every_other(torques.missing.shape[1])
    there = torques.moving & judge
    apart = Contest(torques, taking_part=~judge, terms=named)
    scale = np.resize(_usual(torques), len(torques.missing))[:, None]

    def left(part: Real) -> float:
        return float(np.sqrt(np.mean((((torques.missing - part) / scale)[there]) ** 2)))

    tuned, full = (left(apart.explained(apart.fit(one))) for one in ((), named))
    noise = np.broadcast_to(solved.contest.noise(solved.best)[:, None] / scale, there.shape)[there]
    return _closing(
        left(np.zeros_like(torques.missing)), tuned, full, float(np.sqrt(np.mean(noise**2))), named=bool(named),
        by="torque", held_out=_held_out(torques, torques.log.time_s[torques.kept][judge], torques.rate_hz),
    )  # fmt: skip


def _usual(torques: Torques) -> Real:
    """``[joint]``: RMS of the drives' torques; 1 where none is known."""
    rms = np.sqrt(np.mean(torques.drive**2, axis=1))
    return np.asarray(np.where(torques.driven & (rms > 0), rms, 1.0))


def _of_positions(torques: Torques, found: Confirmed, *, named: bool) -> Closing:
    """How far simulated positions come to the measured ones, over the motion."""
    moves = np.isfinite(found.per_joint_after)
    noise = float(np.sqrt(np.mean((torques.reading_noise[moves] / found.motion[moves]) ** 2)))
    stretches = _held_out(torques, found.time_s[found.judged], torques.log.sample_rate_hz)
    return _closing(
        found.before, found.tuned, found.after if named else found.tuned, noise, named=named, by="windows",
        held_out=stretches if found.held_out else (), horizon_s=found.horizon_s,
    )  # fmt: skip


def _closing(
    before: float, tuned: float, after: float, noise: float, *, named: bool, by: Literal["windows", "torque"],
    held_out: tuple[HeldOut, ...], horizon_s: float | None = None,
) -> Closing:  # fmt: skip
    room = before - noise
    closed = float(np.clip((before - after) / room, 0.0, 1.0)) if room > noise else None
    explained = None
    if named and tuned > _CLEAR * noise:
        explained = float(np.clip((tuned**2 - after**2) / (tuned**2 - noise**2), 0.0, 1.0))
    return Closing(
        before=before, tuned=tuned, after=after, noise=noise, closed=closed, interval=None, held_out=held_out, by=by,
        horizon_s=horizon_s, explained=explained,
    )  # fmt: skip


def _held_out(torques: Torques, at_s: Real, rate_hz: float) -> tuple[HeldOut, ...]:
    breaks = np.flatnonzero(np.diff(at_s) > _GAP / rate_hz)
    edges = [-1, *breaks.tolist(), at_s.size - 1]
    return tuple(
        HeldOut(log=torques.log.log, start_s=float(at_s[a + 1]), end_s=float(at_s[b])) for a, b in pairwise(edges)
    )


def _every_other(count: int) -> Mask:
    return np.asarray(np.arange(count) * _BLOCKS // count % 2 == 1)


def _advice(verdict: Verdict, joints: Sequence[str], denied: Confirmed | None, pushes: Sequence[Push]) -> str | None:
    if verdict != "unknown":
        return None
    if pushes and not joints and denied is None:
        return "Nothing else is missing: look what the robot touched then."
    if denied is not None:
        return (
            "What the torques suggest isn't named: simulated with it, the positions' error is "
            f"{100 * denied.after:.3g} % of the motion, without it {100 * denied.tuned:.3g} %."
        )
    listed = ", ".join(joints)
    return f"At {listed} a torque is missing that no word explains: look there first, at several speeds and loads."
