"""Encoded messages of a log to columns: CDR, ROS 1, protobuf and JSON."""

from chladni.io.decoding.columns import Column, Decoded, Decoder, EncodedMessages, Strings
from chladni.io.decoding.decoder import SUPPORTED, definition_text, make_decoder
from chladni.io.decoding.schema import FieldInfo, FieldKind

__all__ = [
    "SUPPORTED",
    "Column",
    "Decoded",
    "Decoder",
    "EncodedMessages",
    "FieldInfo",
    "FieldKind",
    "Strings",
    "definition_text",
    "make_decoder",
]
