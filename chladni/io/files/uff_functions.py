"""Frequency responses as functions at nodes: dataset 58, text and binary."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.io.files.uff_header import DIRECTIONS, quantity_code, unit_of_header
from chladni.io.files.uff_sets import FUNCTION_AT_NODE, Dataset, read_dataset
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance
from chladni.signals.units import si_factor
from chladni.signals.wording import counted

GENERAL, RESPONSE_FUNCTION, COHERENCE = 0, 4, 6
_FREQUENCY = 18
_LABEL_LENGTH = 20
_ENTITY_LENGTH = 10
_ID_LENGTH = 80
_STD = "one sigma of the magnitude"
# Our own fifth line: the record rounds start and step to six digits.
_AXIS = re.compile(r"^start_hz=(?P<start>[-+.e\d]{1,30}) step_hz=(?P<step>[-+.e\d]{1,30})$")
_SIX_DIGITS = 1e-5
_EVEN = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeDirection:
    """Where a channel stands in a universal file: its node and signed axis, and the name of its point."""

    node: int
    axis: int
    entity: str


Functions = dict[tuple[Channel, Channel], Dataset]


def function_datasets(
    response: FrequencyResponse, places: Mapping[str, NodeDirection], *, binary: bool
) -> tuple[list[Dataset], tuple[str, ...]]:
    """Give the datasets 58 of frequency responses, and sentences on what doesn't fit them.

    Each function is written with its channels' names on the first two identification lines, and its error bars as a
    general function of the same place; the coherence of a single reference too.

    Parameters
    ----------
    places
        Where each channel stands, by name.
    """
    # Text files can't hold NaN, and noise on lines without excitation would be fitted by whoever reads them.
    keep = response.excited & np.isfinite(response.values).all(axis=(0, 1))
    axis, losses = _axis_fields(response.frequency_hz[keep], binary=binary)
    left_out = int(keep.size - keep.sum())
    if left_out:
        losses.append(
            f"{counted(left_out, 'line')} that the references don't excite, or without value, were left out."
        )
    datasets = []
    for row, measured in enumerate(response.responses):
        for column, source in enumerate(response.references):
            header = {**_header(measured, source, places), **axis, "binary": int(binary)}
            values = response.values[row, column, keep].astype(np.complex128)
            datasets.append({**header, "func_type": RESPONSE_FUNCTION, "data": values})
            std = response.std[row, column, keep]
            if np.isfinite(std).all():
                datasets.append({**header, "func_type": GENERAL, "id3": _STD, "data": std.astype(float)})
            else:
                losses.append(f"{measured.name}: the error bars of its function aren't finite and weren't stored.")
            coherence = response.coherence[row, keep]
            if len(response.references) == 1 and np.isfinite(coherence).all():
                datasets.append({**header, "func_type": COHERENCE, "data": coherence.astype(float)})
    if len(response.references) > 1:
        losses.append("The multiple coherence isn't stored; a universal file keeps that of single references.")
    if not binary:
        losses.append("Values of functions are rounded to twelve digits; write binary to keep all.")
    return datasets, tuple(losses) + _name_losses((*response.responses, *response.references))


def read_functions(
    path: Path,
    file: Any,
    headers: Sequence[Dataset],
    names: Mapping[int, str],
    system: Dataset | None,
    units: Mapping[str, str] | None = None,
) -> tuple[FrequencyResponse | None, tuple[str, ...]]:
    """Read the frequency responses of a file, those of one frequency axis and a full grid of channels.

    Parameters
    ----------
    headers
        Of all datasets, as `chladni.io.files.uff_sets.read_headers` gives them.
    names
        Name of a point by node.
    system
        Dataset 164, or None.
    units
        Unit by channel name, instead of that in the file.

    Returns
    -------
    FrequencyResponse or None when there is none, and sentences on what was left out.

    Raises
    ------
    LogError
        When a function is damaged, or in a unit that isn't known.
    """
    by_axis: dict[bytes, Functions] = {}
    beside: dict[int, Functions] = {GENERAL: {}, COHERENCE: {}}
    for number, header in enumerate(headers):
        if not _is_read(header):
            continue
        dataset = read_dataset(path, file, number)
        try:
            pair, factor = _channels(dataset, names, system, units or {})
        except SetupError as error:
            raise LogError(f"{path}: dataset {number + 1}: {error}") from error
        if header["func_type"] != COHERENCE:
            # Damaged binary values may be anything; what isn't finite is masked by `excited`.
            with np.errstate(over="ignore", invalid="ignore"):
                dataset["data"] = dataset["data"] * factor
        if header["func_type"] == RESPONSE_FUNCTION:
            dataset["x"] = _frequency_axis(dataset)
            _require_rising(path, number, dataset["x"])
            by_axis.setdefault(dataset["x"].tobytes(), {}).setdefault(pair, dataset)
        else:
            beside[header["func_type"]][pair] = dataset
    if not by_axis:
        return None, ()
    # One response has one axis: the one that most functions share.
    found = max(by_axis.values(), key=len)
    notes = _left_out_notes(path, headers, len(found))
    references = tuple(dict.fromkeys(pair[1] for pair in found))
    named = dict.fromkeys(pair[0] for pair in found)
    responses = tuple(one for one in named if all((one, source) in found for source in references))
    missing = len(found) - len(responses) * len(references)
    if missing:
        notes += (f"{path}: {counted(missing, 'function')} left out: not every response has every reference.",)
    return (_assembled(found, responses, references, beside) if responses else None), notes


def _is_read(header: Dataset) -> bool:
    if header["type"] != FUNCTION_AT_NODE:
        return False
    kind = header["func_type"]
    return kind in (RESPONSE_FUNCTION, COHERENCE) or (kind == GENERAL and str(header["id3"]).strip() == _STD)


def _assembled(
    found: Functions,
    responses: tuple[Channel, ...],
    references: tuple[Channel, ...],
    beside: Mapping[int, Functions],
) -> FrequencyResponse:
    axis: NDArray[np.float64] = found[responses[0], references[0]]["x"]
    shape = (len(responses), len(references), axis.size)
    values = np.empty(shape, dtype=np.complex128)
    # Infinite and NaN say that nothing is known, which zero and one would deny.
    std = np.full(shape, np.inf)
    coherence = np.full((shape[0], axis.size), np.nan)
    for row, measured in enumerate(responses):
        for column, source in enumerate(references):
            values[row, column] = found[measured, source]["data"]
            sigma = beside[GENERAL].get((measured, source))
            if sigma is not None and len(sigma["data"]) == axis.size:
                std[row, column] = sigma["data"]
            share = beside[COHERENCE].get((measured, source))
            if share is not None and len(share["data"]) == axis.size and len(references) == 1:
                coherence[row] = share["data"]
    return FrequencyResponse(
        frequency_hz=axis,
        values=values,
        std=std,
        coherence=coherence,
        excited=np.asarray(np.isfinite(values).all(axis=(0, 1)), dtype=np.bool_),
        responses=responses,
        references=references,
        provenance=Provenance(estimator="as in the file"),
    )


def _header(measured: Channel, source: Channel, places: Mapping[str, NodeDirection]) -> Dataset:
    here, there = places[measured.name], places[source.name]
    return {
        "type": FUNCTION_AT_NODE,
        "id1": _ascii(measured.name, _ID_LENGTH) or "NONE",
        "id2": _ascii(source.name, _ID_LENGTH) or "NONE",
        "rsp_ent_name": _ascii(here.entity, _ENTITY_LENGTH) or "NONE",
        "rsp_node": here.node,
        "rsp_dir": here.axis,
        "ref_ent_name": _ascii(there.entity, _ENTITY_LENGTH) or "NONE",
        "ref_node": there.node,
        "ref_dir": there.axis,
        "abscissa_spec_data_type": _FREQUENCY,
        "abscissa_axis_lab": "Frequency",
        "abscissa_axis_units_lab": "Hz",
        "ordinate_spec_data_type": quantity_code(measured),
        "ordinate_axis_units_lab": _label(measured.unit),
        "orddenom_spec_data_type": quantity_code(source),
        "orddenom_axis_units_lab": _label(source.unit),
    }


def _axis_fields(frequency_hz: NDArray[np.float64], *, binary: bool) -> tuple[Dataset, list[str]]:
    if frequency_hz.size < 2:
        # Two abscissae are the least that the record's start and step can say.
        return {"abscissa_spacing": 0, "x": np.resize(frequency_hz, 2)}, []
    start, step = float(frequency_hz[0]), float(frequency_hz[-1] - frequency_hz[0]) / (frequency_hz.size - 1)
    even = start + step * np.arange(frequency_hz.size)
    if np.allclose(even, frequency_hz, rtol=0, atol=_EVEN * step):
        return {"abscissa_spacing": 1, "x": frequency_hz, "id5": f"start_hz={start!r} step_hz={step!r}"}, []
    losses = [] if binary else ["The frequencies of unevenly spaced lines are rounded to six digits."]
    return {"abscissa_spacing": 0, "x": frequency_hz}, losses


def _require_rising(path: Path, number: int, axis: NDArray[np.float64]) -> None:
    if not (np.all(np.isfinite(axis)) and np.all(axis[1:] > axis[:-1])):
        raise LogError(f"{path}: dataset {number + 1}: its frequencies don't rise; the file is damaged")


def _frequency_axis(dataset: Dataset) -> NDArray[np.float64]:
    axis = np.asarray(dataset["x"], dtype=np.float64)
    said = _AXIS.match(str(dataset["id5"]).strip())
    if dataset["abscissa_spacing"] == 0 or said is None:
        return axis
    try:
        start, step = float(said["start"]), float(said["step"])
    except ValueError:
        return axis
    in_full = np.asarray(start + step * np.arange(axis.size), dtype=np.float64)
    return in_full if np.allclose(in_full, axis, rtol=_SIX_DIGITS, atol=_SIX_DIGITS * abs(step)) else axis


def _channels(
    dataset: Dataset, names: Mapping[int, str], system: Dataset | None, units: Mapping[str, str]
) -> tuple[tuple[Channel, Channel], float]:
    """Response and reference of a function, and the factor that turns its values into SI."""
    unit, factor = unit_of_header(dataset, system)
    below = {
        "ordinate_axis_units_lab": dataset["orddenom_axis_units_lab"],
        "ordinate_spec_data_type": dataset["orddenom_spec_data_type"],
    }
    source_unit, source_factor = unit_of_header(below, system)
    # Names in full are told by our own fifth line; elsewhere the first two lines hold anything.
    ours = _AXIS.match(str(dataset["id5"]).strip()) is not None
    measured, factor = _channel(dataset, "rsp", names, dataset["id1"] if ours else "", (unit, factor), units)
    source, below_one = _channel(
        dataset, "ref", names, dataset["id2"] if ours else "", (source_unit, source_factor), units
    )
    return (measured, source), factor / below_one


def _channel(
    dataset: Dataset,
    side: str,
    names: Mapping[int, str],
    title: str,
    said: tuple[str, float],
    units: Mapping[str, str],
) -> tuple[Channel, float]:
    """Give a channel, and the factor from its numbers to SI: by the unit that is stated, else as the file says."""
    node, axis = int(dataset[f"{side}_node"]), int(dataset[f"{side}_dir"])
    point = names.get(node, str(node))
    name = title.strip() or f"{point}:{axis:+d}" + (" (reference)" if side == "ref" else "")
    unit, factor = (units[name], 1.0) if name in units else said
    to_si, unit = si_factor(unit)
    channel = Channel(
        name=name,
        unit=unit,
        point=point,
        direction=DIRECTIONS.get(axis),
        role="reference" if side == "ref" else "response",
    )
    return channel, factor * to_si


def _left_out_notes(path: Path, headers: Sequence[Dataset], used: int) -> tuple[str, ...]:
    functions = sum(header.get("func_type") == RESPONSE_FUNCTION for header in headers)
    if functions == used:
        return ()
    what = counted(functions - used, "function")
    return (f"{path}: {what} left out: repeated, or of another frequency axis than most.",)


def _name_losses(channels: Sequence[Channel]) -> tuple[str, ...]:
    changed = [one.name for one in channels if _ascii(one.name, _ID_LENGTH) != one.name]
    units = [one.name for one in channels if _label(one.unit) != one.unit]
    return (
        *(f"{name}: the name was cut to 80 ASCII characters." for name in changed),
        *(f"{name}: the unit has more than 20 characters and isn't stored." for name in units),
    )


def _label(unit: str) -> str:
    return unit if len(unit) <= _LABEL_LENGTH and unit.isascii() else "NONE"


def _ascii(text: str, most: int) -> str:
    return re.sub(r"[^ -~]", "?", text)[:most].strip()
