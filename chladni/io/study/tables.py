"""The tables of a study: their columns, and their form on the wire.

Every table begins with ``log`` (the path or address as it was given) and ``day`` (UTC, of the log's first sample). A
cell is null where a command's document holds null, or where the step wasn't asked for.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import pyarrow as pa
from pyarrow import ipc

from chladni.signals.errors import LogError

Row = Mapping[str, Any]

_TEXT, _NUMBER, _COUNT, _YES = pa.string(), pa.float64(), pa.int64(), pa.bool_()
_TEXTS, _NUMBERS = pa.list_(pa.string()), pa.list_(pa.float64())
_STAMP: Final = pa.timestamp("ns", tz="UTC")


def _schema(**columns: pa.DataType) -> pa.Schema:
    return pa.schema([("log", _TEXT), ("day", pa.date32()), *columns.items()])


#: Columns of each table. What a column means is told in docs/study.md.
SCHEMAS: Final[Mapping[str, pa.Schema]] = {
    "logs": _schema(
        content=_TEXT, status=_TEXT, begins=_STAMP, duration_s=_NUMBER, size_bytes=_COUNT, channels=_COUNT,
        damage=_COUNT, failures=_COUNT, version=_TEXT,
    ),
    "channels": _schema(
        channel=_TEXT, unit=_TEXT, encoding=_TEXT, rate_hz=_NUMBER, rate_std_hz=_NUMBER, samples=_COUNT, stamp=_TEXT,
        jitter_s=_NUMBER, gaps=_COUNT, breaks=_COUNT, longest_stretch_s=_NUMBER, duplicates=_COUNT, clipped=_COUNT,
        untimed=_COUNT, publishers=_COUNT, psd_unit=_TEXT, psd_rms=_NUMBER, averages=_COUNT,
        effective_averages=_NUMBER, segment_s=_NUMBER, window=_TEXT, velocity_mm_s=_NUMBER,
        velocity_std_mm_s=_NUMBER, zone=_TEXT,
    ),
    "levels": _schema(
        channel=_TEXT, unit=_TEXT, low_hz=_NUMBER, high_hz=_NUMBER, samples=_COUNT, mean=_NUMBER, rms=_NUMBER,
        rms_std=_NUMBER, peak=_NUMBER, peak_to_peak=_NUMBER, crest_factor=_NUMBER, skewness=_NUMBER, kurtosis=_NUMBER,
    ),
    "peaks": _schema(
        step=_TEXT, channel=_TEXT, reference=_TEXT, rank=_COUNT, frequency_hz=_NUMBER, frequency_std_hz=_NUMBER,
        height=_NUMBER, height_std=_NUMBER, unit=_TEXT,
    ),
    "modes": _schema(
        mode=_COUNT, frequency_hz=_NUMBER, frequency_std_hz=_NUMBER, damping_ratio=_NUMBER, damping_std=_NUMBER,
        mpc=_NUMBER, mpd_deg=_NUMBER, mean_phase_deg=_NUMBER, modal_mass=_NUMBER, modal_mass_std=_NUMBER,
        orders=_COUNT, estimator=_TEXT, channels=_TEXTS, shape_real=_NUMBERS, shape_imag=_NUMBERS,
        shape_real_std=_NUMBERS, shape_imag_std=_NUMBERS,
    ),
    "gaps": _schema(
        model=_TEXT, verdict=_TEXT, before=_NUMBER, tuned=_NUMBER, after=_NUMBER, noise=_NUMBER, closed=_NUMBER,
        advice=_TEXT, next_measurement=_TEXT,
    ),
    "causes": _schema(
        cause=_COUNT, effect=_TEXT, site=_TEXT, variant=_TEXT, probability=_NUMBER, share=_NUMBER, group=_TEXTS,
        parameters=_TEXT,
    ),
    "findings": _schema(step=_TEXT, place=_COUNT, sentence=_TEXT),
    "failures": _schema(step=_TEXT, kind=_TEXT, reason=_TEXT),
    "documents": _schema(step=_TEXT, document=_TEXT),
}  # fmt: skip

#: What a log took, for whoever runs the study: on the wire alone, since it's another one each time.
EFFORT: Final = _schema(seconds=_NUMBER, cpu_s=_NUMBER, content=_TEXT, unchanged=_YES)
_KNOWN: Final = {**SCHEMAS, "effort": EFFORT}

#: What rows of a table are sorted by, so that the same logs give the same file.
ORDER: Final[Mapping[str, tuple[str, ...]]] = {
    "logs": ("log",),
    "channels": ("log", "channel"),
    "levels": ("log", "channel", "low_hz", "high_hz"),
    "peaks": ("log", "step", "channel", "reference", "rank"),
    "modes": ("log", "mode"),
    "gaps": ("log",),
    "causes": ("log", "cause"),
    "findings": ("log", "step", "place"),
    "failures": ("log", "step", "kind", "reason"),
    "documents": ("log", "step"),
}

_WIRE: Final = pa.schema([("table", pa.string()), ("rows", pa.binary())])
#: A batch's answer; more is a worker that has gone wrong.
MOST_BYTES: Final = 1 << 30


def table_of(name: str, rows: Iterable[Row]) -> pa.Table:
    """Make a table of rows; a column that a row lacks is null, and one that the table lacks is refused.

    Raises
    ------
    KeyError
        When a row has a column that the table hasn't: what it holds would be lost without a word.

    Examples
    --------
    >>> table_of("failures", [{"log": "a.mcap", "step": "open", "kind": "log", "reason": "no such file"}]).num_rows
    1
    """
    schema, given = _KNOWN[name], list(rows)
    for row in given:
        if unknown := row.keys() - set(schema.names):
            raise KeyError(f"table {name} has no column {', '.join(sorted(unknown))}")
    columns = {one: [row.get(one) for row in given] for one in schema.names}
    try:
        return pa.Table.from_pydict(columns, schema=schema)
    except UnicodeEncodeError:
        # Names in a log may hold halves of characters, which no other program reads.
        return pa.Table.from_pydict({one: list(map(_sound, cells)) for one, cells in columns.items()}, schema=schema)


def _sound(cell: Any) -> Any:
    if isinstance(cell, str):
        return cell.encode("utf-8", "backslashreplace").decode()
    return [*map(_sound, cell)] if isinstance(cell, list) else cell


def tables_of(rows: Mapping[str, Sequence[Row]]) -> dict[str, pa.Table]:
    """Make all tables that have rows."""
    return {name: table_of(name, found) for name, found in rows.items() if found}


def packed(tables: Mapping[str, pa.Table]) -> bytes:
    """Put tables into bytes, which `unpacked` reads: one stream of Arrow that holds a stream for each table."""
    parts = [(name, _stream(table)) for name, table in tables.items() if table.num_rows]
    outer = pa.Table.from_pydict(
        {"table": [name for name, _ in parts], "rows": [rows for _, rows in parts]}, schema=_WIRE
    )
    return _stream(outer)


def unpacked(content: bytes, *, source: str) -> dict[str, pa.Table]:
    """Read what `packed` wrote; nothing in it is run or trusted.

    Parameters
    ----------
    content
        Of a file or a worker.
    source
        Where it's from, for messages.

    Raises
    ------
    LogError
        When it's no such content, or a table has other columns than this version's.
    """
    try:
        outer = _table(content, _WIRE)
        return {
            name: _table(rows, _KNOWN[name])
            for name, rows in zip(outer["table"].to_pylist(), outer["rows"].to_pylist(), strict=True)
        }
    except (pa.ArrowException, KeyError, OSError, ValueError) as error:
        raise LogError(f"{source}: holds no tables of a study that this version knows: {error!s:.200}") from error


def _stream(table: pa.Table) -> bytes:
    sink = pa.BufferOutputStream()
    with ipc.new_stream(sink, table.schema) as writer:
        writer.write_table(table)
    return bytes(sink.getvalue())


def _table(content: bytes, schema: pa.Schema) -> pa.Table:
    if len(content) > MOST_BYTES:
        raise ValueError(f"{len(content)} bytes are more than an answer has")
    with ipc.open_stream(content) as reader:
        if not reader.schema.equals(schema):
            raise ValueError(f"columns {', '.join(reader.schema.names)} aren't those of this version")
        table = reader.read_all()
    # Offsets of text are taken from bytes as they are: a wrong one would end the process.
    table.validate(full=True)
    return table
