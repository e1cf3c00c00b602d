"""A button that makes a file off the page's thread and hands it to the browser."""

from base64 import b64encode
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from chladni.viewers.bench.latest import Latest
from chladni.viewers.bench.parts import button, pn, row

if TYPE_CHECKING:
    from concurrent.futures import Future


class Download:
    """A button; pressed, it builds the bytes and the browser saves them.

    Parameters
    ----------
    build
        Gives the bytes; runs on a thread of its own.
    failed
        Called with the error when that fails.
    """

    def __init__(
        self,
        *,
        label: str,
        file_name: str,
        media_type: str,
        latest: Latest,
        build: Callable[[], Callable[[], bytes]],
        failed: Callable[[BaseException], None],
    ) -> None:
        self._media_type = media_type
        self._latest, self._build, self._failed = latest, build, failed
        self.button = button(label, self._pressed)
        self._made = 0
        # An invisible part of the page that holds the file on its way to the browser. Its script is Panel's own: one
        # of ours would be made of text, which the server's policy for content forbids.
        self._carrier = pn.widgets.FileDownload(filename=file_name, visible=False)
        self.view = row(self.button, self._carrier)

    def _pressed(self, _event: Any) -> None:
        # Pressed twice, it would only wait twice.
        self.button.disabled = True
        self._latest.submit(self._build(), self._built)

    def _built(self, future: "Future[bytes]") -> None:
        self.button.disabled = False
        error = future.exception()
        if error is not None:
            self._failed(error)
            return
        content = b64encode(future.result()).decode("ascii")
        # The count makes the same file, saved twice, two changes.
        self._made += 1
        self._carrier.param.update(data=f"data:{self._media_type};base64,{content}", _transfers=self._made)
