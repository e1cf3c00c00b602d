"""What limits a diagnosis: sensors, parameters, noise, excitation."""

import numpy as np

from chladni.gap.calibration import LISTED
from chladni.gap.comparison.distortion import Distortion
from chladni.gap.comparison.doubts import instability_found
from chladni.gap.comparison.outside_band import products_outside
from chladni.gap.comparison.shares import pooled_gap
from chladni.gap.diagnosis.study import Study, step_error
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.black_box import BlackBox
from chladni.gap.records.measurement import Measurement
from chladni.io.log_info import some_of
from chladni.signals.engineering import engineering


def remarks_on(study: Study, causes: Causes, shown: Contestant, distortion: Distortion | None) -> tuple[str, ...]:
    """What limits an answer that tells the numbers of a contestant; without distortion the excitation tells none."""
    found = []
    if len(study.measurement.output_names) < 2:
        found.append(
            "one output only: which site the missing force acts at can't be told from patterns, only from its law; "
            "a second sensor would tell"
        )
    if study.repeating:
        found.append(
            f"{', '.join(study.repeating)}: samples repeat the one before; the sensor is slower than the log, or "
            "messages were lost"
        )
    if causes.distorted:
        found.append(f"{', '.join(causes.distorted)}: what is left follows its own signal in a curve or in steps")
    found += _constants(study, causes, shown)
    if shown.fit.undetermined:
        found.append(
            f"this log doesn't determine {some_of(shown.fit.undetermined, count=LISTED)}: only the stated tolerance "
            "holds what it can't tell, which may have moved inside that with what it depends on"
        )
    if np.any(causes.noise.upper_bound):
        found.append("the noise floor of some outputs is an upper bound: distortion may be in it")
    found += _of_black_box(study, shown)
    run = study.contest.run
    stability = instability_found(run.compiled(), run.compiled(shown.fit.z, shown.fit.effects))
    return (*found, *filter(None, [stability]), *_of_distortion(study.measurement, distortion))


def _constants(study: Study, causes: Causes, shown: Contestant) -> list[str]:
    """Constants that get no name: beside another cause they may have any reason."""
    units = dict(zip(study.measurement.output_names, study.measurement.output_units, strict=True))
    return [
        f"{name} is {'+' if value > 0 else ''}{engineering(value, None, units[name])} beside the model all the time: "
        "an offset of the sensor, gravity or a tilt; it counts for nothing in this answer"
        for name, value in study.constants(shown.fit, causes.noise).items()
        if name not in causes.constants
    ]


def _of_black_box(study: Study, shown: Contestant) -> list[str]:
    """What limits an answer on a plant that only responds."""
    if not isinstance(study.model, BlackBox):
        return []
    error, measured = step_error(study, shown.fit), study.measurement.outputs
    floor = pooled_gap(np.broadcast_to(study.contest.noise.rms[:, None], measured.shape), measured)
    if error is None or error <= floor:
        return [*study.model.untold]
    of_step = (
        f"half the simulator's step moves its outputs by {error:.1%}, more than the noise of {floor:.1%}; shorten "
        "the step, or part of this answer is the step's"
    )
    return [*study.model.untold, of_step]


def _of_distortion(measurement: Measurement, distortion: Distortion | None) -> tuple[str, ...]:
    """What the excitation doesn't allow to be told of distortion, and what the lines above its band tell."""
    if distortion is None:
        return ()
    outside = products_outside(measurement)
    return (*distortion.remarks, *(() if outside is None else (outside.sentence(),)))
