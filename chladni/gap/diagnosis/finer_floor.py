"""Noise behind the best cause: where the floor is too high, and what in a residual follows its own signal."""

from dataclasses import replace

import numpy as np

from chladni.gap.calibration import ALONE, LAW_POINTS, LESS, SOME
from chladni.gap.comparison.noise_estimate import estimate_noise, smaller_floor
from chladni.gap.diagnosis.study import Study
from chladni.gap.explanation.any_law import hats
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Real


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


def share_of_own_signal(simulated: Real, residual: Real) -> Real:
    """Share of each residual's variance that a curve over its simulated signal explains, but for a straight line.

    A noise floor that comes from what no linear model explains holds a sensor's distortion and its steps too, and
    nothing would ever stand out of it. What the signal itself explains is a gain's or a parameter's. A curve of many
    points takes some of any noise: variances are those of the degrees of freedom that are left, the *adjusted* R^2 of
    Ezekiel (1930), which is zero on average for noise of any length. It's ``[output]``, up to 1, and below 0 where
    the signal explains less than chance would.

    Parameters
    ----------
    simulated, residual
        ``[output, sample]``.
    """
    found = np.zeros(len(simulated))
    for row, (signal, left) in enumerate(zip(simulated, residual, strict=True)):
        line, curve = [np.ones_like(signal), signal], hats(signal, LAW_POINTS)
        plain = _variance(line, left)
        found[row] = 1.0 - _variance(curve, left) / plain if plain > 0 and left.size > len(curve) else 0.0
    return found


def without_own_signal(simulated: Real, residual: Real) -> Real:
    """Give ``[output, sample]`` residuals without the curve over their own signal, where they follow one.

    What is left of the others is as it was: a curve through noise would take some of that.
    """
    shares = share_of_own_signal(simulated, residual)
    rows = zip(simulated, residual, shares, strict=True)
    return np.stack([_rest(hats(signal, LAW_POINTS), left) if share > SOME else left for signal, left, share in rows])


def _rest(functions: list[Real], target: Real) -> Real:
    columns = np.stack(functions, axis=1)
    return np.asarray(target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0])


def _variance(functions: list[Real], target: Real) -> float:
    rest = _rest(functions, target)
    return float(rest @ rest) / max(target.size - len(functions), 1)
