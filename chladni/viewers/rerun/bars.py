"""Mode shapes without a geometry: a bar for each channel, in their order, that moves with the phase."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.arrays import Real
from chladni.signals.mode_set import ModeSet
from chladni.signals.study import Study
from chladni.viewers.mode_tables import mode_title
from chladni.viewers.rerun.blueprint import ShapeViews
from chladni.viewers.rerun.canvas import BEHIND, BELOW, LETTERS, Canvas, draw_labels
from chladni.viewers.rerun.movement import Movement
from chladni.viewers.style import Style, amplitude_colours

PATH = "/shapes"
WIDTH, HEIGHT = 560.0, 760.0
GHOST_COLOUR = (70, 70, 70)
NAMES_SHOWN = 24
NAME_ROOM = 150.0


def draw_bars(recording: rr.RecordingStream, study: Study, modes: ModeSet, style: Style) -> list[ShapeViews]:
    """Write each mode at all phases and give the views of each; the names say why there is no wireframe."""
    count = len(modes.channels)
    canvas = Canvas(width=WIDTH, height=HEIGHT, x_range=(-1.1, 1.1), y_range=(0.0, float(count)))
    _draw_axes(recording, canvas, modes, style)
    movement = Movement.of(study, vertices=2 * modes.shapes.size)
    return [_draw_mode(recording, canvas, movement, modes, row) for row in range(modes.frequency_hz.size)]


def _rows(count: int) -> Real:
    # The first channel on top.
    return np.asarray(count - 0.5 - np.arange(count))


def _draw_axes(recording: rr.RecordingStream, canvas: Canvas, modes: ModeSet, style: Style) -> None:
    count = len(modes.channels)
    grid = [canvas.places([at, at], [0.0, count]) for at in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    strips = rr.LineStrips2D(grid, colors=[(60, 60, 60)], radii=rr.Radius.ui_points(0.5), draw_order=BEHIND)
    recording.log(f"{PATH}/axes", strips, static=True)
    numbers = canvas.places([-1.0, 0.0, 1.0], [0.0, 0.0, 0.0]) + BELOW
    shown = np.arange(0, count, -(-count // NAMES_SHOWN))
    names = canvas.places(np.full(shown.size, -1.1), _rows(count)[shown]) - [NAME_ROOM / 2, LETTERS / 2]
    texts = ["-1", "0", "1", *(style.labels[modes.channels[row].name] for row in shown)]
    draw_labels(recording, f"{PATH}/axes/numbers", np.vstack([numbers, names]), texts)


def _draw_mode(
    recording: rr.RecordingStream, canvas: Canvas, movement: Movement, modes: ModeSet, row: int
) -> ShapeViews:
    parent, shape = f"{PATH}/mode_{row + 1}", modes.shapes[row]
    far, heights = np.abs(shape), _rows(shape.size)
    thick = min(5.0, 0.3 * HEIGHT / shape.size)
    reach = canvas.places(np.stack([-far, far], axis=1), np.stack([heights, heights], axis=1))
    ghost = rr.LineStrips2D(list(reach), colors=[GHOST_COLOUR], radii=thick, draw_order=-1.0)
    recording.log(f"{parent}/reach", ghost, static=True)
    look = rr.LineStrips2D.from_fields(colors=amplitude_colours(far), radii=thick * 0.8)
    recording.log(f"{parent}/bars", look, static=True)
    tips = movement.frames(shape)
    ends = np.stack([np.zeros_like(tips), tips], axis=-1)
    across = canvas.places(ends, np.broadcast_to(heights[:, None], ends.shape))
    movement.send(recording, f"{parent}/bars", across, _strips)
    name = "Re(ψ e^jφ) a channel · the setup gives no places · press play"
    return ShapeViews(
        large=_view(name, f"{PATH}/axes/**", f"{parent}/**", left=NAME_ROOM),
        small=_view(mode_title(modes, row), f"{PATH}/axes", f"{parent}/**", left=20.0),
    )


def _view(name: str, *contents: str, left: float) -> rrb.View:
    return rrb.Spatial2DView(
        origin=PATH,
        contents=list(contents),
        name=name,
        visual_bounds=rrb.VisualBounds2D(x_range=(-left, WIDTH + 20), y_range=(-20, HEIGHT + 2 * LETTERS)),
    )


def _strips(frames: Real) -> rr.ComponentColumnList:
    rows, count = frames.shape[:2]
    return rr.LineStrips2D.columns(strips=np.asarray(frames.reshape(-1, 2, 2))).partition([count] * rows)
