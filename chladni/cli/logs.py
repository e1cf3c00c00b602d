"""Several logs of one command: each opened in turn, and named so that they're told apart."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from chladni.signals.errors import SetupError

if TYPE_CHECKING:
    from chladni.cli.opening import Opener
    from chladni.cli.output import Output, Progress
    from chladni.io.log import Log


def told_apart(paths: Sequence[Path], opener: "Opener", out: "Output") -> "Iterator[tuple[str, Log, Progress]]":
    """Open logs one after another; of several, each is announced by its name.

    Yields
    ------
    title, log, progress
        The log's short name, the open log, and what shows how far its reading is.

    Raises
    ------
    SetupError
        When a log is given twice.
    """
    titles = log_names(paths)
    opening = opener if len(paths) == 1 else opener.among(paths)
    for title, path in zip(titles, paths, strict=True):
        if len(paths) > 1:
            out.line(title, style="bold underline")
        with opening(path) as opened, out.progress(title) as progress:
            yield title, opened, progress


def log_names(paths: Sequence[Path]) -> tuple[str, ...]:
    """Give each file's name, with as many folders before it as tell it apart.

    Examples
    --------
    >>> log_names([Path("a/run.mcap"), Path("b/run.mcap")]), log_names([Path("a/run.mcap"), Path("b/walk.mcap")])
    (('a/run.mcap', 'b/run.mcap'), ('run.mcap', 'walk.mcap'))
    """
    whole = [path.resolve().parts for path in paths]
    if len(set(whole)) < len(whole):
        twice = next(path for path, parts in zip(paths, whole, strict=True) if whole.count(parts) > 1)
        raise SetupError(f"{twice}: is given twice; give each log once")
    for length in range(1, max(map(len, whole)) + 1):
        names = ["/".join(parts[-length:]) for parts in whole]
        if len(set(names)) == len(names):
            break
    return tuple(names)
