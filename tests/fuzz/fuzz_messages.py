"""Damaged and odd messages in sound MCAP logs: ``python tests/fuzz/fuzz_messages.py --inputs 20000 --seed 1``.

ROS 2 (CDR, by message text and by IDL), ROS 1, JSON with and without schema, protobuf. A log holds a topic each of
two kinds. Of the first some messages, or the definition, are damaged before they're stored, as by a faulty program.
The rules:

1. The second topic is read to the last sample, whatever became of the first.
2. Messages that weren't damaged are read, unless something is said. A damaged one may hold any number, and any time.
"""

import io
import json
import random
import struct
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from damage import BYTES, ODD_TEXTS, TEXTS, Damage, cut, damaged, huge_number, odd_json
from google.protobuf import descriptor_pb2, timestamp_pb2
from harness import BrokenRuleError, Case, Format, main
from mcap.writer import CompressionType, Writer
from mcap_ros2._dynamic import serialize_dynamic
from samples import START_NS, Truth, check_log, log_command, proven

from chladni.signals.errors import ChladniError
from tests.make_logs import JOINT_STATE, SAMPLE_BLOCK

COUNT = 50
STEP_NS = 10_000_000
BLOCK = 4
FLAT = "std_msgs/Header header\nfloat64 x  # [N]\nfloat32 y\nfloat64[3] v\nPart part\n"
PART = "int16 small\nfloat64[] many\n"
HEADER = JOINT_STATE[JOINT_STATE.index("=") :]
ROS2 = f"{FLAT}{HEADER}{'=' * 80}\nMSG: demo/Part\n{PART}"
ROS1 = ROS2.replace("builtin_interfaces/Time stamp", "uint32 seq\ntime stamp").replace(
    f"{'=' * 80}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n", ""
)
IDL = """module std_msgs { module msg { struct Header { builtin_interfaces::msg::Time stamp; string frame_id; }; }; };
module builtin_interfaces { module msg { struct Time { int32 sec; uint32 nanosec; }; }; };
module demo { module msg {
  struct Part { short small; sequence<double> many; };
  struct Flat {
    std_msgs::msg::Header header; @unit(value="N") double x; float y; double v[3]; demo::msg::Part part;
  };
}; };
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Kind:
    """Messages of one kind, and what they hold.

    Attributes
    ----------
    encoding, schema
        Of the messages, and (name, encoding, text) of the schema, None without.
    payloads
        The messages.
    channels
        ``[sample]`` by the part of the name behind the topic.
    damages
        Ways to damage a message, and its schema.
    """

    name: str
    encoding: str
    schema: tuple[str, str, bytes] | None
    payloads: tuple[bytes, ...]
    channels: dict[str, np.ndarray[Any, Any]]
    damages: tuple[Sequence[Damage], Sequence[Damage]]

    @property
    def per_message(self) -> int:
        """Samples of a message."""
        return len(next(iter(self.channels.values()))) // COUNT


def kinds_of(rng: np.random.Generator) -> list[Kind]:
    """Write messages of every kind, their stamps 10 ms apart."""
    stamps = [START_NS + number * STEP_NS for number in range(COUNT)]
    x, v = rng.normal(size=COUNT), rng.normal(size=(COUNT, 3))
    y, many = rng.normal(size=COUNT).astype(np.float32), rng.normal(size=(COUNT, 2))
    small = rng.integers(-99, 99, COUNT)
    flat = {".x": x, ".y": y.astype(float), ".part.small": small.astype(float)}
    flat |= {f".v[{column}]": v[:, column] for column in range(3)}
    flat |= {f".part.many[{column}]": many[:, column] for column in range(2)}
    stamped = [{"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "abc"} for stamp in stamps]
    messages = [
        {"header": head, "x": x[i], "y": float(y[i]), "v": v[i].tolist(),
         "part": {"small": int(small[i]), "many": many[i].tolist()}}
        for i, head in enumerate(stamped)
    ]  # fmt: skip
    encode = serialize_dynamic("demo/msg/Flat", ROS2)["demo/msg/Flat"]
    cdr = tuple(map(encode, messages))
    in_json = (*TEXTS, *[odd_json] * 6)
    binary, text = ((*BYTES, huge_number, huge_number, cut), TEXTS), (in_json, in_json)
    ros1 = tuple(
        struct.pack("<IIII3s", i, stamp // 10**9, stamp % 10**9, 3, b"abc")
        + struct.pack("<df3dhI2d", x[i], y[i], *v[i], small[i], 2, *many[i])
        for i, stamp in enumerate(stamps)
    )
    schema = {"type": "object", "properties": {"header": {"type": "object"}, "x": {"type": "number"}}}
    raw = tuple(json.dumps(message).encode() for message in messages)
    joints = {f".position[{i}]": many[:, i] for i in range(2)}
    joint = serialize_dynamic("sensor_msgs/msg/JointState", JOINT_STATE)["sensor_msgs/msg/JointState"]
    block = serialize_dynamic("demo/msg/Block", SAMPLE_BLOCK)["demo/msg/Block"]
    samples = rng.normal(size=(2, COUNT * BLOCK)).astype(np.float32)
    parts = [samples[:, BLOCK * i : BLOCK * (i + 1)].ravel().tolist() for i in range(COUNT)]
    return [
        Kind(name="ros2msg", encoding="cdr", schema=("demo/msg/Flat", "ros2msg", ROS2.encode()), payloads=cdr,
             channels=flat, damages=binary),
        Kind(name="ros2idl", encoding="cdr", schema=("demo/msg/Flat", "ros2idl", IDL.encode()), payloads=cdr,
             channels=flat, damages=binary),
        Kind(name="ros1msg", encoding="ros1", schema=("demo/Flat", "ros1msg", ROS1.encode()), payloads=ros1,
             channels=flat, damages=binary),
        Kind(name="json", encoding="json", schema=None, payloads=raw, channels=flat, damages=text),
        Kind(name="json schema", encoding="json", schema=("flat", "jsonschema", json.dumps(schema).encode()),
             payloads=raw, channels=flat, damages=text),
        Kind(name="protobuf", encoding="protobuf", schema=("demo.Flat", "protobuf", proto_schema()),
             payloads=tuple(proto_payload(m, stamps[i]) for i, m in enumerate(messages)), channels=flat,
             damages=(BYTES, BYTES)),
        Kind(name="joints", encoding="cdr", schema=("sensor_msgs/msg/JointState", "ros2msg", JOINT_STATE.encode()),
             payloads=tuple(joint({"header": stamped[i], "name": ["elbow", "wrist"], "position": many[i].tolist(),
                                   "velocity": [], "effort": []}) for i in range(COUNT)),
             channels=joints, damages=binary),
        Kind(name="blocks", encoding="cdr", schema=("demo/msg/Block", "ros2msg", SAMPLE_BLOCK.encode()),
             payloads=tuple(block({"header": stamped[i], "sample_rate": 400.0, "channel_names": ["a", "b"],
                                   "samples": parts[i]}) for i in range(COUNT)),
             channels={".a": samples[0].astype(float), ".b": samples[1].astype(float)}, damages=binary),
    ]  # fmt: skip


def proto_schema() -> bytes:
    file = descriptor_pb2.FileDescriptorProto(
        name="flat.proto", package="demo", dependency=["google/protobuf/timestamp.proto"], syntax="proto3"
    )
    part = file.message_type.add(name="Part")
    part.field.add(name="small", number=1, type=17, label=1)
    part.field.add(name="many", number=2, type=1, label=3)
    flat = file.message_type.add(name="Flat")
    flat.field.add(name="timestamp", number=1, type=11, type_name=".google.protobuf.Timestamp", label=1)
    flat.field.add(name="x", number=2, type=1, label=1)
    flat.field.add(name="y", number=3, type=2, label=1)
    flat.field.add(name="v", number=4, type=1, label=3)
    flat.field.add(name="part", number=5, type=11, type_name=".demo.Part", label=1)
    known = descriptor_pb2.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(known)
    return descriptor_pb2.FileDescriptorSet(file=[known, file]).SerializeToString()


def proto_payload(message: dict[str, Any], stamp_ns: int) -> bytes:
    def inside(number: int, content: bytes) -> bytes:
        return bytes([number << 3 | 2, len(content)]) + content

    small = message["part"]["small"]
    zigzag = small << 1 if small >= 0 else (-small << 1) - 1
    varint = bytes([zigzag]) if zigzag < 128 else bytes([zigzag & 127 | 128, zigzag >> 7])
    stamp = timestamp_pb2.Timestamp(seconds=stamp_ns // 10**9, nanos=stamp_ns % 10**9).SerializeToString()
    part = b"\x08" + varint + inside(2, struct.pack("<2d", *message["part"]["many"]))
    return (
        inside(1, stamp) + b"\x11" + struct.pack("<d", message["x"]) + b"\x1d" + struct.pack("<f", message["y"])
        + inside(4, struct.pack("<3d", *message["v"])) + inside(5, part)
    )  # fmt: skip


def log_of(topics: Sequence[tuple[str, Kind]]) -> bytes:
    """Store messages of several topics, those of one time one after another."""
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.NONE)
    writer.start()
    channels = []
    for topic, kind in topics:
        schema = 0 if kind.schema is None else writer.register_schema(*kind.schema)
        channels.append(writer.register_channel(topic, kind.encoding, schema))
    for number in range(max(len(kind.payloads) for _, kind in topics)):
        time_ns = START_NS + number * STEP_NS + 1_000_000
        for channel, (_, kind) in zip(channels, topics, strict=True):
            if number < len(kind.payloads):
                writer.add_message(channel, time_ns, kind.payloads[number], time_ns, number)
    writer.finish()
    return stream.getvalue()


@cache
def kinds() -> list[tuple[Kind, Truth]]:
    """Give every kind with the truth of its log."""
    found = []
    for kind in kinds_of(np.random.default_rng(1)):
        truth = truth_of("/s", kind)
        found.append((kind, proven("a.mcap", log_of([("/s", kind)]), truth)))
    return found


def truth_of(topic: str, kind: Kind) -> Truth:
    return Truth(
        channels={topic + name: values for name, values in kind.channels.items()},
        rate_hz=1e9 / STEP_NS * kind.per_message,
    )


def make(rng: random.Random) -> Case:
    """Damage some messages of a topic, or its schema, beside a sound one."""
    (first, known), (second, _) = rng.choice(kinds()), rng.choice(kinds())
    sound = truth_of("/sound", second)
    intact = np.ones(COUNT, np.bool_)
    of_message, of_schema = first.damages
    what = rng.random()
    if what < 0.6:
        payloads, hows = list(first.payloads), []
        for _ in range(rng.choice((1, 1, 1, 2, 5, 40))):
            at = rng.randrange(COUNT)
            payloads[at], how = damaged(payloads[at], rng, of_message)
            intact[at] = payloads[at] == first.payloads[at]
            hows.append(f"{at} {how}")
        spoilt, how = replace(first, payloads=tuple(payloads)), ", ".join(hows[:5])
    elif what < 0.8 and first.schema is not None:
        text, how = damaged(first.schema[2], rng, of_schema)
        spoilt, known = replace(first, schema=(*first.schema[:2], text)), replace(known, channels=None)
        how = f"schema {how}"
    else:
        spoilt, how = odd_kind(rng)
        known = replace(known, channels=None)
    truth = replace(
        known,
        intact=np.repeat(intact, first.per_message),
        foreign=int((~intact).sum()) * 2 * first.per_message,
        sure=sound,
    )
    topic = "/s" if rng.random() < 0.9 else f"/s{rng.choice(ODD_TEXTS)[:99]}"
    truth = truth if topic == "/s" else replace(truth, channels=None)
    content = log_of([(topic, spoilt), ("/sound", second)])
    return Case(files={"a.mcap": content}, how=f"{spoilt.name}: {how}; beside {second.name}", truth=truth)


SIZES = ("", "[]", "[3]", "[²]", "[-1]", "[0]", "[99999999999]", "[<=3]", "[]" * 3, "[3", "[ 3 ]", "[1e3]", "[0x3]")
TYPES = ("float64", "string", "wstring", "Self", "demo/Part", "byte", "time", "duration", "string<=5", "int128")


def odd_kind(rng: random.Random) -> tuple[Kind, str]:
    """Write a definition that nobody writes, and messages that don't care for it."""
    what = rng.choice(("ros2msg", "ros1msg", "ros2idl", "jsonschema", "json", "json", "protobuf", "none"))
    if rng.random() < 0.02:
        return spread(rng)
    names = [rng.choice(("a", "b", "header", "stamp", "name", "x" * 300, *ODD_TEXTS)) for _ in range(6)]
    if what in ("ros2msg", "ros1msg"):
        lines = [f"{rng.choice(TYPES)}{rng.choice(SIZES)} {name} {rng.choice(('', '=5', '# [g]'))}" for name in names]
        lines += ["=" * 80, "MSG: demo/Self", "Self[] again", "=" * 80, "MSG: demo/Part", "Part next"][
            : rng.randrange(7)
        ]
        text = "\n".join(lines * rng.choice((1, 1, 1, 1, 100)))
    elif what == "ros2idl":
        sizes = ("", "[3]", "[²]", "[9999999999]", "[N]", "[-1]", "[2]" * 50, "[99999]" * 200, "[")
        kinds = ("double", "sequence<double>", "S", "string<²>", "sequence<" * 60 + "double" + ">" * 60, "map<a,b>")
        members = " ".join(f"{rng.choice(kinds)} {name}{rng.choice(sizes)};" for name in names)
        text = f"const long N = {rng.choice(('3', '²', '-1', '1 << 70', 'N'))}; struct S {{ {members} }};"
    elif what == "jsonschema":
        text = odd_value(rng)
    elif what == "protobuf":
        text = ""
    else:
        text = "".join(names)
    data = proto_odd(rng) if what == "protobuf" else text.encode("utf-8", "surrogatepass")
    encoding = {"ros1msg": "ros1", "jsonschema": "json", "json": "json", "protobuf": "protobuf"}.get(what, "cdr")
    schema = None if what in ("json", "none") else ("demo/msg/S" if encoding == "cdr" else "demo.S", what, data)
    if encoding == "json":
        one = odd_value(rng).encode("utf-8", "surrogatepass")
        payloads = [one if rng.random() < 0.9 else odd_value(rng).encode("utf-8", "surrogatepass") for _ in range(9)]
    else:
        payloads = [b"\0\1\0\0" + rng.randbytes(rng.choice((0, 8, 48))) for _ in range(COUNT)]
    kind = Kind(
        name=f"odd {what}", encoding=encoding, schema=schema, payloads=tuple(payloads), channels={}, damages=((), ())
    )
    return kind, f"{data[:60]!r}"


def spread(rng: random.Random) -> tuple[Kind, str]:
    """Write many fields, few messages, and hours between two of them: a grid over all has billions of places."""
    fields, hours = rng.choice((3, 60, 300)), rng.choice((0.1, 4.4, 900.0))
    numbers = {f"x{number}": 1.5 for number in range(fields)}
    stamps = [START_NS + number * STEP_NS for number in range(COUNT - 2)]
    stamps += [START_NS + round(hours * 3600e9) + number * STEP_NS for number in range(2)]
    heads = [{"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}} for stamp in stamps]
    payloads = tuple(json.dumps({"header": head, **numbers}).encode() for head in heads)
    kind = Kind(name="spread", encoding="json", schema=None, payloads=payloads, channels={}, damages=((), ()))
    return kind, f"{fields} fields, {hours} h apart"


TOKENS = (
    "1", "-0.0", "1e999", "NaN", "null", "true", '"1.5"', '"\\ud800"', "9" * 5000, "[" * 3000, "1E+2", "{}", "[]",
)  # fmt: skip


def odd_value(rng: random.Random, depth: int = 0) -> str:
    """Write JSON that is valid, or nearly so."""
    if depth > 3 or rng.random() < 0.5:
        return rng.choice(TOKENS)
    if rng.random() < 0.3:
        return "[" + ",".join(odd_value(rng, depth + 1) for _ in range(rng.choice((0, 1, 3, 70)))) + "]"
    keys = ('"a"', '"\\ud800"', '"\\u001b[31m"', '"stamp"', '"type"', '"properties"', '"$ref"', '"a.b"', '""', '"a"')
    pairs = ",".join(f"{rng.choice(keys)}:{odd_value(rng, depth + 1)}" for _ in range(rng.choice((1, 2, 5))))
    return "{" + pairs + "}"


def proto_odd(rng: random.Random) -> bytes:
    """Write descriptors of recursive messages, odd types, names and numbers."""
    file = descriptor_pb2.FileDescriptorProto(name="a.proto", package=rng.choice(("demo", "")), syntax="proto3")
    for name in ("S", "T", rng.choice(("S", "U"))):
        message = file.message_type.add(name=name)
        for number in range(rng.choice((0, 2, 9))):
            message.field.add(
                name=rng.choice(("a", "x" * 300, "\x1b[31m", "stamp", "é")),
                number=rng.choice((0, -1, 1, 2, number, 2**29)),
                type=rng.randrange(1, 19),
                type_name=rng.choice((".demo.S", ".demo.T", "S", "", "?")),
                label=rng.randrange(1, 4),
            )
    return descriptor_pb2.FileDescriptorSet(file=[file] * rng.choice((1, 1, 2))).SerializeToString()


def read(path: Path, case: Case) -> str:
    """Read a log; one bad topic must not cost the other."""
    try:
        return check_log(path, case.truth)
    except ChladniError as error:
        raise BrokenRuleError("a bad topic costs the sound one", str(error)[:300]) from error


FORMAT = Format(name="messages", make=make, read=read, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["messages"]))
