"""ROS message definitions as text (``ros2msg``, ``ros1msg``)."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.schema import (
    MAX_NESTING,
    PADDING_MEMBER,
    Array,
    FieldType,
    Member,
    Primitive,
    Record,
    Stamp,
    Text,
)
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from collections.abc import Mapping

_SEPARATOR: Final = re.compile(r"^={3,}\s*$", re.MULTILINE)
_HEADING: Final = re.compile(r"\s*MSG:\s*(\S+)[^\n]*\n?")
_TYPE: Final = re.compile(
    r"(?P<base>[A-Za-z][\w/]*)(?:<=(?P<text_bound>[0-9]{1,10}))?"
    r"(?P<array>\[(?:(?P<length>[0-9]{1,10})|<=(?P<bound>[0-9]{1,10}))?\])?"
)
_NAME: Final = re.compile(r"[A-Za-z_]\w*")

_COMMON: Final = {
    "bool": np.bool_, "int8": np.int8, "uint8": np.uint8, "int16": np.int16, "uint16": np.uint16,
    "int32": np.int32, "uint32": np.uint32, "int64": np.int64, "uint64": np.uint64,
    "float32": np.float32, "float64": np.float64, "char": np.uint8,
}  # fmt: skip

ROS_TIME: Final = Stamp(kind="time", seconds=np.dtype(np.int32), nanoseconds=np.dtype(np.uint32))
"""ROS 2's builtin_interfaces/Time."""

ROS_DURATION: Final = Stamp(kind="duration", seconds=np.dtype(np.int32), nanoseconds=np.dtype(np.uint32))
"""ROS 2's builtin_interfaces/Duration."""

_ROS2_TYPES: Final[dict[str, FieldType]] = {
    **{name: Primitive(dtype=np.dtype(dtype)) for name, dtype in _COMMON.items()},
    "byte": Primitive(dtype=np.dtype(np.uint8)),
    "string": Text(),
    "wstring": Text(wide=True),
    "builtin_interfaces/Time": ROS_TIME,
    "builtin_interfaces/Duration": ROS_DURATION,
}
_ROS1_TYPES: Final[dict[str, FieldType]] = {
    **{name: Primitive(dtype=np.dtype(dtype)) for name, dtype in _COMMON.items()},
    "byte": Primitive(dtype=np.dtype(np.int8)),
    "string": Text(),
    "time": Stamp(kind="time", seconds=np.dtype(np.uint32), nanoseconds=np.dtype(np.uint32)),
    "duration": Stamp(kind="duration", seconds=np.dtype(np.int32), nanoseconds=np.dtype(np.int32)),
}
_ROS1_HEADER: Final = "uint32 seq\ntime stamp\nstring frame_id"


def parse_ros2_text(name: str, text: str) -> Record:
    """Parse the concatenated definitions of a ROS 2 message and the types it uses.

    Parameters
    ----------
    name : str
        Full name of the message, such as ``sensor_msgs/msg/Imu``.
    text : str
        Its definition, then those of its parts, each after a line of ``=`` and a line ``MSG: package/Type``.

    Returns
    -------
    Record

    Raises
    ------
    LogError
        If the text isn't a definition, or a type is missing, uses itself or is nested too deep.

    Examples
    --------
    >>> record = parse_ros2_text("demo_msgs/msg/Level", "float32 value  # in m")
    >>> [member.name for member in record.members]
    ['value']
    """
    # ROS 2 puts one byte into a message without fields; its text doesn't say so.
    padding = Member(name=PADDING_MEMBER, type=_ROS2_TYPES["uint8"])
    return _Parser(name, text, known=_ROS2_TYPES, implied={}, padding=(padding,)).root()


def parse_ros1_text(name: str, text: str) -> Record:
    """Parse the concatenated definitions of a ROS 1 message and the types it uses.

    Parameters and errors as for `parse_ros2_text`.

    Returns
    -------
    Record
    """
    implied = {"std_msgs/Header": _ROS1_HEADER}
    return _Parser(name, text, known=_ROS1_TYPES, implied=implied, padding=()).root()


class _Parser:
    def __init__(
        self,
        name: str,
        text: str,
        *,
        known: Mapping[str, FieldType],
        implied: Mapping[str, str],
        padding: tuple[Member, ...],
    ) -> None:
        self.name = name
        self.known = known
        self.padding = padding
        self.main, self.definitions = _split(text)
        self.definitions = {**implied, **self.definitions}
        self.by_ending: dict[str, list[str]] = {}
        for full in self.definitions:
            self.by_ending.setdefault(full.rpartition("/")[2], []).append(full)
        self.done: dict[str, Record] = {}

    def root(self) -> Record:
        return self._record(_short(self.name), self.main, (self.name,))

    def _record(self, name: str, text: str, above: tuple[str, ...]) -> Record:
        if len(above) > MAX_NESTING:
            raise LogError(f"schema {self.name}: types nested deeper than {MAX_NESTING}; the definition is refused")
        members = []
        # Comments may hold what else ends a line for Unicode.
        for line in text.split("\n"):
            declaration = _uncommented(line)
            if declaration:
                member = self._member(declaration, name, above)
                members += [member] if member is not None else []
        return Record(name=name, members=tuple(members) or self.padding)

    def _member(self, line: str, owner: str, above: tuple[str, ...]) -> Member | None:
        parts = line.split(None, 1)
        type_match = _TYPE.fullmatch(parts[0])
        name_match = _NAME.match(parts[1]) if len(parts) == 2 else None
        if type_match is None or name_match is None:
            raise LogError(f"schema {self.name}: {owner} has the line {line[:80]!r}; expected 'type name'")
        # `int32 X=5` is a constant and not on the wire; `int32 x 5` a default, `string<=5 x` a bound.
        if parts[1][name_match.end() :].lstrip().startswith("="):
            return None
        return Member(name=name_match[0], type=self._type(type_match, owner, above))

    def _type(self, match: re.Match[str], owner: str, above: tuple[str, ...]) -> FieldType:
        element = self._element(match["base"], owner, above)
        if match["text_bound"] is not None:
            if not isinstance(element, Text):
                raise LogError(f"schema {self.name}: {owner} bounds {match['base']!r}; only strings have a bound")
            element = Text(wide=element.wide, bound=int(match["text_bound"]))
        if match["array"] is None:
            return element
        bound = None if match["bound"] is None else int(match["bound"])
        length = None if match["length"] is None else int(match["length"])
        if length == 0:
            raise LogError(f"schema {self.name}: {owner} has an array of length 0; a fixed array has at least 1")
        return Array(element=element, length=length, bound=bound)

    def _element(self, base: str, owner: str, above: tuple[str, ...]) -> FieldType:
        if base in self.known:
            return self.known[base]
        full = self._resolved(base, owner)
        if full in self.known:
            return self.known[full]
        if full not in self.done:
            if full in above:
                raise LogError(f"schema {self.name}: {full} contains itself; such a message has no end")
            self.done[full] = self._record(full, self.definitions[full], (*above, full))
        return self.done[full]

    def _resolved(self, base: str, owner: str) -> str:
        """Full name of a type as the definitions call it: in full, from the same package, or Header alone."""
        short = _short(base)
        package = owner.rpartition("/")[0]
        candidates = (short, f"{package}/{short}", f"std_msgs/{short}" if short == "Header" else "")
        for candidate in candidates:
            if candidate in self.definitions or candidate in self.known:
                return candidate
        endings = self.by_ending.get(short, [])
        if len(endings) == 1:
            return endings[0]
        raise LogError(f"schema {self.name}: {owner} uses {base!r}, which the schema doesn't define")


def _split(text: str) -> tuple[str, dict[str, str]]:
    main, *others = _SEPARATOR.split(text)
    definitions = {}
    for other in others:
        heading = _HEADING.match(other)
        if heading is not None:
            definitions[_short(heading[1])] = other[heading.end() :]
    heading = _HEADING.match(main)
    return main[heading.end() :] if heading is not None else main, definitions


def _short(name: str) -> str:
    """``package/Type``: both ROS 2 forms of a name, with and without ``/msg/``, come to this."""
    return name.replace("/msg/", "/")


def _uncommented(line: str) -> str:
    # A '#' inside the quotes of a string default or constant doesn't matter: all after the name is ignored.
    return line.partition("#")[0].strip()
