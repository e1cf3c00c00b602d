"""What causes the gap: the contestant that is believed, and the verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from chladni.gap.diagnosis.completeness import COMPLETE, completeness, completeness_among, known_share
from chladni.gap.diagnosis.following import Entered
from chladni.gap.diagnosis.further_causes import further_causes, leaves_a_further
from chladni.gap.diagnosis.grown import Grown
from chladni.gap.diagnosis.instead import Instead, explained_elsewhere, explained_instead
from chladni.gap.diagnosis.own_signal import FOLLOWS, share_of_own_signal
from chladni.gap.diagnosis.pairs import exchanged, paired_causes, second_causes, two_act, without_one
from chladni.gap.diagnosis.price import added_nats, leaves_for_sure, price_among
from chladni.gap.diagnosis.search import (
    ALONE,
    best_forms,
    detailed,
    is_far,
    is_lost,
    is_one_force,
    same_places,
    sibling_causes,
    single_causes,
    twin_causes,
    without_cause,
)
from chladni.gap.diagnosis.shaken_by import ShakenGround, shaken_by
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.contest import distinct, lowest, weighed
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.explanation.known_states import KnownStates
from chladni.gap.location.locate import Located
from chladni.gap.records.diagnosis import Candidate, Verdict
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Real

Step = Callable[[float], None]
#: Nats within which a log can't tell two candidates apart.
CLOSE = 2.0
#: First effects beside which a second one is looked for while all leave something; progress where the search beside
#: each begins, that for pairs, that for what grows beside them, and that for each again beside the other.
_LEADS, _BESIDE = 2, (0.80, 0.84, 0.88, 0.92, 0.96)
#: A fit that leaves less than this, over the noise's power, leaves nothing to be explained.
_CLEAN = 1.6
#: Share of the gap's power with which two causes come near to what one force explains.
_NEAR = 0.03


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
        All with causes by falling evidence, weighed together with `tuned` and `best`.
    probabilities
        Of each of `ranked`, in order; what is missing to one is that of no cause, or of one that isn't among them.
    shaken
        The ground when the floor shakes, with the places that can't be told from it, else None.
    noise
        The floor, lowered to what `best` leaves of it where that is less.
    distorted
        Outputs whose residual, when nothing is named, follows their own signal in a curve.
    instead
        What explains the gap better without being a word; nothing is named then.
    states
        That the machine went through, when all runs were lost and a law, or two, follow the log from these over short
        windows; else None.
    forces
        Unknown forces at two places that explain much more than one anywhere, when pairs were looked for; else None.
    """

    verdict: Verdict
    tuned: Contestant
    best: Contestant
    ranked: tuple[Contestant, ...]
    probabilities: tuple[float, ...]
    shaken: ShakenGround | None
    noise: NoiseFloor
    distorted: tuple[str, ...]
    instead: Instead | None
    states: KnownStates | None
    forces: Located | None = None


def causes_of(study: Study, progress: Step) -> Causes:
    """Enter hypotheses and judge."""
    nothing = without_cause(study)
    progress(0.1)
    singles = single_causes(study, progress)
    entered, instead, states, forces = _searched(study, nothing, singles, progress)
    added = added_nats(study.location)
    entered += twin_causes(study, _best(weighed([nothing, *entered]), nothing, added))
    progress(1.0)
    together = distinct(weighed([nothing, *entered]))
    tuned = next(one for one in together if one.fit is nothing.fit)
    best = _best(together, tuned, added)
    noise = study.contest.noise.lowered(best.held)
    floor = lowest(together)
    verdict = _verdict(together, tuned, best, floor)
    if verdict == "effect":
        instead = instead or explained_elsewhere(study, best, _as_likely(together, best))
    if instead is not None:
        verdict = "unknown"
    shaken = shaken_by(study, tuned) if verdict == "unknown" and instead is None else None
    if shaken is not None or (verdict == "none" and study.lattices):
        verdict = "effect"
    distorted = _distorted(study, tuned) if verdict in ("none", "unknown") else ()
    if verdict == "none" and (study.repeating or distorted):
        # A sensor that holds its samples moves nothing, and looks like noise; but it's no noise.
        verdict = "unknown"
    probabilities = _probabilities(together, tuned, floor, added)
    ranked = [(one, share) for one, share in zip(together, probabilities, strict=True) if one is not tuned]
    # Only of what will be told: it costs as much as a step of a fit.
    told = study.contest.with_spread(best)
    return Causes(
        verdict=verdict,
        tuned=told if best is tuned else study.contest.with_spread(tuned),
        best=told,
        ranked=tuple(one for one, _ in ranked),
        probabilities=tuple(share for _, share in ranked),
        shaken=shaken,
        noise=noise,
        distorted=distorted,
        instead=instead,
        states=states,
        forces=forces,
    )


def _searched(
    study: Study, nothing: Contestant, singles: Entered, progress: Step
) -> tuple[list[Contestant], Instead | None, KnownStates | None, Located | None]:
    """Every contestant with a cause: single ones, and two where one leaves something that nothing else explains."""
    added = added_nats(study.location)
    found = list(singles.ranked)

    def best() -> Contestant:
        return _best(weighed([nothing, *found]), nothing, added)

    def leaves_another() -> bool:
        return _leaves_another(study, best(), nothing, lowest([nothing, *found]))

    instead = explained_instead(study, best())
    if instead is not None or not leaves_another():
        return found, instead, singles.states, None
    # Where runs were lost, those of one of two laws are lost again: both at once come first.
    pairs = paired_causes(study, best()) if study.contest.states is not None else Entered()
    found += pairs.ranked
    for place, lead in enumerate(_leads(weighed(found))):
        progress(_BESIDE[place])
        if leaves_another():
            found += second_causes(study, lead)
    progress(_BESIDE[-3])
    if study.contest.states is None and leaves_another():
        pairs = paired_causes(study, best())
        found += pairs.ranked
    # Of one force the states are those of a machine that lacks the other.
    states = pairs.states or singles.states
    progress(_BESIDE[-2])
    grown = Grown(study)
    for lead in _leads(weighed(found)):
        if leaves_another() and (is_far(study.location, best().chi) or _lacks_another(study, best())):
            found += grown.beside(lead)
    progress(_BESIDE[-1])
    if len(best().hypothesis.effects) > 1:
        found += exchanged(study, best())
        # A richer law may only stand in for details of a plainer one, of either effect.
        found += _detailed(study, weighed(found), best())
        found += sibling_causes(study, [best()])
        found += [detailed(study, best()), *without_one(study, best())]
    found = [one for one in found if _is_plausible(study, nothing, one)]
    return _with_further(study, nothing, found, added), None, states, pairs.forces


def _with_further(study: Study, nothing: Contestant, found: Sequence[Contestant], added: float) -> list[Contestant]:
    """Give contestants with those that have a third effect and more, while one more pays."""
    found, named = list(found), 0
    best = _best(weighed([nothing, *found]), nothing, added)
    while leaves_a_further(best) and len(best.hypothesis.effects) > named:
        named = len(best.hypothesis.effects)
        found += [one for one in further_causes(study, best) if _is_plausible(study, nothing, one)]
        best = _best(weighed([nothing, *found]), nothing, added)
    return found


def _detailed(study: Study, ranked: Sequence[Contestant], best: Contestant) -> list[Contestant]:
    """Details fitted of the first few forms with as many effects as the best one."""
    alike = [one for one in ranked if len(one.hypothesis.effects) == len(best.hypothesis.effects)]
    return [detailed(study, one) for one in best_forms(alike)]


def _leaves_another(study: Study, best: Contestant, nothing: Contestant, floor: Real) -> bool:
    """Whether what the best cause leaves may be another one."""
    # Sensors that hear only noise, or whose floor is too high, must not hide the one that hears more.
    if best.most_left < ALONE:
        return best is not nothing and completeness(nothing, best, floor) < COMPLETE
    # One force may do what two do, elsewhere; but then no law follows it.
    return leaves_for_sure(best) or not is_one_force(study.location) or is_lost(study.location, best.chi)


def _lacks_another(study: Study, best: Contestant) -> bool:
    """Whether two forces act for certain, of which one was found."""
    return two_act(study.location) and len(best.hypothesis.effects) == 1


def _is_plausible(study: Study, nothing: Contestant, found: Contestant) -> bool:
    """Whether one cause, or two; where one force explains all, two must do so as well, or they only come near it.

    Two at places each of which explains all are one force to the sensors: those need only come near.
    """
    sites = {one.site for one in found.hypothesis.effects}
    if len(sites) < 2 or not is_one_force(study.location):
        return True
    alike = {name for place in same_places(study.location) for name in place.places[0].names}
    return found.chi < (max(ALONE, _NEAR * nothing.chi) if sites <= alike else ALONE)


def _leads(ranked: Sequence[Contestant]) -> list[Contestant]:
    """The best two effects at different sites: of two causes either may look like the first."""
    leads: dict[str, Contestant] = {}
    for one in ranked:
        if len(one.hypothesis.effects) == 1:
            leads.setdefault(one.hypothesis.effects[0].site, one)
    return list(leads.values())[:_LEADS]


def _best(together: Sequence[Contestant], nothing: Contestant, added: float) -> Contestant:
    """The best form of the most probable names; `nothing` where no cause pays.

    A word with several forms, none of which the log tells from the others, has the probability of all of them.
    """
    price = price_among(together, added)
    if not max(together, key=price.paid).hypothesis.named:
        return nothing
    forms: dict[frozenset[Candidate], list[Contestant]] = {}
    for one in distinct(together):
        forms.setdefault(frozenset(one.hypothesis.named), []).append(one)
    named = [alike for names, alike in forms.items() if names]
    likeliest = max(named, key=lambda alike: logsumexp([price.paid(one) for one in alike]))
    return max(likeliest, key=price.paid)


def _as_likely(together: Sequence[Contestant], best: Contestant) -> list[Contestant]:
    """Those with the same words that this log can't tell from the best: at other sites of its place, say."""
    close = (one for one in together if one.log_evidence > best.log_evidence - CLOSE)
    return [one for one in close if _words(one) == _words(best)]


def _words(one: Contestant) -> list[str]:
    return sorted(effect.effect for effect in one.hypothesis.effects)


def _distorted(study: Study, tuned: Contestant) -> tuple[str, ...]:
    simulated = tuned.fit.outputs[:, study.held]
    shares = share_of_own_signal(simulated, study.measurement.outputs[:, study.held] - simulated)
    return tuple(name for name, share in zip(study.measurement.output_names, shares, strict=True) if share > FOLLOWS)


def _verdict(together: Sequence[Contestant], tuned: Contestant, best: Contestant, floor: Real) -> Verdict:
    if best is tuned:
        # With no candidate that pays: is there anything to explain?
        return "none" if tuned.chi < _CLEAN else "unknown"
    if completeness_among(tuned, best, together, floor) < COMPLETE:
        return "unknown"
    if best.hypothesis.effects:
        return "effect"
    # Parameters have no details that a machine's could differ in: what they leave, something else causes.
    return "parameters" if best.chi < _CLEAN else "unknown"


def _probabilities(contestants: Sequence[Contestant], tuned: Contestant, floor: Real, added: float) -> list[float]:
    price = price_among(contestants, added)
    evidence = np.array([price.paid(one) for one in contestants])
    weight = np.exp(evidence - evidence.max())
    known = known_share(tuned.held, floor)
    complete = [
        1.0 if one is tuned else known * completeness_among(tuned, one, contestants, floor) for one in contestants
    ]
    return [float(one) for one in weight / weight.sum() * np.array(complete)]
