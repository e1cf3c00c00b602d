"""A topic about to be written: its schema, its stamps, and its encoded messages."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Mask, Whole
from chladni.signals.errors import SetupError
from chladni.signals.time_series import NS_PER_S, TimeSeries

_LAST_STAMP_NS = 2**31 * NS_PER_S - 1  # ROS 2 keeps seconds in an int32


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogTopic:
    """One topic of a log.

    Attributes
    ----------
    topic
        Name, such as ``/imu/wrist``.
    schema_name, schema_text
        Of the ros2msg schema.
    metadata
        MCAP channel metadata.
    stamps_ns
        Time of each message, rising.
    payloads
        Gives an iterator over the CDR messages, one for each stamp; nothing is encoded before it's asked for.
    """

    topic: str
    schema_name: str
    schema_text: str
    metadata: Mapping[str, str]
    stamps_ns: Whole
    payloads: Callable[[], Iterator[bytes]]


def measured(series: TimeSeries, rows: tuple[int, ...]) -> Mask:
    """Say of each sample whether any of the given rows holds a valid value."""
    if series.valid is None:
        return np.ones(series.samples, dtype=np.bool_)
    return np.asarray(series.valid[list(rows)].any(axis=0), dtype=np.bool_)


def row_with_gaps(series: TimeSeries, row: int, samples: Whole | slice) -> NDArray[np.floating]:
    """Give samples of one row, with NaN where they are invalid."""
    values = series.values[row, samples]
    if series.valid is None:
        return values
    return np.where(series.valid[row, samples], values, values.dtype.type(np.nan))


def require_ros_time(series: TimeSeries) -> None:
    """Raise `SetupError` unless all stamps fit a ROS 2 stamp: from 1970 to 2038."""
    last_ns = series.start_time_ns + round(series.duration_s * NS_PER_S)
    if series.start_time_ns < 0 or last_ns > _LAST_STAMP_NS:
        raise SetupError(
            f"{series.channels[0].name}: samples from {series.start_time_ns} ns to {last_ns} ns don't fit a ROS 2 "
            f"stamp (0 to {_LAST_STAMP_NS} ns since 1970); set another start time"
        )
