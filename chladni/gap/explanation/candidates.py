"""Candidates: every effect of the catalogue at every plausible site, by the screen."""

from collections.abc import Iterable, Sequence

import numpy as np

from chladni.gap.calibration import FAR, HOPELESS, MANY, PLACES
from chladni.gap.explanation.followed import followed
from chladni.gap.explanation.known_effect import KnownEffect
from chladni.gap.explanation.screen import Screen, Screened
from chladni.gap.explanation.trial import excited_band_hz, trials_at
from chladni.gap.location.locate import Located, Location, sites_at
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.places import Site
from chladni.gap.side_by_side import side_by_side
from chladni.models.effects.effect_kind import EffectKind

#: A form of a law, and the screen that weighed it.
Form = tuple[Screened, Screen]


def screened(
    location: Location,
    places: Iterable[Located],
    kinds: Sequence[EffectKind],
    known: KnownEffect | None = None,
) -> list[Screened]:
    """Weigh every effect at the sites of some places; the best of each form, by rising cost.

    What is known was taken from the log before it was located, when another effect is known already.
    """
    places = list(places)
    return searched(places, forms_at(location, places, kinds, known))


def searched(places: Sequence[Located], forms: Sequence[Form]) -> list[Screened]:
    """Search the most promising of the forms at some places beyond their grid; the best of each, by rising cost."""
    found = sorted(forms, key=lambda one: one[0].cost)
    enough = FAR * min((one.profile.chi for one in places), default=0.0)
    plausible = {site for one in places if one.profile.chi < enough for site, _ in sites_at(one)}
    best: dict[tuple[str, str, str | None, str | None], Form] = {}
    for one, screen in found:
        form = one.trial.form
        best.setdefault((one.trial.effect, one.trial.site.name, form.variant, form.source), (one, screen))
    worth = _worth_a_search([one for one, _ in best.values()], plausible)
    chosen = {place: form for place, form in enumerate(best.values()) if place in worth}
    ends = dict(zip(chosen, side_by_side(lambda form: _searched(*form), [*chosen.values()]), strict=True))
    sure = [one for one in ends.values() if one is not None]
    # What others leave is a promise of the linearisation at their place.
    unsure = [one for place, (one, _) in enumerate(best.values()) if ends.get(place) is None]
    return [*sorted(sure, key=lambda one: one.cost), *sorted(unsure, key=lambda one: one.cost)]


def promised(pair: Located, forms: Iterable[Form]) -> float:
    """Least cost that a law at each of two places promises while the other's force is free; of both, the larger."""
    costs = [(one.trial.site.name, one.cost) for one, _ in forms]
    return max(min((cost for name, cost in costs if name in place.names), default=np.inf) for place in pair.places)


def forms_at(
    location: Location,
    places: Iterable[Located],
    kinds: Sequence[EffectKind],
    known: KnownEffect | None = None,
) -> list[Form]:
    """Give every form at the sites of some places at the best point of its grid, with the screen that weighed it."""
    problem = location.problem
    measurement = problem.measurement if known is None else known.behind(problem.measurement)
    band = excited_band_hz(problem.measurement)

    def weighed(at: tuple[Located, Site, tuple[Site, ...]]) -> list[Form]:
        located, site, others = at
        motion = recovered(problem, located.profile, site, others)
        motion = motion if known is None else known.along(motion, problem.measurement)
        screen = Screen(problem, located.profile, site, others=others, limit=problem.limits(located.profile.z))
        return [(one, screen) for one in screen.run(trials_at(problem, measurement, motion, band, kinds))]

    sites = [(located, site, tuple(others)) for located in places for site, others in sites_at(located)]
    return [one for each in side_by_side(weighed, sites) for one in each]


def _searched(start: Screened, screen: Screen) -> Screened | None:
    """Search what enters a trial nonlinearly, and its parameters, in turn; None when it is no such effect there."""
    first = followed(screen, start)
    found, there = first if first is not None else (start, screen)
    second = followed(there, there.refined(found))
    return min((one for one, _ in filter(None, (first, second))), key=lambda one: one.cost, default=None)


def _worth_a_search(found: Sequence[Screened], plausible: set[Site]) -> set[int]:
    """Places of the first few that are not hopeless, and of each plausible site whatever they leave.

    A grid may step over a law that is sharp in its numbers; where an unknown force explains most, it's looked for.
    """
    worth = {place for place, one in enumerate(found[:MANY]) if one.misfit < HOPELESS * found[0].misfit}
    for site in plausible:
        worth.update([place for place, one in enumerate(found) if one.trial.site == site][:PLACES])
    return worth
