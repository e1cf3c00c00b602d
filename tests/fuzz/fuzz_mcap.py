"""Damaged MCAP logs, for the container reader: ``python tests/fuzz/fuzz_mcap.py --inputs 20000 --seed 1``.

Small logs of every kind (zstd, lz4, plain; chunked or not; with and without index, summary, checksums)
are flipped, cut, spliced, zeroed, repeated and given absurd lengths. Allowed outcomes are a `LogError`,
or messages and damage after these rules:

1. A log whose chunks carry checksums never yields a message that was not recorded. One exception is told
   as such: the start of a chunk that is cut off, whose checksum covers what is missing too.
2. A log under one checksum over all data may yield a wrong message, but not without damage.
3. A log without any checksum can't tell a wrong payload from a right one; there the reader only has to
   end, within its memory.
4. Messages that are missing, or there twice, are not passed over in silence (logs of kind 3 excepted,
   unless their statistics count messages).
"""

import io
import random
import struct
import sys
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import zstandard
from damage import BYTES, Damage, flip, overwrite, splice, zero, zeros
from harness import REFUSED, TOLD, WHOLE, BrokenRuleError, Case, Format, generator, main
from mcap.writer import CompressionType, IndexType, Writer
from samples import log_command, read_log

from chladni.io.mcap.container import McapContainer
from chladni.signals.errors import LogError

START_NS = 1_700_000_000_000_000_000
UNCHECKED = "the checksum could not be checked"

Message = tuple[int, int, bytes]


@dataclass(frozen=True, slots=True, kw_only=True)
class Seed:
    """A sound log and what it holds. ``protection`` is the kind of checksum: chunks, data or none."""

    name: str
    content: bytes
    messages: Counter[Message]
    protection: str
    has_statistics: bool


def write_seed(name: str, rng: random.Random, protection: str, **settings: object) -> Seed:
    """Write a log of three channels: one even, one of changing length, one rare."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=1500, **settings)
    writer.start("ros2", "fuzz")
    messages: Counter[Message] = Counter()
    for number, topic in enumerate(("/imu", "/json", "/rare"), start=1):
        schema = writer.register_schema(f"schema{number}", "ros2msg", b"float64 x\n" * number)
        writer.register_channel(topic, "cdr", schema, {"key": "value"})
    writer.add_metadata("about", {"machine": "press"})
    for step in range(60):
        time_ns = START_NS + step * 1_000_000
        lengths = {1: 48, 2: rng.randrange(60)} | ({3: 400} if step % 20 == 5 else {})
        for channel_id, length in lengths.items():
            payload = bytes([channel_id, step]) + rng.randbytes(length // 2) + bytes(length // 2)
            writer.add_message(channel_id, time_ns, payload, time_ns, step)
            messages[channel_id, time_ns, payload] += 1
    writer.add_attachment(START_NS, START_NS, "note.txt", "text/plain", b"attached " * 20)
    writer.finish()
    return Seed(
        name=name,
        content=stream.getvalue(),
        messages=messages,
        protection=protection,
        has_statistics=bool(settings.get("use_statistics", True)),
    )


@cache
def seeds() -> list[Seed]:
    """Write one log of each kind."""
    rng = generator("mcap")
    bare = {
        "index_types": IndexType.NONE,
        "use_statistics": False,
        "repeat_channels": False,
        "repeat_schemas": False,
        "use_summary_offsets": False,
    }
    found = []
    for compression in CompressionType:
        name = compression.name.lower()
        found += [
            write_seed(name, rng, "chunks", compression=compression),
            write_seed(f"{name}-no-summary", rng, "chunks", compression=compression, **bare),
            write_seed(
                f"{name}-no-message-index", rng, "chunks", compression=compression, index_types=IndexType.CHUNK
            ),
            write_seed(
                f"{name}-no-chunk-index", rng, "chunks", compression=compression, index_types=IndexType.MESSAGE
            ),
            write_seed(f"{name}-no-crc", rng, "none", compression=compression, enable_crcs=False),
        ]
    found += [
        write_seed("unchunked-data-crc", rng, "data", use_chunking=False, enable_data_crcs=True),
        write_seed("unchunked-no-crc", rng, "none", use_chunking=False, enable_crcs=False),
        write_seed("unchunked-no-summary", rng, "none", use_chunking=False, enable_crcs=False, **bare),
    ]
    # A recording that was killed has no end at all.
    for seed in found[:15:5]:
        end = seed.content.rfind(b"\x0f" + struct.pack("<Q", 4))
        found.append(
            Seed(
                name=f"{seed.name}-killed",
                content=seed.content[:end],
                messages=seed.messages,
                protection="chunks",
                has_statistics=False,
            )
        )
    return found


# ---------------------------------------------------------------- damage


def record_starts(content: bytes | bytearray) -> list[int]:
    """Return where the top-level records of a sound log start."""
    found, position = [], 8
    while position + 9 <= len(content) - 8:
        found.append(position)
        position += 9 + struct.unpack_from("<Q", content, position + 1)[0]
    return found


def huge_length(content: bytearray, rng: random.Random) -> None:
    at = rng.choice(record_starts(content)) + 1 if rng.random() < 0.7 else rng.randrange(len(content))
    value = rng.choice((1 << 60, (1 << 64) - 1, 1 << 63, 1 << 31, len(content), 0, 1, rng.randrange(4000)))
    content[at : at + 8] = struct.pack("<Q", value)


def opcode(content: bytearray, rng: random.Random) -> None:
    content[rng.choice(record_starts(content))] = rng.choice((0, *range(1, 17), 0x80, 0xFF))


MUTATIONS: tuple[Damage, ...] = (*BYTES, huge_length, huge_length, opcode)


def mutate(seed: Seed, rng: random.Random) -> tuple[bytes, list[str]]:
    """Damage a log in one to three ways; structured damage comes first, as long as there is structure."""
    chosen = rng.choices(MUTATIONS, k=rng.choice((1, 1, 1, 2, 3)))
    chosen.sort(key=lambda one: one not in (huge_length, opcode))
    content = bytearray(seed.content)
    done = []
    for mutation in chosen:
        if len(content) > 100:
            mutation(content, rng)
            done.append(mutation.__name__)
    return bytes(content), done


def forge(seed: Seed, rng: random.Random) -> tuple[bytes, list[str]]:
    """Spoil the inside of an uncompressed chunk and renew its checksum, as a faulty writer would."""
    content = bytearray(seed.content)
    chunks = [start for start in record_starts(content) if content[start] == 6]
    start = rng.choice(chunks)
    length = struct.unpack_from("<Q", content, start + 1)[0]
    inside = bytearray(content[start + 49 : start + 9 + length])
    rng.choice((flip, zero, splice, huge_length, overwrite))(inside, rng)
    inside = inside[: length - 40].ljust(length - 40, b"\0")
    content[start + 49 : start + 9 + length] = inside
    content[start + 33 : start + 37] = struct.pack("<I", zlib.crc32(inside))
    return bytes(content), ["forge"]


@cache
def bomb(megabytes: int, announced: int) -> bytes:
    """Write a log of one chunk that holds many zeros, and announces so many bytes."""
    packed = zeros(megabytes << 20, zstandard.ZstdCompressor().compressobj())
    chunk = (
        struct.pack("<QQQII", START_NS, START_NS, announced, 0, 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    )
    header = b"\x01" + struct.pack("<QII", 8, 0, 0)
    return b"\x89MCAP0\r\n" + header + b"\x06" + struct.pack("<Q", len(chunk)) + chunk


# ---------------------------------------------------------------- the rules


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What reading one input gave."""

    messages: Counter[Message]
    damage: tuple[str, ...]


def messages_of(log: McapContainer, channel_ids: set[int]) -> Iterator[Message]:
    """Take every message out of its batch."""
    for batch in log.batches(channel_ids):
        data = batch.buffer.tobytes()
        columns = zip(batch.log_time_ns.tolist(), batch.offsets.tolist(), batch.lengths.tolist(), strict=True)
        for log_time, offset, length in columns:
            yield batch.channel_id, log_time, data[offset : offset + length]


def read_all(path: Path, rng: random.Random) -> Outcome:
    """Read a log, sometimes with a second read of one channel."""
    with McapContainer.open(path) as log:
        messages = Counter(messages_of(log, set(log.channels)))
        if rng.random() < 0.2 and log.channels:
            one = rng.choice(sorted(log.channels))
            alone = Counter(messages_of(log, {one}))
            expected = Counter({key: count for key, count in messages.items() if key[0] == one})
            if alone != expected and not log.damage:
                raise BrokenRuleError("one channel alone", f"{one} differs from the same channel among all")
        return Outcome(messages=messages, damage=tuple(damage.what for damage in log.damage))


def broken_rule(seed: Seed, outcome: Outcome, mutations: list[str]) -> tuple[str, str] | None:
    """Return which rule the outcome breaks, None when it breaks none."""
    wrong = [message for message in outcome.messages if message not in seed.messages]
    excused = any(UNCHECKED in what for what in outcome.damage) and mutations != ["cut"]
    if wrong and seed.protection == "chunks" and not excused:
        return "a wrong message under a chunk's checksum", str(wrong[0])
    if wrong and seed.protection == "data" and not outcome.damage:
        return "a wrong message without a word", str(wrong[0])
    unprotected = seed.protection == "none"
    differs = outcome.messages != seed.messages
    if unprotected:
        differs = seed.has_statistics and outcome.messages.total() < seed.messages.total()
    if differs and not outcome.damage:
        return "messages lost without a word", f"{outcome.messages.total()} instead of {seed.messages.total()}"
    return None


def make(rng: random.Random) -> Case:
    """Damage a log, or the inside of one of its chunks."""
    if rng.random() < 0.002:
        megabytes = rng.choice((300, 600, 1000))
        announced = rng.choice((megabytes << 20, 1000, 1 << 40))
        how = f"{megabytes} MB of zeros, {announced} announced"
        return Case(files={"a.mcap": bomb(megabytes, announced)}, how=how, truth=(None, ["forge"], 0))
    forged = rng.random() < 0.05
    plain = [seed for seed in seeds() if seed.name.startswith("none") and seed.protection == "chunks"]
    seed = rng.choice(plain if forged else seeds())
    content, mutations = (forge if forged else mutate)(seed, rng)
    how = f"{seed.name}: {', '.join(mutations)}"
    return Case(files={"a.mcap": content}, how=how, truth=(seed, mutations, rng.getrandbits(32)))


def read(path: Path, case: Case) -> str:
    """Read a log by its container, and now and then as the commands do."""
    seed, mutations, number = case.truth
    rng = generator(number)
    try:
        outcome = read_all(path, rng)
    except LogError as error:
        if "\n" in str(error) or str(path) not in str(error):
            raise BrokenRuleError("not one line that names the file", str(error)) from error
        return REFUSED
    if mutations != ["forge"] and (problem := broken_rule(seed, outcome, mutations)):
        raise BrokenRuleError(*problem)
    if rng.random() < 0.2:
        read_log(path, {})
    return TOLD if outcome.damage else WHOLE


FORMAT = Format(name="mcap", make=make, read=read, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["mcap"]))
