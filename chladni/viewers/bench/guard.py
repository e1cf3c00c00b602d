"""Who may ask the bench for what, and how much of it: origins, headers, pages, messages.

Bokeh's server is made to be embedded in other pages and reached by many; here one person at one computer asks. So
every request passes one place, `Application.get_handler_delegate`, which lets few kinds of handlers answer.
"""

import asyncio
import re
from collections.abc import Mapping
from functools import cache
from html import escape
from typing import Any

from bokeh.server.tornado import BokehTornado
from bokeh.server.views.multi_root_static_handler import MultiRootStaticHandler
from bokeh.server.views.static_handler import StaticHandler
from panel.io.application import build_applications
from panel.io.server import DocHandler, WSHandler
from tornado.httputil import HTTPServerRequest
from tornado.web import RequestHandler

from chladni.viewers.bench.dropper import CHUNK_BYTES

#: Open pages at once. One holds 6 MB, and the program 0.2 GB without any: all together stay below half a gigabyte.
MOST_PAGES = 32
#: A page that no browser has joined is given up after this; one that a browser has left, at the next look.
UNUSED_MS, LOOK_MS = 15_000, 1000
#: Pages that no browser has joined yet, those that wait to be made among them. Making one takes half a second.
MOST_UNJOINED = 8
#: A message from a browser, in all its pieces. The longest one brings a piece of a dropped log, which takes four
#: thirds of its bytes as text.
MOST_MESSAGE_BYTES = 2 * CHUNK_BYTES
#: What a piece of a message costs besides its bytes, so that many empty ones are bounded too.
_PIECE_BYTES = 200
#: A browser that doesn't answer is given up after twice this.
PING_S = 20.0

_OWN_HOST = re.compile(r"(127\.0\.0\.1|localhost)(:[0-9]{1,5})?", re.ASCII | re.IGNORECASE)
#: No code but that of this server's files: neither inside the page nor made of text. Charts bring style rules.
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "font-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
HEADERS: Mapping[str, str] = {
    "Content-Security-Policy": _POLICY,
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    # Neither a window that opened the page nor a script, picture or stylesheet of another origin gets at it.
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_WORDS = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>chladni bench</title><link rel="icon" href="data:,"></head>
<body style="font-family: sans-serif; margin: 3em"><p>{words}</p><p><a href="/">chladni bench</a></p></body></html>
"""


def foreign(request: HTTPServerRequest) -> str:
    """Say why a request comes from elsewhere; nothing when it comes from this computer and its own pages."""
    host = request.headers.get("Host", "")
    # A page of the web may point its own name at 127.0.0.1 (DNS rebinding). Then browsers see one origin; but they
    # still say that name. The port is free: a tunnel (ssh -L) has another at its other end.
    if not _OWN_HOST.fullmatch(host):
        return "chladni answers only to this computer's own name, 127.0.0.1 or localhost."
    websocket = request.headers.get("Upgrade", "").lower() == "websocket"
    own = f"http://{host}"
    # Browsers always say where a websocket comes from.
    origin = request.headers.get("Origin", "" if websocket else own)
    # Scripts, frames and links say no origin, but how they relate; what is typed or started by a program is "none".
    relation = request.headers.get("Sec-Fetch-Site", "same-origin")
    if origin.lower() != own.lower() or relation not in ("same-origin", "none"):
        return "Another page asked for this one. chladni answers only to its own pages; open it by the link below."
    return ""


class Guarded(RequestHandler):
    """Gives every answer the headers that keep other pages out."""

    def set_default_headers(self) -> None:
        """Set them, also for errors."""
        for name, value in HEADERS.items():
            self.set_header(name, value)
        self.clear_header("Server")

    def refuse(self, status: int, words: str) -> None:
        """Answer with a short page."""
        self.set_status(status)
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.finish(_WORDS.format(words=escape(words)))


class Refusal(Guarded):
    """Answers before anything else happens."""

    def initialize(self, status: int, words: str) -> None:
        """Keep what to say."""
        self._refusal = (status, words)

    def prepare(self) -> None:
        """Say it."""
        self.refuse(*self._refusal)


class Text(Guarded):
    """A text that is always the same."""

    def initialize(self, content: str, kind: str) -> None:
        """Keep what to send."""
        self._content, self._kind = content, kind

    def get(self) -> None:
        """Send it."""
        self.set_header("Content-Type", f"{self._kind}; charset=utf-8")
        self.finish(self._content)


class PageHandler(Guarded, DocHandler):
    """Makes a page, as long as there are few."""

    application: "Application"
    _left = False

    async def get(self, *args: Any, **kwargs: Any) -> None:
        """Make it, or say that there are too many."""
        # An asker could name its session, and so share the one of somebody else; names are drawn here.
        self.request.headers.pop("Bokeh-Session-Id", None)
        wanted = self.request.arguments
        self.request.arguments = {"theme": wanted["theme"][:1]} if "theme" in wanted else {}
        full = self.application.full()
        if full:
            await self.application.give_up_unused()
            full = self.application.full()
        if full:
            self.set_header("Refresh", "3")
            self.refuse(503, full)
            return
        application = self.application
        application.waiting += 1
        async with application.turn:
            # All requests that have come meanwhile are counted, or refused, before the next page is made.
            await asyncio.sleep(0)
            application.waiting -= 1
            if self._left:
                return
            # The page is among the open ones before anybody else has the word.
            made = super().get(*args, **kwargs)
            if made is not None:
                await made

    def on_connection_close(self) -> None:
        """Note that nobody waits for the page any more."""
        self._left = True
        super().on_connection_close()


class Socket(Guarded, WSHandler):
    """The connection between a page and its browser: one, and only to a page that was made before."""

    application: "Application"
    _unread_bytes = 0
    _ended = False

    async def get(self, *args: Any, **kwargs: Any) -> None:
        """Join the page that the token names, which is drawn at random and stands in that page only; ends with it."""
        token = self.request.headers.get("Sec-WebSocket-Protocol", "").rpartition(",")[2].strip()
        pages = {session.token: session for session in self.application_context.sessions}
        if token not in pages or token in self.application.joined:
            self.refuse(403, "There is no such page, or a browser has it already. Reload.")
            return
        self.application.joined.add(token)
        try:
            await super().get(*args, **kwargs)
        finally:
            self._ended = True
            self.application.joined.discard(token)
            # On one computer no connection is lost but by closing the page.
            pages[token].request_expiration()

    async def _async_open(self, token: str) -> None:
        await super()._async_open(token)
        # Bokeh comes to this later: the browser may have left, and the page would wait for it for ever.
        if self._ended and self.connection is not None:
            self.application.client_lost(self.connection)

    def check_origin(self, origin: str) -> bool:
        """Ask what was asked of the request; Bokeh would take a list from the environment."""
        return bool(origin) and not foreign(self.request)

    async def on_message(self, fragment: str | bytes) -> None:
        """Take a piece of a message, as long as the pieces together stay within the bound."""
        # Bokeh gathers as many pieces as the first one announces.
        self._unread_bytes += len(fragment) + _PIECE_BYTES
        if self._unread_bytes > MOST_MESSAGE_BYTES:
            self.close(1009, "message too long")
            return
        await super().on_message(fragment)

    async def _receive(self, fragment: str | bytes) -> Any:
        try:
            message = await super()._receive(fragment)
        except (AttributeError, KeyError, RecursionError, TypeError, ValueError) as error:
            # Bokeh would print it, all of it, in the terminal.
            self._protocol_error(f"a message that can't be read ({type(error).__name__})")
            return None
        if message is not None:
            self._unread_bytes = 0
        return message


@cache
def _guarded(handler: type[RequestHandler]) -> type[RequestHandler]:
    return type(f"Guarded{handler.__name__}", (Guarded, handler), {})


#: What answers, by what Bokeh and Panel would take. Everything else of theirs stays shut: scripts to put a page into
#: another one (autoload.js, which answers any origin), metadata, components, icons.
_ANSWERING: Mapping[type[RequestHandler], type[RequestHandler]] = {
    DocHandler: PageHandler,
    WSHandler: Socket,
    StaticHandler: _guarded(StaticHandler),
    MultiRootStaticHandler: _guarded(MultiRootStaticHandler),
    Text: Text,
}


class Application(BokehTornado):
    """The pages, and who may have them.

    Attributes
    ----------
    waiting
        Requests for pages that wait for their turn.
    turn
        Held while a page is made.
    joined
        Tokens of the pages that a browser has.
    """

    def __init__(self, pages: Mapping[str, Any], texts: Mapping[str, tuple[str, str]]) -> None:
        self.waiting, self.turn = 0, asyncio.Lock()
        self.joined: set[str] = set()
        super().__init__(
            build_applications({f"/{name}": make for name, make in pages.items()}),
            extra_patterns=[
                (re.escape(path), Text, {"content": content, "kind": kind}) for path, (content, kind) in texts.items()
            ],
            use_index=False,
            # Nothing of a request but its theme is kept, in the page's token or elsewhere.
            include_headers=[],
            include_cookies=[],
            websocket_max_message_size_bytes=MOST_MESSAGE_BYTES,
            unused_session_lifetime_milliseconds=UNUSED_MS,
            check_unused_sessions_milliseconds=LOOK_MS,
            # Bokeh's own pings ask for no answer.
            keep_alive_milliseconds=0,
            websocket_ping_interval=PING_S,
            # The terminal isn't for whoever asks for pages that there aren't.
            log_function=lambda _handler: None,
        )

    def get_handler_delegate(
        self, request: HTTPServerRequest, target_class: type[RequestHandler], *args: Any, **kwargs: Any
    ) -> Any:
        """Choose who answers; every request passes here, websockets too, before any of its work is done."""
        why = foreign(request)
        if why:
            return super().get_handler_delegate(request, Refusal, {"status": 403, "words": why})
        if target_class not in _ANSWERING:
            return super().get_handler_delegate(request, Refusal, {"status": 404, "words": "There is no such page."})
        return super().get_handler_delegate(request, _ANSWERING[target_class], *args, **kwargs)

    def open_pages(self) -> int:
        """Count the pages there are."""
        return sum(len(list(context.sessions)) for context in self.applications.values())

    def full(self) -> str:
        """Say why there can't be another page now; nothing when there can."""
        pages = self.open_pages() + self.waiting
        if pages >= MOST_PAGES:
            return (
                f"The bench has {pages} open pages, the most there can be. Close one; this one tries again by itself."
            )
        if pages - len(self.joined) >= MOST_UNJOINED:
            return f"The bench is busy with {MOST_UNJOINED} new pages. This one tries again by itself."
        return ""

    async def give_up_unused(self) -> None:
        """Free the pages that nobody looks at any more."""
        await self._cleanup_sessions()
