"""Moments of the columns of one row of missing torque: most numbers are of laws of other joints."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Index, Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Row:
    """The numbers that act at one row, with their columns and moments.

    Attributes
    ----------
    numbers
        ``[acting]``: growing places among all numbers.
    columns
        ``[acting, coarse]``: missing torque a unit of each, over its scale.
    gram, right
        ``[acting, acting]``, ``[acting]``: whitened moments of the columns, and of these with what is missing.
    """

    numbers: Index
    columns: Real
    gram: Real
    right: Real

    @classmethod
    def of(cls, numbers: Index, columns: Real, whiten: Real, missing: Real) -> "Row":
        """Weigh columns: ``[coarse]`` are what whitens them, and what is missing."""
        whitened = columns * whiten**2
        return cls(numbers=numbers, columns=columns, gram=whitened @ columns.T, right=whitened @ missing)

    def column(self, number: int) -> Real:
        """``[coarse]``: of a number that acts here."""
        return np.asarray(self.columns[np.searchsorted(self.numbers, number)])

    def held(self, chosen: Index) -> tuple[Index, Index]:
        """Give the places among chosen numbers of those that act here, and their places here."""
        at = np.searchsorted(self.numbers, chosen)
        acts = at < self.numbers.size
        acts[acts] = self.numbers[at[acts]] == chosen[acts]
        return np.flatnonzero(acts), at[acts]

    def among(self, chosen: Index) -> "Row":
        """Give chosen numbers alone, which are counted anew."""
        places, here = self.held(chosen)
        return Row(
            numbers=places, columns=self.columns[here], gram=self.gram[np.ix_(here, here)], right=self.right[here]
        )


def columns_of_rows(rows: int, blocks: Sequence[tuple[Real, Real]]) -> list[tuple[Index, Real]]:
    """Give of each row the numbers that act there, and their columns ``[acting, coarse]`` over the scales.

    Parameters
    ----------
    blocks
        Columns ``[number, row, coarse]``, of which the rows of loops may be missing, and scales ``[number]``; one
        behind the other.
    """
    none = np.zeros((0, blocks[0][0].shape[2]))
    numbers: list[list[Index]] = [[np.zeros(0, dtype=np.intp)] for _ in range(rows)]
    columns: list[list[Real]] = [[none] for _ in range(rows)]
    first = 0
    for block, scale in blocks:
        acts = np.any(block, axis=2)
        for row in np.flatnonzero(np.any(acts, axis=0)):
            here = acts[:, row]
            numbers[row].append(first + np.flatnonzero(here))
            columns[row].append(block[here, row] * scale[here, None])
        first += len(block)
    return [(np.concatenate(own), np.concatenate(each)) for own, each in zip(numbers, columns, strict=True)]
