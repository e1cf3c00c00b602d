"""HTTP and websockets byte by byte, for requests that no well-behaved client would make."""

import base64
import contextlib
import json
import os
import re
import socket
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field

TEXT, BINARY, PONG = 1, 2, 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What came back; status 0 when the connection was closed without a word."""

    status: int
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes = b""

    @property
    def token(self) -> str:
        """The token of the page that this is."""
        (items,) = re.findall(rb'id="chladni">(.*?)</script>', self.body)
        return str(json.loads(items)[0]["token"])


def request(port: int, path: str, *lines: str, host: str = "", method: str = "GET") -> bytes:
    """Give the bytes of a request; `host` is our own name when none is given."""
    head = [f"{method} {path} HTTP/1.1", f"Host: {host or f'127.0.0.1:{port}'}", *lines]
    return "\r\n".join([*head, "", ""]).encode()


def connect(port: int, *, timeout_s: float = 300.0) -> socket.socket:
    """Open a connection to this computer."""
    return socket.create_connection(("127.0.0.1", port), timeout=timeout_s)


def read_answer(connection: socket.socket, *, method: str = "GET") -> Answer:
    """Read one answer to its end; that of HEAD tells the length of a body that doesn't come."""
    received = b""
    with contextlib.suppress(ConnectionError):
        while b"\r\n\r\n" not in received and (piece := connection.recv(65536)):
            received += piece
        head, _, body = received.partition(b"\r\n\r\n")
        first, *lines = head.decode("latin-1").split("\r\n")
        headers = {name.lower(): value.strip() for name, _, value in (line.partition(":") for line in lines)}
        length = 0 if method == "HEAD" else int(headers.get("content-length", 0))
        while len(body) < length and (piece := connection.recv(65536)):
            body += piece
        if first:
            return Answer(status=int(first.split()[1]), headers=headers, body=body)
    return Answer(status=0)


def ask(port: int, path: str, *lines: str, host: str = "", method: str = "GET", body: bytes = b"") -> Answer:
    """Ask for something over a connection of its own."""
    with connect(port) as connection:
        # A server that refuses may close before it has read everything.
        with contextlib.suppress(ConnectionError):
            connection.sendall(request(port, path, *lines, host=host, method=method) + body)
        return read_answer(connection, method=method)


def upgrade_lines(token: str = "none", origin: str = "") -> list[str]:  # noqa: S107  # a page's name, no password
    """Give the header lines of a websocket's request."""
    key = base64.b64encode(os.urandom(16)).decode()
    words = ["Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13"]
    return [*words, f"Sec-WebSocket-Protocol: bokeh, {token}", *([f"Origin: {origin}"] if origin else [])]


def frame(content: bytes, kind: int = TEXT, *, last: bool = True, length: int | None = None) -> bytes:
    """Give a frame of a websocket; a mask of zeros leaves the content as it is. `length` may lie."""
    said = len(content) if length is None else length
    if said < 126:
        size = bytes([0x80 | said])
    else:
        size = b"\xfe" + struct.pack(">H", said) if said < 65536 else b"\xff" + struct.pack(">Q", said)
    return bytes([(0x80 if last else 0) | kind]) + size + bytes(4) + content


@contextlib.contextmanager
def joined(port: int, name: str, token: str) -> Iterator[socket.socket]:
    """Join a page as its browser would; raises ConnectionError when the server doesn't want it."""
    with connect(port) as connection:
        connection.sendall(request(port, f"/{name}/ws", *upgrade_lines(token, f"http://127.0.0.1:{port}")))
        head = b""
        while b"\r\n\r\n" not in head:
            piece = connection.recv(1)
            if not piece:
                break
            head += piece
        if b" 101 " not in head.split(b"\r\n")[0]:
            raise ConnectionError(head.decode("latin-1"))
        # Bokeh takes nothing before it has said so.
        while b'"ACK"' not in head:
            piece = connection.recv(65536)
            if not piece:
                raise ConnectionError("closed before it was acknowledged")
            head += piece
        yield connection


def until_closed(connection: socket.socket) -> bool:
    """Read what comes, and say whether the other side closes before the connection's time is over."""
    try:
        while True:
            piece = connection.recv(65536)
            # A frame of closing, or the end.
            if not piece or piece[0] == 0x88:
                return True
    except ConnectionError:
        return True
    except TimeoutError:
        return False


def message(content: object, *, kind: str = "PATCH-DOC", buffers: int = 0) -> list[bytes]:
    """Give the frames of a message of Bokeh's protocol, without its buffers."""
    header = {"msgid": os.urandom(8).hex(), "msgtype": kind, **({"num_buffers": buffers} if buffers else {})}
    return [frame(json.dumps(part).encode()) for part in (header, {}, content)]
