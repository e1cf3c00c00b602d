"""Message definitions in OMG IDL: what ROS 2 emits (``ros2idl``) and plain IDL (``omgidl``).

The part of IDL 4.2 that describes data: modules, structs (also derived ones), enums, typedefs, sequences, arrays,
strings, constants. Annotations are read over, apart from those that change the wire: ``@optional``, ``@bit_bound``
of an enum, and the extensibility of a struct.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.message_text import ROS_DURATION, ROS_TIME
from chladni.io.decoding.schema import (
    MAX_FIXED_BYTES,
    MAX_NESTING,
    Array,
    FieldType,
    Member,
    Primitive,
    Record,
    Text,
)
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Callable

    from chladni.io.decoding.schema import Extensibility

# Comments end at the end of the text at the latest, so that a text made of openings can't take quadratic time.
_TOKEN: Final = re.compile(
    r"""//[^\n]*|/\*.*?(?:\*/|\Z)|^[ \t]*\#[^\n]*|^={3,}[^\n]*|^IDL:[^\n]*
    |(?P<token>[A-Za-z_]\w*|\d[\w.]*|"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*'|::|\S)""",
    re.MULTILINE | re.DOTALL | re.VERBOSE,
)

_NAME: Final = re.compile(r"[A-Za-z_]")
# As long as a size can be.
_WHOLE: Final = re.compile(r"0[0-7]{0,12}|[1-9][0-9]{0,11}|0[xX][0-9a-fA-F]{1,10}")

_NUMBERS: Final = {
    "boolean": np.bool_, "octet": np.uint8, "char": np.uint8, "float": np.float32, "double": np.float64,
    "int8": np.int8, "uint8": np.uint8, "int16": np.int16, "uint16": np.uint16, "int32": np.int32,
    "uint32": np.uint32, "int64": np.int64, "uint64": np.uint64, "short": np.int16, "unsigned short": np.uint16,
    "long": np.int32, "unsigned long": np.uint32, "long long": np.int64, "unsigned long long": np.uint64,
}  # fmt: skip
# Bits that an enum may be bound to, and the bytes that hold them (DDS-XTypes 1.3, 7.3.1.2.1.6).
_ENUM_TYPES: Final = ((8, np.uint8), (16, np.uint16), (32, np.uint32))
_EXTENSIBILITY: Final[dict[str, Extensibility]] = {
    "final": "final", "appendable": "appendable", "mutable": "mutable", "extensible": "appendable",
}  # fmt: skip
_ROS_STAMPS: Final[dict[str, FieldType]] = {
    f"builtin_interfaces::msg::{name}": kind for name, kind in (("Time", ROS_TIME), ("Duration", ROS_DURATION))
}


def parse_idl(name: str, text: str) -> Record:
    """Parse IDL and give the struct that a channel's messages are.

    Parameters
    ----------
    name : str
        Full name of the message: ``sensor_msgs/msg/Imu`` or ``sensor_msgs::msg::Imu``.
    text : str
        IDL; several files may follow each other after lines of ``=`` and ``IDL: name``.

    Returns
    -------
    Record

    Raises
    ------
    LogError
        If the text isn't the IDL that is understood, or a type is missing, uses itself or is nested too deep.

    Examples
    --------
    >>> record = parse_idl("demo/Level", "module demo { struct Level { double value; sequence<float, 3> raw; }; };")
    >>> [member.name for member in record.members]
    ['value', 'raw']
    """
    tokens = [match["token"] for match in _TOKEN.finditer(text) if match["token"]]
    declarations = _Reader(name, tokens).read_all()
    return _Resolver(name, declarations).root()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reference:
    """A type as written: its name, or a sequence or string of something, seen from a module."""

    name: str
    scope: tuple[str, ...]
    bound: int | None = None
    element: _Reference | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Field:
    name: str
    type: _Reference
    sizes: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Struct:
    fields: tuple[_Field, ...]
    base: _Reference | None = None
    extensibility: Extensibility | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Enum:
    type: Primitive


_Declaration = _Struct | _Field | _Enum


class _Reader:
    """Reads declarations; names are full (``a::b::C``), references stay as written."""

    def __init__(self, schema: str, tokens: list[str]) -> None:
        self.schema = schema
        self.tokens = tokens
        self.place = 0
        self.scope: tuple[str, ...] = ()
        self.constants: dict[str, int] = {}
        self.declared: dict[str, _Declaration] = {}
        self.annotations: dict[str, str] = {}

    def read_all(self) -> dict[str, _Declaration]:
        while self.place < len(self.tokens):
            self._declaration()
        return self.declared

    def _wrong(self, expected: str) -> LogError:
        near = " ".join(self.tokens[self.place : self.place + 5])
        return LogError(f"schema {self.schema}: IDL near {near[:60]!r}: expected {expected}")

    def _peek(self) -> str:
        return self.tokens[self.place] if self.place < len(self.tokens) else ""

    def _next(self, expected: str = "more text") -> str:
        if self.place >= len(self.tokens):
            raise self._wrong(expected)
        self.place += 1
        return self.tokens[self.place - 1]

    def _accept(self, token: str) -> bool:
        found = self._peek() == token
        self.place += found
        return found

    def _expect(self, token: str) -> None:
        if not self._accept(token):
            raise self._wrong(repr(token))

    def _name(self) -> str:
        token = self._next("a name")
        if not _NAME.match(token):
            self.place -= 1
            raise self._wrong("a name")
        return token

    def _full(self, name: str) -> str:
        return "::".join((*self.scope, name))

    def _declaration(self) -> None:
        self._annotations()
        readers: dict[str, Callable[[], None]] = {
            "module": self._module, "struct": self._struct, "enum": self._enum,
            "typedef": self._typedef, "const": self._constant,
        }  # fmt: skip
        word = self._next()
        if word == ";":
            return
        if word not in readers:
            self.place -= 1
            raise self._wrong("module, struct, enum, typedef or const (unions and the rest aren't supported)")
        readers[word]()

    def _annotations(self) -> None:
        """Take the annotations before a declaration: names, and what stands in their parentheses."""
        self.annotations = {}
        while self._accept("@"):
            name = self._name()
            self.annotations[name.lower()] = self._parentheses() if self._accept("(") else ""

    def _parentheses(self) -> str:
        depth, content = 1, ""
        while depth:
            sign = self._next("')'")
            depth += (sign == "(") - (sign == ")")
            content = content or sign
        return content.lower()

    def _extensibility(self) -> Extensibility | None:
        stated = [*self.annotations, self.annotations.get("extensibility", "").removesuffix("_extensibility")]
        return next((_EXTENSIBILITY[word] for word in stated if word in _EXTENSIBILITY), None)

    def _module(self) -> None:
        if len(self.scope) >= MAX_NESTING:
            raise self._wrong(f"at most {MAX_NESTING} nested modules")
        name = self._name()
        self._expect("{")
        self.scope = (*self.scope, name)
        while not self._accept("}"):
            self._declaration()
        self.scope = self.scope[:-1]
        self._accept(";")

    def _struct(self) -> None:
        name, extensibility = self._name(), self._extensibility()
        base = self._reference() if self._accept(":") else None
        fields: list[_Field] = []
        if self._accept("{"):
            while not self._accept("}"):
                self._annotations()
                if self.annotations.get("optional", "false") != "false":
                    raise self._wrong("no @optional member, which plain CDR lays out differently")
                fields += self._fields()
            self.declared[self._full(name)] = _Struct(fields=tuple(fields), base=base, extensibility=extensibility)
        self._accept(";")

    def _enum(self) -> None:
        bits = _whole_number(self.annotations.get("bit_bound", "32"))
        dtype = next((kind for most, kind in _ENUM_TYPES if bits is not None and bits <= most), None)
        if dtype is None:
            raise self._wrong("an enum bound to at most 32 bits")
        kind = Primitive(dtype=np.dtype(dtype), enumerated=True)
        self.declared[self._full(self._name())] = _Enum(type=kind)
        self._expect("{")
        while self._next("'}'") != "}":
            pass
        self._accept(";")

    def _typedef(self) -> None:
        for one in self._fields():
            self.declared[self._full(one.name)] = one

    def _constant(self) -> None:
        self._reference()
        name = self._name()
        self._expect("=")
        value: list[str] = []
        while (token := self._next("';'")) != ";":
            value.append(token)
        # Only whole numbers can be sizes; other constants don't matter to the wire.
        number = _whole_number(value[0]) if len(value) == 1 else None
        if number is not None:
            self.constants[self._full(name)] = number

    def _fields(self) -> list[_Field]:
        """One declaration: a type and one or several names, each with its own array sizes."""
        kind = self._reference()
        found = []
        while True:
            name, sizes = self._name(), []
            while self._accept("["):
                sizes.append(self._size())
                self._expect("]")
            found.append(_Field(name=name, type=kind, sizes=tuple(sizes)))
            if not self._accept(","):
                break
        self._expect(";")
        return found

    def _size(self) -> int:
        token = self._next("a size")
        number = _whole_number(token)
        size = self._constant_size(token) if number is None else number
        if size < 1:
            raise self._wrong("a size of at least 1")
        return size

    def _constant_size(self, token: str) -> int:
        while self._accept("::"):
            token += "::" + self._name()
        for depth in range(len(self.scope), -1, -1):
            value = self.constants.get("::".join((*self.scope[:depth], token)))
            if value is not None:
                return value
        raise self._wrong("a whole number or a constant declared before")

    def _reference(self, depth: int = 0) -> _Reference:
        if depth > MAX_NESTING:
            raise self._wrong(f"at most {MAX_NESTING} nested sequences")
        self._accept("::")
        name = self._name()
        if name == "sequence":
            self._expect("<")
            element = self._reference(depth + 1)
            bound = self._size() if self._accept(",") else None
            self._expect(">")
            return _Reference(name=name, scope=self.scope, bound=bound, element=element)
        if name in ("string", "wstring") and self._accept("<"):
            bound = self._size()
            self._expect(">")
            return _Reference(name=name, scope=self.scope, bound=bound)
        while name.split(" ")[-1] in ("unsigned", "long") and self._peek() in ("long", "short", "double"):
            name += " " + self._name()
        while self._accept("::"):
            name += "::" + self._name()
        return _Reference(name=name, scope=self.scope)


def _whole_number(token: str) -> int | None:
    """Number that a token of IDL is: decimal, octal or hexadecimal; None where it's none, or no size can be so large.

    Examples
    --------
    >>> _whole_number("12"), _whole_number("012"), _whole_number("0x12"), _whole_number("1_2"), _whole_number("²")
    (12, 10, 18, None, None)
    """
    if _WHOLE.fullmatch(token) is None:
        return None
    is_octal = len(token) > 1 and token[1].isdigit() and token[0] == "0"
    return int(token, 8) if is_octal else int(token, 0)


class _Resolver:
    def __init__(self, schema: str, declared: dict[str, _Declaration]) -> None:
        self.schema = schema
        self.declared = declared
        self.done: dict[str, FieldType] = dict(_ROS_STAMPS)

    def root(self) -> Record:
        wanted = self.schema.replace("/", "::")
        ends = [name for name in self.declared if name.split("::")[-1] == wanted.split("::")[-1]]
        name = wanted if wanted in self.declared else ends[0] if len(ends) == 1 else ""
        kind = self._named(name, ()) if name else None
        if not isinstance(kind, Record):
            raise LogError(f"schema {self.schema}: the IDL doesn't define a struct of this name")
        return kind

    def _named(self, name: str, above: tuple[str, ...]) -> FieldType:
        if name in above or len(above) > MAX_NESTING:
            raise LogError(f"schema {self.schema}: {name} contains itself or is nested deeper than {MAX_NESTING}")
        if name not in self.done:
            self.done[name] = self._made(name, self.declared[name], (*above, name))
        return self.done[name]

    def _made(self, name: str, declared: _Declaration, above: tuple[str, ...]) -> FieldType:
        match declared:
            case _Struct(fields=fields, base=base):
                inherited = self._type(base, above) if base is not None else None
                first = inherited.members if isinstance(inherited, Record) else ()
                own = tuple(Member(name=one.name, type=self._field(one, above)) for one in fields)
                return Record(name=name, members=first + own, extensibility=declared.extensibility)
            case _Field():
                return self._field(declared, above)
            case _Enum(type=kind):
                return kind

    def _field(self, declared: _Field, above: tuple[str, ...]) -> FieldType:
        kind = self._type(declared.type, above)
        if not declared.sizes:
            return kind
        length = 1
        for size in declared.sizes:
            length *= size
            # Checked on the way: a product of many sizes would take hours.
            if length > MAX_FIXED_BYTES:
                raise LogError(f"schema {self.schema}: {declared.name} has {length} elements or more; it is refused")
        shape = declared.sizes
        if isinstance(kind, Array) and kind.length is not None:
            # A typedef of an array gives further dimensions.
            shape += kind.shape or (kind.length,)
            length *= kind.length
            kind = kind.element
        return Array(element=kind, length=length, shape=shape if len(shape) > 1 else ())

    def _type(self, reference: _Reference, above: tuple[str, ...]) -> FieldType:
        if reference.element is not None:
            return Array(element=self._type(reference.element, above), bound=reference.bound)
        if reference.name in ("string", "wstring"):
            return Text(wide=reference.name == "wstring", bound=reference.bound)
        if reference.name in _NUMBERS:
            return Primitive(dtype=np.dtype(_NUMBERS[reference.name]))
        for depth in range(len(reference.scope), -1, -1):
            name = "::".join((*reference.scope[:depth], reference.name))
            if name in self.declared or name in self.done:
                return self._named(name, above)
        raise LogError(f"schema {self.schema}: {reference.name!r} isn't defined, or is a type that isn't supported")
