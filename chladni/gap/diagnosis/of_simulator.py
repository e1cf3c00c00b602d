"""Diagnosis of a simulator that isn't ours: which effects around it bring it to the log."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from chladni.gap.comparison.measuring import measurement_of
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.records.diagnosis import Diagnosis
from chladni.io.source import SeriesLike, series_of
from chladni.models.effects.effect_kind import EffectKind
from chladni.models.simulators.simulator import Simulator
from chladni.models.simulators.wrapped_simulator import WrappedSimulator
from chladni.signals.renamed import renamed


@renamed(recording="source")
def diagnose_simulator(
    simulator: Simulator,
    source: SeriesLike,
    *,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
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
    source
        A log whose channels share one grid, the path to one, a series, or arrays by their channel's name.
    sample_rate_hz
        Samples a second of arrays, or of a file that doesn't say it.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.
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
    recording = series_of(source, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    model = WrappedSimulator(simulator=simulator)
    measurement, remarks = measurement_of(model, recording, log=log)
    found = diagnose(
        model,
        [measurement],
        leave_out=frozenset(leave_out),
        own_effects=own_effects,
        seed=seed,
        progress=progress,
    )
    return replace(found, remarks=(*remarks, *found.remarks))
