"""Where compiled kernels are kept between processes."""

import os
import stat
import sys
import tempfile
from pathlib import Path


def choose_cache() -> bool:
    """Decide where compiled kernels are kept; False when there is no safe place and each process compiles them.

    numba looks beside the source and in the home folder, and raises when it can write to neither. Then a private
    folder is named in ``NUMBA_CACHE_DIR``, which numba reads when it's imported.
    """
    if os.environ.get("NUMBA_CACHE_DIR"):
        return _can_write(Path(os.environ["NUMBA_CACHE_DIR"]))
    home = os.environ.get("XDG_CACHE_HOME") or str(Path(os.environ.get("HOME") or "/nonexistent") / ".cache")
    if _can_write(Path(__file__).parent / "__pycache__") or _can_write(Path(home) / "numba"):
        return True
    folder = _private_folder()
    if folder is None:
        return False
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:
        sys.modules["numba"].config.reload_config()
    return True


def _can_write(folder: Path) -> bool:
    """Whether a file can be made in `folder`, or the folder in the nearest parent that exists."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def _private_folder() -> Path | None:
    """Make or reuse a folder under the temporary one that only this user can enter; None when that can't be had."""
    if not hasattr(os, "getuid"):
        return None
    try:
        folder = Path(tempfile.gettempdir()) / f"chladni-numba-{os.getuid()}"
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError:
        return None
    # The cache holds machine code that will be run: a folder or a link that somebody else put there is not used.
    private = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o077
    return folder if private else None


CACHED = choose_cache()
