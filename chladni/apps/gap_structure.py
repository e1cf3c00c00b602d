"""The structure that was diagnosed, as a sketch coloured by what each of its parts can explain."""

from collections.abc import Sequence
from math import nan

import numpy as np

from chladni.gap.records.diagnosis import Where
from chladni.models.core.model import Model
from chladni.models.structures.structure import GROUND, Joint, Structure
from chladni.models.structures.structure_model import StructureModel
from chladni.signals.arrays import Real
from chladni.viewers.structure_sketch import StructureSketch

Places = dict[str, Real]

# How far the ground is from a body that hangs on it, over the size of the structure.
TO_GROUND = 0.35
# Inputs and outputs stand above their bodies, one above another, so far over the size of the structure.
ABOVE = 0.07


def structure_sketch(model: Model, where: Where) -> StructureSketch | None:
    """Sketch a structure; None for drives, schemes and other models, which have no bodies.

    Bodies without positions stand on an arc, in the order of the file.
    """
    if not isinstance(model, StructureModel) or not model.structure.bodies:
        return None
    structure = model.structure
    places = _body_places(structure)
    size = float(np.linalg.norm(np.ptp(np.array(list(places.values())), axis=0))) or 1.0
    joints = {joint.name: _ends(joint, places, size) for joint in structure.joints}
    # Names of inputs and outputs are unique over both.
    at = {one.name: one.at for one in model.inputs} | {one.name: one.at for one in model.outputs}
    signals = _signal_places(at, places, joints, size)
    shares = {one.name: one.share for one in where.sites}
    return StructureSketch(
        body_names=tuple(places),
        bodies=np.array(list(places.values())),
        body_share=_shares(list(places), shares),
        joint_names=tuple(joints),
        joints=np.array(list(joints.values())).reshape(-1, 2, 3),
        joint_share=_shares(list(joints), shares),
        signal_names=tuple(signals),
        signals=np.array(list(signals.values())).reshape(-1, 3),
        signal_share=_shares(list(signals), shares),
    )


def _body_places(structure: Structure) -> Places:
    bodies = structure.bodies
    if len({body.position for body in bodies}) < len(bodies):
        # Not said, or not said of all: in one place nothing could be told apart. On an arc a joint between any two
        # passes by all others, where in a row it would hide them.
        angles = np.pi * (1 - (np.arange(len(bodies)) + 0.5) / len(bodies))
        arc = np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
        return {body.name: place for body, place in zip(bodies, arc, strict=True)}
    return {body.name: np.array(body.position, dtype=np.float64) for body in bodies}


def _ends(joint: Joint, places: Places, size: float) -> Real:
    moving = next(end for end in joint.between if end != GROUND)
    below = places[moving] - TO_GROUND * size * np.array([0.0, 0.0, 1.0])
    return np.array([places.get(end, below) for end in joint.between])


def _signal_places(at: dict[str, str], places: Places, joints: Places, size: float) -> Places:
    """Places of inputs and outputs that are at a body or a joint; those of controllers and the ground have none."""
    found: Places = {}
    above: dict[str, int] = {}
    for name, part in at.items():
        if part in places or part in joints:
            above[part] = above.get(part, 0) + 1
            foot = places[part] if part in places else joints[part].mean(axis=0)
            found[name] = foot + ABOVE * size * above[part] * np.array([0.0, 0.0, 1.0])
    return found


def _shares(names: Sequence[str], shares: dict[str, float]) -> Real:
    return np.array([shares.get(name, nan) for name in names], dtype=np.float64)
