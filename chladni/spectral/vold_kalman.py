"""The second-generation Vold-Kalman filter: amplitudes of several orders that share a record, each smooth."""

import numpy as np

from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.errors import EstimateError

# Of the banded matrix and its factors, in numbers: a gigabyte.
MOST_VALUES = 1 << 27


def smooth_amplitudes(angle: Real, values: Real, used: Mask, orders: Real, band: float, step: float) -> Complex:
    """Give ``[order, knot]``, amplitudes that run straight between knots `step` revolutions apart: normal equations.

    The samples are a sum of a mean and of each order's cosine and sine, side by side at each knot of the matrix.
    """
    from scipy.linalg import solveh_banded

    place = (angle - angle[0]) / step
    segment = place.astype(np.intp)
    late = place - segment
    knots, parts = int(segment[-1]) + 2, 2 * orders.size + 1
    if knots * parts**2 > MOST_VALUES // 2:
        raise EstimateError(
            f"{orders.size} orders over {angle[-1] - angle[0]:.3g} revolutions are more than fit in memory; give "
            "fewer, more revolutions a window, or a part of the record"
        )
    # By the angle that each sample stands for, so that the band is as many orders wide at every speed.
    weight = np.gradient(angle) / step * used
    turning = 2 * np.pi * np.outer(orders, angle)
    shapes = np.concatenate([np.ones((1, angle.size)), np.cos(turning), -np.sin(turning)])
    hats = (1 - late, late)

    def summed(x: Real) -> Real:
        return np.bincount(segment, weights=x, minlength=knots - 1).astype(np.float64, copy=False)

    matrix, right = np.zeros((2 * parts + 1, knots, parts)), np.zeros((knots, parts))
    for i in range(parts):
        weighted = weight * shapes[i]
        right[:-1, i] += summed(weighted * hats[0] * values)
        right[1:, i] += summed(weighted * hats[1] * values)
        for j in range(parts):
            both = weighted * shapes[j]
            if i <= j:
                matrix[2 * parts + i - j, :-1, j] += summed(both * hats[0] ** 2)
                matrix[2 * parts + i - j, 1:, j] += summed(both * hats[1] ** 2)
            matrix[parts + i - j, 1:, j] += summed(both * hats[0] * hats[1])
    roughness = (np.sqrt(2) - 1) / (2 - 2 * np.cos(np.pi * band * step)) ** 2
    # A cosine and a sine each hold half of the power.
    _add_roughness(matrix, np.where(np.arange(parts) > 0, roughness / 2, roughness))
    solved = solveh_banded(matrix.reshape(2 * parts + 1, -1), right.ravel(), check_finite=False).reshape(knots, parts)
    return np.asarray((solved[:, 1 : orders.size + 1] + 1j * solved[:, orders.size + 1 :]).T)


def _add_roughness(matrix: Real, weight: Real) -> None:
    """Add the squares of each part's second differences to the banded matrix, times its weight."""
    parts = weight.size
    for knot, square in ((slice(None, -2), 1), (slice(1, -1), 4), (slice(2, None), 1)):
        matrix[2 * parts, knot] += square * weight
    matrix[parts, 1:-1] -= 2 * weight
    matrix[parts, 2:] -= 2 * weight
    matrix[0, 2:] += weight
