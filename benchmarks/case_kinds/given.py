"""Files that were given: found in ``CHLADNI_DATA`` or ``../shared/data``."""

import os
from collections.abc import Callable
from pathlib import Path

from case_kinds.product import copied


def data_folder() -> Path:
    """Folder of measured logs and cases."""
    beside = Path(__file__).resolve().parents[2] / ".." / "shared" / "data"
    return Path(os.environ.get("CHLADNI_DATA", beside)) / "cases"


def given(kind: str, name: str) -> Callable[[Path], Path | None]:
    """Give a writer that copies one given file, so that what is written beside it goes away with it."""

    def write(folder: Path) -> Path | None:
        source = data_folder() / kind / name
        return copied(source, folder) if source.exists() else None

    return write
