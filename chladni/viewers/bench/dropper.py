"""Where a log is dropped: bounded, and put into a private file."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from chladni.signals.errors import LogError
from chladni.viewers.bench.errors import told
from chladni.viewers.bench.parts import pn
from chladni.viewers.bench.theme import WIDGET_CSS

#: A dropped log travels through the browser and memory; a longer one is read from the disk with --log.
MOST_BYTES = 64_000_000
#: It comes in pieces.
CHUNK_BYTES = 1_000_000

_DROPPER_CSS = """
.filepond--root { font-family: inherit; font-size: 12.5px; margin: 0; }
.filepond--panel-root, .filepond--root .filepond--panel {
  background: var(--c-card); border: 1px dashed var(--c-line) !important; border-radius: 6px;
}
.filepond--drop-label { color: var(--c-soft); }
.filepond--credits { display: none; }
"""


class Dropper(pn.widgets.FileDropper):  # type: ignore[misc]  # panel has no types
    """A place for one file, by drag and drop or by choosing it.

    Parameters
    ----------
    taken
        Called with the file's name and the private copy, which the caller removes.
    refused
        Called with one line when the file can't be taken.
    """

    def __init__(self, *, taken: Callable[[str, Path], None], refused: Callable[[str], None]) -> None:
        super().__init__(
            max_file_size=f"{MOST_BYTES // 1_000_000}MB",
            chunk_size=CHUNK_BYTES,
            multiple=False,
            previews=[],
            height=76,
            margin=0,
            sizing_mode="stretch_width",
            stylesheets=[WIDGET_CSS, _DROPPER_CSS],
        )
        self._taken, self._refused = taken, refused
        self._copy: IO[bytes] | None = None
        self._pieces = self._bytes = 0

    def _process_event(self, event: Any) -> None:
        # In place of the base's, which gathers whatever a browser sends, in memory and without end.
        if event.event_name != "upload_event":
            return
        piece = event.data
        try:
            if piece["chunk"] == 1:
                self.close()
                # The name comes from a browser: nothing of it but a plain suffix goes to the disk.
                self._copy = private_file(Path(str(piece["name"])).suffix)
            self._take(piece)
        except LogError as error:
            self.close()
            self._refused(told(error))

    def close(self) -> None:
        """Remove what has come of a file so far."""
        copy, self._copy = self._copy, None
        self._pieces = self._bytes = 0
        if copy is not None:
            copy.close()
            Path(copy.name).unlink(missing_ok=True)

    def _take(self, piece: Mapping[str, Any]) -> None:
        # After a refusal the rest is still on its way.
        if self._copy is None:
            return
        content = bytes(piece["data"])
        self._pieces, self._bytes = self._pieces + 1, self._bytes + len(content)
        if piece["chunk"] != self._pieces:
            raise LogError(f"{piece['name']}: its pieces came in another order; drop it again")
        if self._bytes > MOST_BYTES:
            raise LogError(
                f"{piece['name']}: larger than {MOST_BYTES // 1_000_000} MB, all that can be dropped here; "
                "name it when starting: chladni bench --log FILE"
            )
        with _telling():
            self._copy.write(content)
            if piece["chunk"] < piece["total_chunks"]:
                return
            self._copy.close()
        whole, self._copy = Path(self._copy.name), None
        self._taken(str(piece["name"]), whole)


def private_file(suffix: str) -> IO[bytes]:
    """Open a new file of this suffix that only this user can read; the caller removes it.

    Raises
    ------
    LogError
        When it can't be made.
    """
    plain = suffix if suffix[1:].isalnum() and suffix.isascii() else ""
    with _telling():
        return tempfile.NamedTemporaryFile(prefix="chladni-", suffix=plain, delete=False)


@contextmanager
def _telling() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise LogError(
            f"the dropped log can't be kept: {error.strerror or error}; free space or use --log"
        ) from error
