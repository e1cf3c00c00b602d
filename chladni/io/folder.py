"""Folders that commands make for what they write."""

from pathlib import Path

from chladni.signals.errors import LogError


def made_folder(path: Path) -> Path:
    """Make a folder, with those above it, unless it's there; give its path.

    Raises
    ------
    LogError
        When a file is in the way, or the operating system refuses.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as above:
    ...     made_folder(Path(above) / "campaign" / "truth").is_dir()
    True
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise LogError(f"{path}: can't be made a folder ({error.strerror or error}); name another") from error
    return path
