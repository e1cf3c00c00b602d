"""Modes, geometry and frequency responses in and out of universal files, for exchange with other tools."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from chladni.io.atomic import atomic_path
from chladni.io.files.uff import write_uff as write_records
from chladni.io.files.uff_functions import NodeDirection, function_datasets, is_read, read_functions
from chladni.io.files.uff_header import direction_code
from chladni.io.files.uff_mode_set import mode_set_of
from chladni.io.files.uff_nodes import DOUBLE_NODES, NODES, TRACE_LINES, node_blocks, number_points, read_nodes
from chladni.io.files.uff_records import UniversalFile, block_text, id_line, open_uff, state_binary_sizes, text_blocks
from chladni.io.files.uff_sets import (
    FUNCTION_AT_NODE,
    HEADER,
    LEFT_OUT,
    UNITS,
    Dataset,
    append_datasets,
    contradiction,
    cut_off_note,
    length_and_force,
    listed_kinds,
    read_headers,
    si_units,
)
from chladni.io.files.uff_shapes import ANALYSIS_DATA, SHAPES, Degree, NodeMode, read_shapes, shape_blocks
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.geometry import Geometry
from chladni.signals.mode_set import ModeSet
from chladni.signals.time_series import TimeSeries
from chladni.signals.value import Value
from chladni.signals.wording import counted

MODAL_DATASETS = (NODES, *DOUBLE_NODES, TRACE_LINES, SHAPES, ANALYSIS_DATA)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UffModes(Value):
    """What a universal file holds of a modal test.

    Attributes
    ----------
    modes
        None when the file has no modes.
    geometry
        Points and lines; empty when it has none.
    response
        None when it has no frequency responses.
    notes
        Sentences on what was left out, or taken how.
    """

    modes: ModeSet | None
    geometry: Geometry
    response: FrequencyResponse | None
    notes: tuple[str, ...]


def write_uff(
    values: TimeSeries | FrequencyResponse | ModeSet | Sequence[TimeSeries | FrequencyResponse | ModeSet],
    path: Path | str,
    *,
    geometry: Geometry | None = None,
    binary: bool = True,
    overwrite: bool = True,
) -> tuple[str, ...]:
    """Write series, frequency responses or modes to a universal file; `chladni.open` reads all of them.

    Parameters
    ----------
    values
        Series; or frequency responses, modes, or both. A file holds records over time or the results of a test.
    path
        File to write.
    geometry
        Points and lines of the modes.
    binary
        Whether numbers are written as 58b, which is exact; 58 is text with twelve digits.

    Returns
    -------
    losses
        Sentences on what the file doesn't hold.

    Raises
    ------
    LogError
        When the file can't be written, for gaps, or for values that don't go into one file.

    Examples
    --------
    >>> losses = write_uff([response, modes], "test.uff")  # doctest: +SKIP
    """
    parts = (values,) if isinstance(values, Value) else tuple(values)
    series = [one for one in parts if isinstance(one, TimeSeries)]
    responses = [one for one in parts if isinstance(one, FrequencyResponse)]
    modes = [one for one in parts if isinstance(one, ModeSet)]
    if not parts or (series and len(series) < len(parts)) or len(responses) > 1 or len(modes) > 1:
        raise LogError(
            "a universal file holds series, or one set of frequency responses and one of modes; write a file for each"
        )
    if series:
        return write_records(series, path, binary=binary, overwrite=overwrite)
    return write_uff_modes(
        path,
        modes[0] if modes else None,
        geometry=geometry or Geometry(),
        response=responses[0] if responses else None,
        binary=binary,
        overwrite=overwrite,
    )


def write_uff_modes(
    path: Path | str,
    modes: ModeSet | None,
    *,
    geometry: Geometry,
    response: FrequencyResponse | None = None,
    binary: bool = True,
    overwrite: bool = True,
) -> tuple[str, ...]:
    """Write modes for other tools: datasets 151, 164, 15, 82, 55 and, with `response`, 58.

    Points whose names are numbers keep them as nodes, the others are numbered; names are kept on the identification
    lines of the trace lines. Each mode is a complex eigenvalue (analysis type 3) with modal A and modal B, whose
    identification lines hold frequency and damping in full, with one sigma.

    Parameters
    ----------
    modes
        None writes functions alone.
    response
        Functions that the modes came from, in SI.
    binary
        Whether functions are written as 58b, which is exact; 58 is text with twelve digits.

    Returns
    -------
    losses
        Sentences on what the file doesn't hold.

    Raises
    ------
    LogError
        When the file can't be written.
    """
    everything = _channels_of(modes, response)
    points = {channel.name: channel.point or channel.name for channel in everything}
    nodes = number_points([*(point.name for point in geometry.points), *points.values()])
    known = {point.name for point in geometry.points}
    unplaced = [name for name in dict.fromkeys(points.values()) if name not in known]
    places = {one.name: _place(one, nodes[points[one.name]]) for one in everything}
    node_text, losses = node_blocks(geometry, nodes, unplaced)
    shapes = ""
    if modes is not None:
        motions, moved = _motions(modes, places)
        losses += moved + _losses(modes, everything, places)
        unit = _common_unit(modes.channels)
        shapes = shape_blocks(modes, motions, unit=unit, driving=_driving(modes, places))
    functions, lost = ([], ()) if response is None else function_datasets(response, places, binary=binary)
    with atomic_path(path, overwrite=overwrite) as temporary:
        temporary.write_text(_header_text(), encoding="ascii", newline="\n")
        # Units go first: what follows is read by them.
        append_datasets(temporary, [si_units()])
        with temporary.open("a", encoding="ascii", newline="\n") as file:
            file.write(node_text + shapes)
        if functions:
            append_datasets(temporary, functions)
            state_binary_sizes(temporary)
    return losses + lost


def read_uff_modes(path: Path | str, *, units: Mapping[str, str] | None = None) -> UffModes:
    """Read modes, geometry and frequency responses from a universal file of any tool.

    Complex modes (analysis types 3 and 7) and normal modes (2) of datasets 55 and 2414 are read, nodes of 15, 781 and
    2411, in SI by dataset 164. A component that's zero in all modes counts as not measured. Shapes are scaled so that
    their largest component is 1, and modal A and mass with them.

    Parameters
    ----------
    units
        Unit by name of a function's channel, instead of that in the file.

    Raises
    ------
    LogError
        When the file is damaged, or holds neither modes nor nodes nor frequency responses.
    SetupError
        When a unit that is stated is unknown, or stands for a ratio.
    """
    path = Path(path)
    file = open_uff(path)
    headers = read_headers(file)
    found = modal_test(file, headers, units or {})
    if found.modes is None and found.response is None and not found.geometry.points:
        # Why a function can't be read says more than that there is none.
        nothing = (
            f"{path}: holds no mode, node or frequency response (datasets 55, 2414, 15, 2411, 58 of function type "
            f"4), but datasets {listed_kinds(headers)}"
        )
        mistakes = [note for note in found.notes if note.endswith(LEFT_OUT)]
        raise LogError(mistakes[0].removesuffix(LEFT_OUT) if mistakes else nothing)
    return replace(found, notes=found.notes + _unread(path, headers))


def modal_test(file: UniversalFile, headers: Sequence[Dataset], units: Mapping[str, str]) -> UffModes:
    """Read what `read_uff_modes` reads, as far as there is anything."""
    blocks = text_blocks(file, MODAL_DATASETS)
    nodes = read_nodes(blocks, [length_and_force(header["system"])[0] for header in headers])
    response, function_notes = read_functions(file, headers, nodes.names, units=units)
    found, shape_notes = read_shapes(blocks, [_kilogram(header["system"]) for header in headers])
    notes = cut_off_note(file) + nodes.notes + function_notes + shape_notes + _doubts(file.path, headers)
    _require_nodes(file.path, found, nodes.positions)
    modes, mode_notes = mode_set_of(found, nodes, response) if found else (None, ())
    return UffModes(modes=modes, geometry=nodes.geometry(), response=response, notes=notes + mode_notes)


def _kilogram(system: Dataset | None) -> float:
    metre, newton = length_and_force(system)
    return newton / metre


def _unread(path: Path, headers: Sequence[Dataset]) -> tuple[str, ...]:
    """What of the file says nothing of a modal test."""
    others = [
        header for header in headers if header["type"] not in (*MODAL_DATASETS, FUNCTION_AT_NODE, UNITS, HEADER)
    ]
    records = sum("func_type" in header and not is_read(header) for header in headers)
    listed = [f"datasets {listed_kinds(others)}"] if others else []
    listed += [f"{counted(records, 'function')} of another kind than a frequency response"] if records else []
    return (f"{path}: left out: {', '.join(listed)}.",) if listed else ()


def _doubts(path: Path, headers: Sequence[Dataset]) -> tuple[str, ...]:
    """Say where the units of the file contradict themselves."""
    doubts = dict.fromkeys(contradiction(header) for header in headers if header["type"] == UNITS)
    return tuple(
        f"{path}: {doubt}; positions and modal masses were taken by these factors." for doubt in doubts if doubt
    )


def _channels_of(modes: ModeSet | None, response: FrequencyResponse | None) -> tuple[Channel, ...]:
    others = () if response is None else (*response.responses, *response.references)
    # The channels of the modes go last, so that they stand for their name.
    last = () if modes is None else (*modes.references, *modes.channels)
    by_name = {channel.name: channel for channel in (*others, *last)}
    return tuple(by_name.values())


def _place(channel: Channel, node: int) -> NodeDirection:
    entity = channel.point or ""
    return NodeDirection(node=node, axis=direction_code(channel), entity="" if entity == str(node) else entity)


def _motions(
    modes: ModeSet, places: Mapping[str, NodeDirection]
) -> tuple[list[dict[Degree, complex]], tuple[str, ...]]:
    """Motion of each mode by node and axis; sentences on the channels that no axis holds as they are."""
    motions: list[dict[Degree, complex]] = [{} for _ in range(modes.frequency_hz.size)]
    taken: set[Degree] = set()
    losses = []
    for column, channel in enumerate(modes.channels):
        place = places[channel.name]
        axes, lost = _axes(channel, place)
        losses += lost
        if any((place.node, axis) in taken for axis, _ in axes):
            losses.append(f"{channel.name}: left out, another channel has its point and axis.")
            continue
        for axis, cosine in axes:
            taken.add((place.node, axis))
            for row, motion in enumerate(motions):
                motion[place.node, axis] = cosine * complex(modes.shapes[row, column])
    return motions, tuple(losses)


def _axes(channel: Channel, place: NodeDirection) -> tuple[list[tuple[int, float]], list[str]]:
    """Axes with the cosine that the channel has along each."""
    if place.axis:
        return [(abs(place.axis), 1.0 if place.axis > 0 else -1.0)], []
    if channel.direction is None:
        return [(1, 1.0)], [f"{channel.name}: has no direction; written along x."]
    turn = 3 if channel.unit.startswith("rad") else 0
    cosines = [(axis + turn, part) for axis, part in enumerate(channel.direction, start=1) if part]
    return cosines, [f"{channel.name}: its direction is along no axis; the motion was written as a vector along it."]


def _common_unit(channels: Sequence[Channel]) -> str:
    units = {channel.unit for channel in channels if not channel.unit.startswith("rad")}
    return units.pop() if len(units) == 1 else "1"


def _driving(modes: ModeSet, places: Mapping[str, NodeDirection]) -> tuple[Degree, Degree] | None:
    scale = modes.scale
    # Modal A of a universal file is per force; that of another excitation would be read in kilograms.
    forces = {channel.name for channel in modes.references if channel.unit == "N"}
    if scale is None or scale.response not in places or scale.reference not in forces:
        return None
    response, reference = places[scale.response], places[scale.reference]
    return (response.node, response.axis), (reference.node, reference.axis)


def _losses(modes: ModeSet, channels: Sequence[Channel], places: Mapping[str, NodeDirection]) -> tuple[str, ...]:
    losses = [
        "Shapes, positions, eigenvalues and modal A are rounded to six digits; error bars of shapes aren't stored."
    ]
    nameless = [channel.name for channel in channels if channel.point is None]
    if nameless:
        losses.append(f"{', '.join(nameless)}: without point; each became a node of its own.")
    if any(channel.unit != _common_unit(modes.channels) for channel in modes.channels):
        losses.append("The units of the channels differ; the shapes are stored without.")
    unscaled = modes.scale is not None and _driving(modes, places) is None
    held = (
        (unscaled, "modal A, which isn't per newton"),
        (modes.participation is not None and modes.scale is None, "participation factors of unscaled modes"),
        (modes.spread is not None, "the scatter over model orders"),
        (bool(modes.harmonics), "lines of machines"),
        (modes.fit is not None, "the synthesis"),
        (modes.stabilisation is not None, "the stabilisation diagram"),
        (bool(modes.provenance.notes), "notes"),
    )
    missing = [what for there, what in held if there]
    return (*losses, *([f"Not stored: {', '.join(missing)}."] if missing else []))


def _header_text() -> str:
    day = f"{'':<20}"
    # No date: the same modes give the same file, to the byte.
    lines = (
        id_line("chladni"),
        id_line("modes"),
        id_line("chladni"),
        f"{day}{0:>10}{0:>10}{0:>10}",
        day,
        id_line(""),
        day,
    )
    return block_text(HEADER, lines)


def _require_nodes(path: Path, found: Sequence[NodeMode], positions: Mapping[int, object]) -> None:
    if not positions:
        return
    for node in dict.fromkeys(node for mode in found for node, _ in mode.motion):
        if node not in positions:
            raise LogError(
                f"{path}: a mode moves at node {node}, which dataset 15 doesn't have; the file's nodes and shapes "
                "belong to different models"
            )
