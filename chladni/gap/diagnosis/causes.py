"""What causes the gap: hypotheses entered, a second effect added while it pays, and the verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.degenerate import is_degenerate
from chladni.gap.explanation.hypotheses import effect_hypotheses, hypothesis_of, wrong_parameters
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.location.locate import Located, Location, locate, located_pairs
from chladni.gap.records.diagnosis import Verdict

Matrix = NDArray[np.float64]
Step = Callable[[float], None]
#: Fits of a first effect, of a second beside it.
_FITTED, _SECOND = 7, 4
#: Nats that an effect must bring to be named at all, and those that a second must bring beside the first.
NAMED, ADDED = 6.0, 8.0
#: Below this share of the gap's power, the best effect leaves too much to be the cause.
EXPLAINS = 0.8
#: A fit that leaves less than this, over the noise's power, leaves nothing to be explained.
_CLEAN = 1.6


@dataclass(frozen=True, slots=True, kw_only=True)
class Causes:
    """What the contest says.

    Attributes
    ----------
    verdict
        See `Diagnosis`.
    tuned
        The contestant without any cause.
    best
        The one that is believed: `tuned` for the verdicts ``none`` and ``unknown`` without a candidate.
    ranked
        All single ones by falling evidence.
    probabilities
        Of each of `ranked`, in order; they sum to one with that of no cause.
    """

    verdict: Verdict
    tuned: Contestant
    best: Contestant
    ranked: tuple[Contestant, ...]
    probabilities: tuple[float, ...]


def causes_of(study: Study, progress: Step) -> Causes:
    """Enter hypotheses and judge."""
    location, contest = study.location, study.contest
    nothing = contest.enter(Hypothesis(start_z=location.tuned.z), max_iterations=20)
    if nothing is None:
        raise AssertionError("the nominal model was simulated before")
    progress(0.1)
    candidates = screened(location, location.ranked, study.leave_out)
    progress(0.3)
    hypotheses = effect_hypotheses(candidates, study.own, count=_FITTED)
    wrong = wrong_parameters(location)
    entered = contest.enter_all([*hypotheses, *([wrong] if wrong else [])], lambda done: progress(0.3 + 0.5 * done))
    sound = [one for one in entered if not is_degenerate(contest.run, one)]
    ranked = sorted(sound, key=lambda one: -one.log_evidence)
    best = ranked[0] if ranked and ranked[0].log_evidence > nothing.log_evidence + NAMED else nothing
    if best.hypothesis.effects and best.chi > _CLEAN:
        best = _with_second(study, best)
    progress(1.0)
    probabilities = _probabilities([*ranked, nothing])
    return Causes(
        verdict=_verdict(study, nothing, best),
        tuned=nothing,
        best=best,
        ranked=tuple(ranked),
        probabilities=tuple(probabilities[:-1]),
    )


def explained_power(tuned: Contestant, found: Contestant, noise_gap: float) -> float:
    """Share of the gap's power beyond noise that a hypothesis explains, on held-out samples."""
    room = tuned.gap**2 - noise_gap**2
    return float(np.clip((tuned.gap**2 - found.gap**2) / room, 0.0, 1.0)) if room > 0 else 0.0


def noise_gap(study: Study) -> float:
    """The noise over the RMS of what was measured, outputs pooled."""
    outputs = study.measurement.outputs
    size = np.mean((outputs - outputs.mean(axis=1, keepdims=True)) ** 2, axis=1)
    return float(np.sqrt(np.mean(study.location.problem.noise.rms**2 / np.maximum(size, 1e-300))))


def _with_second(study: Study, first: Contestant) -> Contestant:
    """Look for a second effect in what the first leaves; keep it when it pays."""
    contest = study.contest
    # What the first effect did beyond the linear model is taken from the log: the rest is a gap of its own.
    plain = contest.run.outputs(first.fit.z, (), first.fit.initial[:, : _states(study)])
    bent = first.fit.outputs - first.fit.offsets[:, None] - plain
    measurement = replace(study.measurement, outputs=study.measurement.outputs - bent)
    location = locate(study.model, measurement, contest.noise, contest.run.tunables)
    found = screened(location, location.ranked[:4], study.leave_out)
    singles = effect_hypotheses(found, study.own, count=_SECOND)
    taken = {(one.effect, one.site) for one in first.fit.effects}
    both = [
        hypothesis_of((*first.fit.effects, *one.effects), first.fit.z, screened=one.screened)
        for one in singles
        if (one.effects[0].effect, one.effects[0].site) not in taken
    ]
    entered = [one for one in contest.enter_all(both) if not is_degenerate(contest.run, one)]
    best = max(entered, key=lambda one: one.log_evidence, default=first)
    return best if best.log_evidence > first.log_evidence + ADDED else first


def _states(study: Study) -> int:
    return len(study.contest.run.compiled().states)


def _verdict(study: Study, tuned: Contestant, best: Contestant) -> Verdict:
    if best is tuned:
        # With no candidate that pays: is there anything to explain?
        return "none" if tuned.chi < _CLEAN else "unknown"
    if explained_power(tuned, best, noise_gap(study)) < EXPLAINS and best.chi > 2.0:
        return "unknown"
    return "effect" if best.hypothesis.effects else "parameters"


def _probabilities(contestants: Sequence[Contestant]) -> list[float]:
    evidence = np.array([one.log_evidence for one in contestants])
    weight = np.exp(evidence - evidence.max())
    return [float(one) for one in weight / weight.sum()]


__all__ = ["Causes", "Located", "Location", "causes_of", "explained_power", "located_pairs", "noise_gap"]
