"""Data frames of pandas and polars, and tables of Arrow, as logs: a column for each channel, and one of times."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol, TypeGuard, runtime_checkable

from numpy.typing import NDArray

from chladni.io.file_log import FileLog
from chladni.io.files.bounds import Budget, memory_bytes
from chladni.io.files.columns import Column
from chladni.io.files.formats import call_with_options
from chladni.io.files.parquet import arrow_columns
from chladni.io.files.table import Part, series_of_parts
from chladni.io.files.time_column import find_times
from chladni.io.files.time_reading import TimeOptions
from chladni.signals.errors import EstimateError, LogError
from chladni.signals.geometry import Geometry
from chladni.signals.time_series import Frame

#: What messages call it.
WHERE = "the data frame"
_INDEX = b"pandas"


@runtime_checkable
class _ArrowTable(Protocol):
    """What pandas, polars, pyarrow and DuckDB give their tables by."""

    def __arrow_c_stream__(self, requested_schema: object = None) -> object: ...


def is_data_frame(source: object) -> TypeGuard[Frame]:
    """Whether something is a table of columns with names, in memory."""
    return isinstance(source, Frame) and isinstance(source, _ArrowTable)


def has_times(frame: Frame, *, sample_rate_hz: float | None = None) -> bool:
    """Whether a column of a data frame holds times, or its index does; errors as for `open_data_frame`."""
    return _tells_times(_columns(frame)[0], sample_rate_hz)


def named_numbers(frame: Frame) -> dict[str, NDArray[Any]]:
    """Give the numbers of each column by its name, for a frame without times.

    Raises
    ------
    EstimateError
        When a column holds no numbers.
    """
    columns, unread = _columns(frame)
    odd = [*unread, *((column.name, "text") for column in columns if column.numbers is None)]
    if odd:
        raise EstimateError(f"{WHERE}: {odd[0][0]!r} holds {odd[0][1]}, but samples are real numbers; leave it out")
    return {column.name: column.numbers for column in columns if column.numbers is not None}


def open_data_frame(frame: Frame, **reading: Any) -> FileLog:
    """Open a data frame as a log.

    Parameters
    ----------
    frame
        A column for each channel, and one of times: dates, or numbers under a name such as ``time`` or ``t_ms``. An
        index of times counts as such a column.
    reading
        ``sample_rate_hz``, ``time``, ``time_unit`` and ``units``, see `chladni.io.files.formats.READ_OPTIONS`.

    Raises
    ------
    LogError
        When no column holds numbers, or the times make no sampled signal.
    SetupError
        When nothing tells times or rate, or an option isn't known.
    """
    log: FileLog = call_with_options(_opened, frame, reading)
    return log


def _opened(
    frame: Frame,
    *,
    sample_rate_hz: float | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    units: Mapping[str, str] | None = None,
) -> FileLog:
    columns, unread = _columns(frame)
    options = TimeOptions(column=time, unit=time_unit, rate_hz=sample_rate_hz)
    contents = series_of_parts([Part(columns=columns)], options, where=WHERE, units=units, unread=unread)
    contents = replace(contents, notes=tuple(note.removeprefix(f"{WHERE}: ") for note in contents.notes))
    return FileLog(Path(WHERE), "", contents, geometry=Geometry())


def _columns(frame: Frame) -> tuple[list[Column], tuple[tuple[str, str], ...]]:
    """Give the columns, those of an index only where they are times, and why others are none."""
    import pyarrow as pa

    try:
        table = pa.table(frame)
        columns, unread = arrow_columns(table, {}, Budget(path=Path(WHERE), most=memory_bytes()))
    except (pa.ArrowException, TypeError) as error:
        raise LogError(f"{WHERE}: its columns can't be read: {' '.join(str(error).split()):.200}") from error
    described = json.loads((table.schema.metadata or {}).get(_INDEX, b"{}"))
    index = {name for name in described.get("index_columns", ()) if isinstance(name, str)}
    times = {column.name for column in columns if column.name in index and _tells_times([column])}
    return [column for column in columns if column.name not in index - times], unread


def _tells_times(columns: Sequence[Column], sample_rate_hz: float | None = None) -> bool:
    return find_times(columns, TimeOptions(rate_hz=sample_rate_hz), where=WHERE)[0] is not None
