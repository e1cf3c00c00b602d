"""How differently forces at two sites look to a set of sensors."""

from collections.abc import Sequence

import numpy as np

from chladni.signals.arrays import Complex, Real


def angles_deg(patterns: Complex, chosen: Sequence[int]) -> Real:
    """Angle between the patterns of each two sites on some outputs, ``[site, site]``, 0 to 90 degrees.

    A force of any shape is free on every line, so only the direction over the outputs tells: with one output all
    angles are 0. The mean over the lines of the squared sine is taken.

    Examples
    --------
    Two sites that two sensors see apart, and one sensor alone doesn't:

    >>> patterns = np.array([[[1.0], [0.0]], [[1.0], [1.0]]], dtype=np.complex128)
    >>> angles_deg(patterns, [0, 1]).round(3).tolist(), angles_deg(patterns, [0]).tolist()
    ([[0.0, 45.0], [45.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]])
    """
    seen = patterns[:, list(chosen)]
    size = np.sqrt(np.sum(np.abs(seen) ** 2, axis=1, keepdims=True))
    unit = seen / np.where(size > 0, size, 1.0)
    along = np.abs(np.einsum("iol,kol->ikl", unit.conj(), unit)) ** 2
    # A line on which a site prints nothing tells nothing.
    sine = np.where(size[:, 0][:, None] * size[:, 0][None] > 0, np.maximum(1.0 - along, 0.0), 0.0)
    return np.asarray(np.degrees(np.arcsin(np.sqrt(np.clip(sine.mean(axis=-1), 0.0, 1.0)))), dtype=np.float64)
