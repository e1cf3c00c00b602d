"""Hat functions: sums of them are any continuous function of a signal."""

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


def hats(signal: Matrix, count: int) -> list[Matrix]:
    """Give hat functions of a signal ``[sample]``, one for each of `count` points with equally many samples between.

    Points that coincide, of a signal that rests, count once. The functions add up to one.
    """
    points = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, count)))
    return [np.interp(signal, points, one) for one in np.eye(points.size)]
