"""Step of a least-squares fit inside bounds."""

import numpy as np

from chladni.gap.calibration import RIDGE
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError


def bounded_step(curvature: Real, gradient: Real, low: Real, high: Real, *, damping: float) -> Real:
    """Minimise ``gradient.p + p.(H + damping diag H) p / 2`` for ``low <= p <= high``.

    Levenberg and Marquardt's step, with bounds as a linear least-squares problem (Stark & Parker 1995).

    Parameters
    ----------
    curvature
        H ``[unknown, unknown]``, positive semidefinite.
    gradient, low, high
        ``[unknown]``; 0 lies between the bounds.

    Raises
    ------
    EstimateError
        When a number isn't finite.
    """
    from scipy.optimize import lsq_linear

    if not (np.all(np.isfinite(curvature)) and np.all(np.isfinite(gradient))):
        raise EstimateError("the slopes of the fit are not finite; start from other values")
    # An unknown that does nothing stays where it is.
    size = np.sqrt(np.maximum(np.diag(curvature), 0.0))
    moving = size > 0
    step = np.zeros(gradient.size)
    if not moving.any():
        return step
    scale = size[moving]
    scaled = curvature[np.ix_(moving, moving)] / np.multiply.outer(scale, scale)
    # Where initial states were eliminated rounding may leave a curvature just below zero.
    values, vectors = np.linalg.eigh(scaled)
    sizes = np.sqrt(np.maximum(values, 0.0) + damping + scale.size * RIDGE)
    root = sizes[:, None] * vectors.T
    target = -(vectors.T @ (gradient[moving] / scale)) / sizes
    free = vectors @ (target / sizes)
    below, above = low[moving] * scale, high[moving] * scale
    if np.any(free < below) or np.any(free > above):
        # The solver wants room between the bounds, also where an unknown stands on both.
        above = np.maximum(above, below + RIDGE * (1.0 + np.abs(below)))
        free = lsq_linear(root, target, bounds=(below, above), method="bvls").x
    step[moving] = np.clip(free / scale, low[moving], high[moving])
    return step
