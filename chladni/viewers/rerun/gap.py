"""A diagnosis written to a rerun file: the answer, signals before and after, gap map, force, structure."""

import os
from collections.abc import Sequence
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from chladni.gap.records.diagnosis import RestoringForce
from chladni.io.atomic import atomic_write
from chladni.signals.visible import visible
from chladni.viewers.gap_evidence import GapEvidence
from chladni.viewers.rerun.drawing import new_recording
from chladni.viewers.rerun.entities import folder
from chladni.viewers.rerun.gap_map import draw_gap_maps
from chladni.viewers.rerun.gap_signals import draw_errors, draw_signals
from chladni.viewers.rerun.gap_structure import draw_structure
from chladni.viewers.rerun.gap_text import draw_answer
from chladni.viewers.rerun.restoring_force import draw_force_over_time, draw_surfaces
from chladni.viewers.structure_sketch import StructureSketch

# More plots than this above one another are too flat to read; all of them go behind tabs.
STACKED = 3


def write_gap_rrd(
    evidence: GapEvidence, path: str | os.PathLike[str], *, sketch: StructureSketch | None = None
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
        draw_gap(recording, evidence, sketch)
        file.write(stream.read() or b"")
    return target


def draw_gap(recording: rr.RecordingStream, evidence: GapEvidence, sketch: StructureSketch | None) -> None:
    """Write all of a diagnosis and its blueprint into a recording that is connected already."""
    found = evidence.found
    recording.send_recording_name(f"{visible(found.model)}: gap")
    answer = draw_answer(recording, found)
    pages = [_overview(recording, evidence, answer)]
    if maps := draw_gap_maps(recording, found.signals):
        pages.append(rrb.Vertical(*maps, name="Gap map"))
    pages += _forces(recording, [one for one in found.restoring_forces if one.force.size])
    if sketch is not None:
        pages.append(rrb.Horizontal(draw_structure(recording, sketch), name="Structure"))
    # The blueprint goes last: rerun 0.41 has lost rows that followed one in a file (rerun issue 12769).
    recording.flush()
    recording.send_blueprint(_arranged(pages), make_active=True, make_default=True)
    recording.flush()


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
