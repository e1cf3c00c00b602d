"""MJCF: includes resolved inside the file's own folder, and what MuJoCo needn't load left out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from chladni.robots.description import MOST_BYTES, Description, is_mesh, missing_meshes, parsed, text_of, without
from chladni.signals.errors import ModelError
from chladni.signals.wording import counted, shown

if TYPE_CHECKING:
    import xml.etree.ElementTree as ET
    from collections.abc import Sequence

    from chladni.robots.robot import BaseKind

# Nothing of these moves a joint; all of them may name files, or ask for any amount of memory.
_LOOKS: Final = ("texture", "skin", "layer", "visual", "size", "statistic", "custom")
_SOFT: Final = ("composite", "flexcomp", "flex", "deformable")
_PLUGINS: Final = ("extension", "plugin")
_MOST_REPLICAS: Final = 1000


def read_mjcf(path: Path, *, meshes: bool, base: BaseKind | None) -> Description:
    """Make an MJCF file ready for MuJoCo.

    Parameters
    ----------
    path
        The file.
    meshes
        Whether meshes that are there are used.
    base
        What the robot file says; None leaves it as it is.

    Raises
    ------
    ModelError
        When it's no XML, includes what lies elsewhere, or is made of parts that aren't read.
    """
    root = whole_mjcf(path, comments=False)
    _require_whole(path, root)
    remarks = []
    if soft := without(root, _SOFT):
        remarks.append(f"{counted(soft, 'soft body')} left out".replace("bodys", "bodies"))
    if without(root, _PLUGINS):
        remarks.append("plugins are left out: what they drive or add isn't simulated")
    without(root, _LOOKS)
    for material in root.iter("material"):
        material.attrib.pop("texture", None)
    assets = _Assets(path, root, meshes=meshes)
    used, missing = assets.settle()
    weightless = _without_inertia_of_meshes(root, assets.bereft) if missing else []
    if weightless:
        remarks.append(f"the mass of {', '.join(weightless)} isn't known: it came from meshes; give <inertial>")
    for compiler in root.findall("compiler"):
        # Links keep their names.
        compiler.set("fusestatic", "false")
        for attribute in ("meshdir", "assetdir", "texturedir"):
            compiler.attrib.pop(attribute, None)
        compiler.set("strippath", "false")
    if base is not None:
        remarks += _with_base(path, root, base)
    return Description(
        xml=text_of(root),
        meshes=used,
        velocity_limits={},
        remarks=tuple(remarks),
        shapeless=missing_meshes(missing),
        weightless=tuple(weightless),
    )


def whole_mjcf(path: Path, *, comments: bool) -> ET.Element:
    """Read an MJCF file with what it includes in its place; arguments as of `parsed`, errors as of `read_mjcf`."""
    root = parsed(path, comments=comments)
    _Includes(path).resolve(root)
    return root


class _Includes:
    """Puts in the place of each include what the file holds, once each, as MuJoCo does."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._folder = path.parent.resolve()
        self._seen = {path.resolve()}
        self._left = MOST_BYTES - path.stat().st_size

    def resolve(self, root: ET.Element) -> None:
        """Resolve all includes below an element."""
        waiting = [root]
        while waiting:
            parent = waiting.pop()
            for place in reversed(range(len(parent))):
                child = parent[place]
                if child.tag == "include":
                    # What is put in may include, too, and stands below the same parent.
                    parent[place : place + 1] = list(self._included(child))
                    waiting.append(parent)
                    break
            else:
                waiting += list(parent)

    def _included(self, element: ET.Element) -> ET.Element:
        name = element.get("file", "")
        try:
            file = (self._folder / name).resolve()
        except (OSError, ValueError):
            raise ModelError(f"{self._path}: <include file> is {shown(name)}, which is no file's name") from None
        if Path(name).is_absolute() or not file.is_relative_to(self._folder):
            raise ModelError(
                f"{self._path}: includes {shown(name)}, which lies outside of its folder; put that file beside it"
            )
        if file in self._seen:
            raise ModelError(f"{self._path}: includes {shown(name)} twice; MuJoCo takes a file once")
        self._seen.add(file)
        found = parsed(file, most_bytes=max(0, self._left))
        self._left -= file.stat().st_size
        return found


def _require_whole(path: Path, root: ET.Element) -> None:
    if root.find(".//attach") is not None or root.find(".//asset/model") is not None:
        raise ModelError(
            f"{path}: attaches other models, which aren't read; save it as one file: "
            "mujoco.MjSpec.from_file(...).to_xml()"
        )
    waiting = [(root, 1)]
    while waiting:
        element, copies = waiting.pop()
        if element.tag == "replicate":
            count = element.get("count", "1")
            copies *= int(count) if count.isascii() and count.isdecimal() and len(count) < len(str(MOST_BYTES)) else 0
            if not 0 < copies <= _MOST_REPLICAS:
                raise ModelError(
                    f"{path}: <replicate count> is {shown(count)}; at most {_MOST_REPLICAS} copies are made"
                )
        waiting += [(child, copies) for child in element]


class _Assets:
    """Meshes and height fields of an MJCF file, and the geoms made of them."""

    def __init__(self, path: Path, root: ET.Element, *, meshes: bool) -> None:
        self._root, self._meshes = root, meshes
        folder, strip = path.parent.resolve(), False
        for compiler in root.findall("compiler"):
            folder = path.parent.resolve() / compiler.get("meshdir", compiler.get("assetdir", folder))
            strip = compiler.get("strippath", str(strip)).lower() == "true"
        self._folder, self._strip = folder, strip
        self.bereft: list[ET.Element] = []
        """Bodies that lost a geom."""

    def settle(self) -> tuple[int, int]:
        """Keep meshes whose files are there, by their whole paths, and drop all else; count both."""
        used, gone = 0, set[str]()
        for asset in self._root.findall("asset"):
            for mesh in asset.findall("mesh"):
                name = mesh.get("file")
                if name is None:
                    continue
                file = self._folder / (Path(name).name if self._strip else name)
                mesh.set("name", mesh.get("name", Path(name).stem))
                if self._meshes and is_mesh(file):
                    mesh.set("file", str(file))
                    used += 1
                else:
                    gone.add(mesh.get("name", ""))
                    asset.remove(mesh)
        fields = {one.get("name", Path(one.get("file", "")).stem) for one in self._root.iter("hfield")}
        without(self._root, ("hfield",))
        for parent in list(self._root.iter()):
            for geom in parent.findall("geom"):
                if geom.get("mesh") in gone or geom.get("hfield") in fields:
                    _drop(parent, geom)
                    self.bereft += [] if parent in self.bereft else [parent]
        return used, len(gone)


def _drop(parent: ET.Element, geom: ET.Element) -> None:
    """Take a geom out; one that others may refer to stays as a point that touches nothing."""
    if parent.tag == "default" or not geom.get("name"):
        parent.remove(geom)
        return
    name = geom.get("name", "")
    geom.attrib.clear()
    geom.attrib |= {
        "name": name, "type": "sphere", "size": "0.001", "mass": "0", "contype": "0", "conaffinity": "0", "group": "5"
    }  # fmt: skip


def _without_inertia_of_meshes(root: ET.Element, bereft: Sequence[ET.Element]) -> list[str]:
    """Tell which bodies had their mass from meshes alone; and let stated inertias count."""
    for compiler in root.findall("compiler"):
        compiler.attrib.pop("inertiafromgeom", None)
    bodies = [one for one in bereft if one.tag == "body" and one.find("inertial") is None]
    return [one.get("name", "a body without a name") for one in bodies]


def _with_base(path: Path, root: ET.Element, base: BaseKind) -> list[str]:
    """Fix the robot's base to the world, or let it float."""
    bodies = [one for world in root.findall("worldbody") for one in _outermost(world) if _has_joints(one)]
    free = [one for one in bodies if _free_joints(one)]
    if base == "floating" and not free:
        if len(bodies) != 1:
            raise ModelError(
                f"{path}: base can't float: {counted(len(bodies), 'body')} of the world hold joints; join them in one"
            )
        bodies[0].insert(0, bodies[0].makeelement("freejoint", {}))
    elif base == "fixed" and free:
        for body in free:
            for joint in _free_joints(body):
                body.remove(joint)
    else:
        return []
    # Its poses have another number of coordinates.
    without(root, ("keyframe",))
    return [f"the base is taken as {base}, as the robot file says"]


def _outermost(element: ET.Element) -> list[ET.Element]:
    """Bodies that are in no other body; frames and replicas may be between."""
    found = []
    for child in element:
        found += [child] if child.tag == "body" else _outermost(child)
    return found


def _free_joints(body: ET.Element) -> list[ET.Element]:
    return [one for one in body if one.tag == "freejoint" or (one.tag == "joint" and one.get("type") == "free")]


def _has_joints(body: ET.Element) -> bool:
    return any(one not in _free_joints(body) for one in body.iter("joint"))
