"""Where a command may write: asked before anything is computed, for all commands alike."""

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from itertools import combinations
from pathlib import Path

from chladni.io.atomic import Place, require_place
from chladni.signals.errors import LogError, SetupError

# Viewers, browsers and drawing go by the suffix; text for programs may have any name, a pipe's too.
SUFFIXES: Mapping[str, tuple[str, ...]] = {
    "--figure": (".png", ".svg", ".pdf"),
    "--html": (".html", ".htm"),
    "--report": (".html", ".htm"),
    "--save": (".rrd",),
    "--write-model": (".toml", ".xml", ".urdf"),
}


def require_places(
    *,
    reads: Iterable[Path | None],
    writes: Mapping[str, Path | str | None],
    folders: Mapping[str, Path | None] | None = None,
) -> None:
    """Refuse places at which a command can't write, or would destroy what it reads or wrote.

    Parameters
    ----------
    reads
        Files that the command reads; None for those that weren't given.
    writes
        File by the option that asks for it, such as ``--html``; None where it wasn't given, ``-`` is standard output.
    folders
        Folder by the option that asks for it; one that isn't there is made later.

    Raises
    ------
    SetupError
        When a name ends with another suffix than the option's, or is that of a file that is read or written already.
    LogError
        When a file's folder isn't there or can't be written to, or a file is a folder, or the reverse.

    Examples
    --------
    >>> require_places(reads=[Path("arm.mcap")], writes={"--html": Path("arm.mcap")})
    Traceback (most recent call last):
    chladni.signals.errors.SetupError: arm.mcap: --html writes .html or .htm; give such a name
    """
    files = {option: Path(path) for option, path in writes.items() if path is not None and str(path) != "-"}
    for option, path in files.items():
        _require_suffix(option, path)
    places = {option: require_place(path) for option, path in files.items()}
    for option, folder in (folders or {}).items():
        if folder is not None:
            _require_folder(option, folder)
    _require_apart(places, [place for path in reads if path is not None for place in _read_place(path)])


def require_drawn(given: Mapping[str, bool], pictures: Iterable[Path | None]) -> None:
    """Raise `SetupError` when options say how pictures look, and none was asked for."""
    if not any(pictures):
        for option in (name for name, is_given in given.items() if is_given):
            raise SetupError(
                f"{option} says how pictures look; ask for some (--figures FOLDER or --report FILE.html)"
            )


def _require_suffix(option: str, path: Path) -> None:
    known = SUFFIXES.get(option, ())
    if known and path.suffix.lower() not in known:
        raise SetupError(f"{path}: {option} writes {_listed(known)}; give such a name")


def _require_folder(option: str, folder: Path) -> None:
    there = next(one for one in (folder, *folder.parents) if os.path.lexists(one))
    # Also tells that the current folder was removed.
    if not Place.of(there).is_folder:
        raise LogError(f"{folder}: {there} is no folder; {option} takes a folder, name another")


def _read_place(path: Path) -> Iterator[Place]:
    # What can't be read is told by its reader.
    with suppress(LogError):
        yield Place.of(path)


def _require_apart(places: Mapping[str, Place], reads: Iterable[Place]) -> None:
    read = list(reads)
    for option, place in places.items():
        if any(place.is_same(one) for one in read):
            raise SetupError(
                f"{place.path}: is read by this command, and {option} would replace it; name another file"
            )
    for (one, place), (other, second) in combinations(places.items(), 2):
        if place.is_same(second):
            raise SetupError(f"{place.path}: {one} and {other} name the same file; give each its own")


def _listed(suffixes: tuple[str, ...]) -> str:
    *first, last = suffixes
    return f"{', '.join(first)} or {last}" if first else last
