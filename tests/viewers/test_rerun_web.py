"""The web viewer: reachable from this computer and from nowhere else."""

import socket
import urllib.request
from collections.abc import Iterator
from subprocess import Popen
from typing import Any
from urllib.parse import parse_qs, urlsplit

import psutil
import pytest

from chladni.signals.errors import SetupError
from chladni.viewers.display import DISPLAYS
from chladni.viewers.rerun import WebViewer, process, serve_web, spawn, window
from tests.viewers import synthetic


@pytest.fixture(scope="module")
def served() -> Iterator[WebViewer]:
    with serve_web(synthetic.study()) as viewer:
        yield viewer


def listening(pid: int) -> list[tuple[str, int]]:
    family = [psutil.Process(pid), *psutil.Process(pid).children(recursive=True)]
    connections = [connection for member in family for connection in member.net_connections(kind="inet")]
    return [(address.laddr.ip, address.laddr.port) for address in connections if address.status == "LISTEN"]


def test_page_is_served_at_the_address(served: WebViewer) -> None:
    assert served.address.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(served.address, timeout=20) as answer:  # noqa: S310  # our own loopback server
        page = answer.read()
    assert b"<html" in page
    # Colours are for a dark ground, whatever the system prefers; the page asks for it by this name.
    assert parse_qs(urlsplit(served.address).query)["theme"] == ["dark"]
    assert b'query.get("theme")' in page


def test_every_socket_listens_on_loopback_only(served: WebViewer) -> None:
    sockets = listening(served._process.pid)
    assert {ip for ip, _ in sockets} == {"127.0.0.1"}
    (data,) = parse_qs(urlsplit(served.address).query)["url"]
    ports = {urlsplit(served.address).port, urlsplit(data.removeprefix("rerun+")).port}
    assert {port for _, port in sockets} == ports


def test_closing_ends_the_server_and_twice_is_fine() -> None:
    viewer = serve_web(synthetic.study(), port=process.free_port())
    viewer.close()
    viewer.close()
    viewer.wait()
    with pytest.raises(OSError, match="refused"):
        socket.create_connection(("127.0.0.1", urlsplit(viewer.address).port or 0), timeout=2)


def test_a_program_that_ends_at_once_is_told_in_its_own_words() -> None:
    with pytest.raises(SetupError, match=r"no-such-option.*--save"):
        process.start(["--no-such-option"], ports=[process.free_port()], detached=False)


def test_a_program_that_never_listens_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process, "PATIENCE_S", 0.5)
    options = ["--serve-grpc", "--port", str(process.free_port())]
    with pytest.raises(SetupError, match="didn't listen"):
        process.start(options, ports=[process.free_port()], detached=False)


def test_a_viewer_without_a_display_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(SetupError, match="--save"):
        spawn(synthetic.study())


def test_a_window_gets_the_study_and_listens_on_loopback_only(monkeypatch: pytest.MonkeyPatch) -> None:
    # The data server alone stands for the window, which needs a display.
    def start_server(options: list[str], **others: Any) -> Popen[bytes]:
        return process.start(["--serve-grpc", *options], **others)

    monkeypatch.setattr(window, "start", start_server)
    monkeypatch.setenv("DISPLAY", ":0")
    spawn(synthetic.study())
    shown = window._open_windows.pop()
    assert {ip for ip, _ in listening(shown.pid)} == {"127.0.0.1"}
    process.stop(shown)
