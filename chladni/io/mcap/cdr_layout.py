"""CDR encoding of many equal-shaped messages at once: a template, and the offset of every number in it."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from chladni.io.mcap.ros2_definitions import DEFINITIONS, PRIMITIVES, MessageField, message_fields
from chladni.signals.arrays import Bytes

_ENCAPSULATION = b"\x00\x01\x00\x00"  # CDR, little endian


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CdrLayout:
    """Where each number of a message sits.

    Attributes
    ----------
    template
        One message, encapsulation header included, with every number at its default.
    offsets
        Byte offset of each number in `template`, by field path.
    formats
        NumPy type of each number, by field path.
    """

    template: bytes
    offsets: Mapping[str, int]
    formats: Mapping[str, str]

    def encode(self, columns: Mapping[str, ArrayLike], count: int) -> Bytes:
        """Give `count` messages as bytes ``[message, byte]``; `columns` holds the numbers that vary, by path."""
        paths = list(columns)
        # One copy of the template for each message, then each number written as one strided column.
        messages = np.empty((count, len(self.template)), dtype=np.uint8)
        messages[:] = np.frombuffer(self.template, dtype=np.uint8)
        record = np.dtype(
            {
                "names": paths,
                "formats": [self.formats[path] for path in paths],
                "offsets": [self.offsets[path] for path in paths],
                "itemsize": len(self.template),
            }
        )
        rows = messages.view(record)[:, 0]
        for path, column in columns.items():
            rows[path] = column
        return messages


@dataclass(slots=True, kw_only=True)
class _Encoder:
    """Walks a message definition and writes the template."""

    definitions: Mapping[str, str]
    defaults: Mapping[str, float]
    texts: Mapping[str, tuple[str, ...]]
    lengths: Mapping[str, int]
    buffer: bytearray = field(default_factory=lambda: bytearray(_ENCAPSULATION))
    offsets: dict[str, int] = field(default_factory=dict)
    formats: dict[str, str] = field(default_factory=dict)

    def message(self, type_name: str, prefix: str = "") -> None:
        for member in message_fields(type_name, self.definitions):
            self.member(member, prefix + member.name)

    def member(self, member: MessageField, path: str) -> None:
        if member.count is None:
            self.element(member.type, path, 0)
            return
        # A sequence has its length in front, a fixed array hasn't.
        count = member.count
        if count < 0:
            count = len(self.texts.get(path, ())) if member.type == "string" else self.lengths.get(path, 0)
            self.number("<u4", count)
        for index in range(count):
            self.element(member.type, path if member.type == "string" else f"{path}[{index}]", index)

    def element(self, type_name: str, path: str, index: int) -> None:
        if type_name == "string":
            self.text(self.texts.get(path, ("",))[index])
        elif type_name in PRIMITIVES:
            self.offsets[path] = self.number(PRIMITIVES[type_name], self.defaults.get(path, 0))
            self.formats[path] = PRIMITIVES[type_name]
        else:
            self.message(type_name, f"{path}.")

    def number(self, code: str, content: float) -> int:
        scalar = np.array(content, dtype=code)
        # Alignment counts from the end of the encapsulation header, not from the start of the buffer.
        self.buffer += bytes(-(len(self.buffer) - len(_ENCAPSULATION)) % scalar.itemsize)
        self.buffer += scalar.tobytes()
        return len(self.buffer) - scalar.itemsize

    def text(self, content: str) -> None:
        encoded = content.encode() + b"\x00"
        self.number("<u4", len(encoded))
        self.buffer += encoded


def cdr_layout(
    type_name: str,
    *,
    definitions: Mapping[str, str] = DEFINITIONS,
    defaults: Mapping[str, float] | None = None,
    texts: Mapping[str, tuple[str, ...]] | None = None,
    lengths: Mapping[str, int] | None = None,
) -> CdrLayout:
    """Lay out messages of one type whose strings and sequence lengths never change.

    Parameters
    ----------
    type_name
        Key of `definitions`.
    defaults
        Numbers other than zero that no column will set, by path.
    texts
        Strings by path; a string sequence has several.
    lengths
        Elements of each number sequence, by path; 0 for those not named.

    Examples
    --------
    >>> layout = cdr_layout("chladni_msgs/ScalarStamped")
    >>> layout.offsets["value"], len(layout.template)
    (20, 28)
    >>> layout.encode({"value": [1.0, 2.0]}, 2).shape
    (2, 28)
    """
    encoder = _Encoder(definitions=definitions, defaults=defaults or {}, texts=texts or {}, lengths=lengths or {})
    encoder.message(type_name)
    return CdrLayout(template=bytes(encoder.buffer), offsets=encoder.offsets, formats=encoder.formats)
