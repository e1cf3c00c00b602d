"""Values of one leaf as a block of messages gave them, and their joining to a column."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from chladni.io.decoding.assemble import dense_if_even
from chladni.io.decoding.columns import Column, Strings
from chladni.io.decoding.schema import Array

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from chladni.io.decoding.columns import StringValue
    from chladni.io.decoding.schema import Leaf
    from chladni.signals.arrays import Mask, Whole

Number = TypeVar("Number", bound=np.generic)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """Values of one leaf in the sound messages of a block.

    Parameters
    ----------
    values : ndarray or Strings [element]
        One after another.
    lengths : tuple of int64 arrays
        Length of every list, level by level as in `Column`; empty where each sound message has exactly one value.
    """

    values: NDArray[np.generic] | Strings
    lengths: tuple[Whole, ...] = ()

    @property
    def counts(self) -> Whole | None:
        """Elements in each sound message; None where each has exactly one."""
        return totals(self.lengths) if self.lengths else None


@dataclass(slots=True, kw_only=True)
class Row:
    """What one message holds of a leaf.

    Parameters
    ----------
    values : list
        One after another; where the leaf is an array of numbers or of strings, each is a sequence of them.
    lengths : list of list of int
        Length of every list on the way to them, level by level.
    """

    values: list[object]
    lengths: list[list[int]] = field(default_factory=list)

    def open(self, lists: Sequence[Sequence[object]]) -> None:
        """Go on with the elements of the lists that the values are."""
        self.lengths.append([len(one) for one in lists])
        self.values = [element for one in lists for element in one]


def totals(lengths: Sequence[Whole]) -> Whole:
    """Elements that lie in each list of the outermost level, in lists of all levels below it.

    Examples
    --------
    >>> totals([np.array([2, 0, 1]), np.array([3, 1, 2])])
    array([4, 0, 2])
    """
    found = lengths[-1]
    for above in reversed(lengths[:-1]):
        before = np.append(0, np.cumsum(found))
        ends = np.cumsum(above)
        found = before[ends] - before[ends - above]
    return found


def interned(values: Iterable[StringValue]) -> Strings:
    """Store each distinct string once.

    Examples
    --------
    >>> interned(["a", "b", "a"]).table
    ('a', 'b')
    """
    known: dict[StringValue, int] = {}
    codes = np.array([known.setdefault(value, len(known)) for value in values], np.int32)
    return Strings(codes=codes, table=tuple(known))


def found_of(leaf: Leaf, rows: Sequence[Row]) -> Found:
    """Collect values that were read message by message.

    Parameters
    ----------
    leaf : Leaf
    rows : sequence [message] of Row
        What each sound message holds of the leaf.
    """
    values = [value for row in rows for value in row.values]
    levels = [[length for row in rows for length in row.lengths[level]] for level in range(sum(leaf.lists))]
    lengths = tuple(np.array(level, np.int64) for level in levels)
    if leaf.info.kind == "string":
        return Found(values=interned(cast("list[StringValue]", values)), lengths=lengths)
    if not isinstance(leaf.type, Array):
        return Found(values=np.array(values, _roomy(leaf, values)), lengths=lengths)
    arrays = cast("Sequence[Sequence[float]]", values)
    parts = [np.asarray(one, _roomy(leaf, one)) for one in arrays]
    return Found(
        values=np.concatenate([np.empty(0, leaf.info.dtype), *parts]),
        lengths=(*lengths, np.array([len(one) for one in arrays], np.int64)),
    )


def _roomy(leaf: Leaf, values: Iterable[object]) -> np.dtype[np.generic] | None:
    """Type for values of a leaf: one that is missing is NaN, for which integers and truth values have no room."""
    dtype = leaf.info.dtype
    if (
        dtype is None
        or dtype.kind == "f"
        or isinstance(values, np.ndarray)
        or not any(isinstance(value, float) for value in values)
    ):
        return dtype
    return np.dtype(np.float64)


def nothing(leaf: Leaf) -> NDArray[np.generic] | Strings:
    """No values, of the kind that a leaf has."""
    if leaf.info.kind == "string":
        return Strings(codes=np.empty(0, np.int32), table=())
    return np.empty(0, leaf.info.dtype)


def joined_column(found: Sequence[Found], bad: Mask, *, empty: NDArray[np.generic] | Strings) -> Column:
    """Make one column of what the blocks of a batch gave.

    Parameters
    ----------
    found : sequence of Found
        In the order of the messages.
    bad : bool array [message]
        Messages that gave nothing.
    empty : ndarray or Strings
        No values, of the right kind.

    Returns
    -------
    Column
        With a row for each message, bad ones included.
    """
    table: tuple[StringValue, ...] = ()
    if isinstance(empty, Strings):
        parts, table = _one_table([one.values for one in found if isinstance(one.values, Strings)])
    else:
        parts = [np.asarray(one.values) for one in found]
    none = empty.codes if isinstance(empty, Strings) else empty
    # Of one block, nothing has to be joined: of thousands of leaves, that is most of the work.
    flat = parts[0] if len(parts) == 1 and parts[0].dtype == none.dtype else np.concatenate([none, *parts])
    lengths = [np.concatenate(level) for level in zip(*(one.lengths for one in found), strict=True)]
    values, counts, nested = _placed(flat, lengths, bad)
    if isinstance(empty, Strings):
        coded = Strings(codes=values.astype(np.int32, copy=False), table=table or ("",))
        return Column(values=coded, counts=counts, nested=nested)
    return Column(values=values, counts=counts, nested=nested)


def _placed(
    flat: NDArray[np.generic], lengths: list[Whole], bad: Mask
) -> tuple[NDArray[np.generic], Whole | None, tuple[Whole, ...]]:
    if not lengths:
        return (_of_all(flat, bad) if bad.any() else flat), None, ()
    if len(lengths) > 1:
        return flat, _of_all(totals(lengths), bad), (_of_all(lengths[0], bad), *lengths[1:])
    return *dense_if_even(flat, _of_all(lengths[0], bad), bad), ()


def _of_all(sound: NDArray[Number], bad: Mask) -> NDArray[Number]:
    """A value for each message, 0 for the bad ones."""
    values = np.zeros(len(bad), sound.dtype)
    values[~bad] = sound
    return values


def _one_table(parts: Sequence[Strings]) -> tuple[list[NDArray[np.generic]], tuple[StringValue, ...]]:
    known: dict[StringValue, int] = {}
    codes: list[NDArray[np.generic]] = []
    for part in parts:
        new = np.array([known.setdefault(value, len(known)) for value in part.table], np.int32)
        codes.append(new[part.codes] if len(new) else part.codes)
    return codes, tuple(known)
