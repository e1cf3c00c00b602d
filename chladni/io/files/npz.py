"""NumPy ``.npz`` and ``.npy`` files, never unpickled."""

import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.atomic import atomic_write
from chladni.io.files.bounds import Budget
from chladni.io.files.contents import FileContents, one_line
from chladni.io.files.named_arrays import series_of_arrays
from chladni.io.files.series_fields import SERIES_FORMAT, restated, series_fields, series_of_fields
from chladni.io.files.time_reading import TimeOptions
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries
from chladni.signals.wording import counted

_MAX_HEADER = 10_000
# Vectors and matrices are signals; of our own layout also texts.
_MOST_AXES = 2
_READ_KINDS = "fiubmMUS"
# What zipfile and NumPy raise for archives whose bytes are wrong: a flag that claims encryption is a RuntimeError, an
# offset that points nowhere an OSError.
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    ValueError,
    TypeError,
    EOFError,
    OSError,
    KeyError,
    RuntimeError,
    struct.error,
    SyntaxError,
    tokenize.TokenError,
)


def read_npz(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    units: Mapping[str, str] | None = None,
    max_bytes: int | None = None,
) -> FileContents:
    """Read our own layout (`chladni.io.files.series_fields`), or any arrays with a rate or a time vector.

    Parameters
    ----------
    sample_rate_hz
        Rate of foreign arrays when nothing in the file says it.
    time
        Name of the vector of times, ``none`` when there's none whatever it's called.
    time_unit
        What its numbers count, see `chladni.io.files.time_reading.TIME_UNITS`.
    units
        Unit by channel name, instead of that in the file.
    max_bytes
        Most memory that the arrays may take together, by default as `chladni.io.files.bounds` has it; their headers
        are checked before anything is unpacked.

    Raises
    ------
    LogError
        When the file is damaged, too large, holds Python objects, or no signal.
    SetupError
        When nothing says the sample rate, or a unit is unknown.
    """
    path = Path(path)
    try:
        with zipfile.ZipFile(path) as archive:
            wanted, unread = _wanted(path, archive, Budget.of_file(path, max_bytes))
        with np.load(path, allow_pickle=False) as arrays:
            content = {name: arrays[name] for name in wanted}
    except _DAMAGED as error:
        raise LogError(f"{path}: this npz file can't be read: {one_line(error)}") from error
    if str(content.get("format", "")) != SERIES_FORMAT:
        options = TimeOptions(column=time, unit=time_unit, rate_hz=sample_rate_hz)
        return series_of_arrays(content, options, where=str(path), units=units, unread=unread)
    groups = _groups(content)
    series = [series_of_fields(fields, where=f"{path}, {name}") for name, fields in groups.items()]
    return FileContents(series=restated(series, units, where=str(path)))


def read_npy(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    units: Mapping[str, str] | None = None,
    max_bytes: int | None = None,
) -> FileContents:
    """Read one array: a vector, a matrix with a column or row for each channel, or a structured array.

    The channels are called as the file is, with a number; those of a structured array as its fields are.

    Parameters
    ----------
    sample_rate_hz
        Samples a second, which such a file says nowhere.
    time
        Name of the column that holds times, such as ``acc[0]`` of ``acc.npy``.
    time_unit, units, max_bytes
        As in `read_npz`.

    Raises
    ------
    LogError
        When the file is damaged, too large, holds Python objects, or no signal.
    SetupError
        When nothing says the sample rate, or a unit is unknown.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            shape, dtype = _header(file)
            held = path.stat().st_size - file.tell()
            size = _size_held(str(path), shape, dtype, held)
            Budget.of_file(path, max_bytes).take(size)
        array = np.load(path, allow_pickle=False)
    except _DAMAGED as error:
        raise LogError(f"{path}: this npy file can't be read: {one_line(error)}") from error
    fields = {name: array[name] for name in dtype.names} if dtype.names else {path.stem: array}
    options = TimeOptions(column=time, unit=time_unit, rate_hz=sample_rate_hz)
    behind = (f"{counted(held - size, 'byte')} at the end", "they lie behind the numbers that the header announces")
    unread = (behind,) if held > size else ()
    return series_of_arrays(fields, options, where=str(path), units=units, unread=unread)


def write_npz(
    series: TimeSeries | Sequence[TimeSeries], path: Path | str, *, overwrite: bool = True
) -> tuple[str, ...]:
    """Write all there is of the series, compressed; see `chladni.io.files.series_fields` for the names.

    Returns
    -------
    losses
        Empty: nothing is lost.

    Examples
    --------
    >>> import tempfile
    >>> from chladni.signals.channel import Channel
    >>> x = TimeSeries(values=np.ones((1, 4)), sample_rate_hz=8.0, channels=(Channel(name="a", unit="N"),))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = write_npz(x, Path(folder) / "x.npz")
    ...     read_npz(Path(folder) / "x.npz").series[0].channels[0].unit
    'N'
    """
    parts = (series,) if isinstance(series, TimeSeries) else tuple(series)
    content: dict[str, NDArray[Any]] = {"format": np.array(SERIES_FORMAT)}
    for number, part in enumerate(parts, start=1):
        content |= {f"series_{number}.{name}": array for name, array in series_fields(part).items()}
    # As np.savez_compressed writes; its older versions leave the archive open where the disk is full.
    with atomic_write(path, overwrite=overwrite) as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in content.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                np.lib.format.write_array(member, array, allow_pickle=False)
    return ()


def _groups(content: Mapping[str, NDArray[Any]]) -> dict[str, dict[str, NDArray[Any]]]:
    groups: dict[str, dict[str, NDArray[Any]]] = {}
    for name, array in content.items():
        group, dot, field = name.partition(".")
        if dot:
            groups.setdefault(group, {})[field] = array
    return groups


def _wanted(path: Path, archive: zipfile.ZipFile, budget: Budget) -> tuple[list[str], tuple[tuple[str, str], ...]]:
    """Give the names of the arrays that may be signals, and why others aren't read; nothing is unpacked.

    Raises
    ------
    LogError
        When an array holds objects, or less than it announces, or all together take more than is allowed.
    """
    wanted, unread = [], []
    for entry in archive.infolist():
        name, where = entry.filename.removesuffix(".npy"), f"{path}: {entry.filename}"
        with archive.open(entry) as file:
            shape, dtype = _header(file)
        size = _size_held(where, shape, dtype, entry.file_size)
        if len(shape) > _MOST_AXES or dtype.kind not in _READ_KINDS:
            unread.append((name, f"{dtype} {shape}, which are no samples"))
            continue
        budget.take(size)
        wanted.append(name)
    return wanted, tuple(unread)


def _size_held(where: str, shape: tuple[int, ...], dtype: np.dtype[Any], held: int) -> int:
    """Give the bytes that an array takes; NumPy would allocate what its header announces, whatever is there."""
    if dtype.hasobject:
        raise LogError(f"{where} holds Python objects, which are never loaded; store numbers")
    # Python integers: a product of lengths from a file may well overflow 64 bits.
    size = dtype.itemsize * int(np.prod([int(length) for length in shape], dtype=object))
    if min(shape, default=0) < 0 or size > held:
        raise LogError(f"{where} announces {size} bytes and holds {held}")
    return size


def _header(file: Any) -> tuple[tuple[int, ...], np.dtype[Any]]:
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file, max_header_size=_MAX_HEADER)
    return shape, dtype
