"""What a robot looks like: shapes of its links, places of its joints, and where all of them are in a pose."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chladni.robots.robot import Robot
from chladni.signals.arrays import Real, Whole
from chladni.signals.value import Value

Kind = Literal["box", "ellipsoid", "capsule", "cylinder", "mesh"]

#: Of a link without a shape: its own ellipsoid is no larger than so much of its reach, since inertias of descriptions
#: are often wrong, and its bones are so thick.
_MOST, _BONE = 0.6, 0.06
#: Of the robot's size: reach that a link at the end of a chain has at least.
_LEAST = 0.04


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape(Value):
    """A body of a link, in the link's frame.

    Attributes
    ----------
    link
        Place among the robot's links.
    kind
        ``box`` and ``ellipsoid`` have half sizes; ``capsule`` and ``cylinder`` a radius and half a length along z.
    size
        ``[3]`` metres; of a mesh nothing.
    place, turn
        ``[3]`` metres, of the middle; ``[4]`` quaternion x, y, z, w.
    vertices, faces
        ``[vertex, 3]`` and ``[face, 3]`` of a mesh.
    """

    link: int
    kind: Kind
    size: Real
    place: Real
    turn: Real
    vertices: Real | None = None
    faces: Whole | None = None

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def radius(self) -> float:
        """How far it reaches from its middle at most, m."""
        if self.vertices is not None:
            return float(np.linalg.norm(self.vertices, axis=1).max(initial=0.0))
        return float(self.size[:2].sum() if self.kind == "capsule" else np.linalg.norm(self.size))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointPlace(Value):
    """Where a joint is in the frame of the link that it moves: anchor and axis ``[3]``."""

    name: str
    link: int
    anchor: Real
    axis: Real

    def __post_init__(self) -> None:
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Poses(Value):
    """Where links are in the world: ``[sample, link, 3]`` metres and ``[sample, link, 4]`` quaternions x, y, z, w."""

    place: Real
    turn: Real

    def __post_init__(self) -> None:
        self._freeze()


def forward_kinematics(robot: Robot, joints: Sequence[str], position: Real) -> Poses:
    """Give the poses of all links.

    Parameters
    ----------
    joints, position
        Names and ``[joint, sample]``, rad (m). Joints that follow one of these do; all others rest where the
        description has them.
    """
    from chladni.robots.mujoco_shapes import link_poses

    model = robot.model
    pose = np.repeat(np.asarray(model.qpos0, dtype=np.float64)[:, None], position.shape[1], axis=1)
    pose[[robot.joint(name).position for name in joints]] = position
    return Poses(**dict(zip(("place", "turn"), link_poses(model, pose), strict=True)))


def joint_places(robot: Robot) -> tuple[JointPlace, ...]:
    """Give the places of the robot's joints."""
    found = []
    for one in robot.joints:
        joint = int(robot.model.dof_jntid[one.dof])
        found.append(
            JointPlace(
                name=one.name,
                link=robot.links.index(one.link),
                anchor=np.array(robot.model.jnt_pos[joint]),
                axis=np.array(robot.model.jnt_axis[joint]),
            )
        )
    return tuple(found)


def shapes_of(robot: Robot) -> tuple[Shape, ...]:
    """Give the shapes of all links: the description's own; else bones, and an ellipsoid of the inertia."""
    from chladni.robots.mujoco_shapes import described_shapes

    own = described_shapes(robot.model)
    there = {one.link for one in own}
    return (*own, *_stand_ins(robot, there))


def _stand_ins(robot: Robot, there: set[int]) -> Iterator[Shape]:
    from chladni.robots.mujoco_motion import inertials

    model = robot.model
    parents, places = np.asarray(model.body_parentid)[1:] - 1, np.asarray(model.body_pos, dtype=np.float64)[1:]
    size = robot_size(robot)
    for link, (mass, centre, inertia) in enumerate(inertials(model)):
        if link in there:
            continue
        ends = places[parents == link]
        lengths = [float(np.linalg.norm(one)) for one in (*ends, 2.0 * centre)]
        reach = max([_LEAST * size, *lengths])
        for end, length in zip(ends, lengths, strict=False):
            if length > _LEAST * size:
                yield _bone(link, end, _BONE * reach)
        if mass > 0 and np.trace(inertia) > 0:
            yield _ellipsoid(link, mass, centre, inertia, _MOST * reach)


def robot_size(robot: Robot) -> float:
    """Give the length of the robot's longest chain, m."""
    model = robot.model
    length = np.linalg.norm(np.asarray(model.body_pos, dtype=np.float64), axis=1)
    for body, parent in enumerate(model.body_parentid):
        # The first body is the world, and those right on it only say where the robot stands.
        length[body] = 0.0 if parent == 0 else length[body] + length[parent]
    return float(length.max()) or 1.0


def _bone(link: int, end: Real, radius: float) -> Shape:
    length = float(np.linalg.norm(end))
    return Shape(
        link=link, kind="capsule", size=np.array([radius, length / 2.0, 0.0]), place=end / 2.0, turn=turned_to(end)
    )


def _ellipsoid(link: int, mass: float, centre: Real, inertia: Real, most: float) -> Shape:
    """Give the solid ellipsoid of even density that has a link's inertia."""
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    squares = 2.5 / mass * (np.sum(moments) - 2.0 * moments)
    half = np.minimum(np.sqrt(np.maximum(squares, 0.0)), most)
    # A rod has a thickness, too, or nothing of it would be seen.
    half = np.maximum(half, 0.1 * float(half.max()) or 1e-3)
    return Shape(link=link, kind="ellipsoid", size=half, place=centre, turn=_quaternion_of(axes))


def turned_to(direction: Real) -> Real:
    """Give the quaternion x, y, z, w of the shortest turn from z to a direction ``[3]``."""
    x, y, z = direction / np.linalg.norm(direction)
    if z < -1.0 + 1e-9:
        return np.array([1.0, 0.0, 0.0, 0.0])
    found = np.array([-y, x, 0.0, 1.0 + z])
    return np.asarray(found / np.linalg.norm(found))


def _quaternion_of(axes: Real) -> Real:
    """Quaternion x, y, z, w of a rotation matrix."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(axes).as_quat())
