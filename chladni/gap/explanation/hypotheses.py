"""From screened trials and wide parameters to hypotheses that are worth a fit."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from chladni.gap.calibration import CREEP, FAR, LEADS, LITTLE, PLACES, TIED, UNLIKELY
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.explanation.screen import Screened
from chladni.gap.explanation.trial import excited_band_hz
from chladni.gap.location.locate import Located, Location
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.places import Place, Site
from chladni.gap.tuning.output_error import OutputErrorFit
from chladni.models.core.parameter import Parameter
from chladni.models.effects.attached_effect import AttachedEffect, attached_if_possible
from chladni.models.effects.clues import FittedForm
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.effects.trial import Numbers
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


def effect_hypotheses(screened: Sequence[Screened], *, count: int) -> list[Hypothesis]:
    """Give the best screened trials as hypotheses: so many, and a few that are as good as the last of them.

    Of each effect and site there are at most two forms.
    """
    found: list[Hypothesis] = []
    seen: dict[tuple[str, str], int] = {}
    if not screened:
        return found
    enough, last = UNLIKELY * min(one.chi for one in screened), 0.0
    for one in screened:
        key = (one.trial.effect, one.trial.site.name)
        if seen.get(key, 0) >= LEADS or one.chi > enough:
            continue
        if len(found) >= count and (one.chi > TIED * last or len(found) >= count + LEADS):
            break
        effect = effect_of(one)
        if effect is None:
            continue
        seen[key] = seen.get(key, 0) + 1
        found.append(hypothesis_of((effect,), one.z))
        last = max(last, one.chi) if len(found) <= count else last
    return found


def hypothesis_of(effects: tuple[AttachedEffect, ...], z: Real, *, initial: Real | None = None) -> Hypothesis:
    """Give the hypothesis that these effects act."""
    fitted = tuple(effect.usually_fitted for effect in effects)
    return Hypothesis(effects=effects, fitted=fitted, start_z=z, initial=initial)


def effect_of(one: Screened) -> AttachedEffect | None:
    """Give the effect of a screened trial, its values held inside their possible ranges; None when it's none."""
    kind, form = one.trial.kind, one.trial.form
    if kind is None:
        return None
    plain = attached_if_possible(kind, one.trial.site.name, one.values, variant=form.variant, source=form.source)
    if plain is None:
        return None
    values = {name: _inside(plain.parameters[name]) for name in plain.values}
    return replace(plain, values=values)


def little_of(effect: AttachedEffect, site: str) -> AttachedEffect:
    """Give a tenth of an effect at a site: where it isn't known yet how much of it acts there."""
    sizes = effect.kind.clues.sizes
    values = {name: (LITTLE if name in sizes else 1.0) * one for name, one in effect.values.items()}
    return replace(effect, site=site, values=values)


def siblings(found: Contestant, run: FreeRun) -> list[Hypothesis]:
    """Give the effects that contain one of a fit or that it contains, begun where it ended: nested laws compete."""
    effects = found.fit.effects
    return [_instead(found, place, other) for place, one in enumerate(effects) for other in _nested(found, run, one)]


def twins(found: Contestant, places: Iterable[Place]) -> list[Hypothesis]:
    """Give every effect of a fit at the other sites of its place where the same word may act, begun where it ended.

    A force that follows a joint's way may as well come from the input that acts across it. At an input it pushes
    where at a joint it resists: half a turn of a phase is the other sign, both are tried.
    """
    places, effects = list(places), found.fit.effects
    return [_instead(found, number, moved) for number, one in enumerate(effects) for moved in _moved(one, places)]


def _instead(found: Contestant, place: int, other: AttachedEffect) -> Hypothesis:
    """Another effect in the place of one of a fit."""
    fit = found.fit
    return hypothesis_of((*fit.effects[:place], other, *fit.effects[place + 1 :]), fit.z, initial=fit.initial)


def fitted_form(run: FreeRun, effect: AttachedEffect, motion: Callable[[], tuple[Real, Real]]) -> FittedForm:
    """Give an effect of a fit as its own file judges it, with the motion at its site."""
    return FittedForm(
        variant=effect.variant,
        values=effect.values,
        duration_s=run.measurement.duration_s,
        band_hz=excited_band_hz(run.measurement),
        motion=motion,
    )


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

    try:
        forms = list(nested(fitted_form(run, one, motion)))
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
    return replace(coarse, effects=effects, fitted=fitted, start_z=fit.z, initial=fit.initial)


def _inside(parameter: Parameter) -> float:
    return float(np.clip(parameter.value, parameter.minimum, parameter.maximum))


def sticking_hypotheses(location: Location, kinds: Iterable[EffectKind]) -> list[Hypothesis]:
    """Give friction at the joints where the cause may be, as large as most of the force that they pass on.

    Of a joint that sticks sensors tell the whole force, friction with spring and damper: what they miss of the way
    goes to the one as it comes from the other.
    """
    joints = list(_joints(location))[:PLACES]
    resisting = [(kind, kind.clues.resisting) for kind in kinds if kind.clues.resisting is not None]
    found = [_sticking(location, *joint, *friction) for friction in resisting for joint in joints]
    return [one for one in found if one is not None]


def _joints(location: Location) -> Iterator[tuple[Located, Site]]:
    enough = FAR * min((one.profile.chi for one in location.ranked), default=0.0)
    for located in location.ranked:
        if located.profile.forces and located.profile.chi < enough:
            yield from ((located, site) for site in located.places[0].sites if site.kind == "joint")


def _sticking(
    location: Location, located: Located, site: Site, kind: EffectKind, resisting: Callable[[float, float], Numbers]
) -> Hypothesis | None:
    problem = location.problem
    motion = recovered(problem, located.profile, site)
    compiled = problem.view(motion.z).compiled
    port = compiled.ports[compiled.port_index(site.name, "joint")]
    passed = motion.force + port.stiffness * motion.displacement + port.damping * motion.velocity
    # Sliding begins with most of the force.
    force = float(np.quantile(np.abs(passed - np.median(passed)), 1 - LITTLE))
    effect = attached_if_possible(kind, site.name, resisting(force, CREEP * float(np.std(motion.velocity))))
    return None if effect is None else hypothesis_of((effect,), located.profile.z)
