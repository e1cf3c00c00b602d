"""Functions of one motion that a static nonlinearity is made of, even ones apart from odd ones."""

import numpy as np

from chladni.signals.arrays import Real


def even_functions(displacement: Real) -> Real:
    """``[function, ..., sample]`` of a displacement ``[..., sample]`` of about unit RMS: abs(d), d^2, dead zones."""
    size = np.abs(displacement)
    return np.array([size, displacement**2, *(np.maximum(size - zone, 0.0) for zone in (1.0, 2.0))])


def odd_functions(displacement: Real, velocity: Real) -> Real:
    """``[function, ..., sample]``: d abs(d), d^3, dead zones with the sign of d, and the sign of the velocity."""
    size, side = np.abs(displacement), np.sign(displacement)
    beyond = [side * np.maximum(size - zone, 0.0) for zone in (1.0, 2.0)]
    return np.array([displacement * size, displacement**3, *beyond, np.sign(velocity)])
