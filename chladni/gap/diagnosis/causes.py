"""What causes the gap: hypotheses entered, a second effect added while it pays, and the verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.candidates import screened
from chladni.gap.explanation.degenerate import is_degenerate
from chladni.gap.explanation.hypotheses import (
    effect_hypotheses,
    hypothesis_of,
    polished,
    with_siblings,
    wrong_parameters,
)
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.lattice import Lattice, lattice_of
from chladni.gap.explanation.shaken_ground import follows_inputs
from chladni.gap.location.locate import Located, locate, located_pairs
from chladni.gap.location.recovered import recovered
from chladni.gap.records.diagnosis import Candidate, Verdict
from chladni.signals.errors import EstimateError

Matrix = NDArray[np.float64]
Step = Callable[[float], None]
#: Fits of a first effect, of a second beside it.
_FITTED, _SECOND = 7, 4
#: Nats that an effect must bring to be named at all, and those that a second must bring beside the first.
NAMED, ADDED = 6.0, 10.0
#: Below this share of the gap's power, the best effect leaves too much to be the cause.
EXPLAINS = 0.8
#: A fit that leaves less than this, over the noise's power, leaves nothing to be explained.
_CLEAN = 1.6
#: A first effect that leaves less than this, over the noise's power, is alone.
_ALONE = 1.3
#: A best fit that leaves more than this has details of laws worth a fit, those of the first few.
_DETAILED, _POLISHED = 1.1, 4
#: Two forces must leave less than this of what one leaves.
_PAIR_GAIN = 0.6
#: A floor that shakes: how well the place must explain, by what factor better than any other, and how little of the
#: recovered motion may follow the inputs.
_SHAKEN_CHI, _SHAKEN_MARGIN, _SHAKEN_COHERENCE = 1.5, 1.1, 0.5


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
        The one that is believed; `tuned` when none pays.
    ranked
        All single ones by falling evidence.
    probabilities
        Of each of `ranked`, in order; they sum to one with that of no cause.
    shaken
        The ground's profile when the floor shakes, else None.
    lattices
        Outputs whose samples stand on a lattice that is coarse beside the noise.
    """

    verdict: Verdict
    tuned: Contestant
    best: Contestant
    ranked: tuple[Contestant, ...]
    probabilities: tuple[float, ...]
    shaken: Located | None
    lattices: dict[str, Lattice]


def causes_of(study: Study, progress: Step) -> Causes:
    """Enter hypotheses and judge."""
    nothing = _nothing(study)
    progress(0.1)
    ranked = _ranked(study, progress)
    best = ranked[0] if ranked and ranked[0].log_evidence > nothing.log_evidence + NAMED else nothing
    if best.hypothesis.effects and best.chi > _ALONE:
        best = _with_second(study, best)
    if max(best.chi, nothing.chi if best is nothing else 0.0) > _ALONE:
        best = _better_pair(study, best)
    progress(1.0)
    lattices = _lattices(study)
    verdict = _verdict(study, nothing, best)
    shaken = _shaken(study) if verdict == "unknown" else None
    if shaken is not None or (verdict == "none" and lattices):
        verdict = "effect"
    probabilities = _probabilities([*ranked, nothing])
    return Causes(
        verdict=verdict,
        tuned=nothing,
        best=best,
        ranked=tuple(ranked),
        probabilities=tuple(probabilities[:-1]),
        shaken=shaken,
        lattices=lattices,
    )


def explained_power(tuned: Contestant, found: Contestant, noise: float) -> float:
    """Share of the gap's power beyond noise that a hypothesis explains, on held-out samples."""
    room = tuned.gap**2 - noise**2
    return float(np.clip((tuned.gap**2 - found.gap**2) / room, 0.0, 1.0)) if room > 0 else 0.0


def noise_gap(study: Study) -> float:
    """The noise over the RMS of what was measured, outputs pooled."""
    outputs = study.measurement.outputs
    size = np.mean((outputs - outputs.mean(axis=1, keepdims=True)) ** 2, axis=1)
    return float(np.sqrt(np.mean(study.location.problem.noise.rms**2 / np.maximum(size, 1e-300))))


def _nothing(study: Study) -> Contestant:
    contest = study.contest
    found = contest.enter(Hypothesis(start_z=study.location.tuned.z), max_iterations=20)
    if found is None:
        # Too sensitive to be fitted in free run: what the linear part said of the parameters has to do.
        found = contest.enter(Hypothesis(start_z=study.location.tuned.z), tune=False)
    if found is None:
        raise EstimateError(
            f"model {study.model.name!r} diverges on log {study.measurement.log!r} within its tolerances; "
            "check the model's stability and the units of its inputs"
        )
    return found


def _ranked(study: Study, progress: Step) -> list[Contestant]:
    location, contest = study.location, study.contest
    candidates = screened(location, location.ranked, study.leave_out, study.own)
    progress(0.3)
    hypotheses = with_siblings(effect_hypotheses(candidates, study.own, count=_FITTED), study.leave_out)
    wrong = wrong_parameters(location, heavier_is_added="added_mass" not in study.leave_out)
    entered = contest.enter_all([*hypotheses, *([wrong] if wrong else [])], lambda done: progress(0.3 + 0.5 * done))
    sound = [one for one in entered if not is_degenerate(contest.run, one)]
    ranked = sorted(sound, key=lambda one: -one.log_evidence)
    if ranked and ranked[0].chi > _DETAILED:
        # A detail of its law that was set by the screen's grid must not cost a word its place.
        ranked = [_polished(study, one) for one in ranked[:_POLISHED]] + ranked[_POLISHED:]
    return sorted(ranked, key=lambda one: -one.log_evidence)


def _with_second(study: Study, first: Contestant) -> Contestant:
    """Look for a second effect in what the first leaves; keep it when it pays."""
    contest = study.contest
    # What the first effect did beyond the linear model is taken from the log: the rest is a gap of its own.
    states = len(contest.run.compiled().states)
    plain = contest.run.outputs(first.fit.z, (), first.fit.initial[:, :states])
    bent = first.fit.outputs - first.fit.offsets[:, None] - plain
    measurement = replace(study.measurement, outputs=study.measurement.outputs - bent)
    location = locate(study.model, measurement, contest.noise, contest.run.tunables)
    found = screened(location, location.ranked[:4], study.leave_out, study.own)
    taken = {one.site for one in first.fit.effects}
    # At the same site a second word would mend the details of the first one's law.
    singles = effect_hypotheses([one for one in found if one.trial.site.name not in taken], study.own, count=_SECOND)
    both = [hypothesis_of((*first.fit.effects, *one.effects), first.fit.z, screened=one.screened) for one in singles]
    entered = [one for one in contest.enter_all(both) if not is_degenerate(contest.run, one)]
    best = max(entered, key=lambda one: one.log_evidence, default=first)
    return best if best.log_evidence > first.log_evidence + ADDED else first


def _polished(study: Study, found: Contestant) -> Contestant:
    """Let the details of the laws move too: creep, presliding, shape; kept when that pays."""
    finer = polished(found.hypothesis, found.fit.effects, found.fit.z)
    entered = study.contest.enter(finer) if finer is not None else None
    if entered is None or is_degenerate(study.contest.run, entered):
        return found
    return entered if entered.log_evidence > found.log_evidence else found


def _better_pair(study: Study, best: Contestant) -> Contestant:
    """Look for two effects at two places at once, which one after the other may miss."""
    pairs = located_pairs(study.location)
    single = study.location.ranked[0].profile.chi if study.location.ranked else 0.0
    if not pairs or pairs[0].profile.chi > _PAIR_GAIN * single:
        return best
    forms = []
    for place in pairs[0].places:
        sites = {site.name for site in place.sites}
        found = screened(study.location, pairs[:1], study.leave_out, study.own)
        forms.append(effect_hypotheses([one for one in found if one.trial.site.name in sites], study.own, count=2))
    both = [
        hypothesis_of((*first.effects, *second.effects), pairs[0].profile.z)
        for first in forms[0]
        for second in forms[1]
    ]
    entered = [one for one in study.contest.enter_all(both) if not is_degenerate(study.contest.run, one)]
    found_best = max(entered, key=lambda one: one.log_evidence, default=best)
    return found_best if found_best.log_evidence > best.log_evidence + ADDED else best


def _shaken(study: Study) -> Located | None:
    """Give the ground's profile when only a floor that shakes explains the gap."""
    if "base_vibration" in study.leave_out or len(study.measurement.output_names) < 2:
        return None
    ranked = study.location.ranked
    first = ranked[0]
    ground = [site for site in first.places[0].sites if site.kind == "ground"]
    if not ground or first.profile.chi > _SHAKEN_CHI:
        return None
    if len(ranked) > 1 and ranked[1].profile.chi < _SHAKEN_MARGIN * first.profile.chi:
        return None
    motion = recovered(study.location.problem, first.profile, ground[0])
    return first if follows_inputs(study.location.problem, motion.force) < _SHAKEN_COHERENCE else None


def _lattices(study: Study) -> dict[str, Lattice]:
    if "quantization" in study.leave_out:
        return {}
    found = {}
    rows = zip(
        study.measurement.output_names, study.measurement.outputs, study.location.problem.noise.rms, strict=True
    )
    for name, signal, noise in rows:
        lattice = lattice_of(signal)
        # Steps far below the noise are those of any converter.
        if lattice is not None and lattice.step / np.sqrt(12.0) > 0.5 * noise:
            found[name] = lattice
    return found


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


def named(causes: Causes) -> tuple[Candidate, ...]:
    """Give what is named as causes, in order."""
    if causes.shaken is not None:
        return (Candidate(effect="base_vibration", site="ground"),)
    found = list(causes.best.hypothesis.named) if causes.verdict in ("effect", "parameters") else []
    if causes.verdict == "effect":
        found += [Candidate(effect="quantization", site=name) for name in causes.lattices]
    return tuple(dict.fromkeys(found))
