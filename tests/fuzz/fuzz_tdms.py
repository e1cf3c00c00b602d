"""Damaged and odd TDMS files: ``python tests/fuzz/fuzz_tdms.py --inputs 20000 --seed 1``.

TDMS has no checksum. Lengths of segments and counts of values must fit, damage among the numbers changes no others.
"""

import io
import random
import sys
from functools import cache
from typing import Any

import numpy as np
from damage import ODD_TEXTS
from harness import Case, Format, main
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from samples import Sound, Truth, block_of, damaged_case, log_command, odd_case, read_case, sound_file

ROWS = 50


def tdms(channels: dict[str, np.ndarray[Any, Any]], properties: dict[str, Any], *, segments: int = 1) -> bytes:
    stream = io.BytesIO()
    with TdmsWriter(stream) as writer:
        for part in range(segments):
            rows = slice(part * ROWS // segments, (part + 1) * ROWS // segments)
            objects = [ChannelObject("g", name, one[rows], properties=properties) for name, one in channels.items()]
            writer.write_segment([RootObject(), GroupObject("g"), *objects])
    return stream.getvalue()


@cache
def sounds() -> tuple[Sound, ...]:
    """Write one file of each kind."""
    rng = np.random.default_rng(1)
    first, second, times = (rng.normal(size=(ROWS, 1)) for _ in range(3))
    times = np.arange(ROWS)[:, np.newaxis] / 100
    truth = Truth(channels={"a": first[:, 0], "b": second[:, 0]}, start_ns=0)
    wave = {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": "N"}
    names = {"a": first[:, 0], "b": second[:, 0]}
    vague = [np.float64(0.01).tobytes(), b"unit_string", b"wf_increment", b"wf_start_offset", b"'g'/'a'", b"'g'/'b'"]
    one, two = tdms(names, wave), tdms(names, wave, segments=2)
    return (
        sound_file("waveforms", "a.tdms", one, truth, unprotected=[first, second], vague=vague),
        sound_file("segments", "a.tdms", two, truth, vague=vague,
                   blocks=[block_of(part, two, first=ROWS // 2 * number)
                           for one in (first, second) for number, part in enumerate(np.split(one, 2))]),
        sound_file("times", "a.tdms", tdms({"time [s]": times[:, 0], **names}, {"unit_string": "s"}), truth,
                   unprotected=[first, second, times], vague=vague),
    )  # fmt: skip


def odd(rng: random.Random) -> Case:
    """Write channels of odd names, types and properties."""
    size = rng.choice((0, 1, 5, 50))
    kinds = (
        np.zeros(size),
        np.arange(size),
        np.arange(size).astype("M8[us]"),
        np.array(["x"] * size),
        np.ones(size, bool),
    )
    values: tuple[Any, ...] = (0.0, -1.0, 1e-300, 1e300, float("nan"), float("inf"), 3, "text", True, *ODD_TEXTS[:30])
    objects = []
    for _ in range(rng.randrange(5)):
        keys = rng.choices(("wf_increment", "wf_start_offset", "wf_start_time", "unit_string", "x"), k=3)
        given = {key: rng.choice(values) for key in keys}
        objects.append(ChannelObject("g", rng.choice(ODD_TEXTS)[:99], rng.choice(kinds), properties=given))
    stream = io.BytesIO()
    try:
        with TdmsWriter(stream) as writer:
            writer.write_segment(objects)
    except (TypeError, ValueError, OverflowError, UnicodeError):
        # The writer refuses some; what it has written by then is a file that was never closed.
        pass
    return odd_case("a.tdms", stream.getvalue(), "odd channels")


def make(rng: random.Random) -> Case:
    """Damage a file, or write an odd one."""
    return odd(rng) if rng.random() < 0.2 else damaged_case(rng.choice(sounds()), rng)


FORMAT = Format(name="tdms", make=make, read=read_case, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["tdms"]))
