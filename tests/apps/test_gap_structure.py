"""The sketch of a structure: places, ends, shares."""

from dataclasses import replace

import numpy as np

from chladni.apps.gap_structure import structure_sketch
from chladni.models.instruments.catalogue import INSTRUMENTS
from tests import made_diagnosis as made

WHERE = made.diagnosis().where


def test_joints_end_at_their_bodies_and_at_a_ground_below() -> None:
    sketch = structure_sketch(made.arm_model(), WHERE)
    assert sketch is not None
    column, wrist = sketch.bodies
    np.testing.assert_array_equal(column, [0.0, 0.0, 0.4])
    shoulder, elbow = sketch.joints
    np.testing.assert_array_equal(elbow, [column, wrist])
    np.testing.assert_array_equal(shoulder[1], column)
    assert shoulder[0][2] < column[2]
    np.testing.assert_array_equal(shoulder[0][:2], column[:2])


def test_each_part_has_the_share_of_its_site_and_none_that_was_not_asked() -> None:
    sketch = structure_sketch(made.arm_model(), WHERE)
    assert sketch is not None
    assert dict(zip(sketch.joint_names, sketch.joint_share, strict=True)) == {"shoulder": 0.31, "elbow": 0.93}
    assert dict(zip(sketch.signal_names, sketch.signal_share, strict=True))["shaker"] == 0.28
    assert np.isnan(sketch.body_share).all()


def test_signals_stand_above_their_bodies_and_apart() -> None:
    sketch = structure_sketch(made.arm_model(), WHERE)
    assert sketch is not None
    places = dict(zip(sketch.signal_names, sketch.signals, strict=True))
    wrist = sketch.bodies[1]
    assert places["acc_wrist"][2] > places["shaker"][2] > wrist[2]
    np.testing.assert_array_equal(places["acc_wrist"][:2], wrist[:2])


def test_bodies_without_places_stand_so_that_no_joint_hides_another_body() -> None:
    model = made.arm_model()
    bodies = tuple(replace(model.structure.bodies[0], name=name, position=(0.0, 0.0, 0.0)) for name in "abcde")
    joints = tuple(replace(model.structure.joints[0], name=f"{a}{b}", between=(a, b)) for a, b in ("ab", "be", "ae"))
    structure = replace(model.structure, bodies=bodies, joints=joints)
    sketch = structure_sketch(replace(model, structure=structure, inputs=(), outputs=()), WHERE)
    assert sketch is not None
    for ends in sketch.joints:
        along = ends[1] - ends[0]
        apart = [np.linalg.norm(np.cross(along, place - ends[0])) / np.linalg.norm(along) for place in sketch.bodies]
        # Two bodies are its own ends; all others are well aside of the line.
        assert sorted(apart)[2] > 0.15


def test_a_drive_has_no_sketch() -> None:
    assert structure_sketch(INSTRUMENTS["pneumatic-motor"].model(), WHERE) is None
