"""Operating deflection shapes: how the measured points move at the frequency under the cursor."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from chladni.signals.channel import Channel
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.study import Study
from chladni.viewers.drawing import Floats, decibels_of_amplitude
from chladni.viewers.rerun.entities import folder
from chladni.viewers.rerun.timelines import frequency_index, send_columns
from chladni.viewers.style import Style

# The largest motion is drawn as this share of the structure's size, at every frequency.
DRAWN_SHARE = 0.2
# Colours run over this many decibels below the greatest amplitude of any point at any frequency.
COLOUR_RANGE_DB = 60.0
REST_COLOUR = (120, 120, 120)
# Low to high: blue, teal, yellow, red-orange; also told apart in grey.
SCALE = np.array([(40, 70, 160), (40, 160, 160), (235, 190, 60), (250, 90, 40)], dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shape:
    """Complex motion of each point of the geometry, ``motion[frequency, point, axis]``, and where points rest."""

    frequency_hz: Floats
    rest: Floats
    motion: NDArray[np.complexfloating[Any, Any]]
    measured: NDArray[np.bool_]


def draw_deflections(
    recording: rr.RecordingStream, study: Study, response: FrequencyResponse, style: Style
) -> list[Callable[[], rrb.View]]:
    """Write the shape at every excited frequency and give, for each reference, a maker of views of it.

    Nothing is drawn without a geometry in which at least one response has a point and a direction.
    """
    rows = _located(study, response)
    if not rows:
        return []
    return [_draw(recording, study, response, rows, style, column) for column in range(len(response.references))]


def _located(study: Study, response: FrequencyResponse) -> list[int]:
    """Responses of one unit that have a point and a direction: motions of different units can't be added."""
    points = {point.name for point in study.geometry.points}

    def drawable(channel: Channel) -> bool:
        return channel.point in points and channel.direction is not None

    units: dict[str, list[int]] = {}
    for row, channel in enumerate(response.responses):
        if drawable(channel):
            units.setdefault(channel.unit, []).append(row)
    return max(units.values(), key=len, default=[])


def _draw(
    recording: rr.RecordingStream,
    study: Study,
    response: FrequencyResponse,
    rows: list[int],
    style: Style,
    column: int,
) -> Callable[[], rrb.View]:
    parent = folder("deflection", f"reference {column + 1}")
    shape = _shape(study, response, rows, column)
    # One point, or all in one place: any size does, but zero would draw nothing.
    size = float(np.linalg.norm(np.ptp(shape.rest, axis=0))) or 1.0
    _draw_rest(recording, parent, study, shape, size)
    _draw_motion(recording, parent, study, shape, size)
    reference = style.labels[response.references[column].name]
    return partial(
        rrb.Spatial3DView,
        origin=parent,
        name=f"Deflection shape to {reference}, size normalised",
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=_eye(shape.rest, size),
    )


def _shape(study: Study, response: FrequencyResponse, rows: list[int], column: int) -> _Shape:
    points = study.geometry.points
    places = {point.name: place for place, point in enumerate(points)}
    frequency_hz = response.frequency_hz[response.excited]
    motion = np.zeros((frequency_hz.size, len(points), 3), dtype=np.complex128)
    measured = np.zeros(len(points), dtype=np.bool_)
    for row in rows:
        channel = response.responses[row]
        place = places[str(channel.point)]
        along = response.values[row, column, response.excited]
        # A triaxial sensor is three channels of one point, each along its own axis.
        motion[:, place] += np.multiply.outer(along, np.array(channel.direction))
        measured[place] = True
    rest = np.array([point.position for point in points], dtype=np.float64)
    return _Shape(frequency_hz=frequency_hz, rest=rest, motion=motion, measured=measured)


def _draw_rest(recording: rr.RecordingStream, parent: str, study: Study, shape: _Shape, size: float) -> None:
    names = [point.name for point in study.geometry.points]
    dots = rr.Points3D(
        shape.rest, labels=names, show_labels=True, colors=[REST_COLOUR] * len(names), radii=0.008 * size
    )
    recording.log(f"{parent}/rest/points", dots, static=True)
    strips = [shape.rest[_places(study, line)] for line in study.geometry.lines]
    wires = rr.LineStrips3D(strips, colors=[REST_COLOUR] * len(strips), radii=0.002 * size)
    recording.log(f"{parent}/rest/lines", wires, static=True)


def _draw_motion(recording: rr.RecordingStream, parent: str, study: Study, shape: _Shape, size: float) -> None:
    """Points at their furthest, the wireframe through them, and an arrow from where each measured point rests."""
    arrows = _furthest(shape.motion) * DRAWN_SHARE * size
    moved = shape.rest + arrows
    colours = _colours(shape)
    index = frequency_index(shape.frequency_hz)
    lines, count = shape.frequency_hz.size, shape.measured.sum()
    # Only measured points get a dot: one without a sensor would seem to stand still.
    dots = rr.Points3D.columns(
        positions=moved[:, shape.measured].reshape(-1, 3),
        colors=colours[:, shape.measured].reshape(-1, 3),
        radii=np.full(lines * count, 0.018 * size),
    )
    send_columns(recording, f"{parent}/moved/points", index, dots.partition([count] * lines))
    vectors = rr.Arrows3D.columns(
        origins=np.tile(shape.rest[shape.measured], (lines, 1)),
        vectors=arrows[:, shape.measured].reshape(-1, 3),
        colors=colours[:, shape.measured].reshape(-1, 3),
        radii=np.full(lines * count, 0.004 * size),
    )
    send_columns(recording, f"{parent}/moved/arrows", index, vectors.partition([count] * lines))
    for number, line in enumerate(study.geometry.lines, start=1):
        wire = rr.LineStrips3D.columns(strips=list(moved[:, _places(study, line)]))
        # Colour and width once; only the places change with frequency.
        wired = rr.LineStrips3D.from_fields(colors=[(225, 225, 225)], radii=0.004 * size)
        recording.log(f"{parent}/moved/line_{number}", wired, static=True)
        send_columns(recording, f"{parent}/moved/line_{number}", index, wire)
    _return_to_rest(recording, parent, study, shape)


def _return_to_rest(recording: rr.RecordingStream, parent: str, study: Study, shape: _Shape) -> None:
    """Clear the shape after the last line: a cursor outside the band must not show the last shape for ever."""
    # One line further, so that the last line itself can still be looked at.
    step_hz = float(np.median(np.diff(shape.frequency_hz))) if shape.frequency_hz.size > 1 else 1.0
    for timeline, ns in frequency_index(shape.frequency_hz[-1:] + step_hz).items():
        recording.set_time(timeline, duration=np.timedelta64(int(ns[0]), "ns"))
    names = ["points", "arrows", *(f"line_{number}" for number in range(1, len(study.geometry.lines) + 1))]
    for name in names:
        recording.log(f"{parent}/moved/{name}", rr.Clear(recursive=False))
    recording.reset_time()


def _furthest(motion: NDArray[np.complexfloating[Any, Any]]) -> Floats:
    """Real shape, largest length 1, at the instant when the point that moves most is furthest from rest."""
    lines = np.arange(motion.shape[0])
    power = np.sum(np.abs(motion) ** 2, axis=2)
    leader = motion[lines, power.argmax(axis=1)]
    # Im is turned so that leader . leader is real: then its real part is the long axis of its ellipse.
    turn = np.exp(-0.5j * np.angle(np.sum(leader**2, axis=1)))
    shape = (motion * turn[:, None, None]).real
    largest = np.linalg.norm(shape, axis=2).max(axis=1)
    return np.asarray(shape / np.where(largest > 0, largest, 1.0)[:, None, None])


def _colours(shape: _Shape) -> NDArray[np.uint8]:
    """[frequency, point, rgb] from the amplitude in decibels below the greatest of all."""
    amplitude = np.sqrt(np.sum(np.abs(shape.motion) ** 2, axis=2))
    greatest = amplitude.max() or 1.0
    # A point that does not move at all has the lowest colour.
    level = np.nan_to_num(decibels_of_amplitude(amplitude / greatest), nan=-COLOUR_RANGE_DB)
    place = np.clip(1 + level / COLOUR_RANGE_DB, 0, 1) * (len(SCALE) - 1)
    channels = [np.interp(place, np.arange(len(SCALE)), SCALE[:, part]) for part in range(3)]
    return np.stack(channels, axis=2).astype(np.uint8)


def _places(study: Study, line: tuple[str, ...]) -> list[int]:
    names = [point.name for point in study.geometry.points]
    return [names.index(name) for name in line]


def _eye(rest: Floats, size: float) -> rrb.EyeControls3D:
    centre = (rest.min(axis=0) + rest.max(axis=0)) / 2
    direction = np.array([0.5, -1.3, 0.45])
    return rrb.EyeControls3D(position=centre + direction * size, look_target=centre, eye_up=(0.0, 0.0, 1.0))
