"""Damaged and odd MAT files: ``python tests/fuzz/fuzz_mat.py --inputs 20000 --seed 1``.

Compressed arrays have a checksum each: a wrong number is never read. Plain ones have none; what their headers say of
size and kind is there twice and must agree, and damage among the numbers changes no others.
"""

import io
import random
import struct
import sys
import tempfile
import zlib
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from damage import ODD_TEXTS, zeros
from harness import Case, Format, main
from samples import Sound, Truth, damaged_case, log_command, odd_case, read_case, sound_file
from scipy.io import savemat

ROWS = 40


def mat5(compressed: bool, **arrays: Any) -> bytes:
    stream = io.BytesIO()
    savemat(stream, arrays, do_compression=compressed)
    return stream.getvalue()


def mat73(**arrays: Any) -> bytes:
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        path = Path(folder) / "a.mat"
        with h5py.File(path, "w", userblock_size=512) as file:
            for name, array in arrays.items():
                one = file.create_dataset(
                    name, data=np.atleast_2d(array).T, fletcher32=np.size(array) > 1, chunks=True
                )
                one.attrs["MATLAB_class"] = np.bytes_("double")
        content = path.read_bytes()
    return b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + content[128:]


@cache
def sounds() -> tuple[Sound, ...]:
    """Write one file of each kind."""
    values = np.random.default_rng(1).normal(size=(ROWS, 3))
    times = np.arange(ROWS) / 100
    truth = Truth(channels={f"acc[{column}]": values[:, column] for column in range(3)}, start_ns=0)
    inside = Truth(channels={f"run.acc[{column}]": values[:, column] for column in range(3)}, start_ns=0)
    singles = values.astype(np.float32)
    single = Truth(channels={f"acc[{c}]": singles[:, c].astype(float) for c in range(3)}, start_ns=0)
    rate = np.float64(100).tobytes()
    plain = {"unprotected": [np.asfortranarray(values)], "vague": [rate, b"acc\0", b"fs\0"]}
    found = [
        sound_file("plain rate", "a.mat", mat5(False, fs=100.0, acc=values), truth, **plain),
        sound_file("packed rate", "a.mat", mat5(True, fs=100.0, acc=values), truth),
        sound_file("packed times", "a.mat", mat5(True, t=times, acc=values), truth),
        sound_file("packed struct", "a.mat", mat5(True, run={"t": times, "acc": values, "who": "me"}), inside),
        sound_file("7.3", "a.mat", mat73(fs=100.0, acc=values), truth, vague=[rate, b"acc\0", b"fs\0"]),
        singles_file(singles, single, plain["vague"]),
        sound_file(
            "plain times", "a.mat", mat5(False, t=times, acc=values), truth,
            unprotected=[np.asfortranarray(values), times.reshape(-1, 1)], vague=[b"acc\0", b"t\0\0\0"],
        ),
    ]  # fmt: skip
    return tuple(found)


def singles_file(singles: Any, truth: Truth, vague: list[bytes]) -> Sound:
    """Write singles; arrays may be stored as other numbers than they are, so how these are stored stands but once."""
    content = mat5(False, fs=100.0, acc=singles)
    sound = sound_file("singles", "a.mat", content, truth, unprotected=[np.asfortranarray(singles)], vague=vague)
    stored = content.index(struct.pack("<II", 7, singles.nbytes))
    return replace(sound, vague=(*sound.vague, (stored, stored + 4)))


def tag(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def matrix(rng: random.Random, depth: int = 0) -> bytes:
    """Write an element whose kind, size and content don't care for each other."""
    kind = rng.choice((1, 2, 2, 3, 4, 5, 6, 6, 7, 9, 12, 14, 15, 16, 17, 18, 99))
    sizes = [rng.choice((0, 1, 2, 3, 10, -1, 2**31 - 1)) for _ in range(rng.choice((0, 1, 2, 2, 2, 3, 9)))]
    head = tag(6, struct.pack("<II", kind | rng.choice((0, 0, 0x0800, 0x0400, 0x0200)), 0))
    head += tag(5, struct.pack(f"<{len(sizes)}i", *sizes)) + tag(1, rng.choice(ODD_TEXTS).encode()[:60])
    if kind in (1, 2, 3) and depth < 4:
        if kind == 2:
            head += tag(5, struct.pack("<i", rng.choice((32, 0, -1, 8)))) + tag(1, b"a".ljust(32, b"\0") * 2)
        return tag(14, head + b"".join(matrix(rng, depth + 1) for _ in range(rng.randrange(5))))
    return tag(14, head + tag(rng.choice((1, 2, 7, 9, 9, 12, 13, 20)), rng.randbytes(rng.choice((0, 8, 80, 240)))))


@cache
def bomb() -> bytes:
    """Write an element of 640 MB in 3 MB."""
    size = 640 << 20
    head = tag(6, struct.pack("<II", 6, 0)) + tag(5, struct.pack("<ii", size // 8, 1)) + tag(1, b"x")
    head = struct.pack("<II", 14, len(head) + 8 + size) + head + struct.pack("<II", 9, size)
    packer = zlib.compressobj(1)
    return tag(15, packer.compress(head) + zeros(size, packer))


def odd(rng: random.Random) -> Case:
    """Write elements that contradict themselves, cells of unlike members, deep nesting, and much in little."""
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    what = rng.choices(("elements", "cells", "deep", "bomb"), (60, 20, 20, 1))[0]
    if what == "elements":
        parts = [matrix(rng) for _ in range(rng.randrange(1, 4))]
        content = header + b"".join(tag(15, zlib.compress(one)) if rng.random() < 0.4 else one for one in parts)
    elif what == "cells":
        members = (np.arange(9.0), np.arange(4.0), "text", np.float64(3), np.zeros((2, 2)), np.array([]), {"a": 1.0})
        cell = np.empty(rng.randrange(1, 6), dtype=object)
        cell[:] = rng.choices(members, k=len(cell))
        content = mat5(rng.random() < 0.5, **{"c": cell, **({"fs": 9.0} if rng.random() < 0.5 else {})})
    elif what == "deep":
        inner = tag(6, struct.pack("<II", 6, 0)) + tag(5, struct.pack("<ii", 1, 1)) + tag(1, b"x") + tag(9, bytes(8))
        for _ in range(rng.choice((3, 50, 500, 3000))):
            inner = (
                tag(6, struct.pack("<II", 1, 0)) + tag(5, struct.pack("<ii", 1, 1)) + tag(1, b"x") + tag(14, inner)
            )
        content = header + tag(14, inner)
    else:
        content = header + bomb()
    return odd_case("a.mat", content, what)


def make(rng: random.Random) -> Case:
    """Damage a file, or write an odd one."""
    return odd(rng) if rng.random() < 0.3 else damaged_case(rng.choice(sounds()), rng)


FORMAT = Format(name="mat", make=make, read=read_case, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["mat"]))
