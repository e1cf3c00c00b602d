"""Which decoder reads a channel."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

from chladni.signals.errors import LogError

if TYPE_CHECKING:
    from chladni.io.decoding.columns import Decoder

SUPPORTED: Final = (
    ("cdr", "ros2msg"),
    ("cdr", "ros2idl"),
    ("cdr", "omgidl"),
    ("ros1", "ros1msg"),
    ("protobuf", "protobuf"),
    ("json", "jsonschema"),
    ("json", ""),
)
"""Pairs of message encoding and schema encoding that can be decoded."""

MAX_SCHEMA_BYTES: Final = 4 << 20
"""Longest schema that is read; the longest of ROS have some 50 kB."""


def make_decoder(*, message_encoding: str, schema_name: str, schema_encoding: str, schema_data: bytes) -> Decoder:
    """Make the decoder of a channel.

    Parameters
    ----------
    message_encoding, schema_encoding : str
        As the MCAP channel and schema records give them; `schema_encoding` is empty for a channel without schema.
    schema_name : str
        Name of the message type.
    schema_data : bytes
        The schema, untrusted.

    Returns
    -------
    Decoder

    Raises
    ------
    LogError
        If the encoding isn't supported, or the schema is malformed or unreasonably large.
    """
    if len(schema_data) > MAX_SCHEMA_BYTES:
        raise LogError(f"schema {schema_name!r}: {len(schema_data)} bytes; a definition may have {MAX_SCHEMA_BYTES}")
    match message_encoding, schema_encoding:
        case "cdr", "ros2msg":
            from chladni.io.decoding.cdr import BinaryDecoder
            from chladni.io.decoding.message_text import parse_ros2_text

            return BinaryDecoder(parse_ros2_text(schema_name, definition_text(schema_data)), encapsulated=True)
        case "cdr", "ros2idl" | "omgidl":
            from chladni.io.decoding.cdr import BinaryDecoder
            from chladni.io.decoding.idl import parse_idl

            return BinaryDecoder(parse_idl(schema_name, definition_text(schema_data)), encapsulated=True)
        case "ros1", "ros1msg":
            from chladni.io.decoding.cdr import BinaryDecoder
            from chladni.io.decoding.message_text import parse_ros1_text

            return BinaryDecoder(parse_ros1_text(schema_name, definition_text(schema_data)), encapsulated=False)
        case "protobuf", "protobuf":
            from chladni.io.decoding.protobuf import ProtobufDecoder

            return ProtobufDecoder.of_schema(schema_name, schema_data)
        case "json", _:
            from chladni.io.decoding.json import JsonDecoder

            # Messages in JSON name their fields themselves, so a schema in another language isn't needed.
            return JsonDecoder.of_schema(schema_name, schema_data if schema_encoding == "jsonschema" else b"")
    pairs = ", ".join(f"{message}/{schema or 'no schema'}" for message, schema in SUPPORTED)
    raise LogError(
        f"schema {schema_name!r}: message encoding {message_encoding!r} with schema encoding {schema_encoding!r} "
        f"can't be decoded; supported: {pairs}"
    )


# Many channels may share one long definition, of which every copy would take memory.
@lru_cache(maxsize=8)
def definition_text(data: bytes) -> str:
    """Give a definition as text.

    Its names are ASCII; what else it may hold stands in comments, which old editors write in Latin-1.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")
