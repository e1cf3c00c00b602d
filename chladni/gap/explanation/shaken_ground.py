"""A floor that shakes: no law can predict it, but the sensors can predict each other."""

import numpy as np
from numpy.typing import NDArray

from chladni.gap.location.profile import Profile
from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.record_lines import all_lines

Matrix = NDArray[np.float64]
Spectrum = NDArray[np.complex128]


def predicted_by_others(problem: LinearProblem, found: Profile) -> Matrix:
    """Give ``[output, sample]``: what each sensor should have read if the force that all others tell acts.

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
    linear = view.response(found.transient, ())
    residual = ((whole.measured - linear) * whole.weight)[:, 0]
    told, strength = pattern.conj() * residual, np.abs(pattern) ** 2
    others = strength.sum(axis=0) - strength
    force = (told.sum(axis=0) - told) / np.where(others > 0, others, np.inf)
    # A line on which the others hardly feel the force tells nothing: there it's taken for absent.
    power = np.abs(force) ** 2
    share = np.maximum(power - 1.0 / np.where(others > 0, others, 1e-300), 0.0) / np.maximum(power, 1e-300)
    predicted = linear[:, 0] + pattern / whole.weight[:, 0] * force * share
    mean = measurement.outputs.mean(axis=1, keepdims=True)
    return np.asarray(lines.signal(predicted[:, None])[:, 0] + mean, dtype=np.float64)
