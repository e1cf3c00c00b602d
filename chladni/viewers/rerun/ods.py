"""Operating deflection shapes: how the measured points move at the frequency under the cursor."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from chladni.signals.arrays import Bytes, Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.study import Study
from chladni.viewers.drawing import decibels_of_amplitude
from chladni.viewers.rerun.entities import folder
from chladni.viewers.rerun.structure import draw_rest, shape_view
from chladni.viewers.rerun.timelines import frequency_index, send_columns
from chladni.viewers.style import Style, amplitude_colours
from chladni.viewers.wireframe import DRAWN_SHARE, Wireframe, amplitude, furthest

# Colours run over this many decibels below the greatest amplitude of any point at any frequency.
COLOUR_RANGE_DB = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shape:
    """Complex motion of each point of the wireframe, ``motion[frequency, point, axis]``."""

    frequency_hz: Real
    wireframe: Wireframe
    motion: NDArray[np.complexfloating]


def draw_deflections(
    recording: rr.RecordingStream, study: Study, response: FrequencyResponse, style: Style
) -> list[Callable[[], rrb.View]]:
    """Write the shape at every excited frequency and give, for each reference, a maker of views of it.

    Nothing is drawn without a geometry in which at least one response has a point and a direction.
    """
    wireframe = Wireframe.of(study.geometry, response.responses)
    if wireframe is None:
        return []
    return [_draw(recording, study, wireframe, response, style, column) for column in range(len(response.references))]


def _draw(
    recording: rr.RecordingStream,
    study: Study,
    wireframe: Wireframe,
    response: FrequencyResponse,
    style: Style,
    column: int,
) -> Callable[[], rrb.View]:
    parent = folder("deflection", f"reference {column + 1}")
    shape = _Shape(
        frequency_hz=response.frequency_hz[response.excited],
        wireframe=wireframe,
        motion=wireframe.motion(response.values[:, column, response.excited].T),
    )
    draw_rest(recording, parent, wireframe)
    first = _telling(study, shape, response.references[column].name)
    _draw_motion(recording, parent, shape, first)
    reference = style.labels[response.references[column].name]
    name = f"Deflection shape to {reference}, size normalised"
    if shape.frequency_hz[0] > 0:
        name += f" · first at {shape.frequency_hz[first]:.4g} Hz"
    return partial(shape_view, parent, name, wireframe)


def _telling(study: Study, shape: _Shape, reference: str) -> int:
    """Line of the highest peak, or of the greatest amplitude where no peak is named: what is shown at first."""
    peaks = [peak.frequency_hz for peak in study.response_peaks if peak.channels[-1:] == (reference,)]
    if peaks:
        return int(np.argmin(np.abs(shape.frequency_hz - peaks[0])))
    return int(np.argmax(amplitude(shape.motion).max(axis=1)))


def _draw_motion(recording: rr.RecordingStream, parent: str, shape: _Shape, first: int) -> None:
    """Points at their furthest, the wireframe through them, and an arrow from where each measured point rests.

    Below the band, where the cursor is when a file opens, stands the shape of line `first`.
    """
    if shape.frequency_hz[0] > 0:
        shape = replace(
            shape,
            frequency_hz=np.concatenate([[0.0], shape.frequency_hz]),
            motion=np.concatenate([shape.motion[first : first + 1], shape.motion]),
        )
    wireframe, size = shape.wireframe, shape.wireframe.size
    measured = wireframe.measured
    arrows = furthest(shape.motion) * DRAWN_SHARE * size
    moved = wireframe.rest + arrows
    colours = _colours(shape)
    index = frequency_index(shape.frequency_hz)
    lines, count = shape.frequency_hz.size, int(measured.sum())
    # Only measured points get a dot: one without a sensor would seem to stand still.
    dots = rr.Points3D.columns(
        positions=moved[:, measured].reshape(-1, 3),
        colors=colours[:, measured].reshape(-1, 3),
        radii=np.full(lines * count, 0.018 * size),
    )
    send_columns(recording, f"{parent}/moved/points", index, dots.partition([count] * lines))
    vectors = rr.Arrows3D.columns(
        origins=np.tile(wireframe.rest[measured], (lines, 1)),
        vectors=arrows[:, measured].reshape(-1, 3),
        colors=colours[:, measured].reshape(-1, 3),
        radii=np.full(lines * count, 0.004 * size),
    )
    send_columns(recording, f"{parent}/moved/arrows", index, vectors.partition([count] * lines))
    for number, line in enumerate(wireframe.lines, start=1):
        wire = rr.LineStrips3D.columns(strips=list(moved[:, list(line)]))
        # Colour and width once; only the places change with frequency.
        wired = rr.LineStrips3D.from_fields(colors=[(225, 225, 225)], radii=0.004 * size)
        recording.log(f"{parent}/moved/line_{number}", wired, static=True)
        send_columns(recording, f"{parent}/moved/line_{number}", index, wire)
    _return_to_rest(recording, parent, shape)


def _return_to_rest(recording: rr.RecordingStream, parent: str, shape: _Shape) -> None:
    """Clear the shape after the last line: a cursor outside the band must not show the last shape for ever."""
    # One line further, so that the last line itself can still be looked at.
    step_hz = float(np.median(np.diff(shape.frequency_hz))) if shape.frequency_hz.size > 1 else 1.0
    for timeline, ns in frequency_index(shape.frequency_hz[-1:] + step_hz).items():
        recording.set_time(timeline, duration=np.timedelta64(int(ns[0]), "ns"))
    names = ["points", "arrows", *(f"line_{number}" for number in range(1, len(shape.wireframe.lines) + 1))]
    for name in names:
        recording.log(f"{parent}/moved/{name}", rr.Clear(recursive=False))
    recording.reset_time()


def _colours(shape: _Shape) -> Bytes:
    """[frequency, point, rgb] from the amplitude in decibels below the greatest of all."""
    far = amplitude(shape.motion)
    greatest = far.max() or 1.0
    # A point that does not move at all has the lowest colour.
    level = np.nan_to_num(decibels_of_amplitude(far / greatest), nan=-COLOUR_RANGE_DB)
    return amplitude_colours(1 + level / COLOUR_RANGE_DB)
