"""From screened trials and wide parameters to hypotheses that are worth a fit."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chladni.gap.explanation.hypothesis import Hypothesis
from chladni.gap.explanation.screen import Screened
from chladni.gap.location.locate import Location, tuned_stepwise
from chladni.gap.tuning.effect_scale import usually_fitted
from chladni.models.core.parameter import Parameter
from chladni.models.effects.attached_effect import AttachedEffect, attached
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.errors import ModelError

Matrix = NDArray[np.float64]
#: A parameter outside of this many sigmas is wrong, not uncertain.
OUTSIDE = 3.0
#: How far one may be searched for outside its tolerance, in sigmas.
_FAR = 15.0


def effect_hypotheses(
    screened: Sequence[Screened], own: Mapping[str, EffectKind], *, count: int, margin: float = 40.0
) -> list[Hypothesis]:
    """Give the best screened trials as hypotheses.

    Parameters
    ----------
    own
        Effects of the user's by name; others are taken from the catalogue.
    count
        At most so many, of each effect and site at most two forms.
    margin
        Trials whose misfit is so many times that of the best are left out.
    """
    found: list[Hypothesis] = []
    seen: dict[tuple[str, str], int] = {}
    if not screened:
        return found
    enough = margin * min(one.chi for one in screened)
    for one in screened:
        key = (one.trial.effect, one.trial.site.name)
        if seen.get(key, 0) >= 2 or one.chi > enough:
            continue
        effect = effect_of(one, own)
        if effect is None:
            continue
        seen[key] = seen.get(key, 0) + 1
        found.append(hypothesis_of((effect,), one.z, screened=one.chi))
        if len(found) == count:
            break
    return found


def hypothesis_of(effects: tuple[AttachedEffect, ...], z: Matrix, *, screened: float | None = None) -> Hypothesis:
    """Give the hypothesis that these effects act."""
    fitted = tuple(usually_fitted(effect) for effect in effects)
    return Hypothesis(effects=effects, fitted=fitted, start_z=np.clip(z, -OUTSIDE, OUTSIDE), screened=screened)


def effect_of(one: Screened, own: Mapping[str, EffectKind]) -> AttachedEffect | None:
    """Give the effect of a screened trial, its values held inside their possible ranges; None when it's none."""
    trial = one.trial
    kind = own.get(trial.effect, trial.effect)
    try:
        plain = attached(kind, trial.site.name, one.values, variant=trial.variant, source=trial.source)
    except ModelError:
        return None
    values = {name: _inside(plain.parameters[name]) for name in plain.values}
    return replace(plain, values=values)


def wrong_parameters(location: Location, *, most: int = 2) -> Hypothesis | None:
    """Give the hypothesis that a few parameters are outside of their tolerance, None when none goes there.

    All may go far at first; those that do stay free, the others are held within their tolerance again.
    """
    problem, names = location.problem, location.problem.tunables.names
    steps = (*location.segments, problem)
    far = tuned_stepwise(steps, np.zeros(len(names)), _FAR)
    order = np.argsort(-np.abs(far.z))
    outside = [int(place) for place in order if abs(far.z[place]) > OUTSIDE]
    if not outside:
        return None
    best = None
    for count in range(1, min(most, len(outside)) + 1):
        limit = np.full(len(names), OUTSIDE)
        limit[outside[:count]] = _FAR
        start = np.clip(far.z, -limit, limit)
        found = tuned_stepwise(steps, start, limit)
        if best is None or found.cost < 0.8 * best[1].cost:
            best = ([names[place] for place in outside[:count]], found)
    if best is None or best[1].chi > 0.5 * location.tuned.chi:
        return None
    chosen, found = best
    return Hypothesis(wide=dict.fromkeys(chosen, _FAR), start_z=found.z, screened=found.chi)


def _inside(parameter: Parameter) -> float:
    return float(np.clip(parameter.value, parameter.minimum, parameter.maximum))
