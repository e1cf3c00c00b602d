"""A universal file as a whole: time records, frequency responses, modes and measurement points."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from chladni.io.files.contents import FileContents
from chladni.io.files.uff import read_uff
from chladni.io.files.uff_functions import COHERENCE, GENERAL, RESPONSE_FUNCTION
from chladni.io.files.uff_header import FUNCTION_TYPES, TIME_RESPONSE
from chladni.io.files.uff_modes import read_uff_modes
from chladni.io.files.uff_nodes import NODES
from chladni.io.files.uff_sets import FUNCTION_AT_NODE, open_uff, read_headers
from chladni.io.files.uff_shapes import SHAPES
from chladni.signals.errors import LogError, SetupError
from chladni.signals.frequency_response import FrequencyResponse


def read_universal_file(path: Path | str, *, units: Mapping[str, str] | None = None) -> FileContents:
    """Read all that a universal file holds and that can be read.

    Parameters
    ----------
    units
        Unit by channel name, instead of that in the file.

    Returns
    -------
    FileContents
        What is damaged is in its `unread`, as long as something else can be read.

    Raises
    ------
    LogError
        When the file is damaged, or nothing in it can be read.
    SetupError
        When a unit is unknown.
    """
    path = Path(path)
    headers = read_headers(path, open_uff(path))
    types = Counter(int(header["func_type"]) for header in headers if header["type"] == FUNCTION_AT_NODE)
    modal = RESPONSE_FUNCTION in types or bool({NODES, SHAPES} & {header["type"] for header in headers})
    found, unread = FileContents(series=()), _of_other_types(types)
    failures: list[LogError] = []
    if not types and not modal:
        kinds = Counter(header["type"] for header in headers)
        listed = ", ".join(f"{kind} ({count})" for kind, count in kinds.items())
        raise LogError(f"{path}: holds no function, mode or measurement point, but datasets {listed}")
    if modal:
        try:
            held = read_uff_modes(path, units=units)
        except LogError as error:
            failures.append(error)
            unread.append(("functions, modes and points", _reason(path, error)))
        else:
            found = replace(
                found, functions=held.response, modes=held.modes, geometry=held.geometry, notes=held.notes
            )
    if TIME_RESPONSE in types:
        try:
            records = read_uff(path, units=_others(units, found.functions))
        except LogError as error:
            failures.append(error)
            unread.append(("time records", _reason(path, error)))
        else:
            notes = tuple(dict.fromkeys((*records.notes, *found.notes)))
            found = replace(found, series=records.series, time_bases=records.time_bases, notes=notes)
    else:
        _require_none(path, _others(units, found.functions))
    if failures and not (found.series or found.functions or found.modes):
        raise failures[0]
    return replace(found, unread=(*found.unread, *unread))


def _others(units: Mapping[str, str] | None, functions: FrequencyResponse | None) -> dict[str, str]:
    """Units that are stated for other channels than those of the functions."""
    channels = () if functions is None else (*functions.responses, *functions.references)
    known = {channel.name for channel in channels}
    return {name: unit for name, unit in (units or {}).items() if name not in known}


def _require_none(path: Path, units: Mapping[str, str]) -> None:
    for name in units:
        raise SetupError(f"{path}: has no channel {name!r} to give a unit; chladni info {path.name} names them")


def _of_other_types(types: Mapping[int, int]) -> list[tuple[str, str]]:
    """Functions of types that nothing here makes use of; the coherence and our own error bars go with a response."""
    return [
        (f"{FUNCTION_TYPES.get(kind, f'function type {kind}')} ({count})", "it's no record over time and no response")
        for kind, count in types.items()
        if kind not in (TIME_RESPONSE, RESPONSE_FUNCTION, COHERENCE, GENERAL)
    ]


def _reason(path: Path, error: LogError) -> str:
    return str(error).removeprefix(f"{path}: ")
