"""Builds MCAP logs byte by byte, wrong ones too, independent of the reader under test."""

import io
import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import lz4.frame
import zstandard
from mcap.reader import NonSeekingReader
from mcap.writer import Writer

from chladni.io.mcap.container import McapContainer

MAGIC = b"\x89MCAP0\r\n"
START_NS = 1_700_000_000_000_000_000

Message = tuple[int, int, bytes]


def record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def text(value: str) -> bytes:
    return struct.pack("<I", len(value.encode())) + value.encode()


def header(profile: str = "ros2", library: str = "by hand") -> bytes:
    return record(1, text(profile) + text(library))


def schema(number: int = 1, name: str = "Imu", data: bytes = b"float64 x") -> bytes:
    return record(3, struct.pack("<H", number) + text(name) + text("ros2msg") + text(data.decode()))


def channel(number: int = 1, topic: str = "/imu", schema_id: int = 1) -> bytes:
    return record(4, struct.pack("<HH", number, schema_id) + text(topic) + text("cdr") + struct.pack("<I", 0))


def message(number: int, channel_id: int = 1, *, size: int = 20, time_ns: int | None = None) -> bytes:
    log_time = START_NS + number if time_ns is None else time_ns
    return record(5, struct.pack("<HIQQ", channel_id, number, log_time, log_time) + payload(number, size))


def payload(number: int, size: int = 20) -> bytes:
    return bytes([number % 251] * size)


def compress(content: bytes, compression: str) -> bytes:
    if compression == "zstd":
        return zstandard.compress(content)
    return lz4.frame.compress(content) if compression == "lz4" else content


def chunk(
    content: bytes,
    compression: str = "",
    *,
    crc: int | None = None,
    size: int | None = None,
    data: bytes | None = None,
    times: tuple[int, int] = (START_NS, START_NS + 1000),
) -> bytes:
    data = compress(content, compression) if data is None else data
    crc = zlib.crc32(content) if crc is None else crc
    size = len(content) if size is None else size
    fields = struct.pack("<QQQI", *times, size, crc) + text(compression)
    return record(6, fields + struct.pack("<Q", len(data)) + data)


def message_index(channel_id: int, entries: Iterable[tuple[int, int]]) -> bytes:
    packed = b"".join(struct.pack("<QQ", *entry) for entry in entries)
    return record(7, struct.pack("<HI", channel_id, len(packed)) + packed)


def index_of(content: bytes) -> bytes:
    """Build the right message indexes of a chunk."""
    entries: dict[int, list[tuple[int, int]]] = {}
    position = 0
    while position < len(content):
        opcode, length = struct.unpack_from("<BQ", content, position)
        if opcode == 5:
            channel_id, _, log_time = struct.unpack_from("<HIQ", content, position + 9)
            entries.setdefault(channel_id, []).append((log_time, position))
        position += 9 + length
    return b"".join(message_index(*item) for item in entries.items())


def chunk_index(
    start: int,
    length: int,
    channel_ids: Sequence[int],
    index_length: int,
    compressed_size: int,
    size: int,
    compression: str = "",
    times: tuple[int, int] = (START_NS, START_NS + 1000),
) -> bytes:
    offsets = b"".join(struct.pack("<HQ", number, 0) for number in channel_ids)
    fields = struct.pack("<QQQQI", *times, start, length, len(offsets)) + offsets
    fields += struct.pack("<Q", index_length) + text(compression)
    return record(8, fields + struct.pack("<QQ", compressed_size, size))


def statistics(counts: Mapping[int, int], channels: int | None = None) -> bytes:
    packed = b"".join(struct.pack("<HQ", *item) for item in counts.items())
    channels = len(counts) if channels is None else channels
    fields = struct.pack("<QHIIII", sum(counts.values()), 1, channels, 0, 0, 1)
    return record(0x0B, fields + struct.pack("<QQI", START_NS, START_NS + 1000, len(packed)) + packed)


def log(*data: bytes, summary: bytes | None = None, summary_crc: int | None = None) -> bytes:
    """Put a log together; ``summary=None`` leaves out footer and all, as a killed recorder does."""
    content = MAGIC + header() + b"".join(data)
    if summary is None:
        return content
    content += record(0x0F, struct.pack("<I", 0))
    start = len(content) if summary else 0
    footer = struct.pack("<BQQQ", 2, 20, start, 0)
    crc = zlib.crc32(summary + footer) if summary_crc is None else summary_crc
    return content + summary + footer + struct.pack("<I", crc) + MAGIC


def data_start() -> int:
    """Return where the first of the records handed to `log` starts."""
    return len(MAGIC + header())


def write(folder: Path, content: bytes) -> Path:
    path = folder / "log.mcap"
    path.write_bytes(content)
    return path


def read(path: Path, channel_ids: Iterable[int] | None = None, **options: object) -> list[Message]:
    """Read all messages of a log."""
    with McapContainer.open(path, **options) as opened:
        return messages(opened, channel_ids)


def messages(opened: McapContainer, channel_ids: Iterable[int] | None = None, **window: int) -> list[Message]:
    found: list[Message] = []
    for batch in opened.batches(set(opened.channels if channel_ids is None else channel_ids), **window):
        for time_ns, offset, length in zip(batch.log_time_ns, batch.offsets, batch.lengths, strict=True):
            found.append((batch.channel_id, int(time_ns), batch.buffer[offset : offset + length].tobytes()))
    return found


def expected(numbers: Iterable[int], channel_id: int = 1, size: int = 20) -> list[Message]:
    return [(channel_id, START_NS + number, payload(number, size)) for number in numbers]


def sample_log(**settings: object) -> bytes:
    """Write a small log with the mcap package: an even channel, an uneven one, a rare one."""
    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=3000, **settings)
    writer.start("ros2", "sample")
    for number, topic in enumerate(("/imu", "/text", "/rare"), start=1):
        writer.register_channel(topic, "cdr", writer.register_schema(f"s{number}", "ros2msg", b"x"))
    writer.add_metadata("about", {"machine": "press"})
    for step in range(150):
        time_ns = START_NS + step * 1_000_000
        writer.add_message(1, time_ns, payload(step, 40), time_ns + 5, step)
        if step % 3 == 0:
            writer.add_message(2, time_ns + 1, payload(step, step * 7 % 31), time_ns, step)
        if step % 50 == 7:
            writer.add_message(3, time_ns + 2, payload(step, 500), time_ns, step)
            writer.add_attachment(time_ns, time_ns, "photo", "image/png", bytes(200))
    writer.finish()
    return stream.getvalue()


def by_oracle(path: Path) -> list[Message]:
    """Read with the mcap package, in file order and with all checksums."""
    with path.open("rb") as file:
        reader = NonSeekingReader(file, validate_crcs=True)
        found = reader.iter_messages(log_time_order=False)
        return [(one.channel_id, one.log_time, one.data) for _, _, one in found]
