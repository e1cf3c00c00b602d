"""MATLAB ``.mat`` files of versions 5 to 7.2."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chladni.io.atomic import atomic_path
from chladni.io.files.contents import MAX_BYTES, FileContents
from chladni.io.files.mat_elements import HEADER_BYTES, read_mat_elements
from chladni.io.files.named_arrays import series_of_arrays
from chladni.io.files.series_fields import SERIES_FORMAT, series_fields, series_of_groups
from chladni.signals.errors import LogError
from chladni.signals.time_series import TimeSeries

_MAX_DEPTH = 8


def read_mat(
    path: Path | str,
    *,
    sample_rate_hz: float | None = None,
    units: Mapping[str, str] | None = None,
    max_bytes: int = MAX_BYTES,
) -> FileContents:
    """Read our own layout (`chladni.io.files.series_fields`), or any variables with a rate or a time vector.

    Fields of structs are named with dots: ``data.accel``.

    Parameters
    ----------
    sample_rate_hz
        Rate of foreign variables when nothing in the file says it.
    units
        Unit by channel name, instead of that in the file.
    max_bytes
        Most memory that the variables may take, unpacked.

    Raises
    ------
    LogError
        When the file is of version 7.3, damaged, too large, or holds no signal.
    SetupError
        When nothing says the sample rate, or a unit is unknown.
    """
    path = Path(path)
    raw = _raw(path, max_bytes)
    try:
        variables = read_mat_elements(raw, max_bytes=max_bytes)
    except LogError as error:
        raise LogError(f"{path}: this mat file can't be read: {error}") from error
    if variables.get("format") == SERIES_FORMAT:
        groups = {name: fields for name, fields in variables.items() if isinstance(fields, Mapping)}
        return FileContents(series=series_of_groups(groups, where=str(path), units=units))
    return series_of_arrays(_flat(variables), where=str(path), sample_rate_hz=sample_rate_hz, units=units)


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
    return ()


def _as_matlab(array: np.ndarray[Any, Any]) -> Any:
    # A text array would become a matrix of padded characters; a cell keeps the texts apart.
    return array.astype(object) if array.dtype.kind == "U" else array


def _flat(content: Mapping[str, Any], prefix: str = "", depth: int = 0) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in content.items():
        if isinstance(value, Mapping) and depth < _MAX_DEPTH:
            flat |= _flat(value, f"{prefix}{name}.", depth + 1)
        elif not isinstance(value, Mapping):
            flat[prefix + name] = value
    return flat


def _raw(path: Path, max_bytes: int) -> bytes:
    with path.open("rb") as file:
        header = file.read(HEADER_BYTES)
    if header.startswith((b"MATLAB 7.3", b"\x89HDF")):
        raise LogError(
            f"{path}: is a version 7.3 file (HDF5), which isn't read; save it in MATLAB with "
            f"save('{path.name}', '-v7')"
        )
    if len(header) < HEADER_BYTES or header[126:128] not in (b"IM", b"MI"):
        raise LogError(f"{path}: is no mat file of versions 5 to 7.2")
    # The file itself is held in memory beside its arrays.
    if path.stat().st_size > max_bytes:
        raise LogError(
            f"{path}: has {path.stat().st_size} bytes, {max_bytes} are allowed; raise max_bytes to read it"
        )
    return path.read_bytes()
