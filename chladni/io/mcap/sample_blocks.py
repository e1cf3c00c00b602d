"""A topic with batch messages: header, rate, column names, and the samples of all columns, column after column."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from chladni.io.mcap.cdr_layout import CdrLayout, cdr_layout
from chladni.io.mcap.channel_metadata import channel_metadata
from chladni.io.mcap.log_topic import LogTopic, measured, row_with_gaps
from chladni.io.mcap.ros2_definitions import schema_name, schema_text
from chladni.signals.arrays import Mask, Whole
from chladni.signals.time_series import NS_PER_S, TimeSeries


def block_topic(series: TimeSeries, topic: str, rows: dict[str, int], *, block_s: float) -> LogTopic:
    """Lay out batch messages of about `block_s` seconds.

    Missing samples are NaN, and a block without any sample has no message. A block is not cut at a gap: readers
    forgive the stamps of blocks some jitter, and would close a short gap between two. Single precision stays single,
    everything else is written as double.

    Parameters
    ----------
    rows
        Row of `series` by column name.
    """
    single = series.values.dtype == np.float32
    type_name = "daq_msgs/SampleBlock" if single else "daq_msgs/SampleBlock64"
    length = max(1, round(block_s * series.sample_rate_hz))
    spans = _spans(measured(series, tuple(rows.values())), length)
    stamps_ns = series.times_ns()[[first for first, _ in spans]]
    layout = cdr_layout(
        type_name, texts={"channel_names": tuple(rows)}, defaults={"sample_rate": series.sample_rate_hz}
    )
    encoder = _BlockEncoder(
        series=series,
        rows=tuple(rows.values()),
        layout=layout,
        sample_type="<f4" if single else "<f8",
        spans=spans,
        stamps_ns=stamps_ns,
    )
    return LogTopic(
        topic=topic,
        schema_name=schema_name(type_name),
        schema_text=schema_text(type_name),
        metadata=channel_metadata(
            {field: series.channels[row] for field, row in rows.items()}, sample_rate_hz=series.sample_rate_hz
        ),
        stamps_ns=stamps_ns,
        payloads=encoder.payloads,
    )


def _spans(present: Mask, length: int) -> list[tuple[int, int]]:
    """Cut the samples into blocks ``[first, last)`` and give those that hold any."""
    blocks = [(first, min(first + length, len(present))) for first in range(0, len(present), length)]
    return [(first, last) for first, last in blocks if present[first:last].any()]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _BlockEncoder:
    series: TimeSeries
    rows: tuple[int, ...]
    layout: CdrLayout
    sample_type: str
    spans: list[tuple[int, int]]
    stamps_ns: Whole

    def payloads(self) -> Iterator[bytes]:
        for (first, last), stamp_ns in zip(self.spans, self.stamps_ns.tolist(), strict=True):
            yield self._head(stamp_ns, len(self.rows) * (last - first)) + self._samples(slice(first, last))

    def _head(self, stamp_ns: int, count: int) -> bytes:
        sec, nanosec = divmod(stamp_ns, NS_PER_S)
        head = self.layout.encode({"header.stamp.sec": [sec], "header.stamp.nanosec": [nanosec]}, 1).tobytes()
        # The layout ends with the length of the empty sample sequence; the real one takes its place, and the
        # samples start at their own alignment behind the 4 bytes of the encapsulation header.
        width = np.dtype(self.sample_type).itemsize
        padding = bytes(-(len(head) - 4) % width)
        return head[:-4] + np.uint32(count).tobytes() + padding

    def _samples(self, part: slice) -> bytes:
        columns = [row_with_gaps(self.series, row, part) for row in self.rows]
        return np.concatenate(columns).astype(self.sample_type).tobytes()
