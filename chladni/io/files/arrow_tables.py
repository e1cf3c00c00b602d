"""The table of a Parquet, Feather or Arrow file, by pyarrow; its size is told before memory is taken for it."""

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from chladni.io.files.bounds import Budget
from chladni.io.files.contents import FileContents, one_line
from chladni.io.regular_file import open_regular
from chladni.signals.errors import LogError

if TYPE_CHECKING:
    import pyarrow as pa

_MAGIC: Final = b"ARROW1"
# Fields of Message.fbs of Apache Arrow 1.0, by their place in their tables.
_HEADER: Final = 2
_DATA_OF_DICTIONARY: Final = 1
_BUFFERS, _COMPRESSION = 2, 3


def arrow_table(path: Path, budget: Budget) -> tuple["pa.Table", FileContents]:
    """Read the whole table, and tell what it lacks.

    Raises
    ------
    LogError
        When it takes more memory than the budget has.
    pyarrow.ArrowException, OSError
        When it can't be read.
    """
    with open_regular(path, LogError) as file:
        head = file.read(8)
        file.seek(-min(len(_MAGIC), len(head)), os.SEEK_END)
        closed = file.read() == _MAGIC
    if head.startswith(b"PAR1"):
        return _parquet(path, budget)
    return _batches(path, budget, is_file=head.startswith(_MAGIC), closed=closed)


def is_text(kind: "pa.DataType") -> bool:
    """Whether a column holds text."""
    import pyarrow.types as kinds

    return bool(kinds.is_string(kind) or kinds.is_large_string(kind) or kinds.is_string_view(kind))


def _is_flat(kind: "pa.DataType") -> bool:
    """Whether a row of a column is one number, time or text."""
    import pyarrow.types as kinds

    return bool(kinds.is_primitive(kind) or kinds.is_decimal(kind) or kinds.is_null(kind) or is_text(kind)
                or (kinds.is_dictionary(kind) and _is_flat(kind.value_type)))  # fmt: skip


# --- Parquet -----------------------------------------------------------------------------------------------------


def _parquet(path: Path, budget: Budget) -> tuple["pa.Table", FileContents]:
    """Read the columns that may be signals, times or text, one by one where one of them is damaged."""
    import pyarrow as pa
    from pyarrow import parquet

    schema = parquet.read_schema(path)
    flat = [field for field in schema if _is_flat(field.type)]
    unread = [
        (field.name, f"{field.type} values, which are no column of numbers")
        for field in schema
        if not _is_flat(field.type)
    ]
    # Of a text that stands in many rows the file has one copy, and so has memory.
    texts = [field.name for field in flat if is_text(field.type)]
    with parquet.ParquetFile(path, read_dictionary=texts, page_checksum_verification=True) as source:
        # A packed column of equal numbers announces any count of rows in a few bytes.
        budget.take(source.metadata.num_rows * 8 * len(flat))
        names = [field.name for field in flat]
        try:
            return source.read(columns=names if unread else None), FileContents(series=(), unread=tuple(unread))
        except (pa.ArrowException, OSError):
            good = []
            for name in names:
                try:
                    source.read(columns=[name])
                    good.append(name)
                except (pa.ArrowException, OSError) as error:
                    unread.append((name, f"damaged ({one_line(error)})"))
            return source.read(columns=good), FileContents(series=(), unread=tuple(unread))


# --- Arrow and Feather -------------------------------------------------------------------------------------------


def _batches(path: Path, budget: Budget, *, is_file: bool, closed: bool) -> tuple["pa.Table", FileContents]:
    """Put batches together as far as they go.

    A file is a stream between two magics with the places of its batches behind it, which nobody needs who reads all:
    one that was never closed, and has none, is read in the same way.
    """
    import pyarrow as pa
    from pyarrow import ipc

    for size in _announced(path, is_file=is_file):
        budget.take(size)
    read: list[pa.RecordBatch] = []
    notes = [f"{path}: was never closed; {{}} rows are read."] if is_file and not closed else []
    with pa.OSFile(str(path)) as source:
        source.seek(8 if is_file else 0)
        stream = ipc.open_stream(source)
        try:
            for batch in stream:
                # Offsets of text are taken from the file as they are: a wrong one would end the process.
                batch.validate(full=True)
                # Columns may share their bytes in the file, and don't as samples.
                budget.take(batch.nbytes)
                read.append(batch)
        except (pa.ArrowException, OSError) as error:
            if not read:
                raise
            notes = [f"{path}: is cut short or damaged: {{}} rows are read ({one_line(error)})."]
    table = pa.Table.from_batches(read, schema=stream.schema)
    told = FileContents(series=(), notes=tuple(note.format(table.num_rows) for note in notes))
    return table, told


def _announced(path: Path, *, is_file: bool) -> Iterator[int]:
    """Give what the packed buffers of each batch announce to unpack to, up to where the stream is damaged."""
    import pyarrow as pa
    from pyarrow import ipc

    with pa.OSFile(str(path)) as source:
        source.seek(8 if is_file else 0)
        try:
            for message in ipc.MessageReader.open_stream(source):
                if message.type in ("record batch", "dictionary"):
                    yield _unpacked_size(message)
        except (pa.ArrowException, OSError, struct.error):
            # Whoever reads the batches meets the same, and tells it.
            return


def _unpacked_size(message: Any) -> int:
    """Sum of the lengths that stand before packed buffers; 0 where none is packed. After Arrow's Message.fbs."""
    described = message.metadata.to_pybytes()
    header = _pointed(described, _field(described, _pointed(described, 0), _HEADER))
    if message.type == "dictionary":
        header = _pointed(described, _field(described, header, _DATA_OF_DICTIONARY))
    if not _field(described, header, _COMPRESSION) or message.body is None:
        return 0
    listed = _pointed(described, _field(described, header, _BUFFERS))
    (count,) = struct.unpack_from("<I", described, listed)
    total = 0
    for offset, length in struct.iter_unpack("<qq", described[listed + 4 : listed + 4 + 16 * count]):
        if length >= 8 and 0 <= offset <= message.body.size - 8:
            (unpacked,) = struct.unpack("<q", message.body.slice(offset, 8).to_pybytes())
            total += max(unpacked, 0)
    return total


def _field(described: bytes, table: int, place: int) -> int:
    """Where a field of a FlatBuffers table lies; 0 when it's left out."""
    first = table - struct.unpack_from("<i", described, table)[0]
    (size,) = struct.unpack_from("<H", described, first)
    if 4 + 2 * place >= size:
        return 0
    (offset,) = struct.unpack_from("<H", described, first + 4 + 2 * place)
    return table + offset if offset else 0


def _pointed(described: bytes, place: int) -> int:
    return place + int(struct.unpack_from("<I", described, place)[0])
