"""A model with what a diagnosis found: tuned parameters, effects attached."""

from collections.abc import Sequence

from chladni.gap.records.diagnosis import PARAMETER, Cause, Diagnosis
from chladni.models.core.model import Effect, Model
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.effect_kind import EffectKind


def explained_model(model: Model, found: Diagnosis, *, own_effects: Sequence[EffectKind] = ()) -> Model:
    """Give the model with its parameters as tuned and with the effects that were named, ready to simulate.

    Parameters
    ----------
    model
        The one that was diagnosed.
    found
        What was found. A verdict without causes still brings its tuned parameters.
    own_effects
        Effects of your own that took part.

    Raises
    ------
    ModelError
        When the model has no such parameter or site, as of another model's diagnosis.
    """
    # A cause that is a wrong value carries the value itself where it isn't among the tuned ones.
    values = {cause.site: _only_value(cause) for cause in found.causes if _is_value(cause)}
    values |= {name: number.value for name, number in found.tuned_parameters.items()}
    own = {kind.name: kind for kind in own_effects}
    # An effect of one's own is known by its record alone: no catalogue holds its word.
    added: list[Effect] = [
        attached(
            own.get(cause.effect, cause.effect),
            cause.site,
            {name: number.value for name, number in cause.parameters.items()},
            variant=cause.variant,
            source=cause.source,
        )
        for cause in found.causes
        if cause.effect != PARAMETER
    ]
    return model.with_values(values).with_effects((*model.effects, *added))


def _is_value(cause: Cause) -> bool:
    return cause.effect == PARAMETER and bool(cause.parameters)


def _only_value(cause: Cause) -> float:
    return next(iter(cause.parameters.values())).value
