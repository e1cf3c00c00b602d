"""Messages for the decoders' tests: batches of bytes, and the parts of CDR written by hand."""

import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from chladni.io.decoding import Decoded, Decoder, make_decoder
from chladni.signals.arrays import Bytes, Whole


@dataclass(frozen=True, slots=True, kw_only=True)
class Encoded:
    """The least that a decoder takes."""

    buffer: Bytes
    offsets: Whole
    lengths: Whole


def batch_of(messages: Sequence[bytes], *, gaps: Sequence[int] = (5,)) -> Encoded:
    """Messages one after another with `gaps` bytes of 0xEE between them, in turn: one gap gives constant stride."""
    content, offsets = bytearray(), []
    for index, message in enumerate(messages):
        content += b"\xee" * gaps[index % len(gaps)]
        offsets.append(len(content))
        content += message
    return Encoded(
        buffer=np.frombuffer(bytes(content), np.uint8),
        offsets=np.array(offsets, np.int64),
        lengths=np.array([len(message) for message in messages], np.int64),
    )


def values_of(decoded: Decoded, path: str) -> list[Any]:
    """One Python value a message: a scalar or a list."""
    column = decoded.columns[path]
    if column.counts is None:
        if isinstance(column.values, np.ndarray):
            return column.values.tolist()
        table, codes = column.values.table, column.values.codes
        return [[table[c] for c in row] if np.ndim(row) else table[row] for row in codes]
    flat: list[Any]
    if isinstance(column.values, np.ndarray):
        flat = column.values.tolist()
    else:
        flat = [column.values.table[code] for code in column.values.codes]
    ends = np.cumsum(column.counts)
    return [flat[end - count : end] for end, count in zip(ends.tolist(), column.counts.tolist(), strict=True)]


def decode_all(decoder: Decoder, messages: Encoded) -> Decoded:
    return decoder.columns(messages, [info.path for info in decoder.fields])


SEPARATOR = "=" * 80
HEADER = f"""{SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
"""
JOINT_STATE = f"""
# This is a message that holds data to describe the state of joints.
std_msgs/Header header

string[] name
float64[] position
float64[] velocity
float64[] effort
{HEADER}"""


def decoder_of(text: str, name: str = "demo/msg/Demo", *, encoding: str = "cdr") -> Decoder:
    schema_encoding = "ros2msg" if encoding == "cdr" else "ros1msg"
    return make_decoder(
        message_encoding=encoding, schema_name=name, schema_encoding=schema_encoding, schema_data=text.encode()
    )


def cdr(*parts: bytes, little_endian: bool = True) -> bytes:
    return bytes([0, little_endian, 0, 0]) + b"".join(parts)


def text_of(content: bytes) -> bytes:
    return struct.pack("<I", len(content) + 1) + content + b"\0"


class CdrWriter:
    """A message as a writer of CDR lays it out, one field after another.

    Parameters
    ----------
    number : int
        Encapsulation, less the bit for the byte order.
    order : {"<", ">"}
    origin : int
        Bytes in front of the first field that alignment counts: 4 as RTI Connext Micro does.
    """

    def __init__(self, number: int = 0, *, order: str = "<", origin: int = 0) -> None:
        self.order = order
        self.most = 8 if number == 0 else 4
        self.origin = origin
        self.header = bytes([0, number | (order == "<"), 0, 0])
        self.body = bytearray()

    def number(self, code: str, *values: float) -> "CdrWriter":
        width = min(struct.calcsize(code), self.most)
        for value in values:
            self.body += b"\0" * (-(len(self.body) + self.origin) % width)
            self.body += struct.pack(f"{self.order}{code}", value)
        return self

    def text(self, content: str) -> "CdrWriter":
        encoded = content.encode() + b"\0"
        self.number("I", len(encoded)).body.extend(encoded)
        return self

    @contextmanager
    def delimited(self, wanted: bool = True) -> Iterator[None]:
        """Put a delimiter before what is written inside."""
        if not wanted:
            yield
            return
        self.number("I", 0)
        start = len(self.body)
        yield
        self.body[start - 4 : start] = struct.pack(f"{self.order}I", len(self.body) - start)

    def message(self, *, filled: bool = False) -> bytes:
        """The message; `filled` up to a multiple of 4 bytes."""
        content = self.header + self.body
        return bytes(content + b"\0" * (-len(content) % 4 if filled else 0))
