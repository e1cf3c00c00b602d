"""Universal files: time records of dataset 58, text and binary, with the units of dataset 164."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isclose
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
)
from chladni.io.files.uff_header import (
    FUNCTION_TYPES,
    TIME_RESPONSE,
    channel_of_header,
    header_of_channel,
    rate_of_header,
    says_rate,
    start_of_header,
)
from chladni.io.files.uff_records import UniversalFile, open_uff
from chladni.io.files.uff_sets import (
    FUNCTION_AT_NODE,
    HEADER,
    LEFT_OUT,
    UNITS,
    Dataset,
    cut_off_note,
    listed_kinds,
    read_dataset,
    read_headers,
    si_units,
    write_datasets,
)
from chladni.io.files.uff_units import FoundUnit, abscissa_unit, ordinate_unit, unit_sentences
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries
from chladni.signals.unit_labels import read_label

_SINGLE = 2
# Of a product and a quotient in double precision.
_ROUNDING = 1e-15


def read_uff(
    path: Path | str, *, units: Mapping[str, str] | None = None, time_unit: str | None = None
) -> FileContents:
    """Read the time records (function type 1) of a universal file.

    A channel is named by the first line of its record, with its node added where that isn't unique; its point and
    direction are the response node and direction. Its unit is the label of the ordinate; without one it follows from
    the type of the ordinate, in the units of dataset 164 (SI without).

    Parameters
    ----------
    units
        Unit by channel name, instead of that in the file.
    time_unit
        Unit of the abscissa of all records, such as ``ms``, instead of that in the file.

    Returns
    -------
    FileContents
        One series for each rate, start and length. The notes name what was left out and why, channels whose unit the
        file leaves open or contradicts itself in, and rates restored from an increment of six digits.

    Raises
    ------
    LogError
        When the file is no universal file, or no time record in it can be read.
    SetupError
        When a unit that is stated here is unknown.
    """
    file = open_uff(Path(path))
    headers = read_headers(file)
    found = time_records(file, headers, units=units, time_unit=time_unit)
    return replace(found, notes=found.notes + _left_out(file.path, headers))


def time_records(
    file: UniversalFile, headers: Sequence[Dataset], *, units: Mapping[str, str] | None, time_unit: str | None
) -> FileContents:
    """Read what `read_uff` reads, without a word on all else."""
    path = file.path
    numbers = [number for number, header in enumerate(headers) if header.get("func_type") == TIME_RESPONSE]
    names = dict(zip(numbers, _names([headers[number] for number in numbers]), strict=True))
    _require_known(path, names.values(), units)
    records, mistakes = [], [header["mistake"] for header in headers if "mistake" in header]
    for number, name in names.items():
        try:
            records.append(_time_record(file, headers, number, name, units, time_unit))
        except LogError as error:
            mistakes.append(str(error))
    if not records:
        raise LogError(
            mistakes[0]
            if mistakes
            else f"{path}: holds no time record (function type 1), but {_listed(headers, range(len(headers)))}"
        )
    notes = cut_off_note(file) + tuple(f"{one}{LEFT_OUT}" for one in mistakes)
    notes += tuple(note for record in records for note in record.notes)
    unit_notes: dict[str, list[str]] = {}
    for record in records:
        for note in record.unit_notes:
            unit_notes.setdefault(note, []).append(record.channel.name)
    notes += tuple(unit_sentences(path, unit_notes, "--read units=NAME:UNIT states another"))
    # Records of one measurement share their time axis; others in the same file may not.
    groups: dict[tuple[Any, ...], list[_Record]] = {}
    for record in records:
        groups.setdefault(record.axis, []).append(record)
    parts = [_series(path, group) for group in groups.values()]
    notes += tuple(note for part in parts for note in part.notes) + _rate_notes(path, records)
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Record:
    """A time record in SI; the second of its abscissa in seconds, and what was taken how."""

    dataset: Dataset
    channel: Channel
    values: NDArray[np.floating]
    second: float
    start_ns: int
    notes: tuple[str, ...]
    unit_notes: tuple[str, ...]

    @property
    def rate_hz(self) -> float | None:
        return rate_of_header(self.dataset, self.second)

    @property
    def uneven(self) -> bool:
        return bool(self.dataset["abscissa_spacing"] == 0)

    @property
    def axis(self) -> tuple[Any, ...]:
        """What records of one measurement share."""
        if self.uneven:
            return ("uneven", self.second, self.dataset["x"].tobytes())
        return (self.rate_hz, self.start_ns, len(self.values))


def _time_record(
    file: UniversalFile,
    headers: Sequence[Dataset],
    number: int,
    name: str,
    units: Mapping[str, str] | None,
    time_unit: str | None,
) -> _Record:
    where = f"{file.path}: dataset {number + 1} ({name})"
    dataset, notes = read_dataset(file, headers, number)
    if np.iscomplexobj(dataset["data"]):
        raise LogError(f"{where} is a time record of complex values, which isn't a measurement")
    if time_unit is not None:
        dataset |= {"abscissa_axis_units_lab": time_unit, "abscissa_spec_data_type": 0}
    try:
        time = abscissa_unit(dataset, "s")
        start_ns = start_of_header(dataset, time.factor)
    except LogError as error:
        raise LogError(f"{where} {error}; say what it is over with --read time_unit=ms or the like") from error
    if dataset["abscissa_spacing"] != 0 and rate_of_header(dataset, time.factor) is None:
        raise LogError(f"{where}: the increment {dataset['abscissa_inc']} s is no sample interval")
    found = ordinate_unit(dataset) if name not in (units or {}) else _stated_unit(where, dataset, (units or {})[name])
    return _Record(
        dataset=dataset,
        channel=channel_of_header(dataset, name, found.unit),
        values=_values(dataset, found.factor),
        second=time.factor,
        start_ns=start_ns,
        notes=notes + tuple(f"{where}: {note}." for note in time.notes),
        unit_notes=found.notes,
    )


def _stated_unit(where: str, dataset: Dataset, label: str) -> FoundUnit:
    quantity = ordinate_unit({**dataset, "ordinate_axis_units_lab": ""}).unit
    try:
        factor, unit = read_label(label, quantity=None if quantity == "1" else quantity)
    except SetupError as error:
        raise SetupError(f"{where}: {error}") from error
    return FoundUnit(factor=factor, unit=unit)


def _series(path: Path, group: list[_Record]) -> FileContents:
    first = group[0]
    rows = [record.values for record in group]
    channels = [record.channel for record in group]
    if first.uneven:
        times_s = first.dataset["x"] * first.second
        return placed_rows(
            times_to_ns(times_s, start_ns=first.start_ns, where=str(path)), rows, channels, where=str(path)
        )
    if first.rate_hz is None:
        raise AssertionError("a record without a rate isn't read")
    series = series_of_rows(rows, channels, sample_rate_hz=first.rate_hz, start_time_ns=first.start_ns)
    return FileContents(series=(series,))


def _values(dataset: Dataset, factor: float) -> NDArray[np.floating]:
    # Text holds decimals, which double precision keeps better; binary single precision is exact in single.
    single = dataset["ord_data_type"] == _SINGLE and dataset["binary"]
    # Damaged binary values may be anything; what isn't finite counts as missing.
    with np.errstate(over="ignore", invalid="ignore"):
        values: NDArray[np.floating] = dataset["data"].astype(np.float32 if single else np.float64)
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


def _require_known(path: Path, names: Iterable[str], units: Mapping[str, str] | None) -> None:
    known = list(names)
    for name in units or {}:
        if name not in known:
            raise SetupError(f"{path}: has no channel {name!r} to give a unit; channels: {', '.join(known)}")


def _listed(headers: Sequence[Dataset], numbers: Iterable[int]) -> str:
    """Functions by their type, then other datasets, but those of units and of the file itself."""
    chosen = [headers[number] for number in numbers]
    kinds = Counter(header["func_type"] for header in chosen if "func_type" in header)
    listed = [f"{FUNCTION_TYPES.get(kind, f'function type {kind}')} ({count})" for kind, count in kinds.items()]
    others = [header for header in chosen if header["type"] not in (FUNCTION_AT_NODE, UNITS, HEADER)]
    if others or not listed:
        listed.append(f"datasets {listed_kinds(others or chosen)}")
    return ", ".join(listed)


def _left_out(path: Path, headers: Sequence[Dataset]) -> tuple[str, ...]:
    others = [
        number
        for number, header in enumerate(headers)
        if header.get("func_type", TIME_RESPONSE) != TIME_RESPONSE
        or header["type"] not in (FUNCTION_AT_NODE, UNITS, HEADER)
    ]
    return (f"{path}: left out, being no time records: {_listed(headers, others)}.",) if others else ()


def _rate_notes(path: Path, records: Sequence[_Record]) -> tuple[str, ...]:
    increments = {
        record.dataset["abscissa_inc"] * record.second: record.rate_hz
        for record in records
        if not record.uneven and not says_rate(record.dataset)
    }
    return tuple(
        f"{path}: the sample rate {rate_hz:.12g} Hz was taken for the rounded increment {increment:g} s."
        for increment, rate_hz in increments.items()
        if rate_hz is not None and not isclose(rate_hz * increment, 1.0, rel_tol=_ROUNDING)
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
