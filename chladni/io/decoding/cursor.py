"""A place in many messages at once.

Messages of one schema mostly have the same layout: the place of a field, counted from the start of its message, is
then *one number* for a whole batch, and a column is one strided view of the buffer. Where lengths differ the place
becomes a vector with a row for each message, and a column is one gather. Both go through the same few methods.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from collections import Counter

    from numpy.typing import NDArray

    from chladni.io.decoding.layout import FixedLayout
    from chladni.signals.arrays import Bytes, Index, Mask, Whole


class Cursor:
    """The same field of many messages, moving forward.

    Only messages that are sound so far are kept: whoever claims more bytes than a message has is dropped from all
    vectors and marked in `bad`, so no read can reach beyond its own message.

    Parameters
    ----------
    buffer : uint8 array
    base, size : int64 arrays [row]
        First byte and number of bytes of each message's body.
    rows : int64 array [row]
        Index of each in the batch, rising.
    bad : bool array [message]
        Shared by all cursors of a batch; written to.
    reasons : collections.Counter
        What was wrong with how many messages; written to.
    byte_order : {"<", ">"}
    """

    __slots__ = (
        "bad", "base", "buffer", "byte_order", "position", "reasons", "rows", "shortest", "size", "stride",
    )  # fmt: skip

    def __init__(
        self,
        *,
        buffer: Bytes,
        base: Whole,
        size: Whole,
        rows: Whole,
        bad: Mask,
        reasons: Counter[str],
        byte_order: Literal["<", ">"],
        position: int | Whole = 0,
    ) -> None:
        self.buffer = buffer
        self.bad = bad
        self.reasons = reasons
        self.byte_order = byte_order
        self._place(base=base, size=size, rows=rows, position=position)

    def _place(
        self,
        *,
        base: Whole,
        size: Whole,
        rows: Whole,
        position: int | Whole,
    ) -> None:
        self.base, self.size, self.rows = base, size, rows
        self.position = position
        self.shortest = int(size.min(initial=2**62))
        self.stride = _constant_step(base)

    def __len__(self) -> int:
        return len(self.rows)

    def enter(self, width: int, byte_order: Literal["<", ">"]) -> None:
        """Count places from `width` bytes on, behind a header that has been claimed."""
        self.base = self.base + width
        self.size = self.size - width
        self.shortest -= width
        self.byte_order = byte_order

    def compact(self, most_bytes: int) -> None:
        """Copy messages of one length that lie irregularly side by side, so that columns become strided views.

        Parameters
        ----------
        most_bytes : int
            Longest message for which that pays; a gather a column is cheaper for longer ones.
        """
        length = self.shortest
        if self.stride is not None or not 0 < length <= most_bytes or (self.size != length).any():
            return
        # One opaque item a message is copied as a whole; rows of bytes would be copied byte by byte.
        everywhere = np.ndarray((self.buffer.size - length + 1,), f"V{length}", self.buffer, 0, (1,))
        self.buffer = everywhere[self.base].view(np.uint8)
        base = np.arange(len(self), dtype=np.int64) * length
        self._place(base=base, size=self.size, rows=self.rows, position=self.position)

    def subset(self, index: Index) -> Cursor:
        """Give a cursor on some of the rows, at the same place."""
        return Cursor(
            buffer=self.buffer,
            base=self.base[index],
            size=self.size[index],
            rows=self.rows[index],
            bad=self.bad,
            reasons=self.reasons,
            byte_order=self.byte_order,
            position=self.position if isinstance(self.position, int) else self.position[index],
        )

    def drop(self, wrong: Mask, reason: str) -> Mask | None:
        """Mark rows as bad and go on without them.

        Parameters
        ----------
        wrong : bool array [row]
        reason : str

        Returns
        -------
        bool array or None
            Rows that were kept, for vectors that the caller holds; None where all were.
        """
        count = int(np.count_nonzero(wrong))
        if not count:
            return None
        self.reasons[reason] += count
        self.bad[self.rows[wrong]] = True
        return self._keep(~wrong)

    def drop_bad(self) -> Mask | None:
        """Go on without rows that another cursor found bad; gives the rows kept, or None where all were."""
        kept = ~self.bad[self.rows]
        return None if kept.all() else self._keep(kept)

    def _keep(self, kept: Mask) -> Mask:
        position = self.position if isinstance(self.position, int) else self.position[kept]
        self._place(base=self.base[kept], size=self.size[kept], rows=self.rows[kept], position=position)
        return kept

    def align(self, alignment: int) -> None:
        """Move to the next multiple of `alignment`, a power of two."""
        self.position = (self.position + (alignment - 1)) & -alignment

    def advance(self, width: int | Whole) -> None:
        """Move by `width` bytes; whether they exist is checked by the next `claim`."""
        self.position = uniform(self.position + width)

    def pass_over(self, layout: FixedLayout) -> None:
        """Move over a value of fixed size."""
        self.position = self.position + layout.at(self.position)

    def claim(self, width: int | Whole, what: str) -> Mask | None:
        """Drop rows that don't have `width` more bytes.

        Parameters
        ----------
        width : int or int64 array [row]
        what : str
            What is about to be read, for the report.

        Returns
        -------
        bool array or None
            Rows that were kept; None where all were.
        """
        end = self.position + width
        if isinstance(end, int) and end <= self.shortest:
            return None
        return self.drop(end > self.size, f"{what} runs past the end of the message")

    def take(self, dtype: np.dtype[np.generic], *, at: int | Whole = 0) -> NDArray[np.generic]:
        """Read one number a message, `at` bytes after the place; bytes must have been claimed.

        Returns
        -------
        ndarray [row]
            In native byte order.
        """
        return self._take((), (), dtype, at)

    def take_block(
        self, dtype: np.dtype[np.generic], count: int, *, step: int | None = None, at: int = 0
    ) -> NDArray[np.generic]:
        """Read `count` numbers a message, `step` bytes apart (default: next to each other).

        Returns
        -------
        ndarray [row, count]
            In native byte order.
        """
        return self._take((count,), (dtype.itemsize if step is None else step,), dtype, at)

    def _take(
        self,
        shape: tuple[int, ...],
        strides: tuple[int, ...],
        dtype: np.dtype[np.generic],
        at: int | Whole,
    ) -> NDArray[np.generic]:
        rows = len(self)
        if rows == 0 or 0 in shape:
            return np.empty((rows, *shape), dtype)
        wire = dtype.newbyteorder(self.byte_order)
        place = self.position + at
        if isinstance(place, int) and self.stride is not None:
            view = np.ndarray((rows, *shape), wire, self.buffer, int(self.base[0]) + place, (self.stride, *strides))
            return view.astype(dtype)
        span = dtype.itemsize + sum((n - 1) * step for n, step in zip(shape, strides, strict=True))
        everywhere = np.ndarray((self.buffer.size - span + 1, *shape), wire, self.buffer, 0, (1, *strides))
        return everywhere[self.base + place].astype(dtype, copy=False)

    def take_ragged(
        self,
        dtype: np.dtype[np.generic],
        counts: Whole,
        *,
        step: Whole | int | None = None,
        first: Whole | int = 0,
        later: Whole | int = 0,
    ) -> NDArray[np.generic]:
        """Read a different number of numbers from each message.

        Parameters
        ----------
        dtype : numpy.dtype
        counts : int64 array [row]
            Claimed by the caller: what is allocated here is bounded by the bytes that exist.
        step : int or int64 array [row], optional
            Bytes from one element to the next; default the width of `dtype`.
        first, later : int or int64 array [row]
            Offset of element 0, and of element k less ``k * step`` for the others.

        Returns
        -------
        ndarray [element]
            In native byte order, one message after another.
        """
        owner = np.repeat(np.arange(len(counts)), counts)
        within = np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
        steps = dtype.itemsize if step is None else _of_rows(step, owner)
        start = (self.base + self.position)[owner]
        start += np.where(within == 0, _of_rows(first, owner), _of_rows(later, owner) + within * steps)
        if not len(start):
            return np.empty(0, dtype)
        wire = dtype.newbyteorder(self.byte_order)
        everywhere = np.ndarray((self.buffer.size - dtype.itemsize + 1,), wire, self.buffer, 0, (1,))
        values: NDArray[np.generic] = everywhere[start].astype(dtype, copy=False)
        return values


def uniform(values: int | Whole) -> int | Whole:
    """One number where all rows agree, else the vector itself."""
    if isinstance(values, int):
        return values
    if not len(values):
        return 0
    return int(values[0]) if (values == values[0]).all() else values


def _of_rows(values: Whole | int, owner: Index) -> Whole | int:
    return values if isinstance(values, int) else values[owner]


def _constant_step(base: Whole) -> int | None:
    if len(base) < 2:
        return 1
    step = int(base[1]) - int(base[0])
    # Falling offsets would need a view that ends before it starts; the gather serves them as well.
    return step if step > 0 and (base[1:] - base[:-1] == step).all() else None
