"""Descriptions of robots as XML that nobody vouches for, and the mesh files that they name."""

from __future__ import annotations

import re
import stat
import xml.etree.ElementTree as ET
from contextlib import suppress
from dataclasses import dataclass
from math import isnan
from typing import TYPE_CHECKING, Final, Literal
from xml.parsers import expat

from chladni.io.regular_file import open_regular, read_text
from chladni.signals.errors import ModelError
from chladni.signals.wording import shown

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

MOST_BYTES: Final = 1 << 24
"""Largest description, its includes among it; the largest of MuJoCo's menagerie has a tenth of a megabyte."""

_MOST_MESH_BYTES: Final = 1 << 27
_DEEPEST: Final = 200
_HEAD_BYTES: Final = 1 << 16
_ROOT: Final = re.compile(r"<(?![?!])\s*([\w:.-]+)")
# What MuJoCo reads.
_MESHES: Final = (".stl", ".obj", ".msh")

DescriptionKind = Literal["mjcf", "urdf"]
_KINDS: Final[Mapping[str, DescriptionKind]] = {"mujoco": "mjcf", "robot": "urdf"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """A description made ready for MuJoCo.

    Attributes
    ----------
    xml
        Text that refers to no other file but meshes that are there.
    meshes
        How many of these.
    velocity_limits
        Of joints by name, rad/s or m/s, which MuJoCo doesn't keep.
    remarks
        What was left out, in sentences.
    shapeless
        A sentence on the meshes that were left out; empty where none was.
    weightless
        Bodies whose mass came from these alone.
    """

    xml: str
    meshes: int
    velocity_limits: Mapping[str, float]
    remarks: tuple[str, ...]
    shapeless: str
    weightless: tuple[str, ...] = ()


def missing_meshes(count: int) -> str:
    """Say that meshes were left out; nothing where none was."""
    what = "1 mesh is" if count == 1 else f"{count} meshes are"
    told = f"{what} missing, or not such as MuJoCo reads (STL, OBJ, MSH): left out of visuals and collisions"
    return told if count else ""


def parsed(path: Path, *, most_bytes: int = MOST_BYTES, comments: bool = False) -> ET.Element:
    """Read XML that declares no document type, so that nothing in it expands; with comments and layout where asked.

    Raises
    ------
    ModelError
        With the line of what is wrong: no XML, a document type, deeper than 200 elements.
    """
    return parsed_text(read_text(path, most_bytes, ModelError), path, comments=comments)


def parsed_text(text: str, path: Path, *, comments: bool = False) -> ET.Element:
    """Parse the XML of a file; arguments and errors as of `parsed`."""
    # The text is decoded already, whatever encoding it declares.
    builder, parser = ET.TreeBuilder(insert_comments=comments), expat.ParserCreate("UTF-8")
    depth = 0

    def started(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > _DEEPEST:
            raise ModelError(f"{path}:{parser.CurrentLineNumber}: elements are nested deeper than {_DEEPEST}")
        builder.start(tag, attributes)

    def ended(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def declared(*_: object) -> None:
        raise ModelError(
            f"{path}:{parser.CurrentLineNumber}: declares a document type, whose entities may expand without end; "
            "take <!DOCTYPE ...> out"
        )

    parser.StartElementHandler = started
    parser.EndElementHandler = ended
    parser.StartDoctypeDeclHandler = declared
    if comments:
        parser.CommentHandler, parser.CharacterDataHandler = builder.comment, builder.data
    try:
        parser.Parse(text.encode(), True)
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code)
        raise ModelError(f"{path}:{error.lineno}: not XML: {what}") from None
    return builder.close()


def description_kind(path: Path) -> DescriptionKind | None:
    """Tell MJCF and URDF by their root element; None of any other file."""
    with open_regular(path, ModelError) as file:
        head = file.read(_HEAD_BYTES).decode("utf-8-sig", errors="replace")
    bare = re.sub(r"<!--.*?(-->|$)", "", head, flags=re.DOTALL)
    found = _ROOT.search(bare) if bare.lstrip().startswith("<") else None
    return None if found is None else _KINDS.get(found[1])


def is_mesh(path: Path) -> bool:
    """Whether a mesh file is there, of a kind that MuJoCo reads, and of a sane size."""
    if path.suffix.lower() not in _MESHES:
        return False
    try:
        found = path.stat()
    except (OSError, ValueError):
        return False
    return stat.S_ISREG(found.st_mode) and 0 < found.st_size <= _MOST_MESH_BYTES


def real(path: Path, element: ET.Element, attribute: str) -> float | None:
    """Read a number of an element; None where it has none.

    Raises
    ------
    ModelError
        When it's no number.
    """
    text = element.get(attribute)
    if text is None:
        return None
    with suppress(ValueError):
        found = float(text)
        if not isnan(found):
            return found
    raise ModelError(f"{path}: <{element.tag} {attribute}> is {shown(text)}; must be a number")


def without(root: ET.Element, tags: tuple[str, ...]) -> int:
    """Take elements out wherever they are, and count them."""
    taken = 0
    for parent in list(root.iter()):
        for child in [one for one in parent if one.tag in tags]:
            parent.remove(child)
            taken += 1
    return taken


def text_of(root: ET.Element) -> str:
    """Write XML for MuJoCo."""
    return ET.tostring(root, encoding="unicode")
