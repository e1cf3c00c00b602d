"""The elements of a ``.mat`` file of versions 5 to 7.2, after MathWorks' "MAT-File Format" (R2019b), chapter 1.

`scipy.io.loadmat` reads the same, but a few wrong bytes make it crash the interpreter, which no handler can catch.
Here every length is checked before it's believed.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.files.bounds import Budget, TooLargeError
from chladni.signals.errors import LogError
from chladni.signals.wording import counted

HEADER_BYTES = 128

_INT32, _UINT32, _MATRIX, _COMPRESSED = 5, 6, 14, 15
# Types of stored numbers, after table 1-1; of texts; and of the classes that arrays have, after table 1-3.
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXT = {1: "latin-1", 2: "latin-1", 16: "utf-8", 17: "utf-16", 18: "utf-32", 4: "utf-16"}
_NUMERIC = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_CELL, _STRUCT, _CHAR, _OPAQUE = 1, 2, 4, 17
_OTHERS = {3: "an object of MATLAB", 5: "a sparse matrix", 16: "a function"}
_COMPLEX = 0x0800
# Deep enough for any struct a person made; Python's own stack ends at a thousand.
_MAX_DEPTH = 16
# As many as NumPy has had in every version.
_MOST_AXES = 32
MAX_OBJECTS = 100_000
"""Members of structs and cells that are read: more than any file a person made."""
_AT_ONCE = 2**18


@dataclass(frozen=True, slots=True, kw_only=True)
class Unreadable:
    """In place of a content that isn't read."""

    reason: str


def read_mat_elements(raw: bytes, budget: Budget) -> dict[str, Any]:
    """Give the variables of a file.

    Parameters
    ----------
    raw
        The whole file.
    budget
        Memory that the variables may take, together.

    Returns
    -------
    variables
        Arrays without axes of length one, text as `str`, cells as lists, structs as dictionaries (lists of them,
        when they are arrays), `Unreadable` for what is none of these, and for what is damaged.

    Raises
    ------
    LogError
        When nothing can be read, or the variables take more than the budget has.
    """
    if raw[126:128] not in (b"IM", b"MI"):
        raise LogError("it is no mat file of versions 5 to 7.3")
    order = "<" if raw[126:128] == b"IM" else ">"
    variables: dict[str, Any] = {}
    place, limits = HEADER_BYTES, _Limits(memory=budget)
    while place + 8 <= len(raw):
        kind, length = struct.unpack_from(f"{order}II", raw, place)
        body = memoryview(raw)[place + 8 : place + 8 + length]
        place += 8 + length
        # Compressed variables follow one another without padding, unlike everything else.
        try:
            _require_whole(body, length)
            if kind == _COMPRESSED:
                kind, body, _ = _element(_unpacked(body, order, limits.memory), 0, order)
            if kind == _MATRIX and len(body):
                name, content = _Matrix(body=body, order=order, limits=limits).read()
                variables[name] = content
            elif kind != _MATRIX and _holds_any(body):
                variables[f"element {len(variables) + 1}"] = Unreadable(
                    reason=f"of the type {kind}, which is no array"
                )
        except TooLargeError:
            raise
        except LogError as error:
            variables[f"variable {len(variables) + 1}"] = Unreadable(reason=str(error))
    if _holds_any(memoryview(raw)[place:]):
        reason = "they belong to no variable; where bytes were added, the numbers behind them are wrong"
        variables[f"{counted(len(raw) - place, 'byte')} at the end"] = Unreadable(reason=reason)
    read = [content for content in variables.values() if not isinstance(content, Unreadable)]
    damaged = [content.reason for content in variables.values() if isinstance(content, Unreadable)]
    if damaged and not read:
        raise LogError(damaged[0])
    return variables


def _require_whole(body: memoryview, length: int) -> None:
    if len(body) < length:
        raise LogError(f"a variable claims {length} bytes, {len(body)} are there; it's cut short")


def _holds_any(part: memoryview) -> bool:
    """Whether bytes are more than padding."""
    return bool(np.frombuffer(part, np.uint8).any())


def _unpacked(packed: memoryview, order: str, memory: Budget) -> memoryview:
    """Unpack the one element of a compressed variable, whose tag says its length, into memory of that length."""
    unpacker = zlib.decompressobj()
    try:
        tag = unpacker.decompress(packed[:_AT_ONCE], 8)
        if len(tag) < 8:
            raise LogError("a compressed variable is damaged (it ends too early)")
        length = 8 + struct.unpack(f"{order}II", tag)[1]
        memory.take(length)
        content = bytearray(length)
        content[:8], filled = tag, 8
        # What lies behind the element is read for the checksum at the end, and left.
        for part in _parts_of(unpacker, packed):
            content[filled : filled + len(part)] = part[: max(length - filled, 0)]
            filled += len(part)
            if filled > length + _AT_ONCE:
                break
    except zlib.error as error:
        raise LogError(f"a compressed variable is damaged ({error})") from error
    if filled < length or not unpacker.eof:
        raise LogError("a compressed variable is damaged (it ends too early)")
    return memoryview(content).toreadonly()


def _parts_of(unpacker: Any, packed: memoryview) -> Iterator[bytes]:
    """Unpack piece by piece: what isn't used of a piece is copied each time."""
    waiting = unpacker.unconsumed_tail
    for first in range(_AT_ONCE, len(packed) + _AT_ONCE, _AT_ONCE):
        while waiting and not unpacker.eof:
            yield unpacker.decompress(waiting, _AT_ONCE)
            waiting = unpacker.unconsumed_tail
        waiting = packed[first : first + _AT_ONCE]


def _element(raw: memoryview, place: int, order: str) -> tuple[int, memoryview, int]:
    """Give the type, content and end of the element at a place."""
    if place + 8 > len(raw):
        raise LogError("an element is missing where the file announces one")
    first, length = struct.unpack_from(f"{order}II", raw, place)
    if first >> 16:  # up to four bytes of content sit in the tag itself
        length = first >> 16
        if length > 4:
            raise LogError(f"a small element claims {length} bytes, it holds 4")
        return first & 0xFFFF, raw[place + 4 : place + 4 + length], place + 8
    end = place + 8 + length
    if end > len(raw):
        raise LogError(f"an element claims {length} bytes, {len(raw) - place - 8} are there")
    return first, raw[place + 8 : end], end + -end % 8


@dataclass(slots=True, kw_only=True)
class _Limits:
    """What the variables of a file may take together."""

    memory: Budget
    members: int = 0

    def take_members(self, count: int) -> None:
        """Count members of cells and structs; each is an object, tens of times as large as an empty one's tag."""
        self.members += count
        if self.members > MAX_OBJECTS:
            raise LogError(f"its cells and structs have more than {MAX_OBJECTS} members")


@dataclass(slots=True, kw_only=True)
class _Matrix:
    """Reads one array element; `place` walks over its parts."""

    body: memoryview
    order: str
    limits: "_Limits"
    depth: int = 0
    place: int = 0

    def read(self) -> tuple[str, Any]:
        flags = self._numbers(_UINT32)
        if len(flags) and flags[0] & 0xFF == _OPAQUE:
            return self._opaque()
        shape = tuple(int(length) for length in self._numbers(_INT32))
        if len(flags) != 2 or not 2 <= len(shape) <= _MOST_AXES or min(shape) < 0:
            raise LogError(f"an array has {len(flags)} flags and the shape {shape[:_MOST_AXES]}")
        kind, name, self.place = _element(self.body, self.place, self.order)
        if kind not in _TEXT:
            raise LogError(f"the name of an array has the type {kind}")
        return bytes(name).decode("latin-1"), self._content(int(flags[0]), shape)

    def _content(self, flags: int, shape: tuple[int, ...]) -> Any:
        kind = flags & 0xFF
        if kind in _NUMERIC:
            array = self._array(_NUMERIC[kind], shape, is_complex=bool(flags & _COMPLEX))
            if _holds_any(self.body[self.place :]):
                raise LogError("an array has bytes behind its numbers; where they were added, others are wrong")
            return array
        if kind == _CHAR:
            return self._text()
        if kind == _CELL:
            return [content for _, content in self._members(prod(shape))]
        if kind == _STRUCT:
            return self._struct(prod(shape))
        return Unreadable(reason=_OTHERS.get(kind, f"of the class {kind}, which isn't known"))

    def _opaque(self) -> tuple[str, Any]:
        """Name an object of a class of MATLAB's own, whose content only MATLAB knows: strings, tables, dates."""
        texts = []
        for _ in range(3):
            kind, content, self.place = _element(self.body, self.place, self.order)
            texts.append(bytes(content).decode("latin-1") if kind in _TEXT else "")
        name, _, kind_name = texts
        return name, Unreadable(reason=f"a {kind_name or 'class'} of MATLAB, which only MATLAB reads")

    def _numbers(self, expected: int | None = None) -> NDArray[Any]:
        kind, content, self.place = _element(self.body, self.place, self.order)
        if kind not in _STORED or (expected is not None and kind != expected):
            raise LogError(f"numbers have the type {kind}, which is none")
        dtype = np.dtype(self.order + _STORED[kind])
        if len(content) % dtype.itemsize:
            raise LogError(f"{len(content)} bytes are no whole count of {dtype}")
        return np.frombuffer(content, dtype=dtype)

    def _array(self, code: str, shape: tuple[int, ...], *, is_complex: bool) -> NDArray[Any]:
        array = self._part(code, shape)
        if not is_complex:
            return array
        # The imaginary part, that times j, and the sum.
        self.limits.memory.take(5 * array.nbytes)
        whole: NDArray[Any] = array + 1j * self._part(code, shape)
        return whole

    def _part(self, code: str, shape: tuple[int, ...]) -> NDArray[Any]:
        # Numbers are stored in the smallest type that holds them, whatever their class.
        numbers = self._numbers()
        if len(numbers) != prod(shape):
            raise LogError(f"an array of shape {shape} holds {len(numbers)} numbers")
        if not len(numbers):
            # Of empty arrays the other lengths may be any.
            return np.empty((0, 0), code)
        if numbers.dtype != np.dtype(code):
            self.limits.memory.take(len(numbers) * np.dtype(code).itemsize)
        with np.errstate(invalid="ignore", over="ignore"):
            return numbers.astype(code, copy=False).reshape(shape, order="F").squeeze()

    def _text(self) -> str:
        kind, content, self.place = _element(self.body, self.place, self.order)
        codec = _TEXT.get(kind)
        if codec is None:
            raise LogError(f"text has the type {kind}, which is none")
        if codec in ("utf-16", "utf-32"):
            codec += "-le" if self.order == "<" else "-be"
        return bytes(content).decode(codec, errors="replace")

    def _members(self, count: int) -> Iterator[tuple[str, Any]]:
        if self.depth >= _MAX_DEPTH:
            raise LogError(f"cells and structs lie more than {_MAX_DEPTH} deep in each other")
        # Each member takes a tag of 8 bytes at least; a count that can't be is refused before the loop.
        if count * 8 > len(self.body) - self.place:
            raise LogError(f"a cell or struct announces {count} members, more than the file holds")
        self.limits.take_members(count)
        for _ in range(count):
            kind, body, self.place = _element(self.body, self.place, self.order)
            if kind != _MATRIX:
                raise LogError(f"a member of a cell or struct has the type {kind}, which is no array")
            yield self._member(body) if len(body) else ("", None)

    def _member(self, body: memoryview) -> tuple[str, Any]:
        return _Matrix(body=body, order=self.order, limits=self.limits, depth=self.depth + 1).read()

    def _struct(self, count: int) -> Any:
        lengths = self._numbers(_INT32)
        _, raw, self.place = _element(self.body, self.place, self.order)
        width = int(lengths[0]) if len(lengths) == 1 else 0
        if width <= 0 or len(raw) % width:
            raise LogError(f"the field names of a struct are {len(raw)} bytes in pieces of {width}")
        names = [
            bytes(raw[first : first + width]).split(b"\x00")[0].decode("latin-1")
            for first in range(0, len(raw), width)
        ]
        contents = [content for _, content in self._members(count * len(names))]
        rows = [
            dict(zip(names, contents[first : first + len(names)], strict=True))
            for first in range(0, len(contents), len(names) or 1)
        ]
        return rows[0] if len(rows) == 1 else rows
