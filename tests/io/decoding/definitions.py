"""Random message definitions with random values, serialised by rosbags: the oracle of the binary decoders."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

PRIMITIVES = {
    "bool": np.bool_, "int8": np.int8, "uint8": np.uint8, "int16": np.int16, "uint16": np.uint16, "int32": np.int32,
    "uint32": np.uint32, "int64": np.int64, "uint64": np.uint64, "float32": np.float32, "float64": np.float64,
}  # fmt: skip
SEPARATOR = "=" * 80


@dataclass(frozen=True)
class Part:
    """One field: the type as written, its name, and how to draw a value."""

    base: str
    name: str
    array: str = ""
    message: "Message | None" = None


@dataclass(frozen=True)
class Message:
    name: str
    parts: list[Part] = field(default_factory=list)

    def text(self) -> str:
        lines = [f"{part.base}{part.array} {part.name}  # a comment" for part in self.parts]
        return "\n".join(["int32 A_CONSTANT=7", *lines, ""])

    def used(self) -> Iterator["Message"]:
        for part in self.parts:
            if part.message is not None:
                yield part.message
                yield from part.message.used()


@st.composite
def messages(draw: st.DrawFn, *, ros: int, depth: int = 0, counter: list[int] | None = None) -> Message:
    """A definition; members of message type get definitions of their own."""
    counter = [0] if counter is None else counter
    counter[0] += 1
    name = f"M{counter[0]}"
    bases = [*PRIMITIVES, "string", "stamp", *(["message"] * 4 if depth < 2 else [])]
    arrays = ["", "", "[]", "[3]", *(["[<=4]"] if ros == 2 else [])]
    parts = []
    # ROS 1 gives an empty message no bytes at all, which rosbags doesn't serialise in arrays.
    for index in range(draw(st.integers(0 if ros == 2 and depth else 1, 4))):
        base, array = draw(st.sampled_from(bases)), draw(st.sampled_from(arrays))
        inner = draw(messages(ros=ros, depth=depth + 1, counter=counter)) if base == "message" else None
        written = inner.name if inner else base
        if base == "stamp":
            written = draw(st.sampled_from(["time", "duration"]))
            written = written if ros == 1 else f"builtin_interfaces/{written.capitalize()}"
        parts.append(Part(base=written, name=f"f{index}", array=array, message=inner))
    return Message(name=name, parts=parts)


@cache
def ros2_types() -> Any:
    """rosbags' types of a ROS 2 distribution; loading them takes a while."""
    return get_typestore(Stores.ROS2_JAZZY)


class Oracle:
    """rosbags' types of one definition: draws values, serialises them, and tells what each leaf must be."""

    def __init__(self, root: Message, *, ros: int) -> None:
        self.root, self.ros = root, ros
        self.store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_JAZZY)
        for message in [root, *root.used()]:
            self.store.register(get_types_from_msg(message.text(), f"demo/msg/{message.name}"))

    def schema_text(self) -> bytes:
        others = {message.name: message for message in self.root.used()}
        sections = [f"{SEPARATOR}\nMSG: demo/{name}\n{message.text()}" for name, message in others.items()]
        return "".join([self.root.text(), *sections]).encode()

    def value(self, rng: np.random.Generator, message: Message) -> Any:
        kind = self.store.types[f"demo/msg/{message.name}"]
        if not message.parts:
            return kind(**({"structure_needs_at_least_one_member": 0} if self.ros == 2 else {}))
        return kind(**{part.name: self._field(rng, part) for part in message.parts})

    def _field(self, rng: np.random.Generator, part: Part) -> Any:
        if not part.array:
            return self._one(rng, part)
        length = 3 if part.array == "[3]" else int(rng.integers(0, 4))
        if part.base in PRIMITIVES:
            return np.array([self._one(rng, part) for _ in range(length)], PRIMITIVES[part.base])
        return [self._one(rng, part) for _ in range(length)]

    def _one(self, rng: np.random.Generator, part: Part) -> Any:
        if part.message is not None:
            return self.value(rng, part.message)
        if part.base == "string":
            return str(rng.choice(["", "base_link", "é", "wrist", "aa"]))
        if part.base in PRIMITIVES:
            dtype = np.dtype(PRIMITIVES[part.base])
            if dtype.kind in "iu":
                return int(rng.integers(np.iinfo(dtype).min, np.iinfo(dtype).max, dtype=dtype, endpoint=True))
            return bool(rng.integers(2)) if dtype.kind == "b" else float(dtype.type(rng.normal()))
        kind = "Duration" if part.base.lower().endswith("duration") else "Time"
        seconds, nanoseconds = int(rng.integers(0, 2**31)), int(rng.integers(0, 10**9))
        return self.store.types[f"builtin_interfaces/msg/{kind}"](sec=seconds, nanosec=nanoseconds)

    def encode(self, value: Any, *, little_endian: bool = True) -> bytes:
        name = f"demo/msg/{self.root.name}"
        if self.ros == 1:
            return bytes(self.store.serialize_ros1(value, name))
        return bytes(self.store.serialize_cdr(value, name, little_endian=little_endian))


def leaf_of(value: Any, path: str) -> Any:
    """What a decoder must give for a path: a scalar, or all elements in one flat list."""
    return _flat(_reached(value, path.split(".") if path else []))


def _reached(value: Any, names: Sequence[str]) -> Any:
    if not names:
        return value
    name, *below = names
    found = getattr(value, name.removesuffix("[]"))
    return [_reached(one, below) for one in found] if name.endswith("[]") else _reached(found, below)


def _flat(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list):
        return [one for element in value for one in _as_list(_flat(element))]
    if hasattr(value, "nanosec"):
        return value.sec * 1_000_000_000 + value.nanosec
    return value


def _as_list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]
