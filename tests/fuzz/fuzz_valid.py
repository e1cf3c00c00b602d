"""Sound logs as odd as they are allowed to be: ``python tests/fuzz/fuzz_valid.py --inputs 3000 --seed 1``.

Topics of random definitions (structures in arrays in structures, arrays of every kind), in ROS 2 CDR, JSON and
protobuf; several MCAP channels a topic, messages stored out of order, chunks of any size, compressed or not. What a
channel's name says of each message is looked up in the message as it was written, and must be what is read, at its
time.
"""

import io
import json
import random
import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from harness import TOLD, WHOLE, BrokenRuleError, Case, Format, main
from mcap.writer import CompressionType, IndexType, Writer
from mcap_ros2._dynamic import serialize_dynamic
from samples import START_NS, log_command, read_log

COUNT = 40
STEP_NS = 10_000_000
NUMBERS = ("float64", "float32", "int32", "int16", "uint16", "int64")
OF_PROTOBUF = {"float64": 1, "float32": 2, "int32": 17, "int16": 5, "uint16": 13, "int64": 18}


@dataclass(frozen=True, slots=True, kw_only=True)
class Member:
    """A field of a message: a number or a structure, alone (-1), or so many of them; 0 is told by each message."""

    name: str
    kind: "str | tuple[Member, ...]"
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Topic:
    """Messages of one topic: their times and what they hold."""

    name: str
    times_ns: tuple[int, ...]
    messages: tuple[dict[str, Any], ...]


def structure(rng: random.Random, depth: int = 0) -> tuple[Member, ...]:
    """Draw a definition."""
    members = []
    for number in range(rng.randrange(1, 4)):
        inner = depth < 3 and rng.random() < 0.45
        members.append(
            Member(
                name=f"{'abcd'[depth]}{number}",
                kind=structure(rng, depth + 1) if inner else rng.choice(NUMBERS),
                count=rng.choice((-1, -1, 0, 2, 3)),
            )
        )
    return tuple(members)


def values_of(members: tuple[Member, ...], rng: random.Random, lengths: dict[int, int]) -> dict[str, Any]:
    """Draw a message; arrays without a fixed length keep theirs over all messages."""

    def one(member: Member) -> Any:
        if isinstance(member.kind, tuple):
            return values_of(member.kind, rng, lengths)
        if member.kind.startswith("float"):
            value = rng.gauss(0, 1)
            return float(np.float32(value)) if member.kind == "float32" else value
        return rng.randrange(0, 100)

    message = {}
    for member in members:
        count = member.count or lengths.setdefault(id(member), rng.choice((1, 2, 5)))
        message[member.name] = one(member) if count < 0 else [one(member) for _ in range(count)]
    return message


def ros2(members: tuple[Member, ...]) -> str:
    """Write a definition as message text."""
    texts: list[str] = []

    def body(one: tuple[Member, ...], name: str) -> None:
        lines = []
        for member in one:
            kind = member.kind
            if isinstance(kind, tuple):
                inner = f"T{len(texts)}{member.name}"
                texts.append("")
                body(kind, inner)
                kind = f"demo/{inner}"
            ending = "" if member.count < 0 else f"[{member.count or ''}]"
            lines.append(f"{kind}{ending} {member.name}")
        text = "\n".join(lines) + "\n"
        texts.append(text if not name else f"{'=' * 80}\nMSG: demo/{name}\n{text}")

    body(members, "")
    return texts[-1] + "".join(texts[:-1])


def encoder(kind: str, members: tuple[Member, ...]) -> tuple[tuple[str, str, bytes] | None, Callable[[Any], bytes]]:
    """Give the schema of an encoding, and what encodes a message."""
    if kind == "json":
        return None, lambda message: json.dumps(message).encode()
    if kind == "cdr":
        text = ros2(members)
        return ("demo/msg/S", "ros2msg", text.encode()), serialize_dynamic("demo/msg/S", text)["demo/msg/S"]
    file = descriptor_pb2.FileDescriptorProto(name="s.proto", package="demo", syntax="proto3")

    def add(one: tuple[Member, ...], name: str) -> None:
        message = file.message_type.add(name=name)
        for number, member in enumerate(one, start=1):
            label = 1 if member.count < 0 else 3
            if isinstance(member.kind, tuple):
                add(member.kind, name + member.name)
                message.field.add(
                    name=member.name, number=number, type=11, type_name=f".demo.{name}{member.name}", label=label
                )
            else:
                message.field.add(name=member.name, number=number, type=OF_PROTOBUF[member.kind], label=label)

    add(members, "S")
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    maker = message_factory.GetMessageClass(pool.FindMessageTypeByName("demo.S"))
    schema = descriptor_pb2.FileDescriptorSet(file=[file]).SerializeToString()
    return ("demo.S", "protobuf", schema), lambda message: maker(**message).SerializeToString()


def make(rng: random.Random) -> Case:
    """Write a log of one to three topics."""
    stream = io.BytesIO()
    writer = Writer(
        stream,
        compression=rng.choice(list(CompressionType)),
        chunk_size=rng.choice((200, 2000, 10**6)),
        use_chunking=rng.random() < 0.8,
        index_types=rng.choice((IndexType.ALL, IndexType.NONE, IndexType.MESSAGE, IndexType.CHUNK)),
    )
    writer.start()
    topics, rows, hows = [], [], []
    for number in range(rng.choice((1, 1, 2, 3))):
        kind, members, lengths = rng.choice(("cdr", "json", "protobuf")), structure(rng), dict[int, int]()
        schema, encode = encoder(kind, members)
        name, publishers = f"/t{number}", rng.choice((1, 1, 1, 2))
        # A channel is registered, and given its number, whenever a program connects.
        channels = [
            writer.register_channel(
                name, kind, 0 if schema is None else writer.register_schema(*schema), {"publisher": str(one)}
            )
            for one in range(publishers)
        ]
        times = tuple(START_NS + row * STEP_NS for row in range(COUNT))
        topic = Topic(name=name, times_ns=times, messages=tuple(values_of(members, rng, lengths) for _ in times))
        topics.append(topic)
        taking_turns = rng.random() < 0.5
        for row, message in enumerate(topic.messages):
            which = row % publishers if taking_turns else row * publishers // COUNT
            rows.append((times[row], channels[which], encode(message), row))
        hows.append(f"{kind} of {publishers}")
    rows.sort(key=lambda row: row[0])
    disorder = rng.choice((0, 0, 1, 5))
    for _ in range(disorder):
        # Recorders store what comes late behind what is later.
        rows.insert(rng.randrange(len(rows)), rows.pop(rng.randrange(len(rows))))
    for time_ns, channel, payload, row in rows:
        writer.add_message(channel, time_ns, payload, time_ns, row)
    writer.finish()
    how = f"{', '.join(hows)}; {disorder} out of order"
    return Case(files={"a.mcap": stream.getvalue()}, how=how, truth=tuple(topics))


def looked_up(message: Any, path: str) -> float:
    """Give what a path such as ``.a[1].b`` names in a message."""
    for name, index in re.findall(r"\.(\w+)|\[(\d+)\]", path):
        message = message[name] if name else message[int(index)]
    if isinstance(message, dict | list):
        raise BrokenRuleError("a name of no number", path)
    return float(message)


def read(path: Path, case: Case) -> str:
    """Hold every channel against the messages, and see whether every number is a channel."""
    reading = read_log(path, {})
    for name, (times_ns, values) in reading.samples.items():
        topic = next(one for one in case.truth if name.startswith(one.name))
        field = re.sub(r"\{@channel==\d+\}", "", name.removeprefix(topic.name))
        truth = np.array([looked_up(message, field) for message in topic.messages])
        row = np.rint((times_ns - START_NS) / STEP_NS).astype(int)
        if (
            len(row) == 0
            or row.min() < 0
            or row.max() >= COUNT
            or np.abs(times_ns - START_NS - row * STEP_NS).max() > STEP_NS / 10
        ):
            raise BrokenRuleError("a wrong time", f"{name}: {len(row)} samples, rows {row[:5]}")
        if not np.array_equal(values, truth[row]):
            raise BrokenRuleError("a wrong sample", f"{name}: {values[:4]} instead of {truth[row][:4]}")
        if field == name.removeprefix(topic.name) and len(values) != COUNT:
            raise BrokenRuleError("a lost sample", f"{name}: {len(values)} of {COUNT}")
    listed = {re.sub(r"\{@channel==\d+\}", "", name) for name in reading.samples}
    missing = [leaf for topic in case.truth for leaf in leaves(topic) if leaf not in listed]
    if missing and not any("listed" in one for one in reading.said):
        raise BrokenRuleError("a lost channel", ", ".join(missing[:5]))
    return TOLD if reading.said else WHOLE


def leaves(topic: Topic) -> Iterator[str]:
    """Give the names of all numbers of a topic."""

    def inside(value: Any, name: str) -> Iterator[str]:
        if isinstance(value, dict):
            for key, one in value.items():
                yield from inside(one, f"{name}.{key}")
        elif isinstance(value, list):
            for index, one in enumerate(value):
                yield from inside(one, f"{name}[{index}]")
        else:
            yield name

    yield from inside(topic.messages[0], topic.name)


FORMAT = Format(name="valid", make=make, read=read, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["valid"]))
