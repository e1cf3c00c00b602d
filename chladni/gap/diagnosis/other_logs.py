"""What was found on one log, tried on others that nothing was fitted to."""

from collections.abc import Sequence

from chladni.gap.comparison.periodicity import with_period
from chladni.gap.diagnosis.closing import Yardstick, closing_of
from chladni.gap.diagnosis.study import Study, floor_of, training_of
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.windows import short_windows
from chladni.gap.records.diagnosis import Closing
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.output_error import fit_output_error
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import EstimateError, ModelError


def tried_elsewhere(
    study: Study, causes: Causes, measurements: Sequence[Measurement], *, seed: int
) -> tuple[tuple[Closing, ...], tuple[str, ...]]:
    """Give what `closing_elsewhere` says of other logs, and a sentence on each of which it can't say anything."""
    if causes.shaken is not None:
        # A floor's motion is that of one log.
        return (), ()
    found = [(one.log, closing_elsewhere(study, causes, one, seed=seed)) for one in measurements]
    diverging = [
        f"{log}: the model diverges there, as it is or with what was found, so nothing could be tried on it; "
        "check the units of its inputs"
        for log, closing in found
        if closing is None
    ]
    return tuple(closing for _, closing in found if closing is not None), tuple(diverging)


def closing_elsewhere(study: Study, causes: Causes, measurement: Measurement, *, seed: int) -> Closing | None:
    """Say how far the gap closes on another log, with parameters and effects as the first log told them.

    Only the state that the log begins in (each window, as on the first log) and the outputs' constants are estimated,
    on stretches that aren't judged. There's None where the model diverges on that log.
    """
    measurement = with_period(measurement)
    windows = None if study.windows is None else short_windows(study.model, measurement)
    run, noise = FreeRun(study.model, measurement, windows=windows), floor_of(measurement)
    training = training_of(measurement, windows)
    believed = causes.best if causes.verdict in ("effect", "parameters") else causes.tuned
    yardstick = Yardstick(measurement=measurement, held=~training, noise=noise, windows=windows)
    try:
        runs = [_as_told(run, noise, training, one) for one in (None, causes.tuned, believed)]
    except (ModelError, EstimateError):
        return None
    return closing_of(yardstick, *runs, seed=seed)


def _as_told(run: FreeRun, noise: NoiseFloor, training: Mask, told: Contestant | None) -> Real:
    """``[output, sample]`` of the nominal model (None), or of what a contestant says, from the best initial state."""
    effects = () if told is None else told.fit.effects
    return fit_output_error(
        run,
        noise,
        effects=effects,
        fitted=((),) * len(effects),
        training=training,
        start_z=None if told is None else told.fit.z,
        # They stay where they are, wherever that is.
        held=False,
        tune=False,
        offsets=len(run.windows) == 1,
    ).outputs
