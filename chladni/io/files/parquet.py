"""Parquet, Feather and Arrow files: tables of Apache Arrow, by pyarrow."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from chladni.io.atomic import atomic_path
from chladni.io.files.arrow_tables import arrow_table, is_text
from chladni.io.files.bounds import Budget
from chladni.io.files.columns import Column, distinct, parse_titles
from chladni.io.files.contents import FileContents, joined, one_line, one_series
from chladni.io.files.named_arrays import rate_of_scalar
from chladni.io.files.series_fields import SERIES_FORMAT, restated, series_fields, series_of_fields
from chladni.io.files.table import Part, series_of_parts
from chladni.io.files.time_reading import TimeOptions
from chladni.signals.errors import LogError
from chladni.signals.text_reading import real_number
from chladni.signals.time_series import TimeSeries

if TYPE_CHECKING:
    import pyarrow as pa

_UNIT_KEYS: Final = ("unit", "units", "Unit", "unit_string")
# One field each, which makes the values of a series.
_PER_CHANNEL: Final = ("names", "units", "points", "directions", "roles", "overloads")


def read_arrow(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    units: Mapping[str, str] | None = None,
    max_bytes: int | None = None,
) -> FileContents:
    """Read a Parquet, Feather or Arrow file: a column for each channel, and one of times.

    Units are those in a field's metadata (``unit``), in the schema's (``units``, a JSON object by column), or in its
    name (``ax [g]``). The schema's metadata may state the rate (``sample_rate``, ``fs``).

    Parameters
    ----------
    sample_rate_hz
        Rate of the rows when nothing in the file says it.
    time
        Name of the column of times, ``none`` when there's none whatever it's called.
    time_unit
        What its numbers count, see `chladni.io.files.time_reading.TIME_UNITS`.
    units
        Unit by column name, instead of those in the file.
    max_bytes
        Most memory that the columns may take, by default as `chladni.io.files.bounds` has it.

    Raises
    ------
    LogError
        When the file is damaged, too large, or holds no column of numbers.
    SetupError
        When nothing says the times of the rows, or a unit that is stated is unknown.
    """
    import pyarrow as pa

    path = Path(path)
    budget = Budget.of_file(path, max_bytes)
    try:
        table, told = arrow_table(path, budget)
        table.validate(full=True)
        metadata = _texts(table.schema.metadata)
        if metadata.get("format") == SERIES_FORMAT:
            own = _own(table, metadata.get("series", ""), str(path))
            return joined([told, FileContents(series=restated([own], units, where=str(path)))])
        columns, unread = arrow_columns(table, metadata, budget)
    # Names and texts are decoded when they're looked at.
    except (pa.ArrowException, OSError, MemoryError, UnicodeDecodeError) as error:
        raise LogError(f"{path}: this Arrow file can't be read: {one_line(error)}") from error
    part = Part(columns=columns, stated_rate_hz=_stated_rate_hz(metadata))
    options = TimeOptions(column=time, unit=time_unit, rate_hz=sample_rate_hz)
    return joined([told, series_of_parts([part], options, where=str(path), units=units, unread=unread)])


def write_arrow(
    series: TimeSeries | Sequence[TimeSeries], path: Path | str, *, overwrite: bool = True
) -> tuple[str, ...]:
    """Write one series as Parquet or Arrow, told by the suffix: a column for each channel, and times in nanoseconds.

    Rate, start, and each channel's unit, point, direction, role and overload are in the metadata.

    Returns
    -------
    losses
        Empty: nothing is lost.

    Raises
    ------
    LogError
        When there are channels of several rates, or the file can't be written.
    """
    import pyarrow as pa
    from pyarrow import feather, parquet

    part = one_series((series,) if isinstance(series, TimeSeries) else series, "an Arrow table")
    present = np.isfinite(part.values) if part.valid is None else part.valid & np.isfinite(part.values)
    described = series_fields(part)
    kept = {name: described[name].tolist() for name in ("fs", "start_time_ns", *_PER_CHANNEL)}
    fields = [pa.field("time", pa.timestamp("ns"))]
    fields += [
        pa.field(channel.name, pa.from_numpy_dtype(part.values.dtype), metadata={"unit": channel.unit})
        for channel in part.channels
    ]
    columns = [pa.array(part.times_ns().view("datetime64[ns]"))]
    columns += [pa.array(row, mask=~good) for row, good in zip(part.values, present, strict=True)]
    schema = pa.schema(fields, metadata={"format": SERIES_FORMAT, "series": json.dumps(kept)})
    table = pa.Table.from_arrays(columns, schema=schema)
    with atomic_path(path, overwrite=overwrite) as temporary:
        if Path(path).suffix.lower() in (".parquet", ".pq"):
            parquet.write_table(table, temporary)
        else:
            feather.write_feather(table, str(temporary), compression="lz4")
    return ()


def _texts(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    return {key.decode(errors="replace"): text.decode(errors="replace") for key, text in (metadata or {}).items()}


def _own(table: "pa.Table", text: str, where: str) -> TimeSeries:
    """Make the series of our own layout again."""
    try:
        fields = dict(json.loads(text))
        columns = [column.to_numpy() for column in table.columns[1:]]
        fields["values"] = np.stack(columns, axis=1) if columns else np.empty((table.num_rows, 0))
        valid = [np.asarray(column.is_valid()) for column in table.columns[1:]]
        if not all(good.all() for good in valid):
            fields["valid"] = np.stack(valid, axis=1)
        return series_of_fields(fields, where=where)
    except (ValueError, TypeError, RecursionError) as error:
        raise LogError(f"{where}: the description of its series is damaged: {error}") from error


def arrow_columns(
    table: "pa.Table", metadata: Mapping[str, str], budget: Budget
) -> tuple[list[Column], tuple[tuple[str, str], ...]]:
    """Give the columns of numbers, times and text of an Arrow table, and why others are none."""
    import pyarrow as pa

    by_name = _units_by_name(metadata)
    titles = parse_titles(table.column_names)
    names = distinct([title.name for title in titles])
    columns, unread = [], []
    for name, title, field, content in zip(names, titles, table.schema, table.columns, strict=True):
        unit = next((text for key, text in _texts(field.metadata).items() if key in _UNIT_KEYS), None)
        said = unit or by_name.get(field.name) or title.unit
        try:
            numbers, text = _content(content, budget)
        except pa.ArrowException as error:
            unread.append((name, one_line(error)))
            continue
        columns.append(Column(name=name, numbers=numbers, text=text, unit=said, start_ns=title.start_ns))
    return columns, tuple(unread)


def _content(column: "pa.ChunkedArray", budget: Budget) -> tuple[NDArray[Any] | None, "pa.Array | None"]:
    """Give the numbers or the text of a column; an Arrow error for what is neither."""
    import pyarrow as pa
    import pyarrow.types as kinds

    kind = column.type
    if kinds.is_dictionary(kind):
        if is_text(kind.value_type):
            budget.take(_text_bytes(column))
        column = column.cast(kind.value_type)
        kind = column.type
    if is_text(kind) or kinds.is_null(kind):
        text = column.cast(pa.string()).fill_null("").combine_chunks()
        text.validate(full=True)
        return None, text
    if kinds.is_timestamp(kind) or kinds.is_date(kind):
        numbers = column.cast(pa.timestamp("ns")).to_numpy()
    elif kinds.is_duration(kind) or kinds.is_time(kind):
        unit = "ns" if kinds.is_date(kind) else kind.unit
        whole = column.cast(pa.int64() if kind.bit_width == 64 else pa.int32()).cast(pa.int64())
        numbers = whole.cast(pa.duration(unit)).cast(pa.duration("ns")).to_numpy()
    elif kinds.is_decimal(kind) or kinds.is_boolean(kind) or column.null_count:
        numbers = column.cast(pa.int8() if kinds.is_boolean(kind) else kind).cast(pa.float64()).to_numpy()
    elif kinds.is_integer(kind) or kinds.is_floating(kind):
        numbers = column.to_numpy()
    else:
        raise pa.ArrowNotImplementedError(f"{kind} values, which are no column of numbers")
    return np.asarray(numbers), None


def _text_bytes(column: "pa.ChunkedArray") -> int:
    """Bytes of a column of texts that stand once each, written out for every row."""
    import pyarrow.compute as pc

    lengths = [pc.binary_length(part.dictionary).take(part.indices) for part in column.chunks]
    return 8 * len(column) + sum(int(pc.sum(part).as_py() or 0) for part in lengths)


def _units_by_name(metadata: Mapping[str, str]) -> dict[str, str]:
    try:
        units = json.loads(metadata.get("units", "{}"))
    except (ValueError, RecursionError):
        return {}
    if not isinstance(units, dict):
        return {}
    return {name: unit for name, unit in units.items() if isinstance(unit, str)}


def _stated_rate_hz(metadata: Mapping[str, str]) -> float | None:
    for name, text in metadata.items():
        try:
            rate_hz = rate_of_scalar(name, real_number(text))
        except ValueError:
            continue
        if rate_hz is not None:
            return rate_hz
    return None
