"""A floor that shakes: no law can predict it, but the sensors can predict each other."""

import numpy as np

from chladni.gap.calibration import RIDGE
from chladni.gap.location.profile import Profile
from chladni.gap.location.recovered import recovered
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.record_lines import all_lines
from chladni.signals.arrays import Real


def predicted_by_others(problem: LinearProblem, found: Profile) -> Real:
    """Give ``[output, sample]``: what each sensor should have read if the force that all others tell acts.

    The force is Wiener's estimate (Kay 1993, *Estimation theory*, section 12.7): the less it stands out of the noise
    of the sensors that tell it, the less of that is believed. How strong it is around a line all sensors tell: where
    the others hardly feel it, they couldn't tell that either.

    Parameters
    ----------
    problem
        Of the whole record, two sensors at least.
    found
        Profile of a force at one site.
    """
    measurement = problem.measurement
    lines = all_lines(measurement.samples, measurement.sample_rate_hz)
    whole = problem.on(lines)
    view = whole.view(found.z)
    pattern = whole.pattern(view, found.sites[0])[:, 0]
    force = recovered(problem, found, found.sites[0])
    linear = view.response(force.transient, ())
    residual = ((whole.measured - linear) * whole.weight)[:, 0]
    told, strength = pattern.conj() * residual, np.abs(pattern) ** 2
    # All is told of none without noise.
    believed = np.minimum(force.reliable, 1.0 - RIDGE)
    total = strength.sum(axis=0)
    over_noise = np.where(total > 0, believed / (1.0 - believed) / np.where(total > 0, total, 1.0), 0.0)
    others = (told.sum(axis=0) - told) * over_noise / (1.0 + (total - strength) * over_noise)
    predicted = linear[:, 0] + pattern / whole.weight[:, 0] * others
    mean = measurement.outputs.mean(axis=1, keepdims=True)
    return np.asarray(lines.signal(predicted[:, None])[:, 0] + mean, dtype=np.float64)
