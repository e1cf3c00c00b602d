"""Which labels have room: none may lie on another."""

from collections.abc import Iterable

import numpy as np

from chladni.signals.arrays import Index, Real


def spread(
    places: Real, *, apart: tuple[float, float], first: Iterable[int] | None = None, limit: int | None = None
) -> Index:
    """Choose labels greedily so that none lies on another.

    Parameters
    ----------
    places
        ``[label, 2]``.
    apart
        Width and height of a label.
    first
        Order in which labels are given room; as they come when not told.
    limit
        Most labels that are chosen.

    Returns
    -------
    ndarray
        Rising rows of `places`.

    Examples
    --------
    >>> spread(np.array([[0.0, 0.0], [1.0, 0.0], [5.0, 0.0]]), apart=(3.0, 1.0)).tolist()
    [0, 2]
    """
    chosen: list[int] = []
    for row in range(len(places)) if first is None else first:
        if limit is not None and len(chosen) >= limit:
            break
        gaps = np.abs(places[chosen] - places[row])
        # Beside or above each other is enough.
        if np.all((gaps[:, 0] >= apart[0]) | (gaps[:, 1] >= apart[1])):
            chosen.append(int(row))
    return np.array(sorted(chosen), dtype=np.intp)
