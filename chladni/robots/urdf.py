"""URDF: what MuJoCo makes of it, with links that keep their names, and without meshes that aren't there."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from math import inf, isfinite
from typing import TYPE_CHECKING, Final

import numpy as np

from chladni.robots.description import Description, is_mesh, missing_meshes, parsed, real, text_of
from chladni.signals.errors import ModelError
from chladni.signals.wording import shown

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from chladni.robots.robot import BaseKind
    from chladni.signals.arrays import Real

LEAST_MASS: Final = 1e-6
"""kg: what a moving link has that states less; MuJoCo divides by it."""
LEAST_INERTIA: Final = 1e-9
"""kg m^2: likewise."""

# Numbers of a file have some three digits at least.
_ROUNDED: Final = 1e-3
_PACKAGE: Final = "package://"
_WORLD: Final = "world"
_OWN: Final = ("link", "joint", "material", "mujoco")


def read_urdf(path: Path, *, meshes: bool, base: BaseKind | None) -> Description:
    """Make a URDF file ready for MuJoCo; arguments and errors as of `read_mjcf`."""
    root = parsed(path)
    if any(one.tag.startswith("xacro:") for one in root.iter()):
        raise ModelError(f"{path}: holds xacro macros; expand them: xacro {path.name} -o robot.urdf")
    _require_names_once(path, root)
    for child in [one for one in root if one.tag not in _OWN]:
        # Of Gazebo, of controllers, of MoveIt.
        root.remove(child)
    used, missing = _settle_meshes(path, root, meshes=meshes)
    remarks = _uneven(path, root)
    if base == "floating":
        remarks += _let_float(path, root)
    _set_compiler(root)
    return Description(
        xml=text_of(root),
        meshes=used,
        velocity_limits=dict(_velocity_limits(path, root)),
        remarks=tuple(remarks),
        shapeless=missing_meshes(missing),
    )


def _require_names_once(path: Path, root: ET.Element) -> None:
    """Refuse names that stand twice: MuJoCo would take the name of the second away without a word."""
    for tag in ("link", "joint"):
        often = Counter(one.get("name", "") for one in root.findall(tag))
        twice = [shown(name) for name, count in often.items() if count > 1]
        if twice:
            raise ModelError(f"{path}: two {tag}s are called {', '.join(twice)}; give each a name of its own")


def _set_compiler(root: ET.Element) -> None:
    top = root.find("mujoco")
    if top is None:
        top = ET.SubElement(root, "mujoco")
    for one in [one for one in top if one.tag not in ("compiler", "option")]:
        top.remove(one)
    compiler = top.find("compiler")
    if compiler is None:
        compiler = ET.SubElement(top, "compiler")
    # In URDF a link without <inertial> has no mass, whatever its shape.
    compiler.attrib.setdefault("inertiafromgeom", "false")
    compiler.attrib.pop("meshdir", None)
    compiler.attrib |= {
        "fusestatic": "false", "strippath": "false", "discardvisual": "false", "balanceinertia": "true",
        "boundmass": f"{LEAST_MASS}", "boundinertia": f"{LEAST_INERTIA}",
    }  # fmt: skip


def _settle_meshes(path: Path, root: ET.Element, *, meshes: bool) -> tuple[int, int]:
    """Give meshes that are there by their whole paths, drop shapes of those that aren't; count files of both."""
    used, gone = set[str](), set[str]()
    for link in root.iter("link"):
        for shape in [one for one in link if one.tag in ("visual", "collision")]:
            # Nothing refers to it, and MuJoCo prints a line for each that stands there twice.
            shape.attrib.pop("name", None)
            mesh = shape.find("geometry/mesh")
            if mesh is None:
                continue
            name = mesh.get("filename", "")
            file = _mesh_file(path, name) if meshes else None
            if file is None:
                gone.add(name)
                link.remove(shape)
            else:
                mesh.set("filename", str(file))
                used.add(name)
    return len(used), len(gone)


def _mesh_file(path: Path, name: str) -> Path | None:
    """Find the file of a mesh: beside the description, or in the package that one of the folders above it is."""
    folder = path.parent.resolve()
    if not name.startswith(_PACKAGE):
        file = folder / name.removeprefix("file://")
        return file if is_mesh(file) else None
    package, _, rest = name.removeprefix(_PACKAGE).partition("/")
    for above in (folder, *folder.parents):
        for root in (above, above / package):
            if root.name == package and is_mesh(root / rest):
                return root / rest
    return None


def _velocity_limits(path: Path, root: ET.Element) -> Iterator[tuple[str, float]]:
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        velocity = None if limit is None else real(path, limit, "velocity")
        # Zero is how many leave it open, too.
        if velocity and isfinite(velocity):
            yield joint.get("name", ""), abs(velocity)


def _uneven(path: Path, root: ET.Element) -> list[str]:
    """Say whose inertia no body can have: the largest principal moment is above the sum of the others."""
    found = []
    for link in root.iter("link"):
        mass = link.find("inertial/mass")
        if mass is not None and not 0 <= (real(path, mass, "value") or 0.0) < inf:
            raise ModelError(f"{path}: the mass of link {link.get('name')} must be finite and not negative")
        inertia = link.find("inertial/inertia")
        if inertia is None:
            continue
        xx, yy, zz, xy, xz, yz = (
            real(path, inertia, f"i{one}") or 0.0 for one in ("xx", "yy", "zz", "xy", "xz", "yz")
        )
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if not np.isfinite(matrix).all():
            raise ModelError(f"{path}: the inertia of link {link.get('name')} isn't finite")
        low, middle, high = _settled_moments(inertia, matrix)
        if high > (low + middle) * (1 + _ROUNDED) + LEAST_INERTIA:
            found.append(link.get("name", ""))
    if not found:
        return []
    told = "is such as no body has, with one principal moment above the sum of the others; their mean is taken"
    return [f"the inertia of {', '.join(found)} {told}"]


def _settled_moments(inertia: ET.Element, matrix: Real) -> Real:
    """Give the principal moments as the file has them; those that rounding spoilt are mended in the element.

    MuJoCo refuses what isn't positive, and takes the mean of all three where one is above the sum of the others.
    """
    moments, axes = np.linalg.eigh(matrix)
    mended = np.maximum(moments, LEAST_INERTIA)
    most = mended[0] + mended[1]
    if most < mended[2] <= most * (1 + _ROUNDED):
        mended[2] = most * (1 - _ROUNDED * _ROUNDED)
    if moments[2] > LEAST_INERTIA and (mended != moments).any():
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = (axes * mended) @ axes.T
        for name, value in (("ixx", xx), ("iyy", yy), ("izz", zz), ("ixy", xy), ("ixz", xz), ("iyz", yz)):
            inertia.set(name, repr(float(value)))
    return moments


def _let_float(path: Path, root: ET.Element) -> list[str]:
    children = {one.get("link") for joint in root.findall("joint") for one in joint.findall("child")}
    roots = [one.get("name", "") for one in root.findall("link") if one.get("name") not in children]
    if any(joint.get("type") == "floating" for joint in root.findall("joint")):
        return []
    if len(roots) != 1:
        raise ModelError(f"{path}: base can't float: links {', '.join(roots)} have no parent; one must be the base")
    if roots == [_WORLD]:
        held = [one for one in root.findall("joint") if one.find(f"parent[@link='{_WORLD}']") is not None]
        if len(held) != 1 or held[0].get("type") != "fixed":
            raise ModelError(f"{path}: base can't float: link world must hold one link, by a fixed joint")
        held[0].set("type", "floating")
    else:
        # MuJoCo takes a link of this name for the world itself.
        ET.SubElement(root, "link", name=_WORLD)
        joint = ET.SubElement(root, "joint", name="chladni_base", type="floating")
        ET.SubElement(joint, "parent", link=_WORLD)
        ET.SubElement(joint, "child", link=roots[0])
    return ["the base is taken as floating, as the robot file says"]
