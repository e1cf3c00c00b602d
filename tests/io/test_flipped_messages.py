"""Bits flipped in one message of a log without checksums, in four encodings: all other messages stay as they are."""

import json
import struct
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, message_factory
from google.protobuf.descriptor_pool import DescriptorPool

from chladni.io.log import open_log
from chladni.signals.arrays import Real
from tests.make_logs import START_NS, LogMaker

MESSAGES = 100
STEP_NS = 10_000_000
SEPARATOR = "=" * 80
PARTS = (
    "string[] name\nfloat64[] position\nPart[] parts\nfloat64 v\n"
    f"{SEPARATOR}\nMSG: demo/Part\nfloat32[2] c\nfloat64 x\n"
)
CHANNELS = ("position[0]", "position[1]", "parts[0].c[0]", "parts[0].c[1]", "parts[1].c[0]", "parts[1].c[1]",
            "parts[0].x", "parts[1].x", "v")  # fmt: skip

Field = descriptor_pb2.FieldDescriptorProto


@cache
def proto() -> tuple[Any, bytes]:
    file = descriptor_pb2.FileDescriptorProto(name="p.proto", package="demo", syntax="proto3")
    part, whole = file.message_type.add(name="Part"), file.message_type.add(name="Whole")
    part.field.add(name="c", number=1, type=Field.TYPE_FLOAT, label=Field.LABEL_REPEATED)
    part.field.add(name="x", number=2, type=Field.TYPE_DOUBLE, label=Field.LABEL_OPTIONAL)
    whole.field.add(name="name", number=1, type=Field.TYPE_STRING, label=Field.LABEL_REPEATED)
    whole.field.add(name="position", number=2, type=Field.TYPE_DOUBLE, label=Field.LABEL_REPEATED)
    whole.field.add(
        name="parts", number=3, type=Field.TYPE_MESSAGE, label=Field.LABEL_REPEATED, type_name=".demo.Part"
    )
    whole.field.add(name="v", number=4, type=Field.TYPE_DOUBLE, label=Field.LABEL_OPTIONAL)
    pool = DescriptorPool()
    pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("demo.Whole"))
    return kind, descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()


def as_protobuf(values: Sequence[float]) -> bytes:
    message = proto()[0](name=["elbow", "wrist"], position=values[:2], v=values[8])
    for place in range(2):
        message.parts.add(c=values[2 + 2 * place : 4 + 2 * place], x=values[6 + place])
    return bytes(message.SerializeToString())


def as_json(values: Sequence[float]) -> bytes:
    parts = [{"c": values[2 + 2 * place : 4 + 2 * place], "x": values[6 + place]} for place in range(2)]
    return json.dumps({"name": ["elbow", "wrist"], "position": values[:2], "parts": parts, "v": values[8]}).encode()


def as_ros(values: Sequence[float], *, aligned: bool) -> bytes:
    body = bytearray()

    def put(code: str, *numbers: float) -> None:
        for number in numbers:
            body.extend(
                b"\0" * (-len(body) % struct.calcsize(code) if aligned else 0) + struct.pack(f"<{code}", number)
            )

    put("I", 2)
    for name in (b"elbow", b"wrist"):
        name += b"\0" * aligned
        put("I", len(name))
        body.extend(name)
    put("I", 2)
    put("d", *values[:2])
    put("I", 2)
    for place in range(2):
        put("f", *values[2 + 2 * place : 4 + 2 * place])
        put("d", values[6 + place])
    put("d", values[8])
    return (b"\0\1\0\0" if aligned else b"") + bytes(body)


ENCODINGS: dict[str, tuple[Callable[[], tuple[str, str, bytes] | None], Callable[[Sequence[float]], bytes]]] = {
    "cdr": (lambda: ("demo/msg/Whole", "ros2msg", PARTS.encode()), lambda values: as_ros(values, aligned=True)),
    "ros1": (lambda: ("demo/Whole", "ros1msg", PARTS.encode()), lambda values: as_ros(values, aligned=False)),
    "protobuf": (lambda: ("demo.Whole", "protobuf", proto()[1]), as_protobuf),
    "json": (lambda: None, as_json),
}


def write(path: Path, encoding: str, messages: Sequence[bytes]) -> None:
    schema, _ = ENCODINGS[encoding]
    with LogMaker(path, compression="none", chunk_size=2000) as maker:
        channel = maker.raw("/a", encoding=encoding, schema=schema())
        sound = maker.json("/sound")
        for index, content in enumerate(messages):
            maker.write(channel, content, START_NS + index * STEP_NS)
            maker.write(sound, {"x": index}, START_NS + index * STEP_NS)


def samples(path: Path) -> tuple[dict[str, Real], int]:
    """What each listed channel has on the grid of all messages, NaN for nothing; and how many messages are lost."""
    found = {}
    with open_log(path) as log:
        lost = sum(one.lost_messages or 0 for one in log.info().damage)
        # A message of JSON may name a field of its own, which one sample is no signal of.
        for channel in (
            one for one in log.channels if one.name in (*(f"/a.{name}" for name in CHANNELS), "/sound.x")
        ):
            series = log.read([channel.name])
            first = round((series.start_time_ns - START_NS) / STEP_NS)
            found[channel.name] = np.full(MESSAGES, np.nan)
            found[channel.name][first : first + series.samples] = series.values[0]
        return found, lost


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize(
    ("seed", "hits"), [(0, 4), *(pytest.param(seed, 12, marks=pytest.mark.nightly) for seed in (0, 1, 2))]
)
def test_a_damaged_message_costs_only_itself(tmp_path: Path, encoding: str, seed: int, hits: int) -> None:
    rng = np.random.default_rng(seed)
    values = np.float32(rng.normal(size=(MESSAGES, 9))).astype(np.float64)
    messages = [ENCODINGS[encoding][1](row.tolist()) for row in values]
    for _ in range(hits):
        # The first messages tell what the log holds, so they are hit as often as all others.
        odd = int(rng.integers(0, 64 if rng.random() < 0.5 else MESSAGES))
        damaged = bytearray(messages[odd])
        for _ in range(int(rng.integers(1, 4))):
            damaged[rng.integers(len(damaged))] ^= 1 << rng.integers(8)
        write(tmp_path / "a.mcap", encoding, [*messages[:odd], bytes(damaged), *messages[odd + 1 :]])
        found, lost = samples(tmp_path / "a.mcap")
        what = f"{encoding}, message {odd}: {bytes(damaged)!r}"
        np.testing.assert_array_equal(found["/sound.x"], np.arange(MESSAGES), err_msg=what)
        assert {f"/a.{name}" for name in CHANNELS} <= set(found), what
        for channel, truth in zip(CHANNELS, values.T, strict=True):
            one = found[f"/a.{channel}"]
            np.testing.assert_array_equal(np.delete(one, odd), np.delete(truth, odd), err_msg=f"{what} {channel}")
        # What isn't there is told; but a number that JSON lacks is missing, and a list that protobuf lacks is empty.
        absent = [channel for channel in CHANNELS if np.isnan(found[f"/a.{channel}"][odd])]
        assert not absent or lost or encoding in ("json", "protobuf"), (what, absent, lost)
        # Each element is counted that the message calls otherwise.
        assert lost <= 2, what
