"""What explains a gap better than the believed cause, without being a word of the catalogue."""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.gap.diagnosis.pairs import TWO_FORCES
from chladni.gap.diagnosis.search import ALONE
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.any_coupling import Coupling, any_coupling
from chladni.gap.explanation.any_law import left_by_any_law
from chladni.gap.explanation.any_relaxation import Relaxation, any_relaxation
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.explanation.linear_words import fitted_beside
from chladni.gap.location.locate import Located, Location
from chladni.gap.location.recovered import Recovered, recovered
from chladni.gap.plant.places import Site
from chladni.gap.tuning.effect_scale import effect_numbers
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Real

#: Of what the believed cause leaves beyond the noise's power: what leaves less than this share of it is better.
_BETTER = 0.5
#: What a linear law may leave of the gap; most of the noise's power with which nothing else is asked for.
_OF_GAP, _ASKED = 0.01, 1.1
#: Nats that a joint that relaxes must bring beyond a linear word.
_SURE = 10.0
#: Of what the believed cause leaves beyond the noise's power: what a law at another site leaves is better with less.
#: In made machines it was 0.54 at most where the named site was wrong, 4.5 at least where it was right.
_ELSEWHERE = 0.7
#: Most that one law leaves beyond the noise's power, and of the gap as above, to do what several words do.
_NOTHING = 0.5
#: Intervals of displacement and of velocity with equally many samples, and the share of their pairs in which a motion
#: must be for a fifth of an equal share of the time: along one orbit every force is a function of both.
_INTERVALS, _VISITED, _OFTEN = 8, 0.8, 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Instead:
    """What fits.

    Attributes
    ----------
    linear
        Velocities of bodies that push each other, or a joint that relaxes.
    loopless
        The joint whose force is a function where a loop was named.
    elsewhere
        The site whose force alone, by a law that is none of the catalogue's, explains more than what was named at
        other sites.
    """

    linear: Coupling | Relaxation | None = None
    loopless: str | None = None
    elsewhere: str | None = None

    def sentence(self) -> str:
        """Say what fits."""
        if self.linear is not None:
            return f"What fits is no effect of the catalogue: {self.linear.sentence()}."
        if self.elsewhere is not None:
            return (
                f"One force at {self.elsewhere}, by a law of what moves there that is not in the catalogue, explains "
                "the gap: the effects that come near act at other sites."
            )
        return (
            f"The force at {self.loopless} is a function of displacement and velocity: "
            "a loop of hysteresis comes near, and leaves more."
        )


def explained_instead(study: Study, best: Contestant) -> Instead | None:
    """Give what leaves less than half of what the believed cause does, None when nothing of it does.

    A late sensor and a mount do much the same as a wheel that spins between two bodies, but leave more. A mass on a
    soft mount that is damped much does much the same as a joint that relaxes, but leaves more. A loop of hysteresis
    does much the same as a function of displacement and velocity, which is no loop, but leaves more.
    """
    linear = _linear(study, best)
    if linear is not None:
        return Instead(linear=linear)
    loopless = _loopless(study.location, best)
    return None if loopless is None else Instead(loopless=loopless)


def _linear(study: Study, best: Contestant) -> Coupling | Relaxation | None:
    """Give the linear law that is no word and explains more than the believed cause does; None without."""
    if best.hypothesis.wide and best.chi < _ASKED:
        return _relaxing_for_parameters(study.location, best)
    location, word = study.location, _linear_word(best)
    if best.chi < _ASKED and word is None:
        return None
    relaxing = _relaxing(location)
    if word is not None and relaxing is not None and _brings_more(study, relaxing, word, best.fit.z):
        return relaxing
    if best.chi < _ASKED:
        return None
    left, gap = _BETTER * (best.chi - 1.0), location.tuned.chi - 1.0
    # A coupling of every body with every other has so many numbers that little of a small gap says nothing.
    bounds = ((any_coupling(location), _OF_GAP * gap), (relaxing, max(_OF_GAP * gap, _ASKED - 1.0)))
    found = [law for law, most in bounds if law is not None and law.chi - 1.0 < min(left, most)]
    return min(found, key=lambda law: law.chi, default=None)


def _relaxing_for_parameters(location: Location, best: Contestant) -> Relaxation | None:
    """Give the joint that relaxes where its stiffness or damping is said to be wrong, when that is far likelier.

    What relaxes is stiffer and loses more than it does at rest: a value that is off comes near.
    """
    names, screened = best.hypothesis.wide, best.hypothesis.screened
    relaxing = _relaxing(location, {name.rpartition(".")[0] for name in names})
    if relaxing is None or screened is None or relaxing.chi > ALONE:
        return None
    return relaxing if _is_sure(location, screened - relaxing.chi, relaxing.numbers - len(names)) else None


def _linear_word(best: Contestant) -> AttachedEffect | None:
    effects = best.hypothesis.effects
    return best.fit.effects[0] if len(effects) == 1 and effects[0].kind.linear else None


def _relaxing(location: Location, names: Container[str] | None = None) -> Relaxation | None:
    """Give the joint that explains most by relaxing, among those (of some names) where one unknown force does all."""
    joints = ((located, site) for located, site in _alone(location) if site.kind == "joint")
    asked = ((located, site) for located, site in joints if names is None or site.name in names)
    found = (any_relaxation(location, located, site) for located, site in asked)
    return min((law for law in found if law is not None), key=lambda law: law.chi, default=None)


def _brings_more(study: Study, relaxing: Relaxation, word: AttachedEffect, z: Real) -> bool:
    """Whether a joint that relaxes is far likelier than a linear word, both fitted alike to the whole record."""
    if relaxing.chi > ALONE:
        return False
    fitted = fitted_beside(study.model, study.location, word, z)
    if fitted is None:
        return False
    further = relaxing.numbers - len(effect_numbers((word,)))
    return _is_sure(study.location, fitted.chi - relaxing.chi, further)


def _is_sure(location: Location, gained: float, further: int) -> bool:
    """Whether misfit that was gained over the noise pays for further numbers (Schwarz 1978), and more."""
    expected = location.tuned.expected
    return gained * expected > _SURE + 0.5 * further * float(np.log(2 * expected))


def _loopless(location: Location, best: Contestant) -> str | None:
    """Give the joint of a believed loop where a function leaves less; None without."""
    effects = best.hypothesis.effects
    if best.chi < _ASKED or len(effects) != 1 or not effects[0].kind.clues.is_loop:
        return None
    site, gap = effects[0].site, location.tuned.chi - 1.0
    share = _left_by_function(location, site)
    return site if share is not None and share * gap < _BETTER * (best.chi - 1.0) else None


def explained_elsewhere(study: Study, best: Contestant, as_likely: Sequence[Contestant] = ()) -> Instead | None:
    """Give the site at which one force by any law explains more than what is named elsewhere; None without.

    Nothing is said where a law at a named site explains as much: then it's the details of the named one that are off.
    Several words must do what no single law does: equal mounts on all sensors only imitate a filter of the command.

    Parameters
    ----------
    as_likely
        Those that the log can't tell from the believed one: where these act isn't elsewhere either.
    """
    effects = best.hypothesis.effects
    if not effects or (best.chi < ALONE and len(effects) < 2):
        return None
    named = {one.site for each in (best, *as_likely) for one in each.hypothesis.effects}
    gap = study.location.tuned.chi - 1.0
    alone = min(_NOTHING, _OF_GAP * gap) if len(effects) > 1 else 0.0
    enough = max(_ELSEWHERE * (best.chi - 1.0), alone)
    better: dict[str, float] = {}
    for located, site in _alone(study.location):
        left = gap * left_by_any_law(study.location, located, site)
        if left < enough:
            better[site.name] = left
    if not better or not named.isdisjoint(better):
        return None
    return Instead(elsewhere=min(better, key=lambda name: better[name]))


def _alone(location: Location) -> Iterator[tuple[Located, Site]]:
    """Every site at which one unknown force explains all."""
    for located in location.ranked:
        if located.profile.chi < TWO_FORCES:
            yield from ((located, site) for site in located.places[0].sites)


def _left_by_function(location: Location, name: str) -> float | None:
    """Share of the gap that any function of displacement and velocity leaves; None where that says nothing."""
    # Where another force acts too, what a loop leaves may be that one's.
    for located, site in _alone(location):
        if site.name == name and _visited(recovered(location.problem, located.profile, site)) > _VISITED:
            return left_by_any_law(location, located, site)
    return None


def _visited(motion: Recovered) -> float:
    """Share of pairs of intervals, of displacement and of velocity, in which a motion often is."""
    shares = np.linspace(0.0, 1.0, _INTERVALS + 1)[1:-1]
    way, pace = (np.digitize(one, np.quantile(one, shares)) for one in (motion.displacement, motion.velocity))
    count = np.bincount(_INTERVALS * way + pace, minlength=_INTERVALS**2)
    return float(np.mean(count > _OFTEN * count.mean()))
