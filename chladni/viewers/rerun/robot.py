"""The robot in motion: measured, and beside it as it's simulated; joints coloured by the torque that is missing."""

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.gap.records.robot import JointMotion
from chladni.robots.shapes import JointPlace, Poses, Shape, turned_to
from chladni.signals.arrays import Real
from chladni.signals.engineering import percent
from chladni.signals.time_series import NS_PER_S
from chladni.signals.visible import visible
from chladni.viewers.drawing import with_breaks
from chladni.viewers.gap_evidence import AFTER_ON_DARK, BEFORE_ON_DARK, MEASURED_ON_DARK
from chladni.viewers.rerun.entities import folder
from chladni.viewers.rerun.timelines import send_columns, send_scalars, time_axis, time_index
from chladni.viewers.robot_scene import RobotScene
from chladni.viewers.style import Colour, amplitude_colours

PATH = folder("robot")
LINK: Colour = (150, 152, 158)
NOT_ASKED: Colour = (105, 105, 105)
#: Of 255: a ghost lets the measured robot through.
GHOST = 70
#: Over the robot's size: how far away it is looked at from, alone and in a view half as wide; half the length and the
#: radius of a joint.
DISTANCE, BESIDE, JOINT_LENGTH, JOINT_RADIUS = 0.42, 0.58, 0.04, 0.016
DIRECTION = np.array([0.75, -1.0, 0.45])
#: More names than this hide the robot; the others are told under the pointer.
NAMES_SHOWN = 4


def draw_robot(recording: rr.RecordingStream, scene: RobotScene, *, after: str) -> list[rrb.View]:
    """Write the robot as measured and as simulated; give a view of each simulation with what was measured."""
    _pose(recording, "measured", scene, scene.measured)
    _shapes(recording, "measured", scene.shapes, LINK, ghost=False)
    _joints(recording, scene)
    views = []
    ghosts = (
        ("before", scene.before, BEFORE_ON_DARK, "As described", "orange"),
        ("after", scene.after, AFTER_ON_DARK, after.capitalize(), "blue"),
    )
    for what, poses, colour, told, name in ghosts:
        if poses is not None:
            _pose(recording, what, scene, poses)
            _shapes(recording, what, scene.shapes, colour, ghost=True)
            views.append(_view(scene, f"{told} ({name})", what))
    return views or [_view(scene, "Measured; no simulation holds", None)]


def _pose(recording: rr.RecordingStream, what: str, scene: RobotScene, poses: Poses) -> None:
    index = time_index(np.rint(scene.time_s * NS_PER_S).astype(np.int64))
    for link in range(poses.place.shape[1]):
        columns = rr.Transform3D.columns(translation=poses.place[:, link], quaternion=poses.turn[:, link])
        send_columns(recording, f"{PATH}/{what}/{link + 1}", index, columns)
    if scene.gaps:
        # Hidden: the viewer would let the last pose stand for what nobody measured.
        last, first = np.array(scene.gaps), np.array(scene.gaps) + 1
        shown = np.concatenate([[scene.time_s[0]], scene.time_s[last] + 1e-3, scene.time_s[first]])
        size = np.concatenate([[1.0], np.zeros(last.size), np.ones(first.size)])
        order = np.argsort(shown)
        index = time_index(np.rint(shown[order] * NS_PER_S).astype(np.int64))
        send_columns(
            recording, f"{PATH}/{what}", index, rr.Transform3D.columns(scale=np.repeat(size[order, None], 3, axis=1))
        )


def _shapes(
    recording: rr.RecordingStream, what: str, shapes: Sequence[Shape], colour: Colour, *, ghost: bool
) -> None:
    ordered = sorted(shapes, key=lambda one: (one.link, one.kind))
    for (link, kind), group in groupby(ordered, key=lambda one: (one.link, one.kind)):
        for number, archetype in enumerate(_archetypes(kind, list(group), colour, ghost=ghost)):
            recording.log(f"{PATH}/{what}/{link + 1}/{kind}_{number + 1}", *archetype, static=True)


def _archetypes(
    kind: str, group: Sequence[Shape], colour: Colour, *, ghost: bool
) -> Iterator[tuple[rr.AsComponents, ...]]:
    """One of all shapes of a kind on a link; of each mesh its own."""
    paint = (*colour, GHOST) if ghost else colour
    if kind == "mesh":
        for one in group:
            if one.vertices is None:
                continue
            mesh = rr.Mesh3D(vertex_positions=one.vertices, triangle_indices=one.faces, albedo_factor=paint)
            place = rr.InstancePoses3D(translations=[one.place], quaternions=[one.turn])
            yield mesh, place
        return
    sizes, places, turns = (np.array([getattr(one, name) for one in group]) for name in ("size", "place", "turn"))
    fill = rr.components.FillMode.TransparentFillMajorWireframe if ghost else rr.components.FillMode.Solid
    look: dict[str, Any] = {"colors": [paint], "fill_mode": fill, "quaternions": turns}
    match kind:
        case "box":
            yield (rr.Boxes3D(half_sizes=sizes, centers=places, **look),)
        case "ellipsoid":
            yield (rr.Ellipsoids3D(half_sizes=sizes, centers=places, **look),)
        case "cylinder":
            yield (rr.Cylinders3D(radii=sizes[:, 0], lengths=2 * sizes[:, 1], centers=places, **look),)
        case "capsule":
            # rerun's capsules begin at the middle of their lower end.
            low = places - _along(turns) * sizes[:, 1:2]
            yield (rr.Capsules3D(radii=sizes[:, 0], lengths=2 * sizes[:, 1], translations=low, **look),)


def _along(turns: Real) -> Real:
    """``[shape, 3]``: where z points after a turn."""
    x, y, z, w = turns.T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def _joints(recording: rr.RecordingStream, scene: RobotScene) -> None:
    """Write joints as discs about their axes, those with the most torque missing with their names."""
    most = float(np.nanmax(scene.share, initial=0.0)) or 1.0
    order = np.argsort(-np.nan_to_num(scene.share, nan=-1.0))
    named = set(order[:NAMES_SHOWN].tolist())
    for place, (one, share) in enumerate(zip(scene.joints, scene.share.tolist(), strict=True)):
        colour = NOT_ASKED if np.isnan(share) else tuple(amplitude_colours(np.array(share / most)).tolist())
        disc = rr.Cylinders3D(
            radii=[JOINT_RADIUS * scene.size], lengths=[2 * JOINT_LENGTH * scene.size], centers=[one.anchor],
            quaternions=[turned_to(one.axis)], colors=[colour], fill_mode=rr.components.FillMode.Solid,
            labels=[_label(one, share)], show_labels=place in named,
        )  # fmt: skip
        recording.log(f"{PATH}/measured/{one.link + 1}/joint_{place + 1}", disc, static=True)


def _label(one: JointPlace, share: float) -> str:
    return visible(one.name) if np.isnan(share) else f"{visible(one.name)} {percent(share)}"


def _view(scene: RobotScene, name: str, ghost: str | None) -> rrb.View:
    distance = DISTANCE if scene.before is None or scene.after is None else BESIDE
    eye = rrb.EyeControls3D(
        position=scene.centre + DIRECTION * scene.size * distance, look_target=scene.centre, eye_up=(0.0, 0.0, 1.0)
    )
    shown = ["measured"] if ghost is None else ["measured", ghost]
    return rrb.Spatial3DView(
        origin=PATH,
        contents=[f"{PATH}/{one}/**" for one in shown],
        name=name,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=eye,
    )


def draw_positions(recording: rr.RecordingStream, motion: JointMotion, *, after: str) -> list[rrb.View]:
    """Write every joint's position, measured and simulated; each view opens where the description errs most."""
    start_s, end_s = _telling_s(motion)
    lines = (
        ("measured", motion.measured, MEASURED_ON_DARK, 3.0),
        ("as described", motion.before, BEFORE_ON_DARK, 1.2),
        (f"simulated {after}", motion.after, AFTER_ON_DARK, 1.2),
    )
    # A gap and a new start of the simulation are no motion.
    seconds, breaks = motion.time_s, np.array(motion.gaps, dtype=np.intp) + 1
    views: list[rrb.View] = []
    for row, name in enumerate(motion.joints):
        path = folder("positions", str(row + 1))
        for place, (what, values, colour, width) in enumerate(lines):
            if values is None:
                continue
            look = rr.SeriesLines(names=what, colors=[colour], widths=width, aggregation_policy="MinMax")
            recording.log(f"{path}/{place}", look, static=True)
            x, y = with_breaks(seconds, values[row], breaks)
            send_scalars(recording, f"{path}/{place}", time_index(np.rint(x * NS_PER_S).astype(np.int64)), y)
        views.append(
            rrb.TimeSeriesView(
                origin=path,
                name=f"Position of {visible(name)} [{motion.units[row]}]",
                axis_x=time_axis(round(end_s * NS_PER_S), start_ns=round(start_s * NS_PER_S)),
                plot_legend=rrb.PlotLegend(visible=True, corner=rrb.Corner2D.LeftTop),
            )
        )
    return views


#: Runs of the simulation that a view of positions shows at first.
RUNS = 3.0


def _telling_s(motion: JointMotion) -> tuple[float, float]:
    """Start and end of some runs of the simulation where it errs most, each joint by its own motion."""
    first, last = float(motion.time_s[0]), float(motion.time_s[-1])
    simulated = motion.before if motion.before is not None else motion.after
    if simulated is None or motion.horizon_s is None:
        return first, last
    size = np.std(motion.measured, axis=1, keepdims=True)
    errors = np.sum(((simulated - motion.measured) / np.where(size > 0, size, 1.0)) ** 2, axis=0)
    total = np.concatenate([[0.0], np.cumsum(errors)])
    ends = np.searchsorted(motion.time_s, motion.time_s + max(RUNS * motion.horizon_s, 1.0))
    start = int(np.argmax(total[ends] - total[:-1]))
    return float(motion.time_s[start]), float(motion.time_s[ends[start] - 1])
