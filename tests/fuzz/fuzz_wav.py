"""Damaged and odd sound files: ``python tests/fuzz/fuzz_wav.py --inputs 20000 --seed 1``.

WAV has no checksum. The description of the samples is redundant: bytes a second, bytes a frame, bits and channels say
the same twice, so that damage to one of them shows. So do the lengths. Whether
four bytes are an integer or a floating point number stands but once.
"""

import random
import struct
import sys
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from harness import Case, Format, main
from samples import Sound, Truth, damaged_case, log_command, odd_case, read_case, sound_file

ROWS = 200
RATE_HZ = 8000
KINDS = ("<u1", "<i2", "<i4", "<f4", "<f8", ">i2", ">f4")


def chunk(order: str, name: bytes, content: bytes) -> bytes:
    return name + struct.pack(f"{order}I", len(content)) + content + bytes(len(content) % 2)


def described(order: str, kind: np.dtype[Any], channels: int, rate_hz: int = RATE_HZ) -> bytes:
    code, frame = (3 if kind.kind == "f" else 1), kind.itemsize * channels
    return struct.pack(f"{order}HHIIHH", code, channels, rate_hz, rate_hz * frame, frame, kind.itemsize * 8)


def wav(frames: np.ndarray[Any, Any], *, long: bool = False, tail: bytes = b"") -> bytes:
    """Write a RIFF, RIFX or RF64 file."""
    order = ">" if frames.dtype.byteorder == ">" else "<"
    data = frames.tobytes()
    body = chunk(order, b"fmt ", described(order, frames.dtype, frames.shape[1]))
    if long:
        sizes = struct.pack("<QQQI", 0, len(data), len(frames), 0)
        body = chunk("<", b"ds64", sizes) + body + b"data" + struct.pack("<I", 0xFFFFFFFF) + data
    else:
        body += chunk(order, b"data", data) + tail
    name = b"RF64" if long else b"RIFX" if order == ">" else b"RIFF"
    size = 0xFFFFFFFF if long else len(body) + 4
    return name + struct.pack(f"{order}I", size) + b"WAVE" + body


def truth(frames: np.ndarray[Any, Any]) -> Truth:
    size = frames.dtype.itemsize
    values = frames.astype(np.float64)
    if frames.dtype.kind == "u":
        values = (values - 128) / 128
    elif frames.dtype.kind == "i":
        values /= 2.0 ** (8 * size - 1)
    return Truth(
        channels={f"ch{column + 1}": values[:, column] for column in range(frames.shape[1])},
        rate_hz=RATE_HZ,
        start_ns=0,
    )


@cache
def sounds() -> tuple[Sound, ...]:
    """Write one file of each kind."""
    rng = np.random.default_rng(1)
    found = []
    for kind in map(np.dtype, KINDS):
        for channels in (1, 2, 6):
            noise = rng.normal(size=(ROWS, channels))
            scale = 1.0 if kind.kind == "f" else 2.0 ** (8 * kind.itemsize - 4)
            frames = (noise * scale + (128 if kind.kind == "u" else 0)).clip(-(2**31), 2**31 - 1).astype(kind)
            how = f"{kind.str} {channels} channels"
            tail = chunk(">" if kind.byteorder == ">" else "<", b"LIST", b"INFOISFT    lab ")
            sound = sound_file(how, "a.wav", wav(frames, tail=tail), truth(frames), unprotected=[frames])
            # Other widths are of one kind of number alone.
            found.append(replace(sound, vague=((20, 22),)) if kind.itemsize == 4 else sound)
            if kind.str == "<i2":
                content = wav(frames, long=True)
                found.append(sound_file(f"{how} long", "a.wav", content, truth(frames), unprotected=[frames]))
    return tuple(found)


def odd(rng: random.Random) -> Case:
    """Write descriptions that no recorder writes."""
    numbers = [rng.choice((0, 1, 3, 0xFFFE, 2, 65535, 7, 16, 24, 12)) for _ in range(6)]
    fmt = struct.pack("<HHIIHH", *numbers) + rng.randbytes(rng.choice((0, 2, 24)))
    parts = [chunk("<", b"fmt ", fmt), chunk("<", b"data", rng.randbytes(rng.choice((0, 3, 480))))]
    parts += [chunk("<", rng.randbytes(4), b"x" * rng.randrange(9)) for _ in range(rng.randrange(3))]
    rng.shuffle(parts)
    body = b"".join(parts * rng.choice((1, 1, 2)))
    return odd_case("a.wav", b"RIFF" + struct.pack("<I", len(body) + 4) + b"WAVE" + body, f"fmt {numbers}")


def make(rng: random.Random) -> Case:
    """Damage a file, or write an odd one."""
    return odd(rng) if rng.random() < 0.15 else damaged_case(rng.choice(sounds()), rng)


FORMAT = Format(name="wav", make=make, read=read_case, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["wav"]))
