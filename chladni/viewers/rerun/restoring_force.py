"""The restoring-force surface: the recovered force over displacement, velocity and time, the law over it."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.gap.records.diagnosis import RestoringForce
from chladni.signals.arrays import Bytes, Real
from chladni.signals.engineering import axis_scale, engineering
from chladni.signals.time_series import NS_PER_S
from chladni.signals.unit_text import printed_unit
from chladni.signals.visible import visible
from chladni.viewers.drawing import thin
from chladni.viewers.gap_evidence import AFTER_ON_DARK, MEASURED_ON_DARK
from chladni.viewers.rerun.canvas import Canvas
from chladni.viewers.rerun.timelines import send_scalars, time_axis, time_index
from chladni.viewers.restoring_force import (
    Over,
    force_range,
    motion,
    motion_reach,
    motion_unit,
    other,
    signed_colours,
    spread_out,
)
from chladni.viewers.style import Colour

WIDTH, HEIGHT, MARGIN = 800.0, 560.0, 0.05
# For the force's name over its axis.
ABOVE = 100.0
LAW_COLOUR = (255, 255, 255)
# Two lines of this many rows weigh a few tens of megabytes in the viewer.
ROWS = 500_000


def draw_surfaces(recording: rr.RecordingStream, surface: RestoringForce, path: str) -> list[rrb.View]:
    """Write the force over displacement and over velocity, each coloured by the other, under `path`."""
    return [
        _draw(recording, surface, f"{path}/displacement", "displacement"),
        _draw(recording, surface, f"{path}/velocity", "velocity"),
    ]


def _draw(recording: rr.RecordingStream, surface: RestoringForce, path: str, over: Over) -> rrb.View:
    rows = spread_out(surface)
    across, x_unit = axis_scale(motion(surface, over), motion_unit(surface, over))
    up, force_unit = axis_scale(surface.force, surface.force_unit)
    low, high = force_range(surface)
    # The canvas cuts nothing off: a dot beyond its range would stand among numbers and names.
    inside = rows[np.abs(surface.force[rows]) <= high]
    x = motion(surface, over)[rows] / across
    canvas = Canvas(width=WIDTH, height=HEIGHT, x_range=_padded(x), y_range=(low / up, high / up))
    canvas.draw_axes(recording, f"{path}/axes", x_name=f"{over} [{x_unit}]", y_name=f"force [{force_unit}]")
    shade = motion(surface, other(over))[inside] / motion_reach(surface, other(over))
    force = canvas.places(motion(surface, over)[inside] / across, surface.force[inside] / up)
    _dots(recording, f"{path}/force", force, signed_colours(shade), points=1.6)
    if surface.law_force is not None:
        law = canvas.places(x, surface.law_force[rows] / up)
        _dots(recording, f"{path}/law", law, np.array([LAW_COLOUR], dtype=np.uint8), points=0.8)
    law_told = "" if surface.law_force is None else "; white: law"
    name = f"Force recovered at {surface.site} over {over}; blue to orange: {other(over)}{law_told}"
    return canvas.view(path, f"{name}{_beyond(rows.size - inside.size, rows.size)}", above=ABOVE)


def _beyond(missing: int, dots: int) -> str:
    return f" · {missing} of {dots} dots lie beyond the axis" if missing else ""


def _dots(recording: rr.RecordingStream, path: str, places: Real, colours: Bytes, *, points: float) -> None:
    recording.log(path, rr.Points2D(places, colors=colours, radii=rr.Radius.ui_points(points)), static=True)


def _padded(x: Real) -> tuple[float, float]:
    # Dots on the frame would be cut in half.
    low, high = float(x.min()), float(x.max())
    room = MARGIN * (high - low) or 1.0
    return low - room, high + room


def draw_force_over_time(recording: rr.RecordingStream, surface: RestoringForce, path: str) -> rrb.View:
    """Write the recovered force and the law's over time and give their view."""
    # Numbered: the viewer draws lines in the order of their paths, and the law belongs in front.
    _line(recording, f"{path}/time/0", surface.time_s, surface.force, "recovered", MEASURED_ON_DARK)
    if surface.law_force is not None:
        _line(recording, f"{path}/time/1", surface.time_s, surface.law_force, "law", AFTER_ON_DARK)
    unit, furthest, reach = surface.force_unit, float(np.abs(surface.force).max()), force_range(surface)[1]
    # A recovered force swings wildly at the ends of a record, which would make a flat line of all between them.
    beyond = f" · reaches {engineering(furthest, None, unit)}, beyond the axis" if furthest > reach else ""
    start_ns, end_ns = (round(float(end) * NS_PER_S) for end in surface.time_s[[0, -1]])
    return rrb.TimeSeriesView(
        origin=f"{path}/time",
        # The viewer labels powers of ten alone where there is little room.
        name=f"Force recovered at {visible(surface.site)} [{printed_unit(unit)}], "
        f"±{engineering(reach, None, unit)}{beyond}",
        axis_x=time_axis(end_ns, start_ns=start_ns),
        axis_y=rrb.ScalarAxis(range=force_range(surface)),
        plot_legend=rrb.PlotLegend(visible=True, corner=rrb.Corner2D.LeftTop),
    )


def _line(recording: rr.RecordingStream, path: str, time_s: Real, values: Real, name: str, colour: Colour) -> None:
    # The default averages neighbours when zoomed out, which makes a vibration look like silence.
    look = rr.SeriesLines(names=name, colors=[colour], widths=1.2, aggregation_policy="MinMax")
    recording.log(path, look, static=True)
    chosen, _ = thin(values, limit=ROWS)
    send_scalars(recording, path, time_index(np.rint(time_s[chosen] * NS_PER_S).astype(np.int64)), values[chosen])
