"""Universal files: time records of dataset 58, text and binary, with the units of dataset 164."""

import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.atomic import atomic_path
from chladni.io.files.contents import (
    FileContents,
    placed_rows,
    require_no_gaps,
    series_of_rows,
    times_to_ns,
    unit_of,
)
from chladni.io.files.uff_header import (
    FUNCTION_TYPES,
    TIME_RESPONSE,
    channel_of_header,
    header_of_channel,
    rate_of_header,
    says_rate,
    start_of_header,
    unit_of_header,
)
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

Dataset = dict[str, Any]

_FUNCTION_AT_NODE = 58
_UNITS = 164
# Fewest characters or bytes that a value of each ordinate type takes in a file: single, double, complex.
_LEAST_BYTES = {2: 4, 4: 8, 5: 8, 6: 16}
_SINGLE = 2
# Enough for a last line and the blanks or zeros behind it.
_TAIL_BYTES = 4096


def read_uff(path: Path | str, *, units: Mapping[str, str] | None = None) -> FileContents:
    """Read the time records (function type 1) of a universal file.

    A channel is named by the first line of its record, with its node added where that isn't unique; its point and
    direction are the response node and direction. Its unit is the label of the ordinate; without one it follows from
    the type of the ordinate, in the units of dataset 164 (SI without).

    Parameters
    ----------
    units
        Unit by channel name, instead of that in the file.

    Returns
    -------
    FileContents
        One series for each rate, start and length. The notes name functions that were left out, and say where the
        rate was restored from an increment that the file rounds to six digits.

    Raises
    ------
    LogError
        When the file is damaged, or holds no time record (what it holds is named).
    SetupError
        When a unit is unknown.
    """
    path = Path(path)
    file = _uff(path)
    headers = _headers(path, file)
    functions = [number for number, header in enumerate(headers) if header.get("type") == _FUNCTION_AT_NODE]
    records = [number for number in functions if headers[number].get("func_type") == TIME_RESPONSE]
    if not records:
        raise LogError(f"{path}: holds no time record (function type 1), but {_listed(headers, functions)}")
    names = _names([headers[number] for number in records])
    _require_known(path, names, units)
    system = next((header for header in headers if header.get("type") == _UNITS), None)
    notes = _cut_off(path) + _left_out(path, headers, [number for number in functions if number not in records])
    # Records of one measurement share their time axis; others in the same file may not.
    groups: dict[tuple[Any, ...], list[tuple[Dataset, Channel]]] = {}
    for number, name in zip(records, names, strict=True):
        dataset = _dataset(path, file, number)
        unit, factor = unit_of_header(dataset, system)
        if name in (units or {}):
            unit, factor = unit_of(name, unit, units), 1.0
        channel = channel_of_header(dataset, name, unit)
        dataset["data"] = _values(dataset, factor)
        groups.setdefault(_time_axis(dataset), []).append((dataset, channel))
    parts = [_series(path, group) for group in groups.values()]
    notes += tuple(note for part in parts for note in part.notes) + _rate_notes(path, headers, records)
    return FileContents(series=tuple(series for part in parts for series in part.series), notes=notes)


def write_uff(
    series: TimeSeries | Sequence[TimeSeries], path: Path | str, *, binary: bool = True, overwrite: bool = True
) -> tuple[str, ...]:
    """Write each channel as a time record in double precision, after a dataset 164 that says SI.

    The fifth line of a record holds the rate and the start in full, which the record's own fields round.

    Parameters
    ----------
    binary
        Whether to write dataset 58b, which is exact; 58 is text with twelve digits.

    Returns
    -------
    losses
        Sentences on what the file doesn't hold.

    Raises
    ------
    LogError
        For gaps, fewer than two samples, or when the file can't be written.
    """
    parts = (series,) if isinstance(series, TimeSeries) else tuple(series)
    datasets: list[Dataset] = [_si_units()]
    losses: list[str] = []
    for part in parts:
        require_no_gaps(part, "a universal file")
        if part.samples < 2:
            raise LogError(f"{part.channels[0].name}: {part.samples} sample is no time record; give at least two")
        for row, channel in enumerate(part.channels):
            header, lost = header_of_channel(channel, part)
            losses += lost
            datasets.append(_record(header, part, row, binary=binary))
    if not binary:
        losses.append("A text universal file rounds values to twelve digits.")
    _write(path, datasets, overwrite=overwrite)
    return tuple(losses)


def _uff(path: Path) -> Any:
    import pyuff

    if not path.is_file():
        raise LogError(f"{path}: no such file")
    try:
        return pyuff.UFF(str(path))
    except Exception as error:  # pyuff raises nothing more specific
        raise LogError(f"{path}: this universal file can't be read: {error}") from error


def _cut_off(path: Path) -> tuple[str, ...]:
    """Say so when the file ends anywhere but behind a dataset; pyuff passes over what isn't closed."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - _TAIL_BYTES))
        tail = file.read().rstrip(b" \t\r\n\0\x1a")
    # Behind binary values the closing line begins without a line break.
    if tail.endswith(b"    -1") or tail.rpartition(b"\n")[2].strip() == b"-1":
        return ()
    note = (
        f"{path}: doesn't end with the line -1 that closes a dataset; it was cut off, and what stands after the last "
        "whole dataset is lost."
    )
    return (note,)


def _headers(path: Path, file: Any) -> list[Dataset]:
    """Read what is in front of the data, and check that the data it announces are there."""
    count = int(file.get_n_sets())
    if count == 0:
        raise LogError(
            f"{path}: holds no whole dataset between lines of -1; is it a universal file, or was it cut off?"
        )
    headers = []
    for number, kind in enumerate(file.get_set_types()):
        if kind not in (_FUNCTION_AT_NODE, _UNITS):
            headers.append({"type": int(kind)})
            continue
        try:
            headers.append(dict(file.read_sets(number, header_only=True)))
        except Exception as error:  # pyuff raises nothing more specific
            raise LogError(f"{path}: dataset {number + 1} (type {kind}) can't be read: {error}") from error
    # Pyuff builds the abscissa from the announced count, so it must be believable before the values are read.
    size = path.stat().st_size
    for number, header in enumerate(headers):
        least = _LEAST_BYTES.get(header.get("ord_data_type", 0), 0) * header.get("num_pts", 0)
        if header["type"] == _FUNCTION_AT_NODE and not 0 < least <= size:
            raise LogError(
                f"{path}: dataset {number + 1} announces {header.get('num_pts')} values of type "
                f"{header.get('ord_data_type')}, which a file of {size} bytes doesn't hold"
            )
    return headers


def _dataset(path: Path, file: Any, number: int) -> Dataset:
    try:
        dataset = dict(file.read_sets(number))
    except Exception as error:  # pyuff raises nothing more specific
        raise LogError(
            f"{path}: the values of dataset {number + 1} can't be read: {error}; binary files of some exporters hold "
            "line breaks inside the data: export as text (58) or convert with pyuff.fix_58b"
        ) from error
    found, announced = len(dataset["data"]), dataset["num_pts"]
    if found < announced:
        raise LogError(f"{path}: dataset {number + 1} announces {announced} values and holds {found}; it's cut short")
    if np.iscomplexobj(dataset["data"]):
        raise LogError(f"{path}: dataset {number + 1} is a time record of complex values, which isn't a measurement")
    # Padding behind the last binary value would otherwise count as samples.
    dataset["data"], dataset["x"] = dataset["data"][:announced], dataset["x"][:announced]
    return dataset


def _time_axis(dataset: Dataset) -> tuple[Any, ...]:
    if dataset["abscissa_spacing"] == 0:
        return ("uneven", dataset["x"].tobytes())
    return (rate_of_header(dataset), start_of_header(dataset), len(dataset["data"]))


def _series(path: Path, group: list[tuple[Dataset, Channel]]) -> FileContents:
    first = group[0][0]
    rows = [dataset["data"] for dataset, _ in group]
    channels = [channel for _, channel in group]
    start_ns = start_of_header(first)
    if first["abscissa_spacing"] == 0:
        return placed_rows(
            times_to_ns(first["x"], start_ns=start_ns, where=str(path)), rows, channels, where=str(path)
        )
    rate_hz = rate_of_header(first)
    if rate_hz is None:
        raise LogError(f"{path}: {channels[0].name}: the increment {first['abscissa_inc']} s is no sample interval")
    series = series_of_rows(rows, channels, sample_rate_hz=rate_hz, start_time_ns=start_ns)
    return FileContents(series=(series,))


def _values(dataset: Dataset, factor: float) -> NDArray[np.floating[Any]]:
    # Text holds decimals, which double precision keeps better; binary single precision is exact in single.
    single = dataset["ord_data_type"] == _SINGLE and dataset["binary"]
    values: NDArray[np.floating[Any]] = dataset["data"].astype(np.float32 if single else np.float64)
    return values if factor == 1.0 else values * factor


def _names(headers: list[Dataset]) -> list[str]:
    titles = [str(header["id1"]).strip() for header in headers]
    counts = Counter(titles)
    names = []
    for number, (title, header) in enumerate(zip(titles, headers, strict=True), start=1):
        plain = title if title not in ("", "NONE") else ""
        unique = plain and counts[title] == 1
        names.append(plain if unique else f"{plain or 'record'} {header['rsp_node']}:{header['rsp_dir']:+d}")
        if names[-1] in names[:-1]:
            names[-1] = f"{names[-1]} {number}"
    return names


def _require_known(path: Path, names: list[str], units: Mapping[str, str] | None) -> None:
    for name in units or {}:
        if name not in names:
            raise SetupError(f"{path}: has no channel {name!r} to give a unit; channels: {', '.join(names)}")


def _listed(headers: list[Dataset], functions: list[int]) -> str:
    if not functions:
        kinds = Counter(header["type"] for header in headers)
        return "datasets " + ", ".join(f"{kind} ({count})" for kind, count in kinds.items())
    kinds = Counter(int(headers[number]["func_type"]) for number in functions)
    return ", ".join(
        f"{FUNCTION_TYPES.get(kind, f'function type {kind}')} ({count})" for kind, count in kinds.items()
    )


def _left_out(path: Path, headers: list[Dataset], others: list[int]) -> tuple[str, ...]:
    return (f"{path}: left out, being no time records: {_listed(headers, others)}.",) if others else ()


def _rate_notes(path: Path, headers: list[Dataset], records: list[int]) -> tuple[str, ...]:
    increments = {
        headers[number]["abscissa_inc"]: rate_of_header(headers[number])
        for number in records
        if headers[number]["abscissa_spacing"] != 0 and not says_rate(headers[number])
    }
    return tuple(
        f"{path}: the sample rate {rate_hz:.12g} Hz was taken for the rounded increment {increment:g} s."
        for increment, rate_hz in increments.items()
        if rate_hz is not None and rate_hz != 1.0 / increment
    )


def _si_units() -> Dataset:
    return {
        "type": _UNITS,
        "units_code": 1,
        "units_description": "SI",
        "temp_mode": 1,
        "length": 1.0,
        "force": 1.0,
        "temp": 1.0,
        "temp_offset": 0.0,
    }


def _record(header: Dataset, series: TimeSeries, row: int, *, binary: bool) -> Dataset:
    return {
        **header,
        "type": _FUNCTION_AT_NODE,
        "binary": int(binary),
        "func_type": TIME_RESPONSE,
        "abscissa_spacing": 1,
        "x": np.array([0.0, 1.0 / series.sample_rate_hz]),
        "data": np.asarray(series.values[row], dtype=np.float64),
    }


def _write(path: Path | str, datasets: list[Dataset], *, overwrite: bool) -> None:
    import pyuff

    with atomic_path(path, overwrite=overwrite) as temporary, warnings.catch_warnings():
        # Pyuff leaves closing its second handle to the interpreter, which does it before the call returns.
        warnings.simplefilter("ignore", ResourceWarning)
        pyuff.UFF(str(temporary)).write_sets(datasets, mode="overwrite")
