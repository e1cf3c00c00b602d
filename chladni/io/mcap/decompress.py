"""Decompression of chunks that never yields more than was declared and allowed."""

import contextlib
from collections.abc import Callable, Iterator

# zstd hands out whole blocks; what a failing step had decoded before is lost with the step.
_STEP_BYTES = 16 * 1024
_LZ4_INPUT_BYTES = 64 * 1024
_BELIEVED_BYTES = 16 * 1024 * 1024
#: Nothing that is measured shrinks further than this; lz4 can't shrink anything further.
BELIEVED_RATIO = 256


Compressed = bytes | memoryview


class DecompressError(ValueError):
    """Compressed data that can't be decoded; never leaves this package."""


def decompress(data: Compressed, compression: str, *, size: int) -> Compressed:
    """Decompress a whole chunk.

    Parameters
    ----------
    data
        Compressed bytes.
    compression
        ``"zstd"``, ``"lz4"`` (frame format) or ``""``.
    size
        Bytes that the chunk declares to hold, at most what the limits allow.

    Raises
    ------
    DecompressError
        When the data doesn't decode to exactly ``size`` bytes.
    """
    if compression not in _WHOLE:
        raise DecompressError(f"unknown compression {compression!r}; known are 'zstd', 'lz4' and ''")
    result = _WHOLE[compression](data, size)
    if len(result) != size:
        raise DecompressError(f"declares {size} bytes but {_more_or(len(result), size)} were found in it")
    return result


def decompress_start(data: Compressed, compression: str, *, size: int) -> Compressed:
    """Decompress as much as there is of a chunk that was cut off.

    Raises
    ------
    DecompressError
        When the data isn't merely cut off: then a wrong byte may have spoiled what was decoded before.
    """
    if compression not in _STEPS:
        return b""
    result = bytearray()
    for step in _STEPS[compression](data):
        result += step
        # Checked at each step, so that a bomb is stopped at its first bytes too many.
        if len(result) > size:
            raise DecompressError(f"declares {size} bytes but more were found in it")
    # A view, since a copy would hold a large chunk twice.
    return memoryview(result).toreadonly()


def _more_or(found: int, size: int) -> str:
    return "more" if found > size else str(found)


def _believable(compressed: int, size: int) -> bool:
    """Tell whether memory for ``size`` bytes may be taken before they are seen."""
    return size <= max(_BELIEVED_BYTES, BELIEVED_RATIO * compressed)


def _plain(data: Compressed, _size: int) -> Compressed:
    return data


def _plain_steps(data: Compressed) -> Iterator[Compressed]:
    yield data


def _zstd(data: Compressed, size: int) -> Compressed:
    import zstandard

    # The library allocates what a frame's own header claims, so that claim has to be the checked one; -1
    # stands for none, as streaming writers leave it.
    if _claimed_zstd_size(data) in (size, -1) and _believable(len(data), size):
        with contextlib.suppress(zstandard.ZstdError):
            result = zstandard.ZstdDecompressor().decompress(data, max_output_size=max(size, 1))
            if len(result) == size:
                return result
    # More than one frame, or something is wrong: step by step it shows what.
    return decompress_start(data, "zstd", size=size)


def _claimed_zstd_size(data: Compressed) -> int:
    import zstandard

    try:
        return int(zstandard.frame_content_size(data))
    except zstandard.ZstdError as error:
        raise DecompressError(f"zstd: {error}") from error


def _zstd_steps(data: Compressed) -> Iterator[bytes]:
    import zstandard

    with zstandard.ZstdDecompressor().stream_reader(data, read_across_frames=True) as reader:
        try:
            while step := reader.read(_STEP_BYTES):
                yield step
        except zstandard.ZstdError as error:
            raise DecompressError(f"zstd: {error}") from error


def _lz4(data: Compressed, size: int) -> Compressed:
    import lz4.frame

    # With a length to stop at, the library takes that much memory at once, and then copies it.
    if size > _BELIEVED_BYTES:
        return decompress_start(data, "lz4", size=size)
    decompressor = lz4.frame.LZ4FrameDecompressor()
    try:
        result: bytes = decompressor.decompress(data, max_length=size)
    except (RuntimeError, EOFError) as error:
        raise DecompressError(f"lz4: {error}") from error
    if decompressor.eof and not decompressor.unused_data:
        return result
    # More than one frame, or more than was declared.
    return decompress_start(data, "lz4", size=size)


def _lz4_steps(data: Compressed) -> Iterator[bytes]:
    import lz4.frame

    decompressor = lz4.frame.LZ4FrameDecompressor()
    try:
        for start in range(0, len(data), _LZ4_INPUT_BYTES):
            pending = data[start : start + _LZ4_INPUT_BYTES]
            while pending or not decompressor.needs_input:
                yield decompressor.decompress(pending, max_length=_STEP_BYTES)
                pending = decompressor.unused_data or b"" if decompressor.eof else b""
                if decompressor.eof and not pending:
                    break
    except (RuntimeError, EOFError) as error:
        raise DecompressError(f"lz4: {error}") from error


_WHOLE: dict[str, Callable[[Compressed, int], Compressed]] = {"": _plain, "zstd": _zstd, "lz4": _lz4}
_STEPS: dict[str, Callable[[Compressed], Iterator[Compressed]]] = {
    "": _plain_steps,
    "zstd": _zstd_steps,
    "lz4": _lz4_steps,
}
