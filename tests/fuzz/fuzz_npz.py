"""Damaged and odd NPZ and NPY files: ``python tests/fuzz/fuzz_npz.py --inputs 20000 --seed 1``.

An archive has a checksum over each array: a wrong number is never read. A lone array has none. What its header says
must fit its length, and damage among the numbers changes no others.
"""

import io
import random
import struct
import sys
import zipfile
from functools import cache
from typing import Any

import numpy as np
from damage import ODD_TEXTS
from harness import Case, Format, main
from samples import Sound, Truth, damaged_case, log_command, odd_case, read_case, sound_file

ROWS = 40


def archive(compressed: bool, **arrays: Any) -> bytes:
    stream = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(stream, **arrays)
    return stream.getvalue()


def lone(array: np.ndarray[Any, Any]) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


@cache
def sounds() -> tuple[Sound, ...]:
    """Write one file of each kind."""
    values = np.random.default_rng(1).normal(size=(ROWS, 3))
    columns = {f"acc[{column}]": values[:, column] for column in range(3)}
    timed = Truth(channels=columns, start_ns=0)
    rated = Truth(channels=columns, start_ns=0, options={"sample_rate_hz": 100.0})
    fields = np.array([tuple(row) for row in values], dtype=[("x", "f8"), ("y", "f4"), ("z", ">f8")])
    by_field = Truth(channels={name: fields[name].astype(float) for name in "xyz"}, start_ns=0, options=rated.options)
    singles = values.astype(np.float32)
    found = []
    for compressed in (False, True):
        name = "deflated" if compressed else "stored"
        times = np.arange(ROWS) / 100
        found.append(sound_file(f"{name} rate", "acc.npz", archive(compressed, fs=100.0, acc=values), timed))
        found.append(sound_file(f"{name} times", "acc.npz", archive(compressed, t=times, acc=values), timed))
    for how, array in (("doubles", values), ("by column", np.asfortranarray(values)), ("big", values.astype(">f8"))):
        content = lone(array)
        found.append(sound_file(how, "acc.npy", content, rated, unprotected=[array], vague=[content[8:128]]))
    single = Truth(
        channels={name: singles[:, row].astype(float) for row, name in enumerate(columns)}, start_ns=0,
        options=rated.options,
    )  # fmt: skip
    found.append(
        sound_file("singles", "acc.npy", lone(singles), single, unprotected=[singles], vague=[lone(singles)[8:128]])
    )
    content = lone(fields)
    found.append(sound_file("fields", "acc.npy", content, by_field, unprotected=[fields], vague=[content[8:128]]))
    return tuple(found)


@cache
def bomb() -> bytes:
    """Write an archive of 640 MB in 600 kB."""
    stream = io.BytesIO()
    header = lone(np.zeros(0))
    with (
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file,
        file.open("x.npy", "w") as member,
    ):
        member.write(header.replace(b"(0,),  ", b"(80000000,),".ljust(15))[: len(header)])
        for _ in range(640):
            member.write(bytes(10**6))
    return stream.getvalue()


def odd(rng: random.Random) -> Case:
    """Write a header that promises much, an archive of odd members, or one of very many zeros."""
    if rng.random() < 0.01:
        return odd_case("bomb.npz", bomb(), "bomb", sample_rate_hz=100.0)
    if rng.random() < 0.5:
        shape = rng.choice(
            ("(99999999999999,)", "(-1,)", "(0, 3)", "(3, 0)", "()", "(2,)*9", "(1e9,)", "(" + "1," * 70 + ")", "(5")
        )
        kind = rng.choice(
            ("<f8", "|O", "<M8[ns]", "<c16", "<U9", "|V8", "<f2", "<f16", "?", "[('a','<f8')]", "<m8[D]")
        )
        order = rng.choice(("True", "False", "1", "None"))
        header = f"{{'descr': '{kind}', 'fortran_order': {order}, 'shape': {shape}, }}"
        raw = header.encode() + b"\n"
        content = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(raw)) + raw + rng.randbytes(rng.choice((0, 80, 800)))
        return odd_case("odd.npy", content, f"header {header[:60]}", sample_rate_hz=100.0)
    stream = io.BytesIO()
    with zipfile.ZipFile(
        stream, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2))
    ) as file:
        for _ in range(rng.randrange(1, 5)):
            name = rng.choice(
                (*(f"a{text}" for text in ODD_TEXTS), "../../up", "/root", "C:\\x", "a/b", "fs", "t", "acc")
            )[:300]
            size = rng.choice((0, 1, 5, 300))
            odd_array = rng.choice(
                (np.zeros(size), np.full(size, np.nan), np.arange(size), np.zeros((size, 2), np.complex128),
                 np.array([1e308, -1e308]), np.array("text"), np.zeros((2, 3, size)), np.array(rng.choice(ODD_TEXTS)))
            )  # fmt: skip
            file.writestr(f"{name}.npy", lone(odd_array))
    return odd_case("odd.npz", stream.getvalue(), "odd members")


def make(rng: random.Random) -> Case:
    """Damage a file, or write an odd one."""
    return odd(rng) if rng.random() < 0.2 else damaged_case(rng.choice(sounds()), rng)


FORMAT = Format(name="npz", make=make, read=read_case, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["npz"]))
