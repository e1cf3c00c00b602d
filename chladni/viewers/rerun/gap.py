"""A diagnosis written to a rerun file: the answer, signals before and after, gap map, force, structure."""

import os
from collections.abc import Sequence
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from chladni.gap.records.diagnosis import GapSignals, RestoringForce
from chladni.io.atomic import atomic_write
from chladni.signals.time_series import NS_PER_S
from chladni.signals.unit_text import printed_unit
from chladni.signals.visible import visible
from chladni.viewers.gap_evidence import GapEvidence
from chladni.viewers.rerun.drawing import new_recording
from chladni.viewers.rerun.entities import folder
from chladni.viewers.rerun.gap_map import draw_gap_maps
from chladni.viewers.rerun.gap_signals import draw_errors, draw_signals
from chladni.viewers.rerun.gap_structure import draw_structure
from chladni.viewers.rerun.gap_text import draw_answer
from chladni.viewers.rerun.restoring_force import draw_force_over_time, draw_surfaces
from chladni.viewers.rerun.robot import draw_positions, draw_robot
from chladni.viewers.rerun.timelines import time_axis
from chladni.viewers.rerun.torque_maps import draw_torque_maps
from chladni.viewers.robot_scene import RobotScene
from chladni.viewers.structure_sketch import StructureSketch

# More plots than this above one another are too flat to read; all of them go behind tabs.
STACKED = 3
# Of joints in half a window.
TABS = 4


def write_gap_rrd(
    evidence: GapEvidence,
    path: str | os.PathLike[str],
    *,
    sketch: StructureSketch | None = None,
    scene: RobotScene | None = None,
) -> Path:
    """Write a diagnosis to a ``.rrd`` file, whole or not at all.

    Parameters
    ----------
    evidence
        What to draw.
    path
        File to write; one that exists is replaced once the new one is complete.
    sketch
        The structure, coloured by share; None to leave that page out.
    scene
        The robot in motion, which opens the recording; None of a model.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    LogError
        When the folder doesn't exist, or the operating system refuses the write.
    """
    target = Path(path)
    recording = new_recording()
    # Not rerun's own file sink: on a full disk it only logs the loss, and a later flush waits for ever.
    stream = rr.binary_stream(recording)
    with atomic_write(target) as file:
        draw_gap(recording, evidence, sketch=sketch, scene=scene)
        file.write(stream.read() or b"")
    return target


def draw_gap(
    recording: rr.RecordingStream,
    evidence: GapEvidence,
    *,
    sketch: StructureSketch | None = None,
    scene: RobotScene | None = None,
) -> None:
    """Write all of a diagnosis and its blueprint into a recording that is connected already."""
    found = evidence.found
    recording.send_recording_name(f"{visible(found.model)}: gap")
    answer = draw_answer(recording, found)
    pages: list[rrb.Container] = []
    if scene is None:
        pages.append(_overview(recording, evidence, answer))
    else:
        pages += _robot(recording, evidence, answer, scene)
    pages += draw_torque_maps(recording, found, "velocity", "Friction")
    pages += draw_torque_maps(recording, found, "position", "Torque over position")
    if maps := draw_gap_maps(recording, found.signals):
        pages.append(rrb.Vertical(*maps, name="Gap map"))
    pages += _forces(recording, [one for one in found.restoring_forces if one.force.size])
    if sketch is not None:
        pages.append(rrb.Horizontal(draw_structure(recording, sketch), name="Structure"))
    # The blueprint goes last: rerun 0.41 has lost rows that followed one in a file (rerun issue 12769).
    recording.flush()
    recording.send_blueprint(_arranged(pages), make_active=True, make_default=True)
    recording.flush()


def _robot(
    recording: rr.RecordingStream, evidence: GapEvidence, answer: rrb.View, scene: RobotScene
) -> list[rrb.Container]:
    """The robot with answer and plots of each joint, the most missing first; and the torques of all joints."""
    found = evidence.found
    robots = draw_robot(recording, scene, after=evidence.after)
    signals, motion = found.signals, found.motion
    if signals is None or motion is None:
        return [rrb.Horizontal(*robots, answer, name="Robot")]
    torques = draw_signals(recording, signals, evidence.telling_s, after=evidence.after)
    residuals = draw_errors(recording, signals, after=evidence.after, what="Torque missing at")
    positions = draw_positions(recording, motion, after=evidence.after)
    shares = {one.name: one.share for one in found.where.sites}
    order = sorted(range(len(motion.joints)), key=lambda row: -shares.get(motion.joints[row], 0.0))
    joints = [rrb.Vertical(residuals[row], positions[row], name=visible(motion.joints[row])) for row in order]
    left = rrb.Vertical(rrb.Horizontal(*robots), answer, row_shares=[1.3, 1])
    return [
        rrb.Horizontal(left, _tabbed(joints), column_shares=[1.4, 1], name="Robot"),
        # A view has one place only.
        rrb.Grid(
            *(_again(one, signals, row) for row, one in enumerate(residuals)),
            name="Torque residuals",
        ),
        rrb.Horizontal(_tabbed(torques), name="Torques"),
    ]


def _again(view: rrb.View, signals: GapSignals, row: int) -> rrb.View:
    """Show a plot of the whole log once more, small among others, of which the first names the lines of all."""
    start_ns, end_ns = (round(end * NS_PER_S) for end in signals.span_s)
    return rrb.TimeSeriesView(
        origin=view.origin,
        name=f"{visible(signals.output_names[row])} [{printed_unit(signals.output_units[row])}]",
        axis_x=time_axis(end_ns, start_ns=start_ns),
        plot_legend=rrb.PlotLegend(visible=row == 0, corner=rrb.Corner2D.LeftTop),
    )


def _tabbed(views: Sequence[rrb.View | rrb.Container]) -> rrb.Container:
    """Behind tabs, of which so many as fit into a window are in a row; a row is called by its first and last."""
    if len(views) <= TABS:
        return rrb.Tabs(*views, active_tab=0)
    parts = [views[start : start + TABS] for start in range(0, len(views), TABS)]
    return rrb.Tabs(*(rrb.Tabs(*part, active_tab=0, name=_ends(part)) for part in parts), active_tab=0)


def _ends(views: Sequence[rrb.View | rrb.Container]) -> str:
    names = [str(one.name).partition(" [")[0] for one in views]
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"


def _forces(recording: rr.RecordingStream, surfaces: Sequence[RestoringForce]) -> list[rrb.Container]:
    """A page for each force, with its site where there are several."""
    pages: list[rrb.Container] = []
    for surface in surfaces:
        name = "Restoring force" if len(surfaces) == 1 else f"Restoring force at {visible(surface.site)}"
        path = folder(name.lower())
        shown = rrb.Horizontal(*draw_surfaces(recording, surface, path))
        over_time = draw_force_over_time(recording, surface, path)
        pages.append(rrb.Vertical(shown, over_time, row_shares=[3, 2], name=name))
    return pages


def _overview(recording: rr.RecordingStream, evidence: GapEvidence, answer: rrb.View) -> rrb.Container:
    signals = evidence.found.signals
    if signals is None:
        return rrb.Vertical(answer, name="Answer")
    # The stretch that tells most is shown first; all of the log is in it.
    plots = draw_signals(recording, signals, evidence.telling_s, after=evidence.after)
    errors = draw_errors(recording, signals, after=evidence.after)
    beside = rrb.Vertical(_stack(plots), _stack(errors))
    return rrb.Horizontal(answer, beside, column_shares=[1, 1.9], name="Answer")


def _stack(views: list[rrb.View]) -> rrb.Container:
    return rrb.Vertical(*views) if len(views) <= STACKED else rrb.Tabs(*views)


def _arranged(pages: list[rrb.Container]) -> rrb.Blueprint:
    return rrb.Blueprint(
        rrb.Tabs(*pages, active_tab=0),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        # Paused: a file that starts to play runs away from whoever wants to read it.
        rrb.TimePanel(state="collapsed", timeline="time", play_state="paused"),
        auto_layout=False,
        auto_views=False,
    )
