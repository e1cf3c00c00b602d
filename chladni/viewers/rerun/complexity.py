"""Complexity plots: the components of a mode as arrows in the complex plane; a mode in one phase is a line."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.viewers.rerun.canvas import AXIS_COLOUR, BEHIND, GRID_COLOUR, draw_labels
from chladni.viewers.spread import spread
from chladni.viewers.style import Style

PATH = "/complexity"
REACH = 1.4
PHASE_COLOUR = (235, 235, 235)
# Of a label in a view of a few hundred pixels, in units of the greatest component.
LABEL_SIZE = (0.45, 0.2)
NAMES_SHOWN = 6


def draw_complexity(
    recording: rr.RecordingStream, modes: ModeSet, validation: ModeValidation | None, style: Style
) -> list[rrb.View]:
    """Write a plot of each mode and give their views."""
    _draw_circles(recording)
    return [_draw(recording, modes, validation, row, style) for row in range(modes.frequency_hz.size)]


def _draw(
    recording: rr.RecordingStream, modes: ModeSet, validation: ModeValidation | None, row: int, style: Style
) -> rrb.View:
    parent = f"{PATH}/mode_{row + 1}"
    # The viewer's y axis points down.
    tips = np.column_stack([modes.shapes[row].real, -modes.shapes[row].imag])
    colours = [style.on_dark(channel) for channel in modes.channels]
    strips = np.stack([np.zeros_like(tips), tips], axis=1)
    thin = 1.5 if len(tips) <= 30 else 0.75
    recording.log(
        f"{parent}/arrows", rr.LineStrips2D(strips, colors=colours, radii=rr.Radius.ui_points(thin)), static=True
    )
    names = [style.labels[channel.name] for channel in modes.channels]
    dots = rr.Points2D(tips, colors=colours, radii=rr.Radius.ui_points(3.0), labels=names, show_labels=False)
    recording.log(f"{parent}/tips", dots, static=True)
    by_size = np.argsort(-np.abs(modes.shapes[row]))
    named = spread(tips, apart=LABEL_SIZE, first=by_size, limit=NAMES_SHOWN)
    draw_labels(
        recording, f"{parent}/names", tips[named], [names[at] for at in named], colours=[colours[at] for at in named]
    )
    if validation is not None and np.isfinite(validation.mean_phase_deg[row]):
        angle = np.deg2rad(float(validation.mean_phase_deg[row]))
        end = np.array([np.cos(angle), -np.sin(angle)])
        line = rr.LineStrips2D(
            [[-end, end]], colors=[(*PHASE_COLOUR, 120)], radii=rr.Radius.ui_points(0.75), draw_order=-1.0
        )
        recording.log(f"{parent}/mean_phase", line, static=True)
    return rrb.Spatial2DView(
        origin=PATH,
        contents=[f"{PATH}/circles/**", f"{parent}/**"],
        name=_title(validation, row),
        visual_bounds=rrb.VisualBounds2D(x_range=(-REACH, REACH), y_range=(-REACH, REACH)),
    )


def _title(validation: ModeValidation | None, row: int) -> str:
    if validation is None or not np.isfinite(validation.mpc[row]):
        return "Complexity"
    return f"Complexity · MPC {validation.mpc[row]:.3f}, MPD {validation.mpd_deg[row]:.1f}°"


def _draw_circles(recording: rr.RecordingStream) -> None:
    angle = np.linspace(0, 2 * np.pi, 97)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    axes = np.array([[(-1.1, 0.0), (1.1, 0.0)], [(0.0, -1.1), (0.0, 1.1)]])
    lines = [circle, 0.5 * circle, *axes]
    colours = [AXIS_COLOUR, GRID_COLOUR, GRID_COLOUR, GRID_COLOUR]
    strips = rr.LineStrips2D(lines, colors=colours, radii=rr.Radius.ui_points(0.5), draw_order=BEHIND)
    recording.log(f"{PATH}/circles", strips, static=True)
    places = np.array([(1.15, -0.14), (0.0, -1.2), (-0.74, -0.9)])
    draw_labels(recording, f"{PATH}/circles/numbers", places, ["Re", "Im", "1"])
