"""From screened trials and wide parameters to hypotheses that are worth a fit."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from chladni.gap.explanation.excited_band import excited_band_hz
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.screen import Screened
from chladni.gap.location.locate import Location, tuned_stepwise
from chladni.gap.location.profile import Profile
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.places import Place
from chladni.gap.side_by_side import side_by_side
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.models.core.parameter import Parameter
from chladni.models.effects.attached_effect import AttachedEffect, attached_if_possible
from chladni.models.effects.clues import FittedForm
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError

#: A parameter outside of this many sigmas is wrong, not uncertain.
OUTSIDE = 3.0
#: Misfit over another's up to which a screened form is as good, and how many of those are tried too.
_TIED, _TIES = 1.02, 2
#: How far one may be searched for outside its tolerance, in sigmas.
_FAR = 15.0


def effect_hypotheses(screened: Sequence[Screened], *, count: int, margin: float = 40.0) -> list[Hypothesis]:
    """Give the best screened trials as hypotheses.

    Parameters
    ----------
    count
        So many and a few that are as good as the last of them, of each effect and site at most two forms.
    margin
        Trials whose misfit is so many times that of the best are left out.
    """
    found: list[Hypothesis] = []
    seen: dict[tuple[str, str], int] = {}
    if not screened:
        return found
    enough, last = margin * min(one.chi for one in screened), 0.0
    for one in screened:
        key = (one.trial.effect, one.trial.site.name)
        if seen.get(key, 0) >= 2 or one.chi > enough:
            continue
        if len(found) >= count and (one.chi > _TIED * last or len(found) >= count + _TIES):
            break
        effect = effect_of(one)
        if effect is None:
            continue
        seen[key] = seen.get(key, 0) + 1
        found.append(hypothesis_of((effect,), one.z, screened=one.chi))
        last = max(last, one.chi) if len(found) <= count else last
    return found


def hypothesis_of(
    effects: tuple[AttachedEffect, ...], z: Real, *, screened: float | None = None, initial: Real | None = None
) -> Hypothesis:
    """Give the hypothesis that these effects act."""
    fitted = tuple(effect.usually_fitted for effect in effects)
    start = np.clip(z, -OUTSIDE, OUTSIDE)
    return Hypothesis(effects=effects, fitted=fitted, start_z=start, screened=screened, initial=initial)


def effect_of(one: Screened) -> AttachedEffect | None:
    """Give the effect of a screened trial, its values held inside their possible ranges; None when it's none."""
    trial = one.trial
    if trial.kind is None:
        return None
    plain = attached_if_possible(trial.kind, trial.site.name, one.values, variant=trial.variant, source=trial.source)
    if plain is None:
        return None
    values = {name: _inside(plain.parameters[name]) for name in plain.values}
    return replace(plain, values=values)


def siblings(found: Contestant, run: FreeRun) -> list[Hypothesis]:
    """Give the effects that contain one of a fit or that it contains, begun where it ended: nested laws compete."""
    fit, hypotheses = found.fit, []
    for place, one in enumerate(fit.effects):
        for other in _nested(found, run, one):
            effects = (*fit.effects[:place], other, *fit.effects[place + 1 :])
            hypotheses.append(hypothesis_of(effects, fit.z, screened=found.hypothesis.screened, initial=fit.initial))
    return hypotheses


def twins(found: Contestant, places: Iterable[Place]) -> list[Hypothesis]:
    """Give every effect of a fit at the other sites of its place where the same word may act, begun where it ended.

    A force that follows a joint's way may as well come from the input that acts across it. At an input it pushes
    where at a joint it resists: half a turn of a phase is the other sign, both are tried.
    """
    fit, hypotheses = found.fit, []
    places = list(places)
    for number, one in enumerate(fit.effects):
        for moved in _moved(one, places):
            effects = (*fit.effects[:number], moved, *fit.effects[number + 1 :])
            hypotheses.append(hypothesis_of(effects, fit.z, screened=found.hypothesis.screened, initial=fit.initial))
    return hypotheses


def _moved(effect: AttachedEffect, places: Sequence[Place]) -> Iterator[AttachedEffect]:
    there = dict.fromkeys(site for place in places if effect.site in place.names for site in place.sites)
    for site in there:
        if site.name == effect.site or site.kind not in effect.kind.sites or effect.source is not None:
            continue
        moved = replace(effect, site=site.name)
        yield moved
        if "phase" in effect.values:
            phase = effect.values["phase"]
            yield replace(moved, values={**effect.values, "phase": phase - np.copysign(np.pi, phase)})


def _nested(found: Contestant, run: FreeRun, one: AttachedEffect) -> list[AttachedEffect]:
    nested = one.kind.clues.nested
    if nested is None:
        return []

    def motion() -> tuple[Real, Real]:
        there = run.motion(found.fit.z, found.fit.effects, site=one.site)
        return there.displacement, there.velocity

    fitted = FittedForm(
        variant=one.variant,
        values=one.values,
        duration_s=run.measurement.duration_s,
        band_hz=excited_band_hz(run.measurement),
        motion=motion,
    )
    try:
        forms = list(nested(fitted))
    except ModelError:
        return []
    others = [attached_if_possible(form.effect, one.site, form.values, variant=form.variant) for form in forms]
    return [other for other in others if other is not None]


def polished(coarse: Hypothesis, fit: OutputErrorFit) -> Hypothesis | None:
    """Give the hypothesis with the details of the laws free too, starting from a fit; None when there are none."""
    effects = fit.effects
    fitted = tuple(
        (*effect.usually_fitted, *(name for name in effect.kind.clues.details if name in effect.values))
        for effect in effects
    )
    if fitted == coarse.fitted or not effects:
        return None
    start = np.clip(fit.z, -OUTSIDE, OUTSIDE)
    return replace(coarse, effects=effects, fitted=fitted, start_z=start, initial=fit.initial)


def wrong_parameters(location: Location, *, most: int = 2) -> Hypothesis | None:
    """Give the hypothesis that a few parameters are outside of their tolerance, None when none goes there.

    All may go far at first; those that do stay free, the others are held within their tolerance again.

    Parameters
    ----------
    most
        Parameters at once.
    """
    problem, names = location.problem, location.problem.tunables.names
    steps = (*location.segments, problem)
    far = tuned_stepwise(steps, np.zeros(len(names)), _FAR)
    order = np.argsort(-np.abs(far.z))
    outside = [int(place) for place in order if abs(far.z[place]) > OUTSIDE]
    # A body heavier than its tolerance carries something: that is an effect, not a wrong value.
    outside = [place for place in outside if not (_is_inertia(names[place]) and far.z[place] > 0)]
    if not outside:
        return None

    def held(count: int) -> Profile:
        limit = np.full(len(names), OUTSIDE)
        limit[outside[:count]] = _FAR
        return tuned_stepwise(steps, np.clip(far.z, -limit, limit), limit)

    counts = range(1, min(most, len(outside)) + 1)
    best: tuple[int, Profile] | None = None
    for count, found in zip(counts, side_by_side(held, counts), strict=True):
        if best is None or found.cost < 0.8 * best[1].cost:
            best = count, found
    if best is None or best[1].chi > 0.5 * location.tuned.chi:
        return None
    chosen = [names[place] for place in outside[: best[0]]]
    return Hypothesis(wide=dict.fromkeys(chosen, _FAR), start_z=best[1].z, screened=best[1].chi)


def _is_inertia(name: str) -> bool:
    """Whether a parameter is what a body resists acceleration with, in a structure or a drive.

    Examples
    --------
    >>> [_is_inertia(name) for name in ("arm.mass", "reduced_mass", "inertia", "arm.damping")]
    [True, True, True, False]
    """
    return name.split(".")[-1] in ("mass", "inertia", "reduced_mass")


def _inside(parameter: Parameter) -> float:
    return float(np.clip(parameter.value, parameter.minimum, parameter.maximum))
