"""Reads random valid logs beside other readers: ``python tests/fuzz/differential.py --logs 3000 --seed 1``.

Each log has one to three topics of a random message type: scalars of every size, text, arrays of fixed and of
changing length, messages in messages, arrays in arrays, fields that are absent. It is written as ROS 1, ROS 2, IDL,
protobuf or JSON; chunked or not, in any compression, with and without index and summary, by one MCAP channel or
several of a topic, in order or not.

What was recorded is what `mcap` with `mcap-ros2-support`, `rosbags`, protobuf's or Python's own JSON decoder make of
the file. Every number of every message is compared with the sample at its time: equal, and missing where the message
holds none. Every path that is listed has to be one of these numbers, and no damage may be told.

Exits with 1 after the first log that differs, and keeps it.
"""

import argparse
import io
import math
import random
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from made_messages import ENCODINGS, Encoding, Record, TypeMaker, declared_paths, draw, json_text, numbers
from mcap.reader import NonSeekingReader
from mcap.writer import CompressionType, IndexType, Writer

import chladni

START_NS = 1_700_000_000_000_000_000
STEP_NS = 10_000_000
MOST_MESSAGES = 24


# Logs


@dataclass(slots=True)
class Topic:
    """A topic, how its messages are written, and by how many MCAP channels."""

    name: str
    kind: Record
    encoding: Encoding
    writers: int
    channel_ids: list[int] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class MadeLog:
    """A log in memory, its topics, and a word on how it was made."""

    content: bytes
    topics: list[Topic]
    manner: str


def make_log(rng: random.Random) -> MadeLog:
    """Write a random valid log; all topics have one rate, and each message its own time."""
    topics = []
    for number in range(rng.randint(1, 3)):
        written = rng.choice(ENCODINGS)
        kind = TypeMaker(rng, lists_in_lists=written is json_text).record()
        topics.append(Topic(f"/t{number}", kind, written(kind), rng.choice((1, 1, 2, 3))))
    settings: dict[str, Any] = {
        "compression": rng.choice(list(CompressionType)),
        "chunk_size": rng.choice((200, 1500, 1 << 20)),
        "use_chunking": rng.random() < 0.8,
        "enable_crcs": rng.random() < 0.5,
        "use_statistics": rng.random() < 0.7,
        "use_summary_offsets": rng.random() < 0.7,
        "index_types": rng.choice((IndexType.ALL, IndexType.NONE, IndexType.CHUNK)),
        "repeat_channels": rng.random() < 0.7,
        "repeat_schemas": rng.random() < 0.7,
    }
    stream = io.BytesIO()
    writer = Writer(stream, **settings)
    writer.start()
    for topic in topics:
        encoding = topic.encoding
        for _ in range(topic.writers):
            schema_id = 0
            if encoding.schema:
                schema_id = writer.register_schema(encoding.schema_name, encoding.schema_encoding, encoding.schema)
            topic.channel_ids.append(writer.register_channel(topic.name, encoding.message_encoding, schema_id))
    messages = []
    for topic in topics:
        for step in range(rng.randint(10, MOST_MESSAGES)):
            channel_id = topic.channel_ids[step % topic.writers]
            value = draw(topic.kind, rng, absent=topic.encoding.absent) | {"plain": rng.gauss(0, 1)}
            messages.append((START_NS + step * STEP_NS, step, channel_id, topic.encoding.write(value)))
    order = rng.choice(("in order", "a little late", "a topic after the other", "shuffled"))
    late = {"in order": 0.0, "a little late": 3.0 * STEP_NS, "shuffled": 1e12}
    if order in late:
        messages.sort(key=lambda message: message[0] + rng.random() * late[order])
    for time_ns, step, channel_id, data in messages:
        writer.add_message(channel_id, time_ns, data, time_ns, step)
    writer.finish()
    manner = f"{order}, {', '.join(f'{name} {value}' for name, value in settings.items())}"
    return MadeLog(stream.getvalue(), topics, manner)


# The comparison


Columns = dict[str, dict[int, float]]
"""Of each path, the number at each time."""


class DifferenceError(Exception):
    """Something read isn't what others read."""


def recorded(made: MadeLog) -> dict[str, Columns]:
    """What each topic holds, and each MCAP channel of it alone, as the other libraries read it."""
    found: dict[str, Columns] = {}
    topics = {topic.name: topic for topic in made.topics}
    for _, channel, message in NonSeekingReader(io.BytesIO(made.content)).iter_messages():
        topic = topics[channel.topic]
        first, *others = (dict(numbers(topic.kind, reader(message.data), "")) for reader in topic.encoding.read)
        if not all(_same(first, other) for other in others):
            raise DifferenceError(f"the other readers differ on {topic.name}")
        for source in (topic.name, f"{topic.name}{{@channel=={channel.id}}}"):
            columns = found.setdefault(source, {})
            for rest, value in first.items():
                columns.setdefault(source + rest, {})[message.log_time] = value
    return found


def _same(one: dict[str, float], other: dict[str, float]) -> bool:
    return one.keys() == other.keys() and all(
        value == other[path] or (math.isnan(value) and math.isnan(other[path])) for path, value in one.items()
    )


def compare(made: MadeLog, path: Path) -> int:
    """Compare all numbers of a log; gives how many."""
    path.write_bytes(made.content)
    truth = recorded(made)
    compared = 0
    with chladni.open(path) as log:
        listed = {channel.name for channel in log.channels}
        declared = {
            path
            for topic in made.topics
            for source in _all_sources(topic)
            for path in declared_paths(topic.kind, source)
        }
        if unknown := listed - declared:
            raise DifferenceError(f"listed, but of no message: {', '.join(sorted(unknown)[:5])}")
        for topic in made.topics:
            for source in _sources(topic, listed):
                columns = truth[source]
                series = log.read(list(columns))
                places = {int(time_ns): place for place, time_ns in enumerate(series.times_ns())}
                for row, channel in enumerate(series.channels):
                    compared += _compare_row(channel.name, series.values[row], places, columns[channel.name])
        if log.damage:
            raise DifferenceError(f"damage is told: {log.damage[0]}")
    return compared


def _all_sources(topic: Topic) -> list[str]:
    return [topic.name, *(f"{topic.name}{{@channel=={channel_id}}}" for channel_id in topic.channel_ids)]


def _sources(topic: Topic, listed: set[str]) -> list[str]:
    """Give the topic, where its MCAP channels are read as one; else each of them."""
    if f"{topic.name}.plain" in listed:
        return [topic.name]
    apart = _all_sources(topic)[1:]
    if missing := [source for source in apart if f"{source}.plain" not in listed]:
        raise DifferenceError(f"not listed: {', '.join(missing)}")
    return apart


def _compare_row(name: str, read: Any, places: dict[int, int], column: dict[int, float]) -> int:
    expected = np.full(len(read), np.nan)
    for time_ns, value in column.items():
        if time_ns not in places:
            raise DifferenceError(f"{name} has no sample at {(time_ns - START_NS) / 1e9} s")
        # What isn't finite is no measurement: it's missing.
        expected[places[time_ns]] = value if math.isfinite(value) else np.nan
    differs = ~((expected == read) | (np.isnan(expected) & np.isnan(read)))
    if differs.any():
        place = int(np.flatnonzero(differs)[0])
        raise DifferenceError(f"{name}: sample {place} is {read[place]!r}, recorded is {expected[place]!r}")
    return len(column)


def main() -> int:
    """Compare the logs; 1 after the first that differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=3000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first log")
    asked = parser.parse_args()
    began = time.perf_counter()
    compared, kinds = 0, Counter[str]()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(asked.first, asked.first + asked.logs):
            made = make_log(random.Random(f"{asked.seed}-{number}"))  # noqa: S311 - logs need no cryptography
            try:
                compared += compare(made, Path(folder, "log.mcap"))
            except (DifferenceError, chladni.ChladniError) as error:
                kept = Path(tempfile.gettempdir(), f"chladni-differs-{asked.seed}-{number}.mcap")
                kept.write_bytes(made.content)
                sys.stderr.write(f"log {number}: {error}\n{made.manner}\nkept as {kept}\n")
                return 1
            kinds.update(topic.encoding.schema_encoding or "json" for topic in made.topics)
    took = f"{time.perf_counter() - began:.0f} s"
    sys.stdout.write(f"{asked.logs} logs, {compared} numbers equal, {took}; topics: {dict(kinds)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
