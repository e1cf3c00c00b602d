"""A topic with a message for each sample."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chladni.io.mcap.channel_metadata import channel_metadata
from chladni.io.mcap.log_topic import LogTopic, measured, row_with_gaps
from chladni.io.mcap.message_types import MessageType, message_type
from chladni.signals.arrays import Bytes, Whole
from chladni.signals.time_series import NS_PER_S, TimeSeries

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

_MESSAGES_AT_ONCE = 8192  # some MB: enough that NumPy's overhead vanishes, small beside the log


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
