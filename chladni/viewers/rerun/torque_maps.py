"""Torques of a robot's joints over speed or position, coloured by load, with means and the law that was found."""

from itertools import pairwise

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.records.robot import Over, TorqueMap, site_words
from chladni.signals.arrays import Real
from chladni.signals.engineering import axis_scale
from chladni.signals.visible import visible
from chladni.viewers.gap_evidence import AFTER_ON_DARK, BEFORE_ON_DARK
from chladni.viewers.rerun.canvas import Canvas, draw_labels
from chladni.viewers.rerun.entities import folder
from chladni.viewers.restoring_force import spread_over
from chladni.viewers.style import Colour, amplitude_colours
from chladni.viewers.torque_maps import load_reach, maps_over, motion_name, torque_range, turns_of

WIDTH, HEIGHT, MARGIN = 460.0, 300.0, 0.05
MEAN_COLOUR: Colour = (255, 255, 255)
LOAD_COLOUR: Colour = (170, 170, 170)
#: Where the words of the legend stand, over the frame's width, and above the frame.
LEGEND, ABOVE = (0.08, 0.34, 0.62, 0.9), 34.0
#: More in one view are too small to be read.
TOGETHER = 6


def draw_torque_maps(recording: rr.RecordingStream, found: Diagnosis, over: Over, name: str) -> list[rrb.Container]:
    """Write a map for each joint, and give a page of them, with tabs where there are many; none without maps."""
    maps = maps_over(found, over)
    views = [_draw(recording, one, folder("torque", over, str(place + 1))) for place, one in enumerate(maps)]
    if not views:
        return []
    parts = [views[start : start + TOGETHER] for start in range(0, len(views), TOGETHER)]
    if len(parts) == 1:
        return [rrb.Grid(*views, name=name)]
    titles = [site_words(one.site) for one in maps]
    grids = []
    for place, part in enumerate(parts):
        first = place * TOGETHER
        told = f"{titles[first]} … {titles[first + len(part) - 1]}" if len(part) > 1 else titles[first]
        grids.append(rrb.Grid(*part, name=visible(told)))
    return [rrb.Tabs(*grids, active_tab=0, name=name)]


def _draw(recording: rr.RecordingStream, one: TorqueMap, path: str) -> rrb.View:
    across, x_unit = axis_scale(one.motion, one.motion_unit)
    low, high = torque_range(one)
    up, y_unit = axis_scale(np.array([low, high]), one.torque_unit)
    canvas = Canvas(width=WIDTH, height=HEIGHT, x_range=_padded(one.motion / across), y_range=(low / up, high / up))
    canvas.draw_axes(recording, f"{path}/axes", x_name=f"{motion_name(one)} [{x_unit}]", y_name=f"torque [{y_unit}]")
    rows = spread_over(one.motion.size)
    # The canvas cuts nothing off: a dot beyond its range would stand among numbers and names.
    rows = rows[(one.torque[rows] >= low) & (one.torque[rows] <= high)]
    dots = rr.Points2D(
        canvas.places(one.motion[rows] / across, one.torque[rows] / up),
        colors=amplitude_colours(np.abs(one.load[rows]) / load_reach(one)),
        radii=rr.Radius.ui_points(1.4),
    )
    recording.log(f"{path}/samples", dots, static=True)
    told = [("mean", MEAN_COLOUR), ("dots by load", LOAD_COLOUR)]
    if one.over == "velocity":
        _line(recording, f"{path}/described", canvas, one, one.described / up, across, BEFORE_ON_DARK)
        told.append(("described", BEFORE_ON_DARK))
    if one.law is not None:
        _line(recording, f"{path}/law", canvas, one, one.law / up, across, AFTER_ON_DARK)
        told.append(("found" if one.is_named else "suggested", AFTER_ON_DARK))
    _means(recording, f"{path}/means", canvas, one, across, up)
    # In a row above the frame: titles of views are cut off where there are many.
    places = np.column_stack([WIDTH * np.array(LEGEND[: len(told)]), np.full(len(told), -ABOVE)])
    draw_labels(recording, f"{path}/legend", places, [text for text, _ in told], colours=[paint for _, paint in told])
    return canvas.view(path, f"{site_words(one.site)} [{y_unit}]", above=3 * ABOVE)


def _padded(x: Real) -> tuple[float, float]:
    # Dots on the frame would be cut in half.
    low, high = float(x.min()), float(x.max())
    room = MARGIN * (high - low) or 1.0
    return low - room, high + room


def _line(
    recording: rr.RecordingStream,
    path: str,
    canvas: Canvas,
    one: TorqueMap,
    values: Real,
    across: float,
    colour: Colour,
) -> None:
    """Draw a line over the bins, broken where the motion turns: friction jumps there."""
    edges = [0, *turns_of(one).tolist(), one.centre.size]
    strips = [canvas.places(one.centre[a:b] / across, values[a:b]) for a, b in pairwise(edges) if b > a + 1]
    recording.log(path, rr.LineStrips2D(strips, colors=[colour], radii=rr.Radius.ui_points(1.0)), static=True)


def _means(
    recording: rr.RecordingStream, path: str, canvas: Canvas, one: TorqueMap, across: float, up: float
) -> None:
    ends = [canvas.places(one.centre / across, (one.mean + side * one.error) / up) for side in (-1.0, 1.0)]
    bars = rr.LineStrips2D(np.stack(ends, axis=1), colors=[MEAN_COLOUR], radii=rr.Radius.ui_points(0.6))
    recording.log(f"{path}/bars", bars, static=True)
    dots = rr.Points2D(
        canvas.places(one.centre / across, one.mean / up), colors=[MEAN_COLOUR], radii=rr.Radius.ui_points(2.2)
    )
    recording.log(f"{path}/dots", dots, static=True)
