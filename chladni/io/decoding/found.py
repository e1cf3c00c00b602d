"""Values of one leaf as a block of messages gave them, and their joining to a column."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np

from chladni.io.decoding.assemble import dense_if_even
from chladni.io.decoding.columns import Column, Strings
from chladni.io.decoding.schema import Array

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from chladni.io.decoding.columns import StringValue
    from chladni.io.decoding.schema import Leaf


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """Values of one leaf in the sound messages of a block.

    Parameters
    ----------
    values : ndarray or Strings [element]
        One after another.
    counts : int64 array, optional
        Elements in each sound message; None where each has exactly one.
    """

    values: NDArray[np.generic] | Strings
    counts: NDArray[np.int64] | None = None


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


def found_of(leaf: Leaf, rows: Sequence[Sequence[object]]) -> Found:
    """Collect values that were read message by message.

    Parameters
    ----------
    leaf : Leaf
    rows : sequence [message] of sequences
        Values of the leaf in each sound message, several where lists lie on the way; where the leaf is an array of
        numbers, each is a sequence of them.
    """
    values = [value for row in rows for value in row]
    counts = np.array([len(row) for row in rows], np.int64) if any(leaf.lists) else None
    if leaf.info.kind == "string":
        return Found(values=interned(cast("list[StringValue]", values)), counts=counts)
    if not isinstance(leaf.type, Array):
        return Found(values=np.array(values, _roomy(leaf, values)), counts=counts)
    # Elements of all arrays of a message belong to it.
    arrays = cast("Sequence[Sequence[Sequence[float]]]", rows)
    counts = np.array([sum(map(len, row)) for row in arrays], np.int64)
    parts = [np.asarray(one, _roomy(leaf, one)) for row in arrays for one in row]
    return Found(values=np.concatenate([np.empty(0, leaf.info.dtype), *parts]), counts=counts)


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


def joined_column(found: Sequence[Found], bad: NDArray[np.bool_], *, empty: NDArray[np.generic] | Strings) -> Column:
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
    flat = np.concatenate([empty.codes if isinstance(empty, Strings) else empty, *parts])
    values, counts = _placed(flat, [one.counts for one in found], bad)
    if isinstance(empty, Strings):
        return Column(values=Strings(codes=values.astype(np.int32, copy=False), table=table or ("",)), counts=counts)
    return Column(values=values, counts=counts)


def _placed(
    flat: NDArray[np.generic], counts: Sequence[NDArray[np.int64] | None], bad: NDArray[np.bool_]
) -> tuple[NDArray[np.generic], NDArray[np.int64] | None]:
    given = [count for count in counts if count is not None]
    if given:
        of_all = np.zeros(len(bad), np.int64)
        of_all[~bad] = np.concatenate(given)
        return dense_if_even(flat, of_all, bad)
    if not bad.any():
        return flat, None
    values = np.zeros(len(bad), flat.dtype)
    values[~bad] = flat
    return values, None


def _one_table(parts: Sequence[Strings]) -> tuple[list[NDArray[np.generic]], tuple[StringValue, ...]]:
    known: dict[StringValue, int] = {}
    codes: list[NDArray[np.generic]] = []
    for part in parts:
        new = np.array([known.setdefault(value, len(known)) for value in part.table], np.int32)
        codes.append(new[part.codes] if len(new) else part.codes)
    return codes, tuple(known)
