"""What MuJoCo knows of a robot's looks: the description's own shapes, and where links are."""

from typing import Any

import numpy as np

from chladni.robots.shapes import Kind, Shape
from chladni.signals.arrays import Real

#: A scanned robot has more; what shows it needs no more.
_MOST_FACES = 200_000


def link_poses(model: Any, position: Real) -> tuple[Real, Real]:
    """Give places ``[sample, link, 3]`` and quaternions x, y, z, w of all links for ``qpos [place, sample]``.

    Joints that follow others are set as these are.
    """
    import mujoco

    data = mujoco.MjData(model)
    follows = [
        (
            int(model.jnt_qposadr[model.eq_obj1id[one]]),
            int(model.jnt_qposadr[model.eq_obj2id[one]]),
            model.eq_data[one],
        )
        for one in range(model.neq)
        if int(model.eq_type[one]) == int(mujoco.mjtEq.mjEQ_JOINT) and model.eq_obj2id[one] >= 0
    ]
    pose = position.copy()
    for one, other, numbers in follows:
        pose[one] = model.qpos0[one] + np.polynomial.polynomial.polyval(pose[other] - model.qpos0[other], numbers[:5])
    place = np.empty((pose.shape[1], model.nbody - 1, 3))
    turn = np.empty((pose.shape[1], model.nbody - 1, 4))
    for sample, one in enumerate(pose.T):
        data.qpos[:] = one
        mujoco.mj_kinematics(model, data)
        place[sample], turn[sample] = data.xpos[1:], data.xquat[1:]
    return place, np.roll(turn, -1, axis=-1)


def described_shapes(model: Any) -> list[Shape]:
    """Give shapes of links: those to look at where a link has some, else those that it collides with."""
    looks = (np.asarray(model.geom_contype) == 0) & (np.asarray(model.geom_conaffinity) == 0)
    found = []
    for link in range(1, model.nbody):
        first = int(model.body_geomadr[link])
        geoms = np.arange(first, first + int(model.body_geomnum[link])) if first >= 0 else np.zeros(0, dtype=np.intp)
        chosen = geoms[looks[geoms]] if looks[geoms].any() else geoms
        found += [shape for geom in chosen.tolist() if (shape := _shape(model, geom, link - 1)) is not None]
    faces = sum(0 if one.faces is None else len(one.faces) for one in found)
    return found if faces <= _MOST_FACES else [one for one in found if one.kind != "mesh"]


def _shape(model: Any, geom: int, link: int) -> Shape | None:
    import mujoco

    kinds = mujoco.mjtGeom
    kind, size = int(model.geom_type[geom]), np.array(model.geom_size[geom], dtype=np.float64)
    place, turn = np.array(model.geom_pos[geom]), np.roll(np.array(model.geom_quat[geom]), -1)
    if kind == int(kinds.mjGEOM_MESH):
        mesh = int(model.geom_dataid[geom])
        vertex, face = int(model.mesh_vertadr[mesh]), int(model.mesh_faceadr[mesh])
        return Shape(
            link=link, kind="mesh", size=np.zeros(3), place=place, turn=turn,
            vertices=np.array(model.mesh_vert[vertex : vertex + int(model.mesh_vertnum[mesh])], dtype=np.float64),
            faces=np.array(model.mesh_face[face : face + int(model.mesh_facenum[mesh])], dtype=np.int64),
        )  # fmt: skip
    if kind == int(kinds.mjGEOM_SPHERE):
        return Shape(link=link, kind="ellipsoid", size=np.full(3, size[0]), place=place, turn=turn)
    names: dict[Any, Kind] = {
        kinds.mjGEOM_ELLIPSOID: "ellipsoid", kinds.mjGEOM_BOX: "box", kinds.mjGEOM_CAPSULE: "capsule",
        kinds.mjGEOM_CYLINDER: "cylinder",
    }  # fmt: skip
    # Planes and height fields are the world's.
    name = next((name for one, name in names.items() if int(one) == kind), None)
    return None if name is None else Shape(link=link, kind=name, size=size, place=place, turn=turn)
