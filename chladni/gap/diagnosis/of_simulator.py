"""Diagnosis of a simulator that isn't ours: which effects around it bring it to the log."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from chladni.gap.comparison.measuring import measurement_of
from chladni.gap.comparison.noise_estimate import estimate_noise, noise_of_residual, smaller_floor
from chladni.gap.comparison.periodicity import with_period
from chladni.gap.comparison.shares import (
    pooled_gap,
)
from chladni.gap.diagnosis.simulator_findings import SimulatorFindings
from chladni.gap.diagnosis.simulator_runs import SimulatorRuns
from chladni.gap.diagnosis.simulator_search import SimulatorSearch, search
from chladni.gap.records.diagnosis import (
    PARAMETER,
    Diagnosis,
)
from chladni.gap.simulators.signal_model import SignalModel
from chladni.gap.simulators.simulator import RefinableSimulator, Simulator
from chladni.gap.simulators.wrapped_simulator import WrappedSimulator
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import taking_part
from chladni.models.effects.effect_kind import EffectKind
from chladni.signals.time_series import TimeSeries


def diagnose_simulator(
    simulator: Simulator,
    recording: TimeSeries,
    *,
    log: str = "log",
    own_effects: Sequence[EffectKind] = (),
    leave_out: Sequence[str] = (),
    seed: int = 0,
    progress: Callable[[str, float], None] | None = None,
) -> Diagnosis:
    """Say which unmodelled effect, at an input, output or joint of a simulator, explains what a log shows.

    The simulator runs freely from its own start with the log's inputs; of parameters and effects those are chosen
    that explain blocks of the log which no fit saw (docs/methods/other-simulators.md).

    Parameters
    ----------
    simulator
        From `mujoco_simulator`, `callable_simulator`, or of your own.
    recording
        The log's channels on one grid, as `Log.read` gives them.
    log
        Its name, for people.
    own_effects
        Effects beside the catalogue's.
    leave_out
        Words that don't take part.
    seed
        Of the bootstrap.
    progress
        Called with what is being done, and the share of it that is done.

    Returns
    -------
    Diagnosis
        As for a model of ours; without `restoring_force`, which takes equations.

    Raises
    ------
    LogError
        When an input's channel is missing, or no output was measured.
    ModelError
        When units don't fit, or the simulator diverges.
    EstimateError
        When the log is shorter than 3 s.
    """
    measurement, remarks = measurement_of(SignalModel(simulator=simulator), recording, log=log)
    measurement = with_period(measurement)
    noise = estimate_noise(measurement)
    runs = SimulatorRuns.of(simulator, measurement, noise)
    found = search(runs, taking_part(leave_out, own_effects), progress=progress or _silent)
    # What is left in the end is an upper bound too, and where a linear fit took distortion for noise, the lower one.
    left = noise_of_residual(measurement.outputs - found.best.outputs, sample_rate_hz=measurement.sample_rate_hz)
    told = SimulatorFindings(
        search=found, noise=smaller_floor(noise, left), remarks=remarks, seed=seed, step_error=_step_error(found)
    )
    return told.diagnosis()


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
    own = {kind.name: kind for kind in own_effects}
    effects = [
        attached(
            own.get(cause.effect, cause.effect),
            cause.site,
            {name: number.value for name, number in cause.parameters.items()},
            variant=cause.variant,
            source=cause.source,
        )
        for cause in diagnosis.causes
        if cause.effect != PARAMETER
    ]
    values = {name: number.value for name, number in diagnosis.tuned_parameters.items()}
    return WrappedSimulator(simulator=simulator, values=values, effects=tuple(effects))


def _step_error(found: SimulatorSearch) -> float | None:
    """How far half the step moves the best explanation, as a gap; None where the simulator can't tell."""
    simulator = found.runs.wrapped.simulator
    if not isinstance(simulator, RefinableSimulator):
        return None
    finer = replace(found.runs, wrapped=WrappedSimulator(simulator=simulator.refined()))
    measured = found.runs.measurement.outputs
    return pooled_gap(found.best.outputs - finer.simulated(found.best.z, found.best.effects), measured)


def _silent(_doing: str, _share: float) -> None:
    """Nobody listens."""
