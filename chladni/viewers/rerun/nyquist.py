"""Nyquist plots: frequency responses as curves in the complex plane, with axes drawn by us."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.arrays import Real
from chladni.viewers.drawing import line_breaks, ticks
from chladni.viewers.panels import Panel
from chladni.viewers.rerun.entities import channel_entity
from chladni.viewers.rerun.frf import panel_folder
from chladni.viewers.rerun.timelines import frequency_index, send_columns
from chladni.viewers.style import Style

AXIS_COLOUR = (110, 110, 110)
GRID_COLOUR = (50, 50, 50)
LABEL_COLOUR = (170, 170, 170)
MARGIN = 0.12


def draw_nyquist(recording: rr.RecordingStream, panel: Panel, style: Style) -> rrb.View:
    """Write the curves, a dot on each at the frequency under the cursor, and the axes."""
    parent = panel_folder(panel, "nyquist")
    curves = {row: _plane(panel, row) for row in panel.group.rows}
    low, high = _square(np.concatenate(list(curves.values())))
    _draw_axes(recording, f"{parent}/axes", low, high)
    for row, points in curves.items():
        _draw_curve(recording, panel, row, points, parent, style)
    return rrb.Spatial2DView(
        origin=parent,
        name=f"Nyquist, Re and Im of H [{panel.unit}]",
        visual_bounds=rrb.VisualBounds2D(x_range=(low[0], high[0]), y_range=(low[1], high[1])),
    )


def _plane(panel: Panel, row: int) -> Real:
    """Points of a function as the viewer wants them: its y axis points down, so that Im is turned over."""
    value = panel.function(row)
    return np.column_stack([value.real, -value.imag]).astype(np.float64)


def _square(points: Real) -> tuple[Real, Real]:
    """Corners of a square around the origin and all points, so that circles of resonances look like circles."""
    # With the origin, from which gain and phase are read.
    finite = np.vstack([points[np.isfinite(points).all(axis=1)], [[0.0, 0.0]]])
    centre = (finite.min(axis=0) + finite.max(axis=0)) / 2
    half = max(float(np.ptp(finite, axis=0).max()) * (0.5 + MARGIN), np.finfo(np.float32).tiny)
    return centre - half, centre + half


def _draw_curve(
    recording: rr.RecordingStream, panel: Panel, row: int, points: Real, parent: str, style: Style
) -> None:
    channel = panel.response.responses[row]
    path, colour = channel_entity(parent, channel), style.on_dark(channel)
    frequency_hz = panel.frequency_hz()
    # A single point makes no line; the dot at the cursor still shows it.
    strips = [strip for strip in np.split(points, line_breaks(frequency_hz)) if len(strip) > 1]
    lines = rr.LineStrips2D(strips, colors=[colour] * len(strips), radii=rr.Radius.ui_points(1.0))
    recording.log(path, lines, static=True)
    dot = rr.Points2D.from_fields(
        radii=rr.Radius.ui_points(5.0), colors=[colour], labels=[style.labels[channel.name]]
    )
    recording.log(f"{path}/cursor", dot, static=True)
    # In single precision, as the viewer draws: seven digits are more than a screen shows.
    send_columns(recording, f"{path}/cursor", frequency_index(frequency_hz), rr.Points2D.columns(positions=points))


def _draw_axes(recording: rr.RecordingStream, path: str, low: Real, high: Real) -> None:
    real, imaginary = ticks(low[0], high[0]), ticks(-high[1], -low[1])
    grid = [[(x, low[1]), (x, high[1])] for x in real] + [[(low[0], -y), (high[0], -y)] for y in imaginary]
    axes = [[(low[0], 0.0), (high[0], 0.0)], [(0.0, low[1]), (0.0, high[1])]]
    # Behind the curves, whatever the order in which entities are drawn.
    colours = [GRID_COLOUR] * len(grid) + [AXIS_COLOUR] * len(axes)
    strips = rr.LineStrips2D(grid + axes, colors=colours, radii=rr.Radius.ui_points(0.5), draw_order=-10.0)
    recording.log(path, strips, static=True)
    # Inside the frame, for at its edge a number would be cut; labels hang below their point.
    inset = np.array([0.04, 0.08]) * (high - low)
    bottom, left = high[1] - inset[1], low[0] + inset[0]
    places = [(x, bottom) for x in real] + [(left, -y) for y in imaginary]
    places += [(high[0] - inset[0], 0.0), (0.0, low[1] + inset[1] / 4)]
    texts = [f"{x:g}" for x in real] + [f"{y:g}" for y in imaginary] + ["Re", "Im"]
    labels = rr.Points2D(
        places,
        labels=texts,
        show_labels=True,
        colors=[LABEL_COLOUR] * len(texts),
        radii=rr.Radius.ui_points(0.5),
        draw_order=-5.0,
    )
    recording.log(f"{path}/numbers", labels, static=True)
