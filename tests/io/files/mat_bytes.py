"""The bytes of ``.mat`` files of version 5, element by element."""

import struct


def mat_file(*elements: bytes) -> bytes:
    return b"MATLAB 5.0".ljust(124) + b"\x00\x01IM" + b"".join(elements)


def element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def matrix(kind: int, *parts: bytes, shape: tuple[int, ...] = (1, 1), name: bytes = b"x") -> bytes:
    dimensions = element(5, struct.pack(f"<{len(shape)}i", *shape))
    return element(14, element(6, struct.pack("<II", kind, 0)) + dimensions + element(1, name) + b"".join(parts))
