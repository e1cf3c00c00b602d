"""A universal file as a whole: time records, frequency responses, modes and measurement points."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from chladni.io.files.contents import FileContents
from chladni.io.files.uff import time_records
from chladni.io.files.uff_functions import RESPONSE_FUNCTION, is_read
from chladni.io.files.uff_header import FUNCTION_TYPES, TIME_RESPONSE
from chladni.io.files.uff_modes import MODAL_DATASETS, modal_test
from chladni.io.files.uff_records import open_uff
from chladni.io.files.uff_sets import FUNCTION_AT_NODE, HEADER, LEFT_OUT, UNITS, Dataset, listed_kinds, read_headers
from chladni.signals.errors import LogError, SetupError
from chladni.signals.frequency_response import FrequencyResponse

_PART = re.compile(rf"(?P<name>dataset \d+(?: \([^)]*\))?):? (?P<reason>.*){re.escape(LEFT_OUT)}", re.DOTALL)


def read_universal_file(
    path: Path | str, *, units: Mapping[str, str] | None = None, time_unit: str | None = None
) -> FileContents:
    """Read all that a universal file holds and that can be read.

    Parameters
    ----------
    units
        Unit by channel name, instead of that in the file.
    time_unit
        Unit of the abscissa of all time records, such as ``ms``, instead of that in the file.

    Returns
    -------
    FileContents
        What is damaged is in its `unread`, as long as something else can be read.

    Raises
    ------
    LogError
        When the file is damaged, or nothing in it can be read.
    SetupError
        When a unit is unknown, or is stated for a channel that isn't there.
    """
    path = Path(path)
    file = open_uff(path)
    headers = read_headers(file)
    kinds = {header["type"] for header in headers}
    types = {header.get("func_type") for header in headers}
    modal = RESPONSE_FUNCTION in types or not kinds.isdisjoint(MODAL_DATASETS)
    if not modal and FUNCTION_AT_NODE not in kinds:
        raise LogError(f"{path}: holds no function, mode or measurement point, but datasets {listed_kinds(headers)}")
    found, unread = FileContents(series=()), _unread(headers)
    failures: list[LogError] = []
    if modal:
        try:
            held = modal_test(file, headers, units or {})
        except LogError as error:
            failures.append(error)
            unread.append(("functions, modes and points", _reason(path, error)))
        else:
            found = replace(
                found, functions=held.response, modes=held.modes, geometry=held.geometry, notes=held.notes
            )
    others = _others(units, found.functions)
    if TIME_RESPONSE in types:
        try:
            records = time_records(file, headers, units=others, time_unit=time_unit)
        except LogError as error:
            failures.append(error)
            unread.append(("time records", _reason(path, error)))
        else:
            notes = tuple(dict.fromkeys((*records.notes, *found.notes)))
            found = replace(found, series=records.series, time_bases=records.time_bases, notes=notes)
    else:
        _require_none(path, others)
    if failures and not (found.series or found.functions or found.modes):
        raise failures[0]
    notes, damaged = _parted(path, found.notes)
    return replace(found, notes=notes, unread=(*damaged, *unread))


def _parted(path: Path, notes: Sequence[str]) -> tuple[tuple[str, ...], list[tuple[str, str]]]:
    """Tell what a part of the file was left out for from what was taken how."""
    found = {note: _PART.fullmatch(note.removeprefix(f"{path}: ")) for note in notes}
    damaged = [(part["name"], part["reason"]) for part in found.values() if part is not None]
    return tuple(note for note, part in found.items() if part is None), damaged


def _others(units: Mapping[str, str] | None, functions: FrequencyResponse | None) -> dict[str, str]:
    """Units that are stated for other channels than those of the functions."""
    channels = () if functions is None else (*functions.responses, *functions.references)
    known = {channel.name for channel in channels}
    return {name: unit for name, unit in (units or {}).items() if name not in known}


def _require_none(path: Path, units: Mapping[str, str]) -> None:
    for name in units:
        raise SetupError(f"{path}: has no channel {name!r} to give a unit; chladni info {path.name} names them")


def _unread(headers: Sequence[Dataset]) -> list[tuple[str, str]]:
    """Name the functions and datasets that nothing here makes use of."""
    types = Counter(
        int(header["func_type"])
        for header in headers
        if "func_type" in header and header["func_type"] != TIME_RESPONSE and not is_read(header)
    )
    functions = [f"{FUNCTION_TYPES.get(kind, f'function type {kind}')} ({count})" for kind, count in types.items()]
    known = (*MODAL_DATASETS, FUNCTION_AT_NODE, UNITS, HEADER)
    others = [header for header in headers if header["type"] not in known]
    datasets = [f"datasets {listed_kinds(others)}"] if others else []
    return [
        *((name, "it's no record over time and no frequency response") for name in functions),
        *((name, "they hold neither samples nor modes nor points") for name in datasets),
    ]


def _reason(path: Path, error: LogError) -> str:
    return str(error).removeprefix(f"{path}: ")
