"""Write time series as an MCAP log that Foxglove, PlotJuggler and rerun read."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Literal

import numpy as np

from chladni import __version__
from chladni.io.atomic import atomic_write
from chladni.io.mcap.channel_metadata import channel_metadata
from chladni.io.mcap.log_topic import LogTopic, measured, require_ros_time, row_with_gaps
from chladni.io.mcap.message_types import MessageType, message_type
from chladni.io.mcap.sample_blocks import block_topic
from chladni.io.mcap.topic_names import FieldOfTopic, block_places, message_places
from chladni.signals.arrays import Bytes, Whole
from chladni.signals.errors import SetupError
from chladni.signals.time_series import NS_PER_S, TimeSeries

if TYPE_CHECKING:
    from mcap.writer import Writer
    from numpy.typing import ArrayLike

Layout = Literal["messages", "batches"]
_MESSAGES_AT_ONCE = 8192  # some MB: enough that NumPy's overhead vanishes, small beside the log


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenLog:
    """What a log that was written holds.

    Attributes
    ----------
    path
        The file.
    names
        Name under which each channel is read back, by the name it had.
    messages
        Number of messages.
    """

    path: Path
    names: Mapping[str, str]
    messages: int


def write_mcap(
    series: TimeSeries | Sequence[TimeSeries],
    path: Path | str,
    *,
    layout: Layout = "messages",
    block_s: float = 1.0,
    default_topic: str = "/daq",
    metadata: Mapping[str, Mapping[str, str]] | None = None,
    overwrite: bool = True,
) -> WrittenLog:
    """Write series as ROS 2 CDR messages: zstd chunks, indexed, with checksums, atomically.

    Channels whose names are message paths keep them: ``/imu/wrist.linear_acceleration.x`` is written to topic
    ``/imu/wrist`` as ``sensor_msgs/Imu``, ``/shaker.wrench.force.z`` as ``geometry_msgs/WrenchStamped``,
    ``/axis.position[0]`` as ``sensor_msgs/JointState``; what no ROS type holds gets a definition of its own. Fields
    of such a type that were not measured are NaN. Units, points, directions, roles and overload limits go to the
    channel metadata, see `chladni.io.mcap.channel_metadata`. Gaps stay gaps: a sample that is invalid in all
    channels of a topic has no message, and neither has a block without any; other invalid samples are NaN.

    Parameters
    ----------
    series
        One, or several with topics of their own.
    layout
        ``messages``: a message for each sample. ``batches``: blocks of samples (header, sample_rate, channel_names,
        samples column after column), compact, and the way to keep any channel name.
    block_s
        Length of a block in seconds.
    default_topic
        Topic of batch channels whose name has none.
    metadata
        MCAP metadata records by name, such as ``{"truth": {"first_mode_hz": "7.3"}}``.
    overwrite
        Whether an existing file may be replaced.

    Raises
    ------
    SetupError
        When names clash, stamps don't fit, or there is nothing to write.
    LogError
        When the file can't be written.

    Examples
    --------
    >>> import tempfile
    >>> from chladni.signals.channel import Channel
    >>> x = TimeSeries(
    ...     values=np.zeros((1, 50)), sample_rate_hz=100.0, channels=(Channel(name="/a.accel.linear.z"),)
    ... )
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mcap(x, Path(folder) / "a.mcap").messages
    50
    """
    parts = (series,) if isinstance(series, TimeSeries) else tuple(series)
    _require_writable(parts, layout=layout, block_s=block_s)
    # Everything that can be refused is refused before a file is opened.
    places = _places(parts, layout, default_topic)
    topics = _topics(parts, places, layout, block_s)
    with atomic_write(path, overwrite=overwrite) as file:
        messages = _write(file, topics, metadata or {})
    names = [channel.name for part in parts for channel in part.channels]
    written = [place.name for group in places for place in group]
    return WrittenLog(path=Path(path), names=dict(zip(names, written, strict=True)), messages=messages)


def _require_writable(parts: tuple[TimeSeries, ...], *, layout: str, block_s: float) -> None:
    if layout not in ("messages", "batches"):
        raise SetupError(f"layout {layout!r} is none of messages, batches")
    if not 0 < block_s < float("inf"):
        raise SetupError(f"block_s {block_s} must be a positive number of seconds")
    if not any(part.channels for part in parts):
        raise SetupError("there is no channel to write")
    for part in parts:
        require_ros_time(part)


def _places(parts: tuple[TimeSeries, ...], layout: Layout, default_topic: str) -> list[tuple[FieldOfTopic, ...]]:
    places = []
    for number, part in enumerate(parts):
        names = [channel.name for channel in part.channels]
        if layout == "messages":
            places.append(message_places(names))
        else:
            topic = default_topic if number == 0 else f"{default_topic}_{number + 1}"
            places.append(block_places(names, topic=topic))
    return places


def _topics(
    parts: tuple[TimeSeries, ...], places: list[tuple[FieldOfTopic, ...]], layout: Layout, block_s: float
) -> list[LogTopic]:
    topics: dict[str, LogTopic] = {}
    for part, group in zip(parts, places, strict=True):
        for topic, rows in _rows_by_topic(group).items():
            if topic in topics:
                raise SetupError(f"topic {topic} occurs in two series; a topic has one rate: rename its channels")
            topics[topic] = (
                sample_topic(part, topic, rows)
                if layout == "messages"
                else block_topic(part, topic, rows, block_s=block_s)
            )
    return list(topics.values())


def _rows_by_topic(places: tuple[FieldOfTopic, ...]) -> dict[str, dict[str, int]]:
    topics: dict[str, dict[str, int]] = {}
    for row, place in enumerate(places):
        topics.setdefault(place.topic, {})[place.field] = row
    return topics


def _write(file: BinaryIO, topics: list[LogTopic], metadata: Mapping[str, Mapping[str, str]]) -> int:
    from mcap.writer import CompressionType, IndexType, Writer

    writer = Writer(
        file,
        compression=CompressionType.ZSTD,
        index_types=IndexType.ALL,
        enable_crcs=True,
        enable_data_crcs=True,
    )
    writer.start(profile="ros2", library=f"chladni {__version__}")
    ids = _register(writer, topics)
    messages = 0
    for topic, stamp_ns, payload in _in_time_order(topics):
        writer.add_message(ids[topic], stamp_ns, payload, stamp_ns)
        messages += 1
    for name, entries in metadata.items():
        writer.add_metadata(name, dict(entries))
    writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it unannotated
    return messages


def _register(writer: "Writer", topics: list[LogTopic]) -> list[int]:
    schemas: dict[tuple[str, str], int] = {}
    ids = []
    for topic in topics:
        # Topics of one type share a schema, but a made type may have the name of another with other fields.
        key = (topic.schema_name, topic.schema_text)
        if key not in schemas:
            schemas[key] = writer.register_schema(key[0], "ros2msg", key[1].encode())
        ids.append(writer.register_channel(topic.topic, "cdr", schemas[key], dict(topic.metadata)))
    return ids


def _in_time_order(topics: list[LogTopic]) -> Iterator[tuple[int, int, bytes]]:
    """Give ``(index of the topic, stamp, message)`` of all topics, by stamp."""
    # Sorting the stamps alone keeps the encoded messages of a topic out of memory until their turn comes.
    stamps_ns = np.concatenate([topic.stamps_ns for topic in topics])
    owners = np.repeat(np.arange(len(topics)), [len(topic.stamps_ns) for topic in topics])
    order = np.argsort(stamps_ns, kind="stable")
    payloads = [topic.payloads() for topic in topics]
    for owner, stamp_ns in zip(owners[order].tolist(), stamps_ns[order].tolist(), strict=True):
        yield owner, stamp_ns, next(payloads[owner])


def sample_topic(series: TimeSeries, topic: str, rows: dict[str, int]) -> LogTopic:
    """Lay out the messages of one topic, one for each sample that any of its channels measured.

    A sample invalid in all rows has no message; one invalid in some of them has NaN there.

    Parameters
    ----------
    rows
        Row of `series` by field of the message.
    """
    kind = message_type(topic, list(rows))
    samples = np.flatnonzero(measured(series, tuple(rows.values())))
    stamps_ns = series.times_ns()[samples]
    encoder = _SampleEncoder(series=series, kind=kind, rows=rows, samples=samples, stamps_ns=stamps_ns)
    return LogTopic(
        topic=topic,
        schema_name=kind.name,
        schema_text=kind.text,
        metadata=channel_metadata(
            {field: series.channels[row] for field, row in rows.items()}, sample_rate_hz=series.sample_rate_hz
        ),
        stamps_ns=stamps_ns,
        payloads=encoder.payloads,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _SampleEncoder:
    series: TimeSeries
    kind: MessageType
    rows: dict[str, int]
    samples: Whole
    stamps_ns: Whole

    def payloads(self) -> Iterator[bytes]:
        stride = len(self.kind.layout.template)
        for first in range(0, len(self.samples), _MESSAGES_AT_ONCE):
            encoded = self._encode(slice(first, first + _MESSAGES_AT_ONCE)).tobytes()
            for offset in range(0, len(encoded), stride):
                yield encoded[offset : offset + stride]

    def _encode(self, part: slice) -> Bytes:
        samples, stamps_ns = self.samples[part], self.stamps_ns[part]
        columns: dict[str, ArrayLike] = {
            "header.stamp.sec": stamps_ns // NS_PER_S,
            "header.stamp.nanosec": stamps_ns % NS_PER_S,
        }
        for field, row in self.rows.items():
            columns[self.kind.paths[field]] = row_with_gaps(self.series, row, samples)
        return self.kind.layout.encode(columns, len(samples))
