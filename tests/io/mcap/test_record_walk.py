"""The leaping walk against one step at a time."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.io.mcap import record_walk
from chladni.io.mcap.record_walk import walk_records


def step_by_step(content: bytes, start: int, stop: int, until: frozenset[int]) -> tuple[list[int], int]:
    starts = []
    while start + 9 <= stop:
        opcode, length = struct.unpack_from("<BQ", content, start)
        too_short = opcode == 5 and length < 22
        if opcode == 0 or opcode in until or start + 9 + length > stop or too_short:
            break
        starts.append(start)
        start += 9 + length
    return starts, start


def record(opcode: int, length: int) -> bytes:
    return struct.pack("<BQ", opcode, length) + bytes([length % 256]) * length


RECORDS = st.tuples(st.sampled_from([3, 4, 5, 5, 5, 6, 0x90]), st.integers(20, 40))
# A pattern, repeated, is what the leaps are made for; odd ones in between are what must stop them.
RUNS = st.lists(st.tuples(st.lists(RECORDS, min_size=1, max_size=5), st.integers(1, 120)), max_size=5)


@given(runs=RUNS, cut=st.integers(0, 30), junk=st.binary(max_size=20), ends=st.booleans())
def test_leaps_find_what_steps_find(
    runs: list[tuple[list[tuple[int, int]], int]], cut: int, junk: bytes, ends: bool
) -> None:
    content = b"".join(record(*one) for pattern, times in runs for one in pattern * times) + junk
    stop = max(0, len(content) - cut)
    until = frozenset([6]) if ends else frozenset()
    walk = walk_records(np.frombuffer(content, np.uint8), start=0, stop=stop, until=until)
    assert (walk.starts.tolist(), walk.end) == step_by_step(content, 0, stop, until)


def test_a_pattern_is_leapt_over_in_few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    steps = 0

    class Counting:
        def unpack_from(self, buffer: memoryview, offset: int) -> tuple[int, int]:
            nonlocal steps
            steps += 1
            return struct.unpack_from("<BQ", buffer, offset)

    monkeypatch.setattr(record_walk, "RECORD_PREFIX", Counting())
    content = (record(5, 100) + record(5, 60) + record(3, 30)) * 5000
    walk = walk_records(np.frombuffer(content, np.uint8), start=0, stop=len(content))
    assert len(walk.starts) == 15_000
    assert walk.end == len(content)
    assert steps < 300


def test_the_walk_may_start_anywhere() -> None:
    content = b"xyz" + record(5, 30) * 40
    walk = walk_records(np.frombuffer(content, np.uint8), start=3, stop=len(content))
    assert walk.starts.tolist() == list(range(3, len(content), 39))


def test_patterns_longer_than_the_memory_are_walked() -> None:
    content = b"".join(record(5, 22 + number % 300) for number in range(1500))
    walk = walk_records(np.frombuffer(content, np.uint8), start=0, stop=len(content))
    assert len(walk.starts) == 1500
    assert walk.end == len(content)
