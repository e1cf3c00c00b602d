"""Trials of effects that a user wrote: the law itself along the recovered motion."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from chladni.gap.explanation.trial import Force, Numbers, Shape, Trial
from chladni.gap.location.recovered import Recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.places import Site
from chladni.gap.tuning.effect_scale import usually_fitted
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter
from chladni.models.drives.known_motion import force_along_motion
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.effect_kind import EffectKind

Matrix = NDArray[np.float64]
#: Points of the grid over each of an effect's numbers, with one and with more of them.
_ALONE, _TOGETHER = 16, 7
_MOST = 400


def own_trials(
    problem: LinearProblem, motion: Recovered, site: Site, own: Mapping[str, EffectKind]
) -> Iterator[Trial]:
    """Give a trial for each variant of each effect of the user's that acts at this kind of site by a law."""
    compiled = problem.view(np.zeros(len(problem.tunables.names))).compiled
    for kind in own.values():
        if site.kind not in kind.sites:
            continue
        for variant in kind.variants:
            found = _trial(compiled, motion, site, kind, variant.name)
            if found is not None:
                yield found


def _trial(compiled: CompiledModel, motion: Recovered, site: Site, kind: EffectKind, variant: str) -> Trial | None:
    start = {name: one.value for name, one in kind.parameters_of(variant).items()}
    effect = attached(kind, site.name, start, variant=variant)
    names = usually_fitted(effect)
    before = len(compiled.laws)
    # Only a law can be driven along a motion; what attaches in other ways is not screened, and so never weighed.
    if not names or len(effect.attach(compiled).laws) == before:
        return None
    parameters = [effect.parameters[name] for name in names]

    def numbers(shape: Shape) -> Numbers:
        return {**start, **{name: float(np.exp(one)) for name, one in zip(names, shape, strict=True)}}

    def build(shape: Shape) -> Force:
        laws = attached(kind, site.name, numbers(shape), variant=variant).attach(compiled).laws[before:]
        force = sum(force_along_motion(law, motion.displacement, motion.velocity, motion.time_s) for law in laws)
        return Force.known(motion.spectrum(np.asarray(force, dtype=np.float64)))

    return Trial(
        effect=kind.name,
        site=site,
        variant=variant,
        build=build,
        grid=_grid(parameters),
        values=lambda shape, _: numbers(shape),
        parameters=len(names),
    )


def _grid(parameters: list[Parameter]) -> tuple[Shape, ...]:
    """Logarithms over the usual range of each number."""
    points = _ALONE if len(parameters) == 1 else max(2, min(_TOGETHER, int(_MOST ** (1 / len(parameters)))))
    shapes: list[Shape] = [()]
    for one in parameters:
        high = max(abs(one.high), 1e-300)
        low = max(one.low, one.minimum, 1e-4 * high)
        shapes = [
            (*shape, float(value)) for shape in shapes for value in np.linspace(np.log(low), np.log(high), points)
        ]
    return tuple(shapes)
