"""Frequency responses as functions at nodes: dataset 58, text and binary."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from chladni.io.files.uff_header import DIRECTIONS, quantity_code
from chladni.io.files.uff_records import UniversalFile
from chladni.io.files.uff_sets import FUNCTION_AT_NODE, LEFT_OUT, Dataset, read_dataset
from chladni.io.files.uff_units import FoundUnit, abscissa_unit, function_units, unit_sentences
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance
from chladni.signals.unit_labels import read_label
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
    file: UniversalFile, headers: Sequence[Dataset], names: Mapping[int, str], *, units: Mapping[str, str]
) -> tuple[FrequencyResponse | None, tuple[str, ...]]:
    """Read the frequency responses of a file, those of one frequency axis and a full grid of channels.

    Parameters
    ----------
    headers
        Of all datasets, as `chladni.io.files.uff_sets.read_headers` gives them.
    names
        Name of a point by node.
    units
        Unit by channel name, instead of that in the file.

    Returns
    -------
    FrequencyResponse or None when there is none, and sentences on what was left out, or taken how.

    Raises
    ------
    SetupError
        When a unit that is stated is unknown, or stands for a ratio.
    """
    read = _Read()
    for number, header in enumerate(headers):
        if "mistake" in header:
            read.notes.append(f"{header['mistake']}{LEFT_OUT}")
        elif is_read(header):
            try:
                _read_function(file, headers, number, names, units, read)
            except LogError as error:
                read.notes.append(f"{error}{LEFT_OUT}")
    notes = [*read.notes, *unit_sentences(file.path, read.unit_notes, "--read units=NAME:UNIT states another")]
    if not read.by_axis:
        return None, tuple(notes)
    # One response has one axis: the one that most functions share.
    found = max(read.by_axis.values(), key=len)
    if read.responses > len(found):
        what = counted(read.responses - len(found), "function")
        notes.append(f"{file.path}: {what} left out: repeated, or of another frequency axis than most.")
    references = tuple(dict.fromkeys(pair[1] for pair in found))
    named = dict.fromkeys(pair[0] for pair in found)
    responses = tuple(one for one in named if all((one, source) in found for source in references))
    missing = len(found) - len(responses) * len(references)
    if missing:
        what = counted(missing, "function")
        notes.append(f"{file.path}: {what} left out: not every response has every reference.")
    return (_assembled(found, responses, references, read.beside) if responses else None), tuple(notes)


@dataclass(slots=True, kw_only=True)
class _Read:
    """What was read so far: functions by their axis, what belongs to them by name, and what is told of it."""

    by_axis: dict[bytes, Functions] = field(default_factory=dict)
    beside: dict[int, dict[tuple[str, str], Dataset]] = field(default_factory=lambda: {GENERAL: {}, COHERENCE: {}})
    responses: int = 0
    names: dict[str, None] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    unit_notes: dict[str, list[str]] = field(default_factory=dict)


def _read_function(
    file: UniversalFile,
    headers: Sequence[Dataset],
    number: int,
    names: Mapping[int, str],
    units: Mapping[str, str],
    read: _Read,
) -> None:
    dataset, notes = read_dataset(file, headers, number)
    where = f"{file.path}: dataset {number + 1}"
    kind = dataset["func_type"]
    if kind == RESPONSE_FUNCTION:
        notes += _brought_to_hertz(dataset, where)
    pair, factor, unit_notes = _channels(dataset, names, units)
    if kind != COHERENCE:
        # Damaged binary values may be anything; what isn't finite is masked by `excited`.
        with np.errstate(over="ignore", invalid="ignore"):
            dataset["data"] = dataset["data"] * factor
    read.notes += notes
    read.names |= dict.fromkeys(channel.name for channel in pair)
    if kind != RESPONSE_FUNCTION:
        read.beside[kind][pair[0].name, pair[1].name] = dataset
        return
    read.responses += 1
    read.by_axis.setdefault(dataset["x"].tobytes(), {}).setdefault(pair, dataset)
    for channel, told in zip(pair, unit_notes, strict=True):
        for note in told:
            read.unit_notes.setdefault(note, []).append(channel.name)


def is_read(header: Dataset) -> bool:
    """Whether a dataset is a frequency response, or belongs to one."""
    kind = header.get("func_type")
    return kind in (RESPONSE_FUNCTION, COHERENCE) or (kind == GENERAL and str(header["id3"]).strip() == _STD)


def _assembled(
    found: Functions,
    responses: tuple[Channel, ...],
    references: tuple[Channel, ...],
    beside: Mapping[int, Mapping[tuple[str, str], Dataset]],
) -> FrequencyResponse:
    axis: Real = found[responses[0], references[0]]["x"]
    shape = (len(responses), len(references), axis.size)
    values = np.empty(shape, dtype=np.complex128)
    # Infinite and NaN say that nothing is known, which zero and one would deny.
    std = np.full(shape, np.inf)
    coherence = np.full((shape[0], axis.size), np.nan)
    for row, measured in enumerate(responses):
        for column, source in enumerate(references):
            values[row, column] = found[measured, source]["data"]
            sigma = beside[GENERAL].get((measured.name, source.name))
            if sigma is not None and len(sigma["data"]) == axis.size:
                std[row, column] = sigma["data"]
            share = beside[COHERENCE].get((measured.name, source.name))
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


def _axis_fields(frequency_hz: Real, *, binary: bool) -> tuple[Dataset, list[str]]:
    if frequency_hz.size < 2:
        # Two abscissae are the least that the record's start and step can say.
        return {"abscissa_spacing": 0, "x": np.resize(frequency_hz, 2)}, []
    start, step = float(frequency_hz[0]), float(frequency_hz[-1] - frequency_hz[0]) / (frequency_hz.size - 1)
    even = start + step * np.arange(frequency_hz.size)
    if np.allclose(even, frequency_hz, rtol=0, atol=_EVEN * step):
        return {"abscissa_spacing": 1, "x": frequency_hz, "id5": f"start_hz={start!r} step_hz={step!r}"}, []
    losses = [] if binary else ["The frequencies of unevenly spaced lines are rounded to six digits."]
    return {"abscissa_spacing": 0, "x": frequency_hz}, losses


def _brought_to_hertz(dataset: Dataset, where: str) -> tuple[str, ...]:
    """Bring the abscissae of a function to hertz, and say how they were taken."""
    try:
        found = abscissa_unit(dataset, "Hz")
    except LogError as error:
        raise LogError(f"{where} {error}") from error
    axis = _frequency_axis(dataset)
    dataset["x"] = axis if found.factor == 1.0 else axis * found.factor
    if not (np.all(np.isfinite(dataset["x"])) and np.all(dataset["x"][1:] > dataset["x"][:-1])):
        raise LogError(f"{where}: its frequencies don't rise; the file is damaged")
    return tuple(f"{where}: {note}." for note in found.notes)


def _frequency_axis(dataset: Dataset) -> Real:
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
    dataset: Dataset, names: Mapping[int, str], units: Mapping[str, str]
) -> tuple[tuple[Channel, Channel], float, tuple[tuple[str, ...], tuple[str, ...]]]:
    """Response and reference of a function, the factor that turns its values into SI, and notes on both units."""
    response, reference = function_units(dataset)
    # Names in full are told by our own fifth line; elsewhere the first two lines hold anything.
    ours = _AXIS.match(str(dataset["id5"]).strip()) is not None
    measured = _channel(dataset, "rsp", names, dataset["id1"] if ours else "", response.unit)
    source = _channel(dataset, "ref", names, dataset["id2"] if ours else "", reference.unit)
    measured, response = _as_stated(measured, response, units)
    source, reference = _as_stated(source, reference, units)
    return (measured, source), response.factor / reference.factor, (response.notes, reference.notes)


def _as_stated(channel: Channel, found: FoundUnit, units: Mapping[str, str]) -> tuple[Channel, FoundUnit]:
    """Give a channel and its numbers the unit that is stated for it."""
    if channel.name not in units:
        return channel, found
    if found.of_ratio:
        raise SetupError(
            f"{channel.name}: the unit {units[channel.name]!r} is stated, but the file labels the ratio of response "
            "and reference; leave it out"
        )
    factor, unit = read_label(units[channel.name], quantity=None if found.unit == "1" else found.unit)
    return replace(channel, unit=unit), FoundUnit(factor=factor, unit=unit)


def _channel(dataset: Dataset, side: str, names: Mapping[int, str], title: str, unit: str) -> Channel:
    node, axis = int(dataset[f"{side}_node"]), int(dataset[f"{side}_dir"])
    point = names.get(node, str(node))
    return Channel(
        name=title.strip() or f"{point}:{axis:+d}" + (" (reference)" if side == "ref" else ""),
        unit=unit,
        point=point,
        direction=DIRECTIONS.get(axis),
        role="reference" if side == "ref" else "response",
    )


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
