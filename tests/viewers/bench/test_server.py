"""Who can reach the bench."""

import base64
import os
import socket
from collections.abc import Iterator
from typing import Any

import pytest

from chladni.signals.errors import SetupError
from chladni.viewers.bench import serve
from tests.viewers.bench.serving import running
from tests.viewers.bench.stand_in import OSCILLATOR, tools

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


@pytest.fixture(scope="module")
def server() -> Iterator[Any]:
    with running(serve([OSCILLATOR], tools())) as one:
        yield one


def answer(port: int, request: str) -> str:
    """First line of the answer to a raw request."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(request.replace("\n", "\r\n").encode())
        return connection.recv(4096).decode("latin-1").split("\r\n")[0]


def get(port: int, path: str, host: str) -> str:
    return answer(port, f"GET {path} HTTP/1.1\nHost: {host}\nConnection: close\n\n")


def upgrade(port: int, host: str, origin: str) -> str:
    key = base64.b64encode(os.urandom(16)).decode()
    return answer(
        port,
        f"GET /oscillator/ws HTTP/1.1\nHost: {host}\nOrigin: {origin}\nUpgrade: websocket\nConnection: Upgrade\n"
        f"Sec-WebSocket-Key: {key}\nSec-WebSocket-Version: 13\nSec-WebSocket-Protocol: bokeh, none\n\n",
    )


@pytest.mark.parametrize("path", ["/", "/oscillator", "/static/js/bokeh.min.js"])
@pytest.mark.parametrize(
    "name", ["127.0.0.1", *(pytest.param(one, marks=pytest.mark.nightly) for one in ("localhost", "LOCALHOST"))]
)
def test_this_computers_names_are_answered(server: Any, path: str, name: str) -> None:
    assert get(server.port, path, f"{name}:{server.port}").startswith("HTTP/1.1 200")


@pytest.mark.parametrize("path", ["/", "/oscillator", "/oscillator/metadata", "/static/js/bokeh.min.js", "/nowhere"])
@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "evil.example:80", "localhost.evil", "[::1]"]
)
def test_a_foreign_host_is_refused(server: Any, path: str, host: str) -> None:
    assert get(server.port, path, host) == "HTTP/1.1 403 Forbidden"


def test_a_websocket_under_a_foreign_name_is_refused_though_its_origin_agrees(server: Any) -> None:
    host = f"evil.example:{server.port}"
    assert upgrade(server.port, host, f"http://{host}") == "HTTP/1.1 403 Forbidden"


def test_a_websocket_from_a_foreign_origin_is_refused(server: Any) -> None:
    assert upgrade(server.port, f"127.0.0.1:{server.port}", "http://evil.example") == "HTTP/1.1 403 Forbidden"


def test_a_websocket_from_a_page_of_another_port_is_refused(server: Any) -> None:
    origin = f"http://127.0.0.1:{server.port + 1}"
    assert upgrade(server.port, f"127.0.0.1:{server.port}", origin) == "HTTP/1.1 403 Forbidden"


def test_only_the_loopback_address_listens(server: Any) -> None:
    addresses = {entry[4][0] for entry in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for address in addresses - {"127.0.0.1"}:
        with pytest.raises(OSError, match=r"refused|timed out|unreachable"):
            socket.create_connection((address, server.port), timeout=1)
    assert server.address == f"http://127.0.0.1:{server.port}/"


def test_a_taken_port_is_told(server: Any) -> None:
    with pytest.raises(SetupError, match=rf"^port {server.port} of 127\.0\.0\.1 can't be had .*give another, or 0"):
        serve([OSCILLATOR], tools(), port=server.port)


def test_an_impossible_port_is_told() -> None:
    with pytest.raises(SetupError, match="port 70000 of"):
        serve([OSCILLATOR], tools(), port=70000)


def test_a_port_can_be_chosen() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with running(serve([OSCILLATOR], tools(), port=port)) as server:
        assert server.port == port
        assert get(port, "/", "localhost").startswith("HTTP/1.1 200")


def test_stopping_what_never_ran_gives_the_port_back() -> None:
    server = serve([OSCILLATOR], tools())
    server.stop()
    with running(serve([OSCILLATOR], tools(), port=server.port)) as again:
        assert again.port == server.port
