"""Serves the pages on this computer only, to requests that name this computer."""

import asyncio
import gc
import socket
from collections.abc import Callable, Mapping
from typing import Any

from bokeh.server.server import BaseServer
from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.websocket import WebSocketClosedError

from chladni.signals.errors import SetupError
from chladni.viewers.bench.guard import MOST_MESSAGE_BYTES, Application
from chladni.viewers.bench.page import START_JS

ADDRESS = "127.0.0.1"
#: Connections besides those of open pages. A browser asks through six.
MOST_CONNECTIONS = 128
#: Who takes longer to say what is wanted, or keeps a connection without asking, is let go.
PATIENCE_S = 10.0
_MOST_HEADER_BYTES = 16_384
#: Calls that are not answered yet: a page that is being made holds all others up for half a second.
_MOST_CALLS = 1024


class BoundedServer(HTTPServer):
    """Gives up the connection that has waited longest when there are too many."""

    def initialize(self, *args: Any, **kwargs: Any) -> None:
        """Begin without connections."""
        super().initialize(*args, **kwargs)
        self._waiting: dict[Any, None] = {}

    def start_request(self, server_conn: Any, request_conn: Any) -> Any:
        """Note a connection that begins to wait for a request."""
        self._waiting.pop(server_conn, None)
        self._waiting[server_conn] = None
        # Not the newest: whoever opens connections to keep them would keep everybody else out.
        for oldest in list(self._waiting)[:-MOST_CONNECTIONS]:
            self._waiting.pop(oldest)
            oldest.stream.close()
        return super().start_request(server_conn, request_conn)

    def on_close(self, server_conn: Any) -> None:
        """Forget it, closed or become the websocket of a page."""
        self._waiting.pop(server_conn, None)
        super().on_close(server_conn)


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
            self._socket = socket.create_server((ADDRESS, port), backlog=_MOST_CALLS)
        except OSError as error:
            raise SetupError(
                f"port {port} of {ADDRESS} can't be had ({error}); give another, or 0 for any"
            ) from error
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self._loop: asyncio.AbstractEventLoop | None = None
        self._ended: asyncio.Event | None = None
        self._application: Application | None = None

    @property
    def address(self) -> str:
        """Address of the first page."""
        return f"http://{ADDRESS}:{self.port}/"

    @property
    def open_pages(self) -> int:
        """Pages that are open now."""
        return 0 if self._application is None else self._application.open_pages()

    def run(self, ready: Callable[[], None] | None = None) -> None:
        """Serve until `stop` or Ctrl-C; `ready` is called once pages can be had."""
        # A quarter of a million objects of the toolkit would be looked through now and then, a tenth of a second each
        # time, in the middle of a turn of a knob; all of them live as long as the pages do. What the program that
        # serves pages froze before stays frozen.
        frozen = gc.get_freeze_count() > 0
        if not frozen:
            gc.collect()
            gc.freeze()
        try:
            # A loop of its own, made here and closed here: whatever else runs in the process keeps its.
            asyncio.run(self._serve(ready))
        finally:
            if not frozen:
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
        texts = {"/": (self._index, "text/html"), "/start.js": (START_JS, "text/javascript")}
        self._application = application = Application(self._pages, texts)
        http = BoundedServer(
            application,
            idle_connection_timeout=PATIENCE_S,
            body_timeout=PATIENCE_S,
            max_header_size=_MOST_HEADER_BYTES,
            # Nothing that is served takes a body; logs come through websockets.
            max_body_size=0,
            max_buffer_size=2 * MOST_MESSAGE_BYTES,
        )
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


def _on_exception(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    # A message on its way while a browser leaves the page is nobody's mistake.
    if not isinstance(context.get("exception"), WebSocketClosedError):
        loop.default_exception_handler(context)
