"""Linear effects beside the parameters of a model, fitted where both are linear: over segments first."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import FAR, FORMS, LOCATED, ROUNDING, WIDE
from chladni.gap.explanation.hypotheses import effect_of, hypothesis_of
from chladni.gap.explanation.hypothesis import Hypothesis
from chladni.gap.explanation.screen import Screened
from chladni.gap.location.locate import Location, tuned_stepwise
from chladni.gap.location.profile import Profile, profiled
from chladni.gap.plant.black_box import BlackBox
from chladni.gap.plant.further_numbers import with_further
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.tuning.effect_scale import effect_numbers, with_numbers
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearFit:
    """A linear effect fitted together with the parameters.

    Attributes
    ----------
    effect
        With the numbers found.
    z
        ``[parameter]`` in units of their tolerance.
    chi
        Misfit over what noise alone leaves.
    """

    effect: AttachedEffect
    z: Real
    chi: float


def linear_hypotheses(
    model: Model, location: Location, screened: Sequence[Screened], *, count: int = 2 * LOCATED
) -> list[Hypothesis]:
    """Fit the linear effects of a screen together with the parameters; the best, by rising misfit.

    The screen weighs an effect along a motion that was recovered with the parameters that suit any force there. Where
    few sensors leave that motion open, or an effect moves resonances far, it finds a wrong size. Here resonances may
    lie elsewhere at first, as when a model is tuned.

    Parameters
    ----------
    model
        Of the location's problem.
    count
        Of screened forms that are fitted, at half a second each. A black box has no equations to fit.
    """
    if isinstance(model, BlackBox):
        return []
    enough = FAR * min((one.profile.chi for one in location.ranked), default=0.0)
    there = {site.name: one for one in location.ranked if one.profile.chi < enough for site in one.places[0].sites}
    worth = [one for one in screened if one.trial.site.name in there]
    effects = [effect for one in worth if (effect := effect_of(one)) is not None and effect.kind.linear]
    found = [fitted_beside(model, location, effect, there[effect.site].profile.z) for effect in effects[:count]]
    ranked = sorted((one for one in found if one is not None), key=lambda one: one.chi)
    return [hypothesis_of((one.effect,), one.z, screened=one.chi) for one in ranked[:FORMS]]


def _starts(effect: AttachedEffect) -> list[AttachedEffect]:
    if "frequency" not in effect.values:
        return [effect]
    return [
        replace(effect, values={**effect.values, "frequency": factor * effect.values["frequency"]})
        for factor in (0.5, 1.0, 2.0)
    ]


def fitted_beside(model: Model, location: Location, effect: AttachedEffect, z: Real) -> LinearFit | None:
    """Fit from the start that is best over short segments; None where none converges."""
    numbers = effect_numbers((effect,))
    limit = np.concatenate([location.problem.limits(z), np.full(len(numbers), np.inf)])
    begun: list[tuple[Profile, AttachedEffect]] = []
    for start in _starts(effect):
        first = _beside(location.segments[0], model, start)
        at = np.concatenate([z, np.zeros(len(numbers))])
        with suppress(ModelError, np.linalg.LinAlgError):
            begun.append((profiled(first, (), at, limit=limit), start))
    if not begun:
        return None
    best, start = min(begun, key=lambda one: one[0].chi)
    problems = [_beside(one, model, start) for one in (*location.segments[1:], location.problem)]
    try:
        found = tuned_stepwise(problems, best.z, limit)
    except (ModelError, np.linalg.LinAlgError):
        return None
    return LinearFit(effect=_moved(start, found.z[z.size :]), z=found.z[: z.size], chi=found.chi)


def _beside(problem: LinearProblem, model: Model, effect: AttachedEffect) -> LinearProblem:
    """Give the problem with the effect's numbers behind its parameters."""

    def make(parameters: Mapping[str, float], further: Real) -> CompiledModel:
        return model.with_values(parameters).with_effects((*model.effects, _moved(effect, further))).compile()

    return with_further(problem, len(effect_numbers((effect,))), make)


def _moved(effect: AttachedEffect, further: Real) -> AttachedEffect:
    """Give the effect with its numbers moved, within their possible ranges but for what rounding adds."""
    numbers = effect_numbers((effect,))
    low, high = np.array([one.low for one in numbers]), np.array([one.high for one in numbers])
    steps = np.clip(WIDE * further, low + ROUNDING * np.abs(low), high - ROUNDING * np.abs(high))
    return with_numbers((effect,), numbers, steps)[0]
