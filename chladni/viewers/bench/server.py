"""Serves the pages on this computer only, to requests that name this computer."""

import asyncio
import gc
import re
import socket
from collections.abc import Callable, Mapping
from typing import Any

from bokeh.server.server import BaseServer
from bokeh.server.tornado import BokehTornado
from panel.io.application import build_applications
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.web import RequestHandler
from tornado.websocket import WebSocketClosedError

from chladni.signals.errors import SetupError

ADDRESS = "127.0.0.1"
OWN_NAMES = (ADDRESS, "localhost")
#: A page that nobody looks at any more is given up after this.
UNUSED_MS = 15_000
_MOST_MESSAGE_BYTES = 16_000_000


class ForeignHost(RequestHandler):
    """Refuses a request that names another computer.

    A page of the web may point its own name at 127.0.0.1 (DNS rebinding). Browsers then see one origin, so that
    checking where a request comes from isn't enough; but they still name that foreign host.
    """

    def prepare(self) -> None:
        """Answer 403 before anything else happens."""
        self.set_status(403)
        self.finish("chladni answers only to this computer's own name\n")


class Index(RequestHandler):
    """The first page."""

    def initialize(self, content: str) -> None:
        """Keep what to send."""
        self.content = content

    def get(self) -> None:
        """Send it."""
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.finish(self.content)


class BenchServer:
    """A server of pages, on the loopback address.

    Parameters
    ----------
    pages
        Function that makes the page, by name; a page is reached under ``/name``.
    index
        HTML of the first page.
    port
        0 takes a free one.

    Raises
    ------
    SetupError
        When the port can't be had.
    """

    def __init__(self, pages: Mapping[str, Callable[[], Any]], *, index: str, port: int = 0) -> None:
        self._pages, self._index = pages, index
        if not 0 <= port <= 65535:
            raise SetupError(f"port {port} of {ADDRESS} can't be had (the highest is 65535); give 0 for any")
        try:
            # Bound at once, so that a taken port is told before anything starts; browsers wait until `run`.
            self._socket = socket.create_server((ADDRESS, port))
        except OSError as error:
            raise SetupError(
                f"port {port} of {ADDRESS} can't be had ({error}); give another, or 0 for any"
            ) from error
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ended: asyncio.Event | None = None

    @property
    def address(self) -> str:
        """Address of the first page."""
        return f"http://{ADDRESS}:{self.port}/"

    def run(self, ready: Callable[[], None] | None = None) -> None:
        """Serve until `stop` or Ctrl-C; `ready` is called once pages can be had."""
        # A quarter of a million objects of the toolkit would be looked through now and then, a tenth of a second each
        # time, in the middle of a turn of a knob; all of them live as long as the pages do.
        gc.collect()
        gc.freeze()
        try:
            # A loop of its own, made here and closed here: whatever else runs in the process keeps its.
            asyncio.run(self._serve(ready))
        finally:
            gc.unfreeze()

    def stop(self) -> None:
        """End `run`, or give the port back when it never ran; may be called from any thread."""
        if self._loop is None:
            self._socket.close()
        elif self._ended is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._ended.set)

    async def _serve(self, ready: Callable[[], None] | None) -> None:
        self._loop, self._ended = asyncio.get_running_loop(), asyncio.Event()
        self._loop.set_exception_handler(_on_exception)
        application = self._application()
        http = HTTPServer(application)
        http.add_sockets([self._socket])
        server = BaseServer(IOLoop.current(), application, http)
        server.start()
        try:
            if ready is not None:
                ready()
            await self._ended.wait()
        finally:
            server.stop()
            # Browsers keep their connections open, and would keep the port.
            await http.close_all_connections()

    def _application(self) -> BokehTornado:
        application = BokehTornado(
            build_applications({f"/{name}": make for name, make in self._pages.items()}),
            # Without these Bokeh would let in pages of localhost only, and the address that is printed is a number.
            extra_websocket_origins=[f"{name}:{self.port}" for name in OWN_NAMES],
            extra_patterns=[(r"/", Index, {"content": self._index})],
            use_index=False,
            websocket_max_message_size_bytes=_MOST_MESSAGE_BYTES,
            unused_session_lifetime_milliseconds=UNUSED_MS,
        )
        # Handlers for some hosts come before those for all, whatever the path.
        application.add_handlers(foreign_hosts(), [(r".*", ForeignHost)])
        return application


def _on_exception(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    # A message on its way while a browser leaves the page is nobody's mistake.
    if not isinstance(context.get("exception"), WebSocketClosedError):
        loop.default_exception_handler(context)


def foreign_hosts() -> str:
    """Regular expression of host names that aren't this computer's own."""
    own = "|".join(re.escape(name) for name in OWN_NAMES)
    return rf"(?!(?:{own})$).*"
