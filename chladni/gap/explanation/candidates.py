"""Candidates: every effect of the catalogue at every plausible site, by the screen."""

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from chladni.gap.explanation.body_trials import body_trials
from chladni.gap.explanation.excited_band import excited_band_hz
from chladni.gap.explanation.input_trials import input_trials
from chladni.gap.explanation.joint_trials import joint_trials
from chladni.gap.explanation.output_trials import output_trials
from chladni.gap.explanation.own_trials import own_trials
from chladni.gap.explanation.ripple_trials import ripple_at_input
from chladni.gap.explanation.screen import Screen, Screened
from chladni.gap.explanation.trial import Trial
from chladni.gap.location.locate import Located, Location, sites_at
from chladni.gap.location.recovered import Recovered, recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.models.effects.effect_kind import EffectKind

#: Screened forms that are searched beyond their grid.
_REFINED = 16


def screened(
    location: Location, places: Iterable[Located], leave_out: frozenset[str], own: Mapping[str, EffectKind]
) -> list[Screened]:
    """Weigh every effect at the sites of some places; the best of each form, by rising cost.

    Parameters
    ----------
    leave_out
        Words that don't take part.
    own
        The user's effects by name.
    """
    problem = location.problem
    band = excited_band_hz(problem.measurement)
    found: list[tuple[Screened, Screen]] = []
    for located in places:
        for site, others in sites_at(located):
            motion = recovered(problem, located.profile, site)
            screen = Screen(problem, located.profile, site, others=others)
            trials = [*trials_at(problem, motion, site, band), *own_trials(problem, motion, site, own)]
            found += [(one, screen) for one in screen.run(one for one in trials if one.effect not in leave_out)]
    found.sort(key=lambda one: one[0].cost)
    best: dict[tuple[str, str, str | None, str | None], tuple[Screened, Screen]] = {}
    for one, screen in found:
        best.setdefault((one.trial.effect, one.trial.site.name, one.trial.variant, one.trial.source), (one, screen))
    refined = [screen.refined(one) if place < _REFINED else one for place, (one, screen) in enumerate(best.values())]
    return sorted(refined, key=lambda one: one.cost)


def trials_at(problem: LinearProblem, motion: Recovered, site: Site, band_hz: tuple[float, float]) -> Iterator[Trial]:
    """Give the trials of a site."""
    compiled = problem.view(np.zeros(len(problem.tunables.names))).compiled
    if site.kind == "joint":
        yield from joint_trials(motion, compiled.ports[compiled.port_index(site.name, "joint")])
    elif site.kind == "body":
        yield from body_trials(motion, band_hz)
    elif site.kind == "input":
        yield from input_trials(motion)
        yield from ripple_at_input(problem, motion, site)
    elif site.kind == "output":
        yield from output_trials(motion, problem.measurement)
