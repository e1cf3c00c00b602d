"""Noise as it shows behind the best cause, where the floor that was estimated without one may be too high."""

from dataclasses import replace

import numpy as np

from chladni.gap.calibration import ALONE, LESS
from chladni.gap.comparison.noise_estimate import estimate_noise, smaller_floor
from chladni.gap.diagnosis.own_signal import without_own_signal
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.records.noise_floor import NoiseFloor


def finer_floor(study: Study, best: Contestant) -> NoiseFloor | None:
    """Give the noise of what the best hypothesis leaves; None where that says nothing new.

    Distortion that no response explains is in a floor that is estimated without a model: up to thirty times the
    noise of a sensor, and a second effect hides there. Behind a first one much of it is gone, and what follows a
    sensor's own signal, as where that is clipped, is no noise either. The floor is asked of what is left again, and
    where that is lower, and more is left than it, the search goes on over it.
    """
    measurement, noise = study.measurement, study.contest.noise
    if len(measurement.output_names) < 2:
        return None
    left = measurement.outputs - best.fit.outputs
    rest = without_own_signal(best.fit.outputs, left)
    if not best.hypothesis.effects and np.array_equal(rest, left):
        # Behind values alone nothing new is told, but where a sensor follows its own signal.
        return None
    finer = smaller_floor(noise, estimate_noise(replace(measurement, outputs=rest)))
    lower = bool(np.any(finer.rms < LESS * noise.rms))
    more = bool(np.any(np.mean(left**2, axis=1) > ALONE * finer.rms**2))
    return finer if lower and more else None
