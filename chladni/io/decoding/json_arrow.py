"""JSON messages to columns by Arrow's parser: the fast path for messages that all fit the schema.

Messages are joined by newlines and parsed as one stream of objects. That is only safe because no message can hide a
boundary: each begins with ``{``, ends with ``}`` and holds no newline and no NUL, a string can't contain a newline,
and after a closing brace another opening brace is legal at the top level only. So each message gives at least one
row, and as many rows as messages means exactly one row each. Whatever Arrow refuses, and whatever it would take more
generously than the rules of `chladni.io.decoding.json_values`, is left to those.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.columns import Strings
from chladni.io.decoding.found import Found
from chladni.io.decoding.json_schema import FLOAT, INTEGER, NANOSECONDS, SECONDS
from chladni.io.decoding.schema import Array, FieldType, Leaf, Primitive, Stamp, Text, tree_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

    import pyarrow as pa

    from chladni.io.decoding.json_stream import Span
    from chladni.io.decoding.schema import Tree

BLOCK_BYTES: Final = 1 << 18
"""Bytes that one thread parses at a time; a chunk usually holds a megabyte, so that several share it."""

LARGEST_TIME_S: Final = 9_000_000_000
"""Seconds (the year 2255) beyond which nanoseconds come near the end of 64 bits; left to exact arithmetic."""


def read_by_arrow(span: Span, leaves: Sequence[Leaf]) -> list[Found] | None:
    """Read leaves of messages that are all sound.

    Parameters
    ----------
    span : Span
        The messages.
    leaves : sequence of Leaf

    Returns
    -------
    list of Found or None
        One for each leaf; None where any message, or a leaf's type, is beyond this path.
    """
    stream = span.lines() if all(_is_plain(leaf) for leaf in leaves) else None
    if stream is None:
        return None
    block_bytes = max(BLOCK_BYTES, 2 * int((span.ends - span.starts).max()))
    table = _parsed(stream, leaves, block_bytes)
    if table is None or table.num_rows != len(span):
        return None
    found = [_found(table, leaf) for leaf in leaves]
    complete = [one for one in found if one is not None]
    return complete if len(complete) == len(found) else None


def _parsed(stream: bytes, leaves: Sequence[Leaf], block_bytes: int) -> pa.Table | None:
    import pyarrow as pa
    from pyarrow import json as arrow_json

    try:
        return arrow_json.read_json(
            pa.BufferReader(stream),
            read_options=arrow_json.ReadOptions(use_threads=True, block_size=block_bytes),
            parse_options=arrow_json.ParseOptions(
                explicit_schema=pa.schema(_arrow_fields(tree_of(leaves), pa)), unexpected_field_behavior="ignore"
            ),
        )
    except pa.ArrowInvalid:
        return None


def _is_plain(leaf: Leaf) -> bool:
    scalar = leaf.type.element if isinstance(leaf.type, Array) else leaf.type
    return not any(leaf.lists) and (isinstance(scalar, Primitive) or isinstance(leaf.type, Stamp | Text))


def _arrow_fields(tree: Tree, pa: ModuleType) -> list[pa.Field]:
    return [
        pa.field(
            name,
            _arrow_type(below.type, pa) if isinstance(below, Leaf) else pa.struct(_arrow_fields(below, pa)),
        )
        for name, below in tree.items()
    ]


def _arrow_type(kind: FieldType, pa: ModuleType) -> pa.DataType:
    match kind:
        case Array(element=element):
            return pa.list_(_arrow_type(element, pa))
        case Stamp():
            return pa.struct([(name, pa.int64()) for name in (SECONDS, *NANOSECONDS)])
        case Primitive(dtype=dtype):
            return pa.from_numpy_dtype(dtype)
        case _:
            return pa.string()


def _found(table: pa.Table, leaf: Leaf) -> Found | None:
    array = table.column(leaf.names[0]).combine_chunks()
    for name in leaf.names[1:]:
        if array.null_count:
            return None
        array = array.field(name)
    if array.null_count and leaf.type not in (FLOAT, INTEGER):
        # A key that is missing, or null itself: the rules say what becomes of the message.
        return None
    match leaf.type:
        case Array():
            return _of_lists(array)
        case Stamp():
            return _of_times(array)
        case Primitive():
            return _of_numbers(array)
        case _:
            coded = array.dictionary_encode()
            codes = coded.indices.to_numpy(zero_copy_only=False).astype(np.int32, copy=False)
            return Found(values=Strings(codes=codes, table=tuple(coded.dictionary.to_pylist())))


def _complete(array: pa.Array) -> pa.Array | None:
    return None if array.null_count else array


def _of_numbers(array: pa.Array) -> Found:
    # Nulls become NaN, and integers beside them doubles, which is what the rules make of them.
    return Found(values=array.to_numpy(zero_copy_only=False))


def _of_lists(array: pa.Array) -> Found | None:
    elements = _complete(array.flatten())
    if elements is None:
        return None
    counts = np.diff(array.offsets.to_numpy()).astype(np.int64)
    return Found(values=_of_numbers(elements).values, lengths=(counts,))


def _of_times(array: pa.Array) -> Found | None:
    seconds = _complete(array.field(SECONDS))
    given = [part for part in (array.field(name) for name in NANOSECONDS) if part.null_count < len(part)]
    if seconds is None or len(given) != 1 or given[0].null_count:
        return None
    whole, part = seconds.to_numpy(), given[0].to_numpy()
    if (np.abs(whole) > LARGEST_TIME_S).any() or (np.abs(part) > LARGEST_TIME_S).any():
        return None
    return Found(values=whole * 1_000_000_000 + part)
