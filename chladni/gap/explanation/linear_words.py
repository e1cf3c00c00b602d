"""Linear effects beside the parameters of a model, fitted where both are linear: over segments first."""

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Self

import numpy as np

from chladni.gap.calibration import FAR, FORMS, LESS, LITTLE, LOCATED, ROUNDING, SHARE_OF_RANGE, UNLIKELY, WIDE
from chladni.gap.explanation.hypotheses import effect_of, hypothesis_of
from chladni.gap.explanation.hypothesis import Hypothesis
from chladni.gap.explanation.screen import Regression, Screened
from chladni.gap.location.locate import Location, tuned_stepwise
from chladni.gap.location.profile import Elimination, Profile, profiled
from chladni.gap.plant.black_box import BlackBox
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import sites_of
from chladni.gap.plant.tunable import Scaled
from chladni.gap.side_by_side import side_by_side
from chladni.gap.tuning.effect_scale import effect_numbers, with_numbers
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.effects.attached_effect import AttachedEffect, attached_if_possible
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.effects.pair import pairs_of
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearFit:
    """A linear effect, with the numbers found, fitted together with the parameters ``z [parameter]``.

    `chi` is the misfit over what noise alone leaves.
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
    lie elsewhere at first, as when a model is tuned. The model is of the location's problem; a black box has no
    equations to fit. Each form that is fitted costs half a second.
    """
    if isinstance(model, BlackBox):
        return []
    enough = FAR * min((one.profile.chi for one in location.ranked), default=0.0)
    there = {site.name: one for one in location.ranked if one.profile.chi < enough for site in one.places[0].sites}
    worth = [one for one in screened if one.trial.site.name in there]
    effects = [effect for one in worth if (effect := effect_of(one)) is not None and effect.kind.linear]
    found = [fitted_beside(model, location, effect, there[effect.site].profile.z) for effect in effects[:count]]
    ranked = sorted((one for one in found if one is not None), key=lambda one: one.chi)
    return [hypothesis_of((one.effect,), one.z) for one in ranked[:FORMS]]


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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Numbered:
    """A model with an effect whose numbers stand behind its parameters in z: implements `Varied` and `Scaled`."""

    model: Model
    effect: AttachedEffect
    tunables: Scaled
    further: tuple[str, ...]
    given: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.tunables.names, *self.further)

    def wrong(self, z: Real) -> tuple[str, ...]:
        return self.tunables.wrong(z[: len(self.tunables.names)])

    def limits(self, freed: Collection[str] = ()) -> Real:
        return np.concatenate([self.tunables.limits(freed), np.full(len(self.further), np.inf)])

    def values(self, z: Real) -> dict[str, float]:
        own = len(self.tunables.names)
        return {**self.tunables.values(z[:own]), **dict(zip(self.further, z[own:].tolist(), strict=True))}

    def with_values(self, values: Mapping[str, float]) -> Self:
        return replace(self, given={**self.given, **values})

    def compile(self) -> CompiledModel:
        parameters = {name: one for name, one in self.given.items() if name not in self.further}
        effect = _moved(self.effect, np.array([self.given.get(name, 0.0) for name in self.further]))
        return self.model.with_values(parameters).with_effects((*self.model.effects, effect)).compile()


def _beside(problem: LinearProblem, model: Model, effect: AttachedEffect) -> LinearProblem:
    """Give the problem with the effect's numbers behind its parameters."""
    further = tuple(f"further {place}" for place in range(len(effect_numbers((effect,)))))
    numbered = _Numbered(model=model, effect=effect, tunables=problem.tunables, further=further)
    return LinearProblem(numbered, problem.measurement, problem.noise, numbered, problem.lines)


def _moved(effect: AttachedEffect, further: Real) -> AttachedEffect:
    """Give the effect with its numbers moved, within their possible ranges but for what rounding adds."""
    numbers = effect_numbers((effect,))
    low, high = np.array([one.low for one in numbers]), np.array([one.high for one in numbers])
    steps = np.clip(WIDE * further, low + ROUNDING * np.abs(low), high - ROUNDING * np.abs(high))
    return with_numbers((effect,), numbers, steps)[0]


def linear_elsewhere(
    model: Model, location: Location, kinds: Sequence[EffectKind], screened: Sequence[Screened]
) -> list[Hypothesis]:
    """Fit linear effects where no place that was followed tells of them, as their first step promises; the best.

    An unknown force is no bound on every effect: a gyroscopic coupling is no force between two bodies, and a force is
    taken to be band-limited, which what a held reference makes of a gain inside its loop isn't. The model is of the
    location's problem. What leaves many times as much as the best screened form isn't worth a fit.
    """
    if isinstance(model, BlackBox):
        return []
    followed = {name for one in location.ranked for place in one.places for name in place.names}
    scores = _Scores(model, location.problem, location.tuned)
    enough = min([LESS * location.tuned.chi, *(UNLIKELY * one.chi for one in screened)])
    found = _promised(scores, location, kinds, followed | scores.open_ended, enough)
    return [hypothesis_of((one.effect,), one.z) for one in found]


def linear_beside(
    model: Model,
    location: Location,
    kinds: Sequence[EffectKind],
    kept: tuple[AttachedEffect, ...],
    z: Real,
    enough: float,
) -> list[Hypothesis]:
    """Fit linear effects beside linear ones that are kept, as far as their first step promises; the best.

    The model is of the location's problem, ``z [parameter]`` of the fit of those that are kept. Misfits over what
    noise alone leaves must come below `enough`.
    """
    beside = model.with_effects((*model.effects, *kept))
    old = location.problem
    problem = LinearProblem(beside, old.measurement, old.noise, old.tunables, old.lines)
    scores = _Scores(beside, problem, profiled(problem, (), z))
    found = _promised(scores, location, kinds, {one.site for one in kept}, enough)
    return [hypothesis_of((*kept, one.effect), one.z) for one in found]


def _promised(
    scores: "_Scores", location: Location, kinds: Sequence[EffectKind], taken: Collection[str], enough: float
) -> list[LinearFit]:
    """Fit the first few of the effects whose first step promises to come lower; those that come below a misfit."""
    tried = [(kind, site) for kind in kinds if kind.linear for site in scores.sites(kind, taken)]
    promised = [one for one in side_by_side(lambda one: scores.weighed(*one), tried) if one is not None]
    worth = [one for one in sorted(promised, key=lambda one: one[1]) if one[0].chi < LESS * scores.chi][:FORMS]
    found = [fitted_beside(scores.model, location, one.effect, one.z) for one, _ in worth]
    return sorted((one for one in found if one is not None and one.chi < enough), key=lambda one: one.chi)


class _Scores:
    """What little of an effect prints, beside the parameters: as a parameter's slope that's known without any force.

    The score test of Rao (1948). Effects that begin at nothing have one.
    """

    def __init__(self, model: Model, problem: LinearProblem, tuned: Profile) -> None:
        self.model, self.problem, self.chi = model, problem, tuned.chi
        self._plain = self.problem.view(tuned.z)
        self._out = Elimination([], self.problem.transients(self._plain))
        self._forced = self._plain.forced()
        self._size = float(np.linalg.norm(self._forced * self.problem.weight))
        rest = self._out.rest((self.problem.measured - self._forced) * self.problem.weight)
        slopes = self._out.rest(self.problem.slopes(tuned.z, tuned.transient, ()))
        self._regression = Regression(rest, slopes, tuned.z, self.problem.limits(tuned.z))

    @property
    def open_ended(self) -> set[str]:
        """Outputs that nothing listens to: an error there is any signal."""
        ports = {port.name for port in self._plain.compiled.ports}
        return set(self.problem.measurement.output_names) - ports

    def sites(self, kind: EffectKind, taken: Collection[str]) -> list[str]:
        """Where an effect may act that begins at nothing, but for sites that are taken."""
        if not kind.required or not set(kind.required) <= set(kind.neutral):
            return []
        compiled = self._plain.compiled
        if kind.clues.between_linked:
            # No force between two bodies tells of what also acts beside their joint.
            return pairs_of(compiled, "pair")
        sites = sites_of(compiled, self.problem.measurement.output_names)
        return [site.name for site in sites if site.kind in kind.sites and site.name not in taken]

    def weighed(self, kind: EffectKind, site: str) -> tuple[LinearFit, float] | None:
        """Give the effect of the size that its first step promises, with its cost; None where it promises nothing."""
        columns = {name: one for name in kind.neutral if (one := self._column(kind, site, name)) is not None}
        found: list[tuple[LinearFit, float]] = []
        for count in range(1, len(columns) + 1):
            for names in combinations(columns, count):
                sizes, misfit, z = self._regression.solved(np.array([columns[name] for name in names]))
                values = {
                    **kind.neutral,
                    **{name: kind.neutral[name] + one for name, one in zip(names, sizes, strict=True)},
                }
                effect = attached_if_possible(kind, site, values)
                if effect is not None:
                    cost = misfit + float(z @ z) / 2 + 0.5 * count * float(np.log(self.problem.scale))
                    found.append((LinearFit(effect=effect, z=z, chi=misfit / self.problem.scale), cost))
        return min(found, key=lambda one: one[1], default=None)

    def _column(self, kind: EffectKind, site: str, name: str) -> Real | None:
        """``[number]`` what one more of a number prints where it does nothing yet; None where that is nothing."""
        parameter = kind.parameters_of().require(name)
        step = SHARE_OF_RANGE * (parameter.high - parameter.low)
        printed = self._printed(kind, site, {**kind.neutral, name: kind.neutral[name] + step})
        size = float(np.linalg.norm(printed))
        if size > LITTLE**2 * self._size and np.isfinite(size):
            # So little that it's a straight line.
            step *= LITTLE**3 * self._size / size
            printed = self._printed(kind, site, {**kind.neutral, name: kind.neutral[name] + step})
        size = float(np.linalg.norm(printed))
        return self._out.rest(printed) / step if 0.0 < size < np.inf else None

    def _printed(self, kind: EffectKind, site: str, values: Mapping[str, float]) -> Complex:
        """Whitened ``[output, segment, line]`` of an effect; zero where there's none of these numbers."""
        tunables, z = self.problem.tunables, self._regression.z
        effect = attached_if_possible(kind, site, values)
        with suppress(ModelError):
            effects = () if effect is None else (effect,)
            model = self.model.with_values(tunables.values(z)).with_effects((*self.model.effects, *effects))
            moved = self.problem.beside(z, model.compile()).forced() - self._forced
            return np.asarray(moved * self.problem.weight, dtype=np.complex128)
        return np.zeros_like(self._forced)
