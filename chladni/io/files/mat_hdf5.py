"""MATLAB ``.mat`` files of version 7.3, which are HDF5: read by h5py, which comes with the extra ``[io]``.

Only what lies in the file itself is followed: no link or data in another file. Every length is checked before memory
is taken for it.
"""

from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any, Final

import numpy as np

from chladni.io.files.bounds import Budget
from chladni.io.files.contents import one_line
from chladni.io.files.mat_elements import MAX_OBJECTS, Unreadable
from chladni.signals.errors import LogError

_MAX_DEPTH: Final = 8
# deflate packs no better than 1032:1; what claims to was never written.
_BEST_PACKING: Final = 1032
_SMALL_BYTES: Final = 65_536
_OPAQUE: Final = ("string", "datetime", "duration", "table", "timetable", "categorical")
# What h5py raises where the bytes are wrong.
_DAMAGED: Final = (OSError, KeyError, ValueError, RuntimeError, TypeError, AttributeError)


def read_mat_hdf5(path: Path, budget: Budget) -> dict[str, Any]:
    """Give the variables of a file, in the form of `chladni.io.files.mat_elements.read_mat_elements`.

    Raises
    ------
    LogError
        When h5py isn't installed, the file is damaged, or its variables take more memory than the budget has.
    """
    try:
        import h5py
    except ImportError as error:
        raise LogError(
            f"version 7.3 (HDF5) is read by h5py, which this installation lacks; pip install 'chladni[io]', or save "
            f"the file in MATLAB with save('{path.name}', '-v7')"
        ) from error
    try:
        with h5py.File(path, "r") as file:
            variables: dict[str, Any] = _Reader(h5py, file, budget).group(file, 0)
            return variables
    except _DAMAGED as error:
        raise LogError(f"its HDF5 structure is damaged ({one_line(error)})") from error


class _Reader:
    """Walks over the groups and datasets of one file."""

    def __init__(self, h5py: Any, file: Any, budget: Budget) -> None:
        self._h5py = h5py
        self._file = file
        self._memory = budget
        self._objects = 0
        self._groups = {self._address(file)}

    def group(self, group: Any, depth: int) -> Any:
        """Give the members of a group: the variables, the fields of a struct, or a list for an array of structs."""
        content: dict[str, Any] = {}
        for name in group:
            # Names with # hold what cells and objects refer to.
            if name.startswith("#"):
                continue
            if not isinstance(group.get(name, getlink=True), self._h5py.HardLink):
                content[name] = Unreadable(reason="a link to elsewhere, which isn't followed")
                continue
            try:
                content[name] = self._member(group[name], depth)
            except _DAMAGED as error:
                content[name] = Unreadable(reason=f"damaged ({one_line(error)})")
        lengths = {len(part.parts) if isinstance(part, _OfEach) else -1 for part in content.values()}
        if len(lengths) == 1 and -1 not in lengths:
            rows = zip(*(part.parts for part in content.values()), strict=True)
            return [dict(zip(content, row, strict=True)) for row in rows]
        return {name: part.parts if isinstance(part, _OfEach) else part for name, part in content.items()}

    def _member(self, member: Any, depth: int) -> Any:
        self._objects += 1
        if depth >= _MAX_DEPTH or self._objects > MAX_OBJECTS:
            return Unreadable(reason="structs and cells too deep, or too many of them")
        kind = _text(member.attrs.get("MATLAB_class", b""))
        if "MATLAB_object_decode" in member.attrs or kind in _OPAQUE:
            return Unreadable(reason=f"a {kind or 'class'} of MATLAB, which only MATLAB reads")
        if isinstance(member, self._h5py.Group):
            address = self._address(member)
            if address in self._groups:
                return Unreadable(reason="a struct that stands elsewhere as well, or in itself")
            self._groups.add(address)
            return self.group(member, depth + 1)
        if "MATLAB_empty" in member.attrs:
            return "" if kind == "char" else np.empty((0, 0))
        self._require_bounded(member)
        if member.dtype == self._h5py.ref_dtype:
            if member.size > MAX_OBJECTS - self._objects:
                return Unreadable(reason="a cell of too many members")
            parts = [self._member(self._file[place], depth + 1) for place in member[()].ravel()]
            return parts if kind == "cell" else _OfEach(parts=parts)
        return _array(member, kind)

    def _address(self, member: Any) -> int:
        return int(self._h5py.h5o.get_info(member.id).addr)

    def _require_bounded(self, member: Any) -> None:
        if member.is_virtual or member.external:
            raise ValueError("its numbers lie in another file, which isn't followed")
        held = int(member.id.get_storage_size())
        packing = _BEST_PACKING if member.chunks else 1
        if member.nbytes > packing * held + _SMALL_BYTES:
            raise ValueError(f"it announces {member.nbytes} bytes and holds {held}")
        # A chunk is unpacked whole, however little of it the numbers take.
        chunk = prod(member.chunks or ()) * member.dtype.itemsize
        self._memory.take(max(int(member.nbytes), chunk))


@dataclass(frozen=True, slots=True, kw_only=True)
class _OfEach:
    """One field of each struct in an array of them."""

    parts: list[Any]


def _array(member: Any, kind: str) -> Any:
    if kind == "char" and member.dtype.kind in "iu":
        return member[()].astype("<u2").tobytes().decode("utf-16-le", errors="replace")
    if member.dtype.names == ("real", "imag"):
        return Unreadable(reason="complex numbers, which are no samples")
    if member.dtype.kind not in "fiub":
        return Unreadable(reason=f"of the type {member.dtype}")
    # MATLAB counts axes the other way round.
    return np.asarray(member[()]).T.squeeze()


def _text(attribute: Any) -> str:
    return attribute.decode("latin-1") if isinstance(attribute, bytes) else str(attribute)
