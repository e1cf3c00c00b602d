"""Poles of a compiled model, and its modes as motion of the bodies."""

from collections.abc import Sequence
from math import pi

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.structures.structure import AT_REST, NaturalModes
from chladni.signals.arrays import Complex


def ordered_poles(compiled: CompiledModel) -> Complex:
    """Eigenvalues of the linear equations in rad/s, those of slowest decay first."""
    poles = np.linalg.eigvals(compiled.a).astype(np.complex128)
    return np.asarray(poles[np.argsort(-poles.real, kind="stable")])


def motion_modes(compiled: CompiledModel, bodies: Sequence[str]) -> NaturalModes:
    """Oscillating modes by rising frequency, shapes over the bodies.

    Parameters
    ----------
    compiled
        With a ``body`` port for each of `bodies`.
    bodies
        Columns of the shapes.
    """
    poles, vectors = np.linalg.eig(compiled.a)
    oscillating = np.flatnonzero(poles.imag > AT_REST * np.abs(poles).max(initial=0.0))
    chosen = oscillating[np.argsort(np.abs(poles[oscillating]), kind="stable")]
    # Read at the bodies' ports, since effects and controllers add states that no body has.
    rows = compiled.displacement_state[[compiled.port_index(name, "body") for name in bodies]]
    shapes = (rows @ vectors[:, chosen]).T.reshape(chosen.size, len(bodies))
    largest = np.argmax(np.abs(shapes), axis=1, keepdims=True) if len(bodies) else np.zeros((chosen.size, 0), int)
    scale = np.take_along_axis(shapes, largest, axis=1)
    # A mode of a controller may leave every body at rest.
    scale = np.where(scale == 0, 1.0, scale)
    return NaturalModes(
        frequency_hz=np.abs(poles[chosen]) / (2 * pi),
        damping_ratio=-poles[chosen].real / np.abs(poles[chosen]),
        shapes=shapes / scale,
    )
