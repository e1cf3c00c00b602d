"""Logs of text alone, logs that a transfer spoilt, and logs with one topic that can't be decoded."""

import math
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np

from case_kinds.checks import check_rate, check_tone, check_values
from case_kinds.given import given
from case_kinds.judging import Case, Check
from case_kinds.logs import (
    HEADER,
    NS,
    START_NS,
    Entry,
    Topic,
    as_json,
    double,
    json_topic,
    plain,
    proto_class,
    proto_file,
    proto_topic,
    read_back,
    write_log,
)
from case_kinds.messages import PERIOD_NS, SAMPLES, SINE, one_topic_log
from case_kinds.product import MismatchError, Product, RefusalError, expect

# A log without numbers


def _texts(topics: dict[Topic, tuple[int, bytes]], seconds: int) -> Callable[[Path], Path]:
    """Topics of text, each with a rate (Hz) and one message again and again."""

    def write(folder: Path) -> Path:
        entries = [
            Entry(topic, START_NS + index * NS // rate, data)
            for topic, (rate, data) in topics.items()
            for index in range(rate * seconds)
        ]
        path = write_log(folder / "text.mcap", sorted(entries, key=lambda entry: entry.log_ns))
        assert len(read_back(path)) == len(entries)
        return path

    return write


def _check_text(seconds: float, **messages: int) -> Check:
    def check(product: Product, path: Path) -> None:
        document = product.info(path)
        expect(
            abs(document["duration_s"] - seconds) <= 0.3, f"duration {document['duration_s']:g} s, not {seconds:g}"
        )
        # A topic may be listed as such; a channel of numbers there is none.
        numbers = [each["name"] for each in document["channels"] if each["name"].lstrip("/") not in messages]
        expect(not numbers, f"channels {', '.join(numbers)} of text")
        for topic, number in messages.items():
            product.told(rf"/{topic}\b", rf"\b{number}\b")
        product.told(r"no (\w+ )?number|numeric|only text|text alone|nothing to (analyse|measure)")

    return check


def log_without_numbers() -> list[Case]:
    """A log that holds text alone."""
    kind = "log_without_numbers"
    chatter = Topic("/chatter", "std_msgs/msg/String", b"string data\n")
    hello = b"\0\1\0\0\6\0\0\0hello\0"
    state = json_topic("/state", {"mode": {"type": "string"}})
    empty = Topic("/trigger", "std_msgs/msg/Empty", b"")
    descriptors = proto_file("note.proto", [("Note", [("text", 1, "string", "implicit")])], "proto3")
    note = proto_class(descriptors, "Note")(text="calibrated").SerializeToString()
    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("strings", given(kind, "strings.mcap"), _check_text(2, chatter=200)),
            ("two_topics", _texts({chatter: (50, hello), state: (4, as_json(mode="run"))}, 5),
             _check_text(5, chatter=250, state=20)),
            ("json_without_schema", _texts({json_topic("/said", None): (20, as_json(said="go"))}, 10),
             _check_text(10, said=200)),
            ("empty_messages", _texts({empty: (10, b"\0\1\0\0\0")}, 3), _check_text(3, trigger=30)),
            ("protobuf_text", _texts({proto_topic("/notes", "Note", descriptors): (25, note)}, 4),
             _check_text(4, notes=100)),
        )
    ]  # fmt: skip


# MCAP through a text-mode transfer


SPOILT_WORDS = ("text-mode", "text mode", "autocrlf", "as text", "utf-8", "line end")


def _spoilt(change: Callable[[bytes], bytes]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = one_topic_log(folder, plain(), (double(value) for value in SINE))
        path.write_bytes(change(path.read_bytes()))
        return path

    return write


def _check_spoilt(product: Product, path: Path) -> None:
    try:
        product.info(path)
    except RefusalError as refusal:
        if not any(word in str(refusal).lower() for word in SPOILT_WORDS):
            raise RefusalError(f"not said that a transfer changed it: {refusal}") from None
        return
    raise MismatchError("read as if nothing had happened")


def mcap_through_text_mode() -> list[Case]:
    """Line ends, or bytes above 127, were changed on the way."""
    kind = "mcap_through_text_mode"
    return [
        Case(kind=kind, name=name, write=write, check=_check_spoilt)
        for name, write in (
            ("lf", given(kind, "lf.mcap")),
            ("lf_to_crlf", _spoilt(lambda data: data.replace(b"\n", b"\r\n"))),
            ("crlf_to_lf_and_lone_cr_kept", _spoilt(lambda data: data.replace(b"\r\n", b"\n"))),
            ("cr_alone", _spoilt(lambda data: data.replace(b"\r\n", b"\r").replace(b"\n", b"\r"))),
            ("seven_bits", _spoilt(lambda data: bytes(byte & 0x7F for byte in data))),
            ("latin1_as_utf8", _spoilt(lambda data: data.decode("latin-1").encode())),
            ("replaced_by_utf8", _spoilt(lambda data: data.decode(errors="replace").encode())),
        )
    ]


# One topic spoils the log


def _beside(other: Topic, data_of: Callable[[int], bytes]) -> Callable[[Path], Path]:
    """Write a plain topic /good with a sine of 13 Hz, and another."""

    def write(folder: Path) -> Path:
        entries = []
        for index in range(SAMPLES):
            stamp = START_NS + index * PERIOD_NS
            entries.append(Entry(plain("/good"), stamp, double(math.sin(2 * math.pi * 13 * index / 100))))
            entries.append(Entry(other, stamp, data_of(index)))
        path = write_log(folder / "beside.mcap", entries)
        assert len(read_back(path)) == 2 * SAMPLES
        return path

    return write


def _check_good(other: str, hz: float = 13.0, truth: np.ndarray | None = None) -> Check:
    def check(product: Product, path: Path) -> None:
        document = product.info(path)
        names = [entry["name"] for entry in document["channels"]]
        expect(any(name.startswith("/good") for name in names), f"/good isn't among {', '.join(names) or 'none'}")
        check_rate(product, path, "/good.x", 100, samples=SAMPLES)
        # Of two seconds the lines chosen by themselves are too far apart for a slow tone, as psd says.
        check_tone(product, path, "/good.x", hz, "--channel", "/good.x", "--resolution", "1")
        product.ask("psd", path)
        decoded = [name for name in names if name.startswith(other) and name != other]
        if decoded and truth is not None:
            check_values(product, path, decoded[0], truth)
        elif decoded:
            raise MismatchError(f"{', '.join(decoded)} is listed, but can't be decoded")
        else:
            product.told(re_quoted(other))

    return check


def re_quoted(text: str) -> str:
    """Give a pattern of a topic's name."""
    return rf"{text}\b"


def one_topic_spoils_the_log() -> list[Case]:
    """One topic can't be decoded; the other can."""
    kind = "one_topic_spoils_the_log"
    nested = f"std_msgs/Header header\nn/Inner inner\n{HEADER}{'=' * 80}\nMSG: n/Inner\nwstring w\nfloat32[] v\n"
    orphan = Topic("/orphan", "p/msg/O", b"q/Missing m\nfloat64 x\n")
    broken = Topic(
        "/broken", "B", b'{"type": "object", "properties": ', schema_encoding="jsonschema", encoding="json"
    )
    proto = Topic("/proto", "t.Gone", b"\x0a\xff\xff\xff\x7f", schema_encoding="protobuf", encoding="protobuf")
    packed = Topic("/packed", "", b"", schema_encoding="", encoding="msgpack")
    flat = Topic("/flat", "F", b"\0\0\0\0BFBS", schema_encoding="flatbuffer", encoding="flatbuffer")
    long = Topic("/long", "m::D", b"module m { struct D { long double d; wchar c; }; };", schema_encoding="omgidl")
    mutable = Topic("/mutable", "p/msg/M", b"bool b\nfloat64 x\n")

    def inner(_: int) -> bytes:
        header = struct.pack("<iII2s", 1_700_000_000, 0, 2, b"f\0")
        return (
            b"\0\1\0\0" + header + b"\0\0" + struct.pack("<I3H", 3, 97, 98, 99) + b"\0\0" + struct.pack("<If", 1, 1)
        )

    def mutable_cdr2(index: int) -> bytes:
        body = struct.pack("<IB3xId", 0x00000000, 1, 0x30000001, SINE[index])
        return b"\0\x0b\0\0" + struct.pack("<I", len(body)) + body

    # A bool in four bytes, then a double that XCDR2 aligns to four.
    xcdr2 = _check_good("/x2", 30 / (2 * math.pi), SINE)
    return [
        Case(kind=kind, name=name, write=write, check=check)
        for name, write, check in (
            ("wstring_topic", given(kind, "wstring_topic.mcap"), _check_good("/label", 30 / (2 * math.pi), SINE)),
            ("xcdr2_topic", given(kind, "xcdr2_topic.mcap"), xcdr2),
            ("wstring_in_an_inner_type",
             _beside(Topic("/deep", "n/Outer", nested.encode()), inner),
             _check_good("/deep", truth=np.ones(SAMPLES))),
            ("type_without_definition", _beside(orphan, lambda i: double(SINE[i])), _check_good("/orphan")),
            ("broken_json_schema",
             _beside(broken, lambda i: as_json(x=float(SINE[i]))), _check_good("/broken", truth=SINE)),
            ("broken_descriptor", _beside(proto, lambda _: b"\x09" + bytes(8)), _check_good("/proto")),
            ("msgpack_without_schema", _beside(packed, lambda _: b"\x81\xa1x\x01"), _check_good("/packed")),
            ("flatbuffer_of_nothing", _beside(flat, lambda _: bytes(12)), _check_good("/flat")),
            ("long_double_in_idl", _beside(long, lambda _: b"\0\1\0\0" + bytes(18)), _check_good("/long")),
            ("mutable_xcdr2", _beside(mutable, mutable_cdr2), _check_good("/mutable", truth=SINE)),
        )
    ]  # fmt: skip


def cases() -> list[Case]:
    """Every case about text alone, spoilt logs and spoiling topics."""
    return [*log_without_numbers(), *mcap_through_text_mode(), *one_topic_spoils_the_log()]
