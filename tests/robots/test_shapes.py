"""What a robot looks like, and where its links are, against closed forms."""

from pathlib import Path

import numpy as np
import pytest

from chladni.robots.loading import load_robot
from chladni.robots.shapes import Shape, forward_kinematics, joint_places, robot_size, shapes_of, turned_to
from tests.robots.made import ARM, written

pytest.importorskip("mujoco")

#: A bar of even density, and a link with shapes to look at and to collide with.
DRAWN = """<mujoco model="drawn"><compiler angle="radian"/>
  <default><default class="look"><geom contype="0" conaffinity="0"/></default></default>
  <asset><mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset>
  <worldbody><geom type="plane" size="1 1 1"/><body name="bar"><joint name="turn" axis="0 0 1"/>
    <inertial pos="0.1 0 0" mass="5" diaginertia="0.058 0.034 0.026"/>
    <body name="head" pos="0 0 0.5"><joint name="nod" axis="0 -1 0" pos="0 0 0.1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <geom type="box" size="0.1 0.2 0.3"/><geom class="look" type="capsule" size="0.02 0.1"/>
      <geom class="look" type="mesh" mesh="wedge"/></body>
  </body></worldbody>
  <equality><joint joint1="nod" joint2="turn" polycoef="0.2 -2 0 0 0"/></equality></mujoco>"""


def test_links_are_where_trigonometry_puts_them(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, ARM))
    shoulder, elbow, lift = np.array([[0.0, 0.7, -1.1], [0.0, -0.4, 0.9], [0.0, 0.05, 0.1]])
    poses = forward_kinematics(robot, ("shoulder", "elbow", "lift"), np.array([shoulder, elbow, lift]))
    fore, hand = (robot.links.index(name) for name in ("fore", "hand"))
    x, z = 0.4 * np.sin(shoulder), 0.4 * np.cos(shoulder)
    np.testing.assert_allclose(poses.place[:, fore], np.stack([x, 0 * x, z], axis=1), atol=1e-12)
    reach, angle = 0.3 + lift, shoulder + elbow
    np.testing.assert_allclose(poses.place[:, hand, 0], x + reach * np.sin(angle), atol=1e-12)
    # x, y, z, w of a turn about y.
    np.testing.assert_allclose(poses.turn[:, hand, 1], np.sin(angle / 2), atol=1e-12)
    np.testing.assert_allclose(poses.turn[:, hand, 3], np.cos(angle / 2), atol=1e-12)


def test_joints_that_follow_others_do(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, DRAWN))
    turn = np.array([[0.0, 0.3]])
    poses = forward_kinematics(robot, ("turn",), turn)
    nod = forward_kinematics(robot, ("turn", "nod"), np.array([turn[0], 0.2 - 2 * turn[0]]))
    np.testing.assert_allclose(poses.turn, nod.turn, atol=1e-12)


def test_shapes_to_look_at_go_before_those_that_collide(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, DRAWN))
    shapes = [one for one in shapes_of(robot) if one.link == robot.links.index("head")]
    assert [one.kind for one in shapes] == ["capsule", "mesh"]
    np.testing.assert_allclose(shapes[0].size[:2], [0.02, 0.1])
    mesh = shapes[1]
    assert mesh.vertices is not None
    assert mesh.faces is not None
    # MuJoCo moves a mesh to its centre of mass; its place and its turn bring it back.
    corners = mesh.place + [_turn(mesh, one) for one in mesh.vertices]
    assert {tuple(np.round(one, 6) + 0.0) for one in corners} == {(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)}


def _turn(shape: Shape, vector: np.ndarray) -> np.ndarray:
    axis, w = shape.turn[:3], shape.turn[3]
    return vector + 2 * np.cross(axis, np.cross(axis, vector) + w * vector)


def test_a_link_without_shapes_has_the_ellipsoid_of_its_inertia_and_bones(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, DRAWN))
    bone, body = (one for one in shapes_of(robot) if one.link == robot.links.index("bar"))
    assert (bone.kind, body.kind) == ("capsule", "ellipsoid")
    np.testing.assert_allclose(2 * bone.place, [0, 0, 0.5])
    np.testing.assert_allclose(bone.size[1], 0.25)
    # I = m/5 (b^2 + c^2) and so on, of half axes 0.1, 0.15 and 0.2 m less rounding.
    squares = np.sort(body.size**2)
    np.testing.assert_allclose(squares, 2.5 / 5 * (0.118 - 2 * np.array([0.058, 0.034, 0.026])), rtol=1e-9)
    np.testing.assert_allclose(body.place, [0.1, 0, 0])


@pytest.mark.parametrize("moments", ["1e3 1e3 1e3", "1e-9 1e-9 1e-9"])
def test_no_wrong_inertia_hides_the_robot(tmp_path: Path, moments: str) -> None:
    robot = load_robot(written(tmp_path, DRAWN.replace("0.058 0.034 0.026", moments)))
    for one in shapes_of(robot):
        assert np.isfinite(one.size).all()
        assert one.size.max() <= robot_size(robot)
        assert one.kind == "mesh" or one.size[0] > 0


def test_joints_are_told_in_the_frame_of_the_link_that_they_move(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, DRAWN))
    turn, nod = joint_places(robot)
    assert (turn.name, turn.link, nod.name, nod.link) == ("turn", 0, "nod", 1)
    np.testing.assert_allclose(nod.anchor, [0, 0, 0.1])
    np.testing.assert_allclose(nod.axis, [0, -1, 0])


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -2), (1, -2, 0.5)])
def test_a_turn_brings_z_to_the_direction(direction: tuple[float, float, float]) -> None:
    aim = np.array(direction, dtype=np.float64)
    shape = Shape(link=0, kind="box", size=np.ones(3), place=np.zeros(3), turn=turned_to(aim))
    np.testing.assert_allclose(_turn(shape, np.array([0.0, 0.0, 1.0])), aim / np.linalg.norm(aim), atol=1e-12)
