"""Hat functions: sums of them are any continuous function of a signal."""

import numpy as np

from chladni.signals.arrays import Real


def hats(signal: Real, count: int) -> list[Real]:
    """Give hat functions of a signal ``[sample]``, one for each of `count` points with equally many samples between.

    Points that coincide, of a signal that rests, count once. The functions add up to one.
    """
    points = np.unique(np.quantile(signal, np.linspace(0.0, 1.0, count)))
    return [np.interp(signal, points, one) for one in np.eye(points.size)]
