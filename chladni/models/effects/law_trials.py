"""Trials of an effect that has none of its own: its law itself along the known motion."""

from collections.abc import Iterable, Iterator

import numpy as np

from chladni.models.core.parameter import Parameter
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion
from chladni.models.integrator.known_motion import force_along_motion

#: Points of the grid over each of an effect's numbers, with one and with more of them.
_ALONE, _TOGETHER = 16, 7
_MOST = 400


def trials_of(kind: EffectKind, motion: TrialMotion) -> Iterable[Trial]:
    """Give the forms of an effect to weigh at a site of its kind: its own trials, or each law along the motion."""
    clues = kind.clues
    if clues.in_samples is not None or clues.of_force is not None:
        return ()
    return _along(kind, motion) if clues.trials is None else clues.trials(motion)


def _along(kind: EffectKind, motion: TrialMotion) -> Iterator[Trial]:
    for variant in kind.variants:
        found = _trial(kind, variant.name, motion)
        if found is not None:
            yield found


def _trial(kind: EffectKind, variant: str, motion: TrialMotion) -> Trial | None:
    compiled = motion.compiled
    start = {name: one.value for name, one in kind.parameters_of(variant).items()}
    effect = attached(kind, motion.name, start, variant=variant)
    names = effect.usually_fitted
    before = len(compiled.laws)
    # Only a law can be driven along a motion; what attaches in other ways is not screened, and so never weighed.
    if not names or len(effect.attach(compiled).laws) == before:
        return None
    parameters = [effect.parameters[name] for name in names]

    def numbers(shape: Shape) -> Numbers:
        return {**start, **{name: float(np.exp(one)) for name, one in zip(names, shape, strict=True)}}

    def build(shape: Shape) -> Force:
        laws = attached(kind, motion.name, numbers(shape), variant=variant).attach(compiled).laws[before:]
        force = sum(force_along_motion(law, motion.displacement, motion.velocity, motion.time_s) for law in laws)
        return Force.known(motion.spectrum(np.asarray(force, dtype=np.float64)))

    return Trial(
        variant=variant, build=build, grid=_grid(parameters), values=lambda shape, _: numbers(shape),
        parameters=len(names),
    )  # fmt: skip


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
