"""A model nearer to its machine: tuned to a log, or with what a diagnosis found."""

from collections.abc import Sequence
from typing import TypeVar

from chladni.gap.comparison.measuring import measurement_of
from chladni.gap.records.diagnosis import PARAMETER, Cause, Diagnosis
from chladni.io.source import SeriesLike, log_or_series, series_of
from chladni.models.core.model import Effect, Model
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.simulators.simulator import Simulator
from chladni.models.simulators.wrapped_simulator import WrappedSimulator

ModelT = TypeVar("ModelT", bound=Model)


def explained_model(model: ModelT, found: Diagnosis, *, own_effects: Sequence[EffectKind] = ()) -> ModelT:
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


def explained_simulator(
    simulator: Simulator, diagnosis: Diagnosis, *, own_effects: Sequence[EffectKind] = ()
) -> WrappedSimulator:
    """Give the simulator as a diagnosis says that the machine is: tuned, and with the causes that it names.

    Parameters
    ----------
    simulator, diagnosis
        What was diagnosed, and what came of it.
    own_effects
        Those that took part.

    Raises
    ------
    ModelError
        When the diagnosis is another simulator's.
    """
    return explained_model(WrappedSimulator(simulator=simulator), diagnosis, own_effects=own_effects)


def tuned_model(
    model: Model,
    source: SeriesLike,
    *,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Model:
    """Give the model with the parameters that suit a log best when nothing is added to it.

    Parameters
    ----------
    model
        The one to tune, as far as its tolerances allow.
    source, sample_rate_hz, start_s, end_s
        The log, the path to one, a series, or arrays by their channel's name; see `chladni.psd`.

    Raises
    ------
    LogError
        When the log lacks a channel of an input, or holds no output.
    """
    # They compile what they simulate with, which a look at the façade shouldn't pay for.
    from chladni.gap.comparison.whitening import quiet_floor
    from chladni.gap.plant.free_run import FreeRun
    from chladni.gap.tuning.output_error import fit_output_error

    log = log_or_series(source, sample_rate_hz=sample_rate_hz)
    terminals = (*model.compile().inputs, *model.compile().outputs)
    wanted = {name for one in terminals for name in (one.channel, one.name)}
    listened = [channel.name for channel in log.channels if channel.name in wanted]
    measured, _ = measurement_of(
        model, series_of(log, channels=listened or None, start_s=start_s, end_s=end_s), log="log"
    )
    return model.with_values(fit_output_error(FreeRun(model, measured), quiet_floor(measured)).values)


def _is_value(cause: Cause) -> bool:
    return cause.effect == PARAMETER and bool(cause.parameters)


def _only_value(cause: Cause) -> float:
    return next(iter(cause.parameters.values())).value
