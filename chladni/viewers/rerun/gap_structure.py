"""The structure in three dimensions, each part coloured by the share of the gap that it can explain."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.arrays import Bytes, Real
from chladni.signals.engineering import percent
from chladni.signals.visible import visible
from chladni.viewers.rerun.entities import folder
from chladni.viewers.structure_sketch import StructureSketch
from chladni.viewers.style import amplitude_colours

PATH = folder("structure")
NOT_ASKED = (105, 105, 105)
# Over the structure's size: bodies, joints, inputs and outputs; how far away it is looked at from.
BODY, JOINT, SIGNAL, DISTANCE = 0.03, 0.012, 0.015, 0.95
DIRECTION = np.array([0.35, -1.0, 0.3])


def draw_structure(recording: rr.RecordingStream, sketch: StructureSketch) -> rrb.View:
    """Write bodies, joints, inputs and outputs with names and shares, and give their view."""
    size = sketch.size
    for name, places, names, share, radius in (
        ("bodies", sketch.bodies, sketch.body_names, sketch.body_share, BODY),
        ("signals", sketch.signals, sketch.signal_names, sketch.signal_share, SIGNAL),
    ):
        dots = rr.Points3D(places, labels=_labels(names, share), colors=_colours(share), radii=radius * size,
                           show_labels=True)  # fmt: skip
        recording.log(f"{PATH}/{name}", dots, static=True)
    # Joints are where most effects sit: lines thick enough to carry their colour.
    joints = rr.LineStrips3D(
        list(sketch.joints),
        labels=_labels(sketch.joint_names, sketch.joint_share),
        colors=_colours(sketch.joint_share),
        radii=JOINT * size,
        show_labels=True,
    )
    recording.log(f"{PATH}/joints", joints, static=True)
    eye = rrb.EyeControls3D(
        position=sketch.centre + DIRECTION * size * DISTANCE, look_target=sketch.centre, eye_up=(0.0, 0.0, 1.0)
    )
    return rrb.Spatial3DView(
        origin=PATH,
        name="What each part alone can explain of the gap: blue nothing, orange all, grey not asked",
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=eye,
    )


def _labels(names: tuple[str, ...], share: Real) -> list[str]:
    shown = zip(map(visible, names), share, strict=True)
    return [name if np.isnan(one) else f"{name} {percent(float(one))}" for name, one in shown]


def _colours(share: Real) -> Bytes:
    asked = ~np.isnan(share)[:, None]
    return np.where(asked, amplitude_colours(share), np.array(NOT_ASKED)).astype(np.uint8)
