"""What a decoder takes and what it gives: encoded messages in, one column a field out."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from chladni.signals.errors import LogError
from chladni.signals.wording import near_words

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from chladni.io.decoding.schema import FieldInfo
    from chladni.signals.arrays import Bytes, Mask, Whole

StringValue = str | tuple[str, ...]
"""One string, or all strings of an array of strings."""


class EncodedMessages(Protocol):
    """Messages of one channel as they stand in one buffer."""

    @property
    def buffer(self) -> Bytes:
        """Bytes that hold all messages (and whatever lies between them)."""

    @property
    def offsets(self) -> Whole:
        """Index of the first byte of each message."""

    @property
    def lengths(self) -> Whole:
        """Number of bytes of each message."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Strings:
    """Strings of many messages, each distinct one stored once.

    Parameters
    ----------
    codes : int32 array
        Index into `table`, shaped as the values of a `Column`.
    table : tuple of str, or of tuple of str
        The distinct strings (or, for an array of strings, the distinct lists), in the order they first appear.
    """

    codes: NDArray[np.int32]
    table: tuple[StringValue, ...]

    def __len__(self) -> int:
        return self.codes.size

    def __getitem__(self, index: int) -> StringValue:
        return self.table[int(self.codes.flat[index])]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Column:
    """One field of many messages.

    Parameters
    ----------
    values : ndarray or Strings
        ``[message]`` for a scalar; ``[message, element]`` for an array of the same length in all messages;
        ``[element]``, one message after another, for arrays of different length.
    counts : int64 array, optional
        Elements in each message, where the lengths differ; None where `values` has a row for each message.
    nested : tuple of int64 arrays
        Of lists in lists, length of every list of each level, in the order of the messages: of one list a message,
        then of one list an element of those, and so on. Empty for a single list, and for no list.

    Examples
    --------
    >>> import numpy as np
    >>> column = Column(values=np.array([1.0, 2.0, 3.0]), counts=np.array([1, 2]))
    >>> column.per_message()
    (array([1., 2., 3.]), array([1, 2]))
    """

    values: NDArray[np.generic] | Strings
    counts: Whole | None = None
    nested: tuple[Whole, ...] = ()

    @property
    def lengths(self) -> tuple[Whole, ...]:
        """Length of every list, level by level as in `nested`; empty for one value a message."""
        if self.nested:
            return self.nested
        if self.counts is not None:
            return (self.counts,)
        shape = self.values.codes.shape if isinstance(self.values, Strings) else self.values.shape
        return (np.full(shape[0], shape[1], np.int64),) if len(shape) > 1 else ()

    @property
    def numbers(self) -> NDArray[np.generic]:
        """The values of a column that isn't one of strings.

        Raises
        ------
        LogError
            If it is one of strings.
        """
        if isinstance(self.values, Strings):
            raise LogError("a column of strings was used as numbers; choose a numeric field of the message")
        return self.values

    @property
    def strings(self) -> Strings:
        """The values of a column of strings.

        Raises
        ------
        LogError
            If it is one of numbers.
        """
        if not isinstance(self.values, Strings):
            raise LogError("a column of numbers was used as strings; choose a string field of the message")
        return self.values

    def per_message(self) -> tuple[NDArray[np.generic], Whole]:
        """All numbers, one message after another, and how many belong to each message.

        Returns
        -------
        values : ndarray [element]
        counts : int64 array [message]
        """
        numbers = self.numbers
        if self.counts is not None:
            return numbers, self.counts
        width = numbers.shape[1] if numbers.ndim == 2 else 1
        return numbers.reshape(-1), np.full(len(numbers), width, np.int64)

    def select(self, messages: Mask) -> Column:
        """Give the column of some of the messages, dense again where those have the same number of elements.

        Parameters
        ----------
        messages : bool array [message]

        Returns
        -------
        Column
        """
        if self.counts is None:
            return Column(values=_taken(self.values, messages))
        counts, chosen, nested = self.counts[messages], messages, []
        for lengths in self.lengths:
            nested.append(lengths[chosen])
            chosen = np.repeat(chosen, lengths)
        values = _taken(self.values, chosen)
        if self.nested:
            return Column(values=values, counts=counts, nested=tuple(nested))
        even = len(counts) > 0 and bool((counts == counts[0]).all())
        return Column(values=_reshaped(values, len(counts))) if even else Column(values=values, counts=counts)


def _taken(values: NDArray[np.generic] | Strings, chosen: Mask) -> NDArray[np.generic] | Strings:
    if isinstance(values, Strings):
        return Strings(codes=values.codes[chosen], table=values.table)
    return values[chosen]


def _reshaped(values: NDArray[np.generic] | Strings, rows: int) -> NDArray[np.generic] | Strings:
    if isinstance(values, Strings):
        return Strings(codes=values.codes.reshape(rows, -1), table=values.table)
    return values.reshape(rows, -1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Decoded:
    """Columns of a batch, and which of its messages could not be read.

    Parameters
    ----------
    columns : mapping of path to Column
        Values at bad messages are placeholders and mean nothing.
    bad : bool array [message]
        Messages that are malformed as far as the fields asked for go.
    reasons : mapping of str to int
        What was wrong, and with how many messages.
    told : mapping of str to int
        What is odd about messages that are read all the same, and about how many.
    """

    columns: Mapping[str, Column]
    bad: Mask
    reasons: Mapping[str, int] = field(default_factory=dict)
    told: Mapping[str, int] = field(default_factory=dict)


class Decoder(Protocol):
    """Turns messages of one schema to columns."""

    def __hash__(self) -> int:
        """Each is one of its own."""

    @property
    def fields(self) -> tuple[FieldInfo, ...]:
        """Leaves of the message in the order of the schema; empty while only messages could tell."""

    @property
    def unread(self) -> Mapping[str, str]:
        """Numeric leaves that can't be read, and why; they aren't among `fields`."""

    def informed_by(self, heads: Sequence[EncodedMessages]) -> Decoder:
        """Learn from the first messages what the schema doesn't tell.

        Parameters
        ----------
        heads : sequence of EncodedMessages
            The first messages of the channel; none for a silent one.

        Raises
        ------
        LogError
            If they show that messages of this channel can't be decoded.
        """

    def columns(self, messages: EncodedMessages, paths: Sequence[str]) -> Decoded:
        """Decode the fields named.

        Parameters
        ----------
        messages : EncodedMessages
        paths : sequence of str
            Paths out of `fields`.

        Raises
        ------
        LogError
            If a path isn't in the schema.
        """


def require_known(
    paths: Sequence[str], fields: Sequence[FieldInfo], *, schema_name: str, unread: Mapping[str, str] | None = None
) -> None:
    """Refuse a path that is not a leaf of the schema, or one that can't be read.

    Raises
    ------
    LogError
        Names the path, and fields that come near it or why it can't be read.
    """
    known = {info.path for info in fields}
    for path in paths:
        if unread and path in unread:
            raise LogError(f"{schema_name}: {path} {unread[path]}")
        if path not in known:
            near = near_words(path, (info.path for info in fields), count=3) or sorted(known)[:5]
            raise LogError(
                f"{schema_name or 'message without schema'} has no field {path!r}; near: {', '.join(near) or 'none'}"
            )


def outside_buffer(messages: EncodedMessages) -> Mask:
    """Messages whose claimed place isn't inside the buffer.

    Returns
    -------
    bool array [message]
    """
    # `size - lengths` can't overflow where `offsets + lengths` could: both are non-negative where it matters.
    room = messages.buffer.size - messages.lengths
    outside: Mask = (messages.offsets < 0) | (messages.lengths < 0) | (messages.offsets > room)
    return outside
