"""A study served to a browser on this computer."""

from functools import partial
from subprocess import Popen
from types import TracebackType
from typing import Self

from chladni.signals.study import Study
from chladni.viewers.rerun.drawing import draw
from chladni.viewers.rerun.process import Drawing, free_port, page_address, send, start, stop


class WebViewer:
    """A running web viewer; close it, or use it as a context manager, to end it.

    Attributes
    ----------
    address
        What to open in a browser on this computer; nobody else can reach it.
    """

    def __init__(self, address: str, process: Popen[bytes]) -> None:
        self.address = address
        self._process = process

    def wait(self) -> None:
        """Wait until the server ends by itself."""
        self._process.wait()

    def close(self) -> None:
        """End the server; closing twice is fine."""
        stop(self._process)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def serve_web(study: Study, *, port: int = 0) -> WebViewer:
    """Serve a study to a browser on this computer; what it gives and raises is as of `serve_drawing`.

    Parameters
    ----------
    study
        What to draw.
    """
    return serve_drawing(partial(draw, study=study), port=port)


def serve_drawing(drawing: Drawing, *, port: int = 0) -> WebViewer:
    """Serve what is drawn into a recording to a browser on this computer, bound to loopback only.

    Parameters
    ----------
    drawing
        Writes all of it.
    port
        Port of the page; 0 takes a free one.

    Returns
    -------
    WebViewer
        With the address to open. The server runs until it's closed.

    Raises
    ------
    SetupError
        When the server doesn't start, as when `port` is taken.
    """
    # The page and the data have a port each, and the page must know that of the data.
    data_port = free_port()
    page_port = port or free_port()
    options = ["--serve-web", "--port", str(data_port), "--web-viewer-port", str(page_port)]
    process = start(options, ports=[data_port, page_port], detached=False)
    try:
        send(drawing, data_port)
    except BaseException:
        stop(process)
        raise
    return WebViewer(page_address(page_port, data_port), process)
