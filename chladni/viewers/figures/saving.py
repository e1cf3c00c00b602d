"""Figures, written to a folder."""

import os
import re
from collections.abc import Sequence
from pathlib import Path

from chladni.io.atomic import atomic_write
from chladni.io.folder import made_folder
from chladni.signals.errors import SetupError
from chladni.signals.study import Study
from chladni.viewers.figures.album import Album

FORMATS = ("png", "svg", "pdf")


def save_figures(
    study: Study, folder: str | os.PathLike[str], *, formats: Sequence[str] = ("png", "svg")
) -> list[Path]:
    """Write every figure of a study to a folder, which is made when it isn't there.

    Parameters
    ----------
    study
        What to draw.
    folder
        Where to; files of the same names are replaced, each whole or not at all.
    formats
        Any of ``png`` (300 dots an inch), ``svg``, ``pdf``.

    Returns
    -------
    list of Path
        The files, in the order of the figures.

    Raises
    ------
    SetupError
        When a format is none of those.
    LogError
        When the folder can't be made or a file can't be written.
    """
    # Before drawing: a minute of work shouldn't end in a misspelt format.
    target = _prepared(folder, formats)
    return save_album(Album.of(study), target, formats=formats)


def save_album(
    album: Album, folder: str | os.PathLike[str], *, formats: Sequence[str] = ("png", "svg")
) -> list[Path]:
    """Write the figures of an album as `save_figures` does those of a study; what is rendered already is reused."""
    target = _prepared(folder, formats)
    written = []
    for name in album.figures:
        for kind in formats:
            path = target / f"{file_name(name)}.{kind}"
            with atomic_write(path) as file:
                file.write(album.rendered(name, kind))
            written.append(path)
    return written


def _prepared(folder: str | os.PathLike[str], formats: Sequence[str]) -> Path:
    for kind in formats:
        if kind not in FORMATS:
            raise SetupError(f"figure format {kind!r} is none of {', '.join(FORMATS)}")
    return made_folder(Path(folder))


def file_name(name: str) -> str:
    """Make a file name of a figure's name.

    Examples
    --------
    >>> file_name("psd 1 Acceleration 2/3")
    'psd-1-acceleration-2-3'
    """
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
