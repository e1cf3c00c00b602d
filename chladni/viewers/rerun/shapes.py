"""Mode shapes that move: the wireframe where the setup knows places, else a bar for each channel."""

from functools import partial

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.mode_set import ModeSet
from chladni.signals.study import Study
from chladni.signals.wording import counted
from chladni.viewers.mode_tables import mode_title
from chladni.viewers.rerun.bars import draw_bars
from chladni.viewers.rerun.blueprint import ShapeViews
from chladni.viewers.rerun.movement import Movement
from chladni.viewers.rerun.structure import draw_rest, shape_view
from chladni.viewers.style import Style, amplitude_colours
from chladni.viewers.wireframe import DRAWN_SHARE, Wireframe, along, amplitude

PATH = "/shapes"
# The large view is upright, the small one lies; what moves must stay inside.
DISTANCE, SMALL_DISTANCE = 1.3, 0.85
# Pieces that each line is cut into, so that colour runs along it, as far as this many segments allow.
PIECES, SEGMENTS = 6, 600


def draw_shapes(recording: rr.RecordingStream, study: Study, modes: ModeSet, style: Style) -> list[ShapeViews]:
    """Write each mode at all phases and give the views of each."""
    wireframe = Wireframe.of(study.geometry, modes.channels)
    if wireframe is None:
        return draw_bars(recording, study, modes, style)
    draw_rest(recording, PATH, wireframe)
    parts = sum(len(line) - 1 for line in wireframe.lines)
    pieces = max(1, min(PIECES, SEGMENTS // max(parts, 1)))
    count = modes.frequency_hz.size
    movement = Movement.of(study, vertices=count * (len(wireframe.names) + 2 * parts * pieces))
    left_out = len(modes.channels) - len(wireframe.rows)
    draw = partial(_draw_mode, recording, wireframe, movement, pieces, left_out)
    return [draw(row, motion, mode_title(modes, row)) for row, motion in enumerate(wireframe.motion(modes.shapes))]


def _draw_mode(
    recording: rr.RecordingStream,
    wireframe: Wireframe,
    movement: Movement,
    pieces: int,
    left_out: int,
    row: int,
    motion: NDArray[np.complexfloating],
    title: str,
) -> ShapeViews:
    parent, size = f"{PATH}/mode_{row + 1}", wireframe.size
    far = amplitude(motion)
    greatest = float(far.max()) or 1.0
    drawn = motion * (DRAWN_SHARE * size / greatest)
    places = wireframe.rest + movement.frames(drawn)
    colours = amplitude_colours(far / greatest)
    measured = wireframe.measured
    few = len(wireframe.names) <= 60
    dots = rr.Points3D.from_fields(colors=colours[measured], radii=(0.016 if few else 0.006) * size)
    recording.log(f"{parent}/points", dots, static=True)
    movement.send(recording, f"{parent}/points", places[:, measured], _points)
    ends, shares = wireframe.segments(pieces)
    if len(ends):
        shade = along(far[:, None] / greatest, ends, shares).mean(axis=(1, 2))
        wires = rr.LineStrips3D.from_fields(colors=amplitude_colours(shade), radii=(0.006 if few else 0.003) * size)
        recording.log(f"{parent}/lines", wires, static=True)
        movement.send(recording, f"{parent}/lines", along(places, ends, shares), _strips)
    note = f" · {counted(left_out, 'channel')} without a place" if left_out else ""
    moved, view = f"{parent}/**", partial(shape_view, PATH, wireframe=wireframe)
    return ShapeViews(
        large=view(
            f"Re(ψ e^jφ), colour |ψ| · press play{note}", contents=(f"{PATH}/rest/**", moved), distance=DISTANCE
        ),
        small=view(title, contents=(f"{PATH}/rest/points", f"{PATH}/rest/lines", moved), distance=SMALL_DISTANCE),
    )


def _points(frames: Real) -> rr.ComponentColumnList:
    rows, count = frames.shape[:2]
    return rr.Points3D.columns(positions=frames.reshape(-1, 3)).partition([count] * rows)


def _strips(frames: Real) -> rr.ComponentColumnList:
    rows, count = frames.shape[:2]
    return rr.LineStrips3D.columns(strips=np.asarray(frames.reshape(-1, 2, 3))).partition([count] * rows)
