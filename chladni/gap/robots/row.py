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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moments:
    """Moments of chosen numbers at all rows, of which few act at each.

    Attributes
    ----------
    places
        ``[row, acting]``: places among the chosen ones; behind the last where a row has fewer than another.
    gram, right
        ``[row, acting, acting]``, ``[row, acting]``.
    size
        How many are chosen.
    """

    places: Index
    gram: Real
    right: Real
    size: int

    @classmethod
    def of(cls, rows: Sequence[Row], chosen: Index) -> "Moments":
        """Gather the moments of numbers."""
        held = [one.held(chosen) for one in rows]
        most = max((own.size for own, _ in held), default=0)
        places = np.full((len(rows), most), chosen.size)
        gram, right = np.zeros((len(rows), most, most)), np.zeros((len(rows), most))
        for row, (one, (own, here)) in enumerate(zip(rows, held, strict=True)):
            count = own.size
            places[row, :count], right[row, :count] = own, one.right[here]
            gram[row, :count, :count] = one.gram[here[:, None], here]
        return cls(places=places, gram=gram, right=right, size=chosen.size)

    def at_rows(self, numbers: Real) -> Real:
        """``[row, acting]`` of ``[..., number]``, a row or all rows."""
        padded = np.concatenate([numbers, np.zeros((*numbers.shape[:-1], 1))], axis=-1)
        return padded[self.places] if padded.ndim == 1 else np.take_along_axis(padded, self.places, axis=1)

    def information(self, weight: Real) -> Real:
        """``[number, number]`` with the rows weighed."""
        side = self.size + 1
        flat = self.places[:, :, None] * side + self.places[:, None, :]
        weighed = (weight[:, None, None] * self.gram).ravel()
        found = np.bincount(flat.ravel(), weighed, minlength=side * side).reshape(side, side)
        return np.asarray(found[:-1, :-1], dtype=np.float64)

    def toward(self, weight: Real) -> Real:
        """``[number]``: the right side with the rows weighed."""
        weighed = (weight[:, None] * self.right).ravel()
        found = np.bincount(self.places.ravel(), weighed, minlength=self.size + 1)
        return np.asarray(found[:-1], dtype=np.float64)

    def power(self, numbers: Real) -> Real:
        """``[row]``: energy of what numbers ``[row, acting]`` explain."""
        return np.asarray(np.sum(numbers * (self.gram @ numbers[..., None])[..., 0], axis=1))


#: Of each row at which a block of numbers acts: the row, places of those that do, and columns ``[acting, coarse]``.
Parts = tuple[tuple[int, Index, Real], ...]


def parts_of(columns: Real) -> Parts:
    """Give the parts of columns ``[number, row, coarse]``, most of which are zero."""
    acts = np.any(columns, axis=2)
    return tuple(
        (int(row), np.flatnonzero(acts[:, row]), columns[acts[:, row], row])
        for row in np.flatnonzero(np.any(acts, axis=0))
    )


def columns_of_rows(shape: tuple[int, ...], blocks: Sequence[tuple[Parts, Real]]) -> list[tuple[Index, Real]]:
    """Give of each row the numbers that act there, and their columns ``[acting, coarse]`` over the scales.

    Parameters
    ----------
    shape
        ``[row, coarse]``.
    blocks
        Parts, and scales ``[number]``; one behind the other.
    """
    rows, none = shape[0], np.zeros((0, shape[1]))
    numbers: list[list[Index]] = [[np.zeros(0, dtype=np.intp)] for _ in range(rows)]
    columns: list[list[Real]] = [[none] for _ in range(rows)]
    first = 0
    for parts, scale in blocks:
        for row, acting, own in parts:
            numbers[row].append(first + acting)
            columns[row].append(own * scale[acting, None])
        first += len(scale)
    return [(np.concatenate(own), np.concatenate(each)) for own, each in zip(numbers, columns, strict=True)]
