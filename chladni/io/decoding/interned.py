"""Byte strings of many messages, each distinct one decoded once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.io.decoding.columns import Strings

if TYPE_CHECKING:
    from collections.abc import Callable

    from chladni.io.decoding.columns import StringValue
    from chladni.signals.arrays import Bytes, Mask, Whole

MAX_TEMPLATES: Final = 8
"""Distinct strings searched for by comparing all messages at once, before going through them one by one."""

COMPARE_BYTES: Final = 1 << 22
"""Bytes compared at once; bounds the memory that a long string in many messages takes."""


def intern_blocks(
    buffer: Bytes,
    blocks: Whole,
    decode: Callable[[bytes], StringValue],
) -> tuple[Strings, Mask]:
    """Decode strings, each distinct sequence of bytes once.

    Parameters
    ----------
    buffer : uint8 array
    blocks : int64 array [block, 2]
        First byte and number of bytes of each; inside the buffer.
    decode : callable
        From bytes to the value; `ValueError` (as `UnicodeDecodeError` is) says that they are malformed.

    Returns
    -------
    strings : Strings
        One code a block.
    malformed : bool array [block]
    """
    codes = np.full(len(blocks), -1, np.int32)
    found: list[bytes] = []
    remaining = np.arange(len(blocks))
    while len(remaining) and len(found) < MAX_TEMPLATES:
        found.append(_bytes_of(buffer, blocks[remaining[0]]))
        same = _equal_to_first(buffer, blocks[remaining])
        codes[remaining[same]] = len(found) - 1
        remaining = remaining[~same]
    known = {value: code for code, value in enumerate(found)}
    for index in remaining.tolist():
        codes[index] = known.setdefault(_bytes_of(buffer, blocks[index]), len(known))
    table, malformed = _decode_all(list(known), decode)
    return Strings(codes=codes, table=table), malformed[codes]


def _bytes_of(buffer: Bytes, block: Whole) -> bytes:
    start, length = int(block[0]), int(block[1])
    return buffer[start : start + length].tobytes()


def _equal_to_first(buffer: Bytes, blocks: Whole) -> Mask:
    start, length = int(blocks[0, 0]), int(blocks[0, 1])
    equal: Mask = blocks[:, 1] == length
    if length == 0:
        return equal
    windows = np.lib.stride_tricks.sliding_window_view(buffer, length)
    alike = np.flatnonzero(equal)
    at_once = max(1, COMPARE_BYTES // length)
    for first in range(0, len(alike), at_once):
        some = alike[first : first + at_once]
        equal[some] = (windows[blocks[some, 0]] == buffer[start : start + length]).all(axis=1)
    return equal


def _decode_all(values: list[bytes], decode: Callable[[bytes], StringValue]) -> tuple[tuple[StringValue, ...], Mask]:
    table: list[StringValue] = []
    malformed = np.zeros(max(1, len(values)), np.bool_)
    for code, value in enumerate(values):
        try:
            table.append(decode(value))
        except ValueError:
            malformed[code] = True
            table.append("")
    # A code must find an entry even where there was nothing to decode.
    return tuple(table) or ("",), malformed
