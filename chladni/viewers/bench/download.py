"""A button that makes a file off the page's thread and hands it to the browser."""

from base64 import b64encode
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from bokeh.models import CustomJS
from bokeh.models.widgets import Div

from chladni.viewers.bench.latest import Latest
from chladni.viewers.bench.parts import button, drawing, row

if TYPE_CHECKING:
    from concurrent.futures import Future

_SAVE_JS = """
const [_, text, name, type] = carrier.tags;
if (!text) { return; }
const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const address = URL.createObjectURL(new Blob([bytes], {type}));
const link = document.createElement("a");
link.href = address;
link.download = name;
document.body.appendChild(link);
link.click();
link.remove();
setTimeout(() => URL.revokeObjectURL(address), 10000);
"""


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
        self._file_name, self._media_type = file_name, media_type
        self._latest, self._build, self._failed = latest, build, failed
        self.button = button(label, self._pressed)
        self._made = 0
        # An invisible part of the page that holds the file on its way to the browser.
        self._carrier = Div(visible=False, tags=[0, "", "", ""])
        self._carrier.js_on_change("tags", CustomJS(args={"carrier": self._carrier}, code=_SAVE_JS))
        self.view = row(self.button, drawing(self._carrier))

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
        # The count makes the same file, saved twice, two changes.
        self._made += 1
        content = b64encode(future.result()).decode("ascii")
        self._carrier.tags = [self._made, content, self._file_name, self._media_type]
