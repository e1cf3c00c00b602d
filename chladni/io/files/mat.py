"""MATLAB ``.mat`` files: versions 5 to 7.2 by our own reader, 7.3 by HDF5."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chladni.io.atomic import atomic_path
from chladni.io.files.bounds import Budget, TooLargeError, read_whole
from chladni.io.files.contents import FileContents
from chladni.io.files.mat_elements import HEADER_BYTES, Unreadable, read_mat_elements
from chladni.io.files.mat_hdf5 import read_mat_hdf5
from chladni.io.files.named_arrays import series_of_arrays
from chladni.io.files.series_fields import SERIES_FORMAT, restated, series_fields, series_of_fields
from chladni.io.files.time_reading import TimeOptions
from chladni.io.regular_file import open_regular
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries

_MAX_DEPTH = 8


def read_mat(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    time: str | None = None,
    time_unit: str | None = None,
    units: Mapping[str, str] | None = None,
    max_bytes: int | None = None,
) -> FileContents:
    """Read our own layout (`chladni.io.files.series_fields`), or any variables with a rate or a time vector.

    Fields of structs are named with dots: ``data.accel``, those of arrays of structs and cells with a number from 0:
    ``data.signals[0].values``. Objects of MATLAB's own classes are left out and told.

    Parameters
    ----------
    sample_rate_hz
        Rate of foreign variables when nothing in the file says it.
    time
        Name of the vector of times, ``none`` when there's none whatever it's called.
    time_unit
        What its numbers count, see `chladni.io.files.time_reading.TIME_UNITS`.
    units
        Unit by channel name, instead of that in the file.
    max_bytes
        Most memory that the variables may take, unpacked; by default as `chladni.io.files.bounds` has it.

    Raises
    ------
    LogError
        When the file is damaged, too large, or holds no signal, or it is of version 7.3 and h5py isn't installed.
    SetupError
        When nothing says the sample rate, or a unit is unknown.
    """
    path = Path(path)
    budget = Budget.of_file(path, max_bytes)
    with open_regular(path, LogError) as file:
        header = file.read(HEADER_BYTES)
    try:
        if header.startswith((b"MATLAB 7.3", b"\x89HDF")):
            variables = read_mat_hdf5(path, budget)
        else:
            variables = read_mat_elements(read_whole(path), budget)
    except TooLargeError:
        raise
    except LogError as error:
        raise LogError(f"{path}: this mat file can't be read: {error}") from error
    flat, unread = _flat(variables)
    if variables.get("format") == SERIES_FORMAT:
        series = tuple(
            series_of_fields(fields, where=f"{path}, {name}")
            for name, fields in variables.items()
            if isinstance(fields, Mapping)
        )
        if not series and unread:
            raise LogError(f"{path}: {unread[0][0]}: {unread[0][1]}")
        return FileContents(series=restated(series, units, where=str(path)), unread=unread)
    options = TimeOptions(column=time, unit=time_unit, rate_hz=sample_rate_hz)
    return series_of_arrays(flat, options, where=str(path), units=units, unread=unread)


#: Of a header: a text for people, padded with spaces.
_TEXT_BYTES = 116


def write_mat(
    series: TimeSeries | Sequence[TimeSeries], path: Path | str, *, overwrite: bool = True
) -> tuple[str, ...]:
    """Write a struct for each series, in version 5: ``load('x.mat'); plot(series_1.values)``.

    See `chladni.io.files.series_fields` for the fields.

    Returns
    -------
    losses
        Empty: nothing is lost.

    Raises
    ------
    LogError
        When an array takes more than the 2 GiB that this version holds, or the file can't be written.
    """
    from scipy.io import savemat

    parts = (series,) if isinstance(series, TimeSeries) else tuple(series)
    content: dict[str, Any] = {"format": SERIES_FORMAT}
    for number, part in enumerate(parts, start=1):
        if part.values.nbytes >= 2**31:
            raise LogError(f"{path}: {part.values.nbytes} bytes of samples don't fit a mat file (2 GiB); use npz")
        content[f"series_{number}"] = {name: _as_matlab(array) for name, array in series_fields(part).items()}
    with atomic_path(path, overwrite=overwrite) as temporary:
        savemat(str(temporary), content, appendmat=False, do_compression=True)
        with temporary.open("r+b") as file:
            # SciPy writes the time here, and the platform; without them the same series give the same file.
            file.write(b"MATLAB 5.0 MAT-file, by chladni".ljust(_TEXT_BYTES))
    return ()


def _as_matlab(array: np.ndarray[Any, Any]) -> Any:
    # A text array would become a matrix of padded characters; a cell keeps the texts apart.
    return array.astype(object) if array.dtype.kind == "U" else array


def _flat(content: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[tuple[str, str], ...]]:
    """Name what lies in structs and cells with dots and numbers, and give (name, reason) of what isn't read."""
    flat: dict[str, Any] = {}
    unread: list[tuple[str, str]] = []
    waiting = [(name, value, 0) for name, value in reversed(list(content.items()))]
    while waiting:
        name, value, depth = waiting.pop()
        if isinstance(value, Unreadable):
            unread.append((name, value.reason))
        elif isinstance(value, Mapping) and depth < _MAX_DEPTH:
            waiting.extend((f"{name}.{field}", part, depth + 1) for field, part in reversed(list(value.items())))
        elif isinstance(value, list) and value and all(isinstance(part, str) for part in value):
            flat[name] = np.array(value)
        elif isinstance(value, list) and depth < _MAX_DEPTH:
            # Cells of text are names and remarks.
            parts = [(place, part) for place, part in enumerate(value) if not isinstance(part, str)]
            waiting.extend((f"{name}[{place}]", part, depth + 1) for place, part in reversed(parts))
        elif isinstance(value, np.ndarray) and value.dtype.kind == "c":
            unread.append((name, "complex numbers, which are no samples"))
        elif isinstance(value, np.ndarray) and value.ndim > 2:
            unread.append((name, f"an array of {value.ndim} axes"))
        elif isinstance(value, Mapping | list):
            unread.append((name, f"structs and cells more than {_MAX_DEPTH} deep in each other"))
        else:
            flat[name] = value
    return flat, tuple(unread)
