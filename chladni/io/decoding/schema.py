"""What a message definition says, whatever language it was written in.

Each schema language (ROS message text, IDL, protobuf, JSON schema) is parsed to these few types; decoders and
the path of a channel know nothing else.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from chladni.io.message_path import quoted
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

MAX_NESTING: Final = 64
"""Deepest nesting of types in a schema; real ones stay under ten."""

MAX_FIELDS: Final = 20_000
"""Most leaves in one message type. Definitions that double a type at each level would reach 2**64."""

MAX_FIXED_BYTES: Final = 2**32
"""Most bytes the fixed part of a message may take: no container can hold more in one message."""

PADDING_MEMBER: Final = "structure_needs_at_least_one_member"
"""Name of the byte that ROS 2 puts into a message without fields."""

Dimension = int | Literal["dynamic"]
"""Elements of a list, where the schema fixes them."""

FieldKind = Literal["number", "bool", "string", "time", "duration"]
Extensibility = Literal["final", "appendable", "mutable"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Primitive:
    """A number or a truth value of fixed width; ``dtype`` is native, the wire's byte order is the decoder's.

    ``enumerated`` ones are names for numbers, which some writers of arrays don't count as primitive.
    """

    dtype: np.dtype[np.generic]
    enumerated: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """A string; ``wide`` ones have two or four bytes a character, depending on who wrote them."""

    wide: bool = False
    bound: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Stamp:
    """A point in time or a duration: two 32-bit numbers, seconds and nanoseconds."""

    kind: Literal["time", "duration"]
    seconds: np.dtype[np.generic]
    nanoseconds: np.dtype[np.generic]


@dataclass(frozen=True, slots=True, kw_only=True)
class Array:
    """Elements of one type: ``length`` of them, or, where that is None, a counted number up to ``bound``.

    Those of an array of several dimensions lie one after another, the last index running fastest; ``shape`` has them.
    """

    element: FieldType
    length: int | None = None
    bound: int | None = None
    shape: tuple[int, ...] = ()

    @property
    def dims(self) -> tuple[Dimension, ...]:
        """Length of each of its dimensions, the outermost first."""
        return self.shape or ("dynamic" if self.length is None else self.length,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Delimited:
    """A value behind a 32-bit number that counts its bytes: what XCDR2 makes of types that may grow."""

    content: FieldType


# Compared by identity: a definition may use one type many times, and comparing or hashing by content would
# take time exponential in its depth.
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Record:
    """A message type: named members in the order of the wire; its extensibility where the definition states it."""

    name: str
    members: tuple[Member, ...]
    extensibility: Extensibility | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """One field of a message type."""

    name: str
    type: FieldType


FieldType = Primitive | Text | Stamp | Array | Record | Delimited


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldInfo:
    """One leaf of a message: what a column can be made of.

    Parameters
    ----------
    path : str
        Names joined by dots, in quotes where a path would read them otherwise; a
        list of messages or of lists on the way is marked: ``transforms[].transform.translation.x``.
        An array of numbers or strings is one leaf and carries no mark: ``position``, or ``grid[]`` of two dimensions.
    kind : {"number", "bool", "string", "time", "duration"}
        Times and durations are whole nanoseconds, whatever the wire holds.
    dtype : numpy.dtype or None
        Type of the values; None for strings.
    dims : tuple of int or "dynamic"
        Length of each list that the leaf is in, the outermost first; a path names an element of each.
    """

    path: str
    kind: FieldKind
    dtype: np.dtype[np.generic] | None
    dims: tuple[Dimension, ...] = ()

    @property
    def array(self) -> Dimension | None:
        """Length of the innermost list; None for a single value."""
        return self.dims[-1] if self.dims else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaf:
    """A leaf and the way to it.

    Parameters
    ----------
    info : FieldInfo
    names : tuple of str
        Member names from the message down to the leaf.
    lists : tuple of int
        For each name, how many lists of messages (or of lists) are to be opened below it; mostly 0.
    type : FieldType
        What stands there: for an array of numbers or strings the array.
    """

    info: FieldInfo
    names: tuple[str, ...]
    lists: tuple[int, ...]
    type: FieldType

    @property
    def depth(self) -> int:
        """Lists whose elements are values of their own; an array of strings is one value."""
        if isinstance(self.type, Array) and isinstance(self.type.element, Text):
            return len(self.info.dims) - len(self.type.dims)
        return len(self.info.dims)


def leaves(record: Record) -> tuple[Leaf, ...]:
    """All leaves of a message type, in the order of the schema.

    Raises
    ------
    LogError
        If there are more than `MAX_FIELDS`, the fixed part alone takes more than `MAX_FIXED_BYTES`, types are nested
        too deep, or two fields of one type have the same name.
    """
    _height(record, 0, {})
    smallest_size(record, {})
    found = tuple(islice(_leaves_of(record, _Way()), MAX_FIELDS + 1))
    if len(found) > MAX_FIELDS:
        raise LogError(f"schema {record.name}: more than {MAX_FIELDS} fields; the definition is refused")
    return found


Tree = dict[str, "Tree | Leaf"]
"""Leaves by the names on the way to them."""


def tree_of(chosen: Sequence[Leaf], depth: int = 0) -> Tree:
    """Group leaves by name, level by level.

    Parameters
    ----------
    chosen : sequence of Leaf
    depth : int
        Names already passed.

    Returns
    -------
    dict
        For each name the leaf, or the tree of what lies below it.
    """
    groups: dict[str, list[Leaf]] = {}
    for leaf in chosen:
        groups.setdefault(leaf.names[depth], []).append(leaf)
    return {
        name: group[0] if len(group[0].names) == depth + 1 else tree_of(group, depth + 1)
        for name, group in groups.items()
    }


@dataclass(frozen=True, slots=True)
class _Way:
    """The way from a message down to a member, while leaves are listed."""

    path: str = ""
    names: tuple[str, ...] = ()
    lists: tuple[int, ...] = ()
    dims: tuple[Dimension, ...] = ()

    def into(self, member: Member) -> _Way:
        # JSON keys may hold dots and blanks.
        name = quoted(member.name)
        path = f"{self.path}.{name}" if self.path else name
        return _Way(path, (*self.names, member.name), (*self.lists, 0), self.dims)

    def onto(self, array: Array) -> _Way:
        """To an array that is a leaf itself."""
        return _Way(self.path + "[]" * (len(array.dims) - 1), self.names, self.lists, (*self.dims, *array.dims))

    def opened(self, array: Array) -> _Way:
        """To the elements of an array."""
        lists = (*self.lists[:-1], self.lists[-1] + 1)
        return _Way(self.path + "[]" * len(array.dims), self.names, lists, (*self.dims, *array.dims))


def _leaves_of(kind: FieldType, way: _Way) -> Iterator[Leaf]:
    match kind:
        case Array(element=Primitive() | Text() | Stamp() as element):
            info = _field_info(element, way.onto(kind))
            yield Leaf(info=info, names=way.names, lists=way.lists, type=kind)
        case Array(element=element):
            yield from _leaves_of(element, way.opened(kind))
        case Delimited(content=content):
            yield from _leaves_of(content, way)
        case Record(members=members):
            for member in members:
                if member.name != PADDING_MEMBER:
                    yield from _leaves_of(member.type, way.into(member))
        case _:
            yield Leaf(info=_field_info(kind, way), names=way.names, lists=way.lists, type=kind)


def _field_info(kind: Primitive | Text | Stamp, way: _Way) -> FieldInfo:
    match kind:
        case Primitive(dtype=dtype):
            number: FieldKind = "bool" if dtype == np.bool_ else "number"
            return FieldInfo(path=way.path, kind=number, dtype=dtype, dims=way.dims)
        case Text():
            return FieldInfo(path=way.path, kind="string", dtype=None, dims=way.dims)
        case Stamp(kind=stamp):
            return FieldInfo(path=way.path, kind=stamp, dtype=np.dtype(np.int64), dims=way.dims)


def _height(kind: FieldType, above: int, known: dict[int, int]) -> int:
    """How many types and lists lie inside each other from here on; all that walks a definition goes as deep.

    By identity: hashing a list hashes what it lists, and so on.
    """
    height = known.get(id(kind), 0)
    # Each type may be in a list.
    if above + height > 2 * MAX_NESTING:
        raise LogError(f"schema: types are nested deeper than {MAX_NESTING}; the definition is refused")
    if not height:
        match kind:
            case Array(element=element):
                height = _height(element, above + 1, known)
            case Delimited(content=content):
                height = _height(content, above + 1, known)
            case Record(name=name, members=members):
                twice = [one for one, count in Counter(member.name for member in members).items() if count > 1]
                if twice:
                    raise LogError(f"schema {name}: two fields are called {twice[0]!r}; the definition is refused")
                height = max((_height(member.type, above + 1, known) for member in members), default=0)
        height += 1
        known[id(kind)] = height
    return height


def smallest_size(kind: FieldType, known: dict[FieldType, int]) -> int:
    """Fewest bytes that a value of this type takes on the wire, padding not counted.

    Parameters
    ----------
    kind : FieldType
    known : dict
        Sizes already found; without it a definition that doubles a type at each level takes forever.

    Raises
    ------
    LogError
        If the size exceeds `MAX_FIXED_BYTES`.
    """
    if kind in known:
        return known[kind]
    match kind:
        case Primitive(dtype=dtype):
            size = dtype.itemsize
        case Stamp():
            size = 8
        case Text():
            size = 4
        case Array(element=element, length=length):
            smallest = smallest_size(element, known)
            size = 4 if length is None else length * smallest
        case Delimited(content=content):
            size = 4 + smallest_size(content, known)
        case Record(members=members):
            size = sum(smallest_size(member.type, known) for member in members)
    if size > MAX_FIXED_BYTES:
        raise LogError(f"schema: a type takes {size} bytes, more than the {MAX_FIXED_BYTES} a message can hold")
    known[kind] = size
    return size
