"""From the modes of a universal file, by node and axis, to a set of modes by channel."""

from collections.abc import Sequence
from math import nan, pi

import numpy as np

from chladni.io.files.uff_header import DIRECTIONS, direction_code
from chladni.io.files.uff_nodes import NodeGeometry
from chladni.io.files.uff_shapes import Degree, NodeMode
from chladni.signals.arrays import Complex
from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.modal_scale import ModalScale
from chladni.signals.mode_set import ModeSet
from chladni.signals.provenance import Provenance

_AXES = {1: "+x", 2: "+y", 3: "+z", 4: "+rx", 5: "+ry", 6: "+rz"}
_TURNS = {"m": "rad", "m/s": "rad/s", "m/s^2": "rad/s^2"}
_UNKNOWN = "not stated in the file"


def mode_set_of(
    found: Sequence[NodeMode], nodes: NodeGeometry, response: FrequencyResponse | None
) -> tuple[ModeSet, tuple[str, ...]]:
    """Give the modes by channel, with the names of the functions' channels where they stand at the same place.

    Parameters
    ----------
    found
        At least one mode.

    Returns
    -------
    ModeSet and sentences on what was taken how.
    """
    ordered = sorted(found, key=lambda mode: mode.frequency_hz)
    degrees = tuple(dict.fromkeys(degree for mode in ordered for degree in mode.motion))
    units = {mode.unit for mode in ordered}
    channels = _channels(degrees, nodes, response, units.pop() if len(units) == 1 else "1")
    sign = np.array([-1.0 if direction_code(channel) < 0 else 1.0 for channel in channels])
    motion = sign * np.array([[mode.motion.get(degree, 0j) for degree in degrees] for mode in ordered])
    # Other tools scale shapes as they like; ours have the largest component 1.
    rows = np.arange(len(ordered))
    pivot = np.argmax(np.abs(motion), axis=1)
    largest = motion[rows, pivot]
    shapes = motion / largest[:, np.newaxis]
    shapes[rows, pivot] = 1.0
    # The file has no place for them, and zero would claim that they're exact.
    std = np.full(shapes.shape, complex(nan, nan))
    std[rows, pivot] = 0.0
    scale = _scale(ordered, largest, degrees, channels, nodes, response)
    references = () if response is None else response.references
    if response is None and scale is not None and scale.reference != _UNKNOWN:
        references = (Channel(name=scale.reference, unit="N", role="reference"),)
    modes = ModeSet(
        frequency_hz=np.array([mode.frequency_hz for mode in ordered]),
        frequency_std_hz=np.array([mode.frequency_std_hz for mode in ordered]),
        damping_ratio=np.array([mode.damping_ratio for mode in ordered]),
        damping_std=np.array([mode.damping_std for mode in ordered]),
        shapes=shapes,
        shape_std=std,
        channels=channels,
        references=references,
        participation=None if scale is None else _participation(shapes, scale, channels, references, nodes, ordered),
        scale=scale,
        provenance=Provenance(estimator="as in the file"),
    )
    return modes, _notes(ordered)


def _channels(
    degrees: Sequence[Degree], nodes: NodeGeometry, response: FrequencyResponse | None, unit: str
) -> tuple[Channel, ...]:
    measured = {} if response is None else {(one.point, abs(direction_code(one))): one for one in response.responses}
    channels = []
    for node, axis in degrees:
        point = nodes.name(node)
        made = Channel(
            name=f"{point}:{_AXES[axis]}",
            unit=unit if axis <= 3 else _TURNS.get(unit, "rad"),
            point=point,
            direction=DIRECTIONS[axis],
        )
        channels.append(measured.get((point, axis), made))
    return tuple(channels)


def _scale(
    ordered: Sequence[NodeMode],
    largest: Complex,
    degrees: Sequence[Degree],
    channels: Sequence[Channel],
    nodes: NodeGeometry,
    response: FrequencyResponse | None,
) -> ModalScale | None:
    """Modal A over the square of what the shapes were divided by; None when no mode has one."""
    modal_a = np.array([mode.modal_a for mode in ordered]) / largest**2
    # Zero is what tools write for modes that they didn't scale.
    if not np.any(modal_a):
        return None
    modal_a[modal_a == 0] = complex(nan, nan)
    damped = [2 * pi * mode.frequency_hz * np.sqrt(1 - mode.damping_ratio**2) for mode in ordered]
    driving = ordered[0].driving
    place = (abs(driving[0][1]), driving[0][0]) if driving else (0, 0)
    names = {(axis, node): channel.name for (node, axis), channel in zip(degrees, channels, strict=True)}
    return ModalScale(
        response=names.get(place, _UNKNOWN),
        reference=_UNKNOWN if driving is None else _reference_name(driving[1], nodes, response),
        modal_a=modal_a,
        modal_mass=(modal_a / (2j * np.array(damped))).real,
        modal_mass_std=np.array([mode.modal_mass_std for mode in ordered]) / np.abs(largest) ** 2,
    )


def _reference_name(degree: Degree, nodes: NodeGeometry, response: FrequencyResponse | None) -> str:
    point = nodes.name(degree[0])
    for one in () if response is None else response.references:
        if one.point == point and direction_code(one) == degree[1]:
            return one.name
    return f"{point}:{degree[1]:+d} (reference)"


def _participation(
    shapes: Complex,
    scale: ModalScale,
    channels: Sequence[Channel],
    references: Sequence[Channel],
    nodes: NodeGeometry,
    ordered: Sequence[NodeMode],
) -> Complex | None:
    """Shape at each reference over modal A, by reciprocity; None when a reference isn't at a measured place."""
    columns = {(one.point, abs(direction_code(one))): row for row, one in enumerate(channels)}
    factors = []
    scaled, unknown = np.isfinite(scale.modal_a), np.full(scale.modal_a.shape, complex(nan, nan))
    for source in references:
        axis = direction_code(source)
        point = source.point
        if point is None and ordered[0].driving is not None:
            node, axis = ordered[0].driving[1]
            point = nodes.name(node)
        column = columns.get((point, abs(axis)))
        if column is None or not axis:
            return None
        # A force against x does what the opposite force along x would: the sign goes with the participation.
        turned = np.sign(axis) * (-1.0 if direction_code(channels[column]) < 0 else 1.0)
        factors.append(turned * np.divide(shapes[:, column], scale.modal_a, out=unknown.copy(), where=scaled))
    return np.stack(factors, axis=1) if factors else None


def _notes(ordered: Sequence[NodeMode]) -> tuple[str, ...]:
    notes = ["Components that are zero in all modes count as not measured, which the file doesn't tell."]
    if any(not np.isfinite(mode.frequency_std_hz) for mode in ordered):
        notes.append("The file has no error bars for its modes.")
    return tuple(notes)
