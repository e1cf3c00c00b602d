"""Universal files: time records of dataset 58, text and binary, with the units of dataset 164."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
from chladni.io.files.uff_sets import (
    FUNCTION_AT_NODE,
    UNITS,
    Dataset,
    cut_off_note,
    open_uff,
    read_dataset,
    read_headers,
    si_units,
    write_datasets,
)
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

_SINGLE = 2


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
        One series for each rate, start and length. The notes say where the rate was restored from an increment that
        the file rounds to six digits.

    Raises
    ------
    LogError
        When the file is damaged, or holds no time record (what it holds is named).
    SetupError
        When a unit is unknown.
    """
    path = Path(path)
    file = open_uff(path)
    headers = read_headers(path, file)
    functions = [number for number, header in enumerate(headers) if header.get("type") == FUNCTION_AT_NODE]
    records = [number for number in functions if headers[number].get("func_type") == TIME_RESPONSE]
    if not records:
        raise LogError(f"{path}: holds no time record (function type 1), but {_listed(headers, functions)}")
    names = _names([headers[number] for number in records])
    _require_known(path, names, units)
    system = next((header for header in headers if header.get("type") == UNITS), None)
    notes = cut_off_note(path)
    # Records of one measurement share their time axis; others in the same file may not.
    groups: dict[tuple[Any, ...], list[tuple[Dataset, Channel]]] = {}
    for number, name in zip(records, names, strict=True):
        dataset = _time_record(path, file, number)
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
    datasets: list[Dataset] = [si_units()]
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
    write_datasets(path, datasets, overwrite=overwrite)
    return tuple(losses)


def _time_record(path: Path, file: Any, number: int) -> Dataset:
    dataset = read_dataset(path, file, number)
    if np.iscomplexobj(dataset["data"]):
        raise LogError(f"{path}: dataset {number + 1} is a time record of complex values, which isn't a measurement")
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


def _record(header: Dataset, series: TimeSeries, row: int, *, binary: bool) -> Dataset:
    return {
        **header,
        "type": FUNCTION_AT_NODE,
        "binary": int(binary),
        "func_type": TIME_RESPONSE,
        "abscissa_spacing": 1,
        "x": np.array([0.0, 1.0 / series.sample_rate_hz]),
        "data": np.asarray(series.values[row], dtype=np.float64),
    }
