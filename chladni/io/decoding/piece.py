"""What a part of the messages gave for one leaf."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chladni.signals.arrays import Whole


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """Part of a column: what some rows gave for one leaf.

    Parameters
    ----------
    rows : int64 array [row]
    values : ndarray
        ``[row]``, ``[row, element]``, or ``[element]`` with counts. For strings two numbers take the place of one:
        first byte and number of bytes, ``[..., 2]``.
    counts : int64 array [row], optional
    """

    rows: Whole
    values: NDArray[np.generic]
    counts: Whole | None = None
