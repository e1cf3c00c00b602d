"""Where a log is dropped: bounded, and put into a private file."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from chladni.signals.errors import LogError
from chladni.viewers.bench.parts import pn
from chladni.viewers.bench.theme import WIDGET_CSS

#: A dropped log travels through the browser and memory; a longer one is read from the disk with --log.
MOST_BYTES = 64_000_000
_CHUNK_BYTES = 2_000_000

_DROPPER_CSS = """
.filepond--root { font-family: inherit; font-size: 12.5px; margin: 0; }
.filepond--panel-root, .filepond--root .filepond--panel {
  background: var(--c-card); border: 1px dashed var(--c-line) !important; border-radius: 6px;
}
.filepond--drop-label { color: var(--c-soft); }
.filepond--credits { display: none; }
"""


class Dropper(pn.widgets.FileDropper):  # type: ignore[misc]  # panel has no types
    """A place for one file, by drag and drop or by choosing it."""

    def __init__(self, *, taken: Callable[[str, bytes], None], refused: Callable[[str], None]) -> None:
        super().__init__(
            max_file_size=f"{MOST_BYTES // 1_000_000}MB",
            chunk_size=_CHUNK_BYTES,
            multiple=False,
            previews=[],
            height=76,
            margin=0,
            sizing_mode="stretch_width",
            stylesheets=[WIDGET_CSS, _DROPPER_CSS],
        )
        self._taken, self._refused = taken, refused
        self._received: list[bytes] = []
        self._bytes = 0

    def _process_event(self, event: Any) -> None:
        # In place of the base's, which gathers whatever a browser sends, in memory and without end.
        if event.event_name != "upload_event":
            return
        piece = event.data
        if piece["chunk"] == 1:
            self._received, self._bytes = [], 0
        content = bytes(piece["data"])
        self._bytes += len(content)
        if self._bytes > MOST_BYTES:
            self._received = []
            # Said once, at the piece that crosses the bound.
            if self._bytes - len(content) <= MOST_BYTES:
                self._refused(
                    f"{piece['name']}: larger than {MOST_BYTES // 1_000_000} MB, all that can be dropped here; "
                    "name it when starting: chladni bench --log FILE"
                )
            return
        self._received.append(content)
        if piece["chunk"] == piece["total_chunks"]:
            whole, self._received = b"".join(self._received), []
            self._taken(str(piece["name"]), whole)


def private_file(content: bytes, suffix: str) -> Path:
    """Write dropped bytes to a file of this suffix that only this user can read; the caller removes it.

    Raises
    ------
    LogError
        When it can't be written.
    """
    try:
        descriptor, name = tempfile.mkstemp(prefix="chladni-", suffix=suffix)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
    except OSError as error:
        raise LogError(
            f"the dropped log can't be kept: {error.strerror or error}; free space or use --log"
        ) from error
    return Path(name)
