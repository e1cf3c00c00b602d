"""The bias that noise brings to the reduced normal equations, and most of it taken off."""

import numpy as np

from chladni.modal.functions.line_weights import WeightedLines
from chladni.modal.functions.unit_circle import UnitCircle
from chladni.signals.arrays import Complex

# All of the noise that fits under the data would make the least-squares fit a total one, consistent but with noise
# poles on both sides; four fifths leave a fifth of the bias and keep them apart.
SHARE = 0.8
# Lines with gaps leave the noise matrix nearly singular; this part of its mean diagonal bounds its inverse.
RIDGE = 1e-6


def without_noise(matrix: Complex, lines: WeightedLines, circle: UnitCircle, order: int) -> Complex:
    """Take the expected contribution of noise off a reduced normal matrix, as far as it stays positive definite.

    Noise of H enters the quadratic form of A as if each line carried A itself, so that a small A, with roots off the
    circle and too much damping or none, looks best. With N its expectation, M - 0.8 lambda N is used, where lambda is
    the smallest generalised eigenvalue of (M, N), about 1 for the right std, whose scale hence doesn't matter
    (between the least-squares and the generalised total least-squares estimates of Verboven 2002).
    """
    if not np.any(lines.noise_power):
        return matrix
    from scipy.linalg import eigh, toeplitz

    references = lines.reference_scale.size
    noise = np.zeros_like(matrix)
    for reference, moments in enumerate(circle.moments(lines.noise_power, order)):
        noise[reference::references, reference::references] = toeplitz(moments[order:], moments[order::-1])
    diagonal = np.diag_indices_from(noise)
    noise[diagonal] += RIDGE * np.mean(noise[diagonal].real)
    smallest = eigh(matrix, noise, eigvals_only=True, subset_by_index=(0, 0), check_finite=False)[0]
    # Exact data under a std that isn't theirs have an eigenvalue of zero, up to rounding.
    return np.asarray(matrix - SHARE * max(smallest, 0.0) * noise)
