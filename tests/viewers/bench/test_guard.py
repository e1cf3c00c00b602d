"""What the bench gives to whom: origins, hosts, headers, numbers of pages, lengths of messages, slow clients."""

import contextlib
import http.server
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any

import pytest

from chladni.viewers.bench import serve
from tests.viewers.bench import wire
from tests.viewers.bench.serving import browsing, needs_chromium, open_page, running
from tests.viewers.bench.stand_in import OSCILLATOR, tools

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]

NAME = OSCILLATOR.name
#: All that Bokeh and Panel answer by themselves, ours, and nothing.
PATHS = ["/", f"/{NAME}", f"/{NAME}/", f"/{NAME}/ws", f"/{NAME}/autoload.js?bokeh-autoload-element=x",
         f"/{NAME}/metadata", "/static/js/bokeh.min.js", "/start.js", "/favicon.ico", "/nowhere"]  # fmt: skip


@pytest.fixture(scope="module")
def server() -> Iterator[Any]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("chladni.viewers.bench.guard.LOOK_MS", 100)
        patch.setattr("chladni.viewers.bench.server.PATIENCE_S", 2.0)
        with running(serve([OSCILLATOR], tools())) as one:
            yield one


@pytest.fixture
def port(server: Any) -> int:
    # Pages that a test leaves behind are given up at once; those of this one stay, however busy the machine is.
    give_up_after(server, 1)
    until(lambda: server.open_pages == 0)
    give_up_after(server, 600_000)
    return int(server.port)


def give_up_after(server: Any, milliseconds: int) -> None:
    """Change the time after which a page that no browser joined is given up."""
    server._application._unused_session_lifetime_milliseconds = milliseconds


def until(reached: Callable[[], bool], seconds: float = 120.0) -> None:
    begun = time.monotonic()
    while not reached():
        assert time.monotonic() - begun < seconds
        time.sleep(0.02)


def own(port: int) -> str:
    return f"http://127.0.0.1:{port}"


def join(port: int, token: str) -> Any:
    return wire.joined(port, NAME, token)


@pytest.mark.parametrize(
    "line",
    [
        "Origin: http://evil.example", "Origin: null", "Origin: https://127.0.0.1:PORT", "Origin: http://localhost:PORT",
        "Origin: http://127.0.0.1:1", "Origin: http://127.0.0.1:PORT.evil.example", "Origin: http://x@127.0.0.1:PORT",
        "Origin: file://", "Origin:", "Sec-Fetch-Site: cross-site", "Sec-Fetch-Site: same-site", "Sec-Fetch-Site: x",
        "Origin: http://127.0.0.1:PORT\r\nSec-Fetch-Site: cross-site",
        "Origin: http://127.0.0.1:PORT\r\nOrigin: http://evil.example",
    ],
)  # fmt: skip
def test_nothing_is_given_to_another_origin(server: Any, port: int, line: str) -> None:
    for path in PATHS:
        answer = wire.ask(port, path, line.replace("PORT", str(port)))
        # Tornado takes some of them for no request at all.
        assert answer.status in (400, 403), path
        assert not any(name.startswith("access-control") for name in answer.headers), path
    assert server.open_pages == 0


@pytest.mark.parametrize(
    "host", ["evil.example:PORT", "localhost.evil:PORT", "127.0.0.1:PORT.evil", "127.0.0.2:PORT", "127.1:PORT",
             "[::1]:PORT", "localhost:PORT@evil.example", "127.0.0.1:", "0.0.0.1"],
)  # fmt: skip
def test_nothing_is_given_under_another_name(server: Any, port: int, host: str) -> None:
    host = host.replace("PORT", str(port))
    for path in PATHS:
        assert wire.ask(port, path, f"Origin: http://{host}", host=host).status in (400, 403), path
        assert wire.ask(port, path, host=host).status in (400, 403), path
    assert server.open_pages == 0


@pytest.mark.parametrize("relation", ["none", "same-origin"])
@pytest.mark.parametrize("host", ["127.0.0.1:PORT", "localhost:PORT", "LocalHost:PORT", "localhost:9"])
def test_what_is_typed_and_what_our_own_pages_ask_is_answered(port: int, host: str, relation: str) -> None:
    # Port 9 is that of the other end of a tunnel.
    host = host.replace("PORT", str(port))
    assert wire.ask(port, "/", f"Sec-Fetch-Site: {relation}", host=host).status == 200
    assert wire.ask(port, "/start.js", f"Origin: http://{host}", host=host).status == 200


def test_a_refusal_is_a_page_that_leads_to_the_bench(port: int) -> None:
    answer = wire.ask(port, f"/{NAME}", "Sec-Fetch-Site: cross-site")
    assert answer.headers["content-type"].startswith("text/html")
    assert b'href="/"' in answer.body
    assert b"Another page asked for this one" in answer.body


@pytest.mark.parametrize("end", ["autoload.js?bokeh-autoload-element=x", "metadata", "autoload.js", "components/x"])
@pytest.mark.parametrize("method", ["GET", "OPTIONS", "POST", "HEAD"])
def test_what_puts_a_page_into_another_one_is_not_there(server: Any, port: int, end: str, method: str) -> None:
    answer = wire.ask(port, f"/{NAME}/{end}", f"Origin: {own(port)}", method=method)
    assert answer.status == 404
    assert not any(name.startswith("access-control") for name in answer.headers)
    assert server.open_pages == 0


@pytest.mark.parametrize("path", [PATHS[0], *(pytest.param(path, marks=pytest.mark.nightly) for path in PATHS[1:])])
def test_every_answer_has_the_headers_that_keep_others_out(port: int, path: str) -> None:
    for line in ("Sec-Fetch-Site: none", "Sec-Fetch-Site: cross-site"):
        headers = wire.ask(port, path, line).headers
        rules = dict(rule.split(" ", 1) for rule in headers["content-security-policy"].split("; "))
        assert (
            rules["default-src"] == rules["frame-ancestors"] == rules["base-uri"] == rules["form-action"] == "'none'"
        )
        # Neither inline nor made of text, nor of another host.
        assert rules["script-src"] == rules["connect-src"] == "'self'"
        assert "http" not in headers["content-security-policy"]
        assert headers["x-frame-options"] == "DENY"
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert "server" not in headers


def test_the_page_has_no_script_of_its_own(port: int) -> None:
    body = wire.ask(port, f"/{NAME}").body.decode()
    assert body.count("<script") == body.count("<script src=") + body.count('<script type="application/json"')
    assert "://" not in body.replace("http://www.w3.org", "")
    assert "<title>Oscillator &lt;one body&gt; · chladni</title>" in body


@pytest.mark.nightly
def test_there_are_no_more_pages_than_there_may_be(server: Any, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chladni.viewers.bench.guard.MOST_PAGES", 3)
    with ExitStack() as held:
        first = wire.ask(port, f"/{NAME}")
        with join(port, first.token):
            for _ in range(2):
                held.enter_context(join(port, wire.ask(port, f"/{NAME}").token))
            answers = [wire.ask(port, f"/{NAME}") for _ in range(5)]
            assert [one.status for one in answers] == [503] * 5
            assert b"3 open pages, the most there can be. Close one" in answers[0].body
            assert answers[0].headers["refresh"]
            assert server.open_pages == 3
            # Everything that costs nothing is still there.
            assert wire.ask(port, "/").status == 200
        # One was closed.
        until(lambda: wire.ask(port, f"/{NAME}").status == 200)
    # The one that was just made waits for its browser.
    until(lambda: server.open_pages == 1)


@pytest.mark.nightly
def test_pages_that_no_browser_joins_are_few_and_soon_gone(
    server: Any, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chladni.viewers.bench.guard.MOST_UNJOINED", 2)
    tokens = [wire.ask(port, f"/{NAME}").token for _ in range(2)]
    answer = wire.ask(port, f"/{NAME}")
    assert answer.status == 503
    assert b"busy with 2 new pages" in answer.body
    with join(port, tokens[0]):
        # Joined: another may come.
        assert wire.ask(port, f"/{NAME}").status == 200
        assert server.open_pages == 3
        give_up_after(server, 1)
        until(lambda: server.open_pages == 1)
    until(lambda: server.open_pages == 0)


@pytest.mark.nightly
def test_of_many_that_ask_at_once_most_are_told_to_wait(
    server: Any, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chladni.viewers.bench.guard.MOST_UNJOINED", 2)
    with ThreadPoolExecutor(40) as pool:
        statuses = [one.status for one in pool.map(lambda _: wire.ask(port, f"/{NAME}"), range(40))]
    # However long a page takes to make, those that wait for it are counted.
    assert statuses.count(200) == 2
    assert statuses.count(503) == 38


@pytest.mark.nightly
def test_a_page_that_is_closed_makes_room_at_once(server: Any, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chladni.viewers.bench.guard.MOST_PAGES", 1)
    # As somebody who reloads again and again.
    for _ in range(3):
        with join(port, wire.ask(port, f"/{NAME}").token):
            assert server.open_pages == 1
        until(lambda: len(server._application.joined) == 0)


@pytest.mark.nightly
def test_a_browser_that_leaves_at_once_leaves_no_page(server: Any, port: int) -> None:
    for _ in range(2):
        token = wire.ask(port, f"/{NAME}").token
        assert server.open_pages == 1
        with wire.connect(port) as connection:
            # Gone before the server has noticed that it came.
            connection.sendall(wire.request(port, f"/{NAME}/ws", *wire.upgrade_lines(token, own(port))))
            connection.sendall(wire.frame(b"", 8))
        until(lambda: server.open_pages == 0)
        assert wire.ask(port, f"/{NAME}/ws", *wire.upgrade_lines(token, own(port))).status == 403


@pytest.mark.parametrize("token", ["", "none", "e30", "a.b", "eyJ9", "x" * 2000])
def test_made_up_tokens_join_nothing(server: Any, port: int, token: str) -> None:
    answer = wire.ask(port, f"/{NAME}/ws", *wire.upgrade_lines(token, own(port)))
    assert answer.status == 403
    assert server.open_pages == 0


def test_a_token_that_bokeh_would_take_joins_nothing(server: Any, port: int) -> None:
    from bokeh.util.token import generate_jwt_token

    for name in ("mine", "x" * 44):
        token = generate_jwt_token(name, extra_payload={"headers": {}, "cookies": {}, "arguments": {}})
        assert wire.ask(port, f"/{NAME}/ws", *wire.upgrade_lines(token, own(port))).status == 403
    assert server.open_pages == 0


def test_a_page_has_one_browser(port: int) -> None:
    token = wire.ask(port, f"/{NAME}").token
    with join(port, token):
        assert wire.ask(port, f"/{NAME}/ws", *wire.upgrade_lines(token, own(port))).status == 403


def test_a_websocket_says_where_it_comes_from(port: int) -> None:
    token = wire.ask(port, f"/{NAME}").token
    assert wire.ask(port, f"/{NAME}/ws", *wire.upgrade_lines(token)).status == 403


@pytest.mark.nightly
def test_nobody_chooses_the_name_of_a_page(port: int) -> None:
    from bokeh.util.token import get_session_id, get_token_payload

    asked = (
        "?bokeh-session-id=mine",
        "?bokeh-session-id=mine",
        "?bokeh-token=e30",
        "?bokeh-session-id=a&bokeh-token=b",
    )
    answers = [wire.ask(port, f"/{NAME}{path}", "Bokeh-Session-Id: mine", "Cookie: secret=1") for path in asked]
    names = {get_session_id(one.token) for one in answers}
    assert len(names) == len(asked)
    assert all(len(name) == 44 for name in names)
    for one in answers:
        payload = get_token_payload(one.token)
        assert (payload["headers"], payload["cookies"], payload["arguments"]) == ({}, {}, {})


LONG = b"x" * 3_000_000
BUFFER = wire.frame(b'{"id": "a"}')


@pytest.mark.parametrize(
    "frames",
    [
        pytest.param([wire.frame(LONG)], marks=pytest.mark.nightly),
        pytest.param([wire.frame(LONG, wire.BINARY)], marks=pytest.mark.nightly),
        pytest.param(
            [wire.frame(LONG[:500_000], last=False)] + [wire.frame(LONG[:500_000], 0, last=False)] * 5,
            marks=pytest.mark.nightly,
        ),
        pytest.param([wire.frame(b"", length=1 << 62)], marks=pytest.mark.nightly),
        pytest.param(
            [*wire.message({}, buffers=10**9), *[BUFFER, wire.frame(LONG[:900_000], wire.BINARY)] * 3],
            marks=pytest.mark.nightly,
        ),
        pytest.param(
            [*wire.message({}, buffers=10**9), *[BUFFER, wire.frame(b"", wire.BINARY)] * 6000],
            marks=pytest.mark.nightly,
        ),
        [*wire.message({})[:2], wire.frame(b"[" * 1_000_000)],
        pytest.param([wire.frame(b"[]")] * 3, marks=pytest.mark.nightly),
        pytest.param([wire.frame(b"\xff\xfe")], marks=pytest.mark.nightly),
        pytest.param([wire.frame(b"x", wire.BINARY)], marks=pytest.mark.nightly),
        pytest.param(wire.message({}, kind="NONSENSE"), marks=pytest.mark.nightly),
    ],
    ids=["text", "binary", "fragments", "announced", "buffers", "empty buffers", "deep", "no message", "no text",
         "bytes first", "unknown kind"],
)  # fmt: skip
def test_a_message_that_is_too_long_or_none_ends_the_connection(
    server: Any, port: int, frames: list[bytes], caplog: pytest.LogCaptureFixture
) -> None:
    with join(port, wire.ask(port, f"/{NAME}").token) as connection:
        with contextlib.suppress(ConnectionError):
            connection.sendall(b"".join(frames))
        assert wire.until_closed(connection)
    until(lambda: server.open_pages == 0)
    # Nor is it printed in the terminal.
    assert all(len(record.getMessage()) < 2000 for record in caplog.records)
    assert wire.ask(port, f"/{NAME}").status == 200


def test_a_dropped_logs_pieces_fit_into_a_message(port: int) -> None:
    from chladni.viewers.bench.dropper import CHUNK_BYTES

    with join(port, wire.ask(port, f"/{NAME}").token) as connection:
        for _ in range(3):
            pieces = [*wire.message({"events": []}, buffers=1), wire.frame(b'{"id": "a"}')]
            connection.sendall(b"".join([*pieces, wire.frame(bytes(CHUNK_BYTES), wire.BINARY)]))
        connection.sendall(b"".join(wire.message({}, kind="SERVER-INFO-REQ")))
        received = b""
        while b"SERVER-INFO-REPLY" not in received:
            piece = connection.recv(65536)
            assert piece
            received += piece


@pytest.mark.parametrize("path", ["/", f"/{NAME}", "/nowhere"])
@pytest.mark.parametrize(
    ("lines", "body"),
    [
        (["Content-Length: 3000000"], LONG),
        (["Content-Length: " + "9" * 400], b""),
        (["Transfer-Encoding: chunked"], b"2dc6c0\r\n" + LONG + b"\r\n0\r\n\r\n"),
        (["X: " + "x" * 3_000_000], b""),
        ([f"X{number}: y" for number in range(50_000)], b""),
    ],
    ids=["body", "announced", "chunked", "one header", "many headers"],
)
def test_bodies_and_long_headers_are_refused(
    server: Any, port: int, path: str, lines: list[str], body: bytes
) -> None:
    answer = wire.ask(port, path, *lines, method="POST", body=body)
    assert answer.status in (0, 400, 404, 405)
    assert server.open_pages == 0


@pytest.mark.parametrize(
    "sent",
    [
        b"",
        pytest.param(b"GET / HT", marks=pytest.mark.nightly),
        pytest.param(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ", marks=pytest.mark.nightly),
    ],
)
def test_slow_clients_keep_nobody_out_and_are_let_go(port: int, sent: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chladni.viewers.bench.server.MOST_CONNECTIONS", 5)
    with ExitStack() as kept:
        slow = [kept.enter_context(wire.connect(port, timeout_s=20)) for _ in range(30)]
        for connection in slow:
            connection.sendall(sent)
        assert [wire.ask(port, path).status for path in ("/", f"/{NAME}", "/start.js")] == [200] * 3
        # The older ones at once, the newest when their time is over.
        assert all(wire.until_closed(connection) for connection in slow)


HOSTILE = """<!doctype html><script>
window.onload = async () => {
  const told = {}, base = "TARGET";
  for (const path of ["/NAME", "/NAME/autoload.js?bokeh-autoload-element=x", "/start.js"]) {
    await new Promise((done) => {
      const script = document.createElement("script");
      script.src = base + path;
      script.onload = () => { told["script " + path] = 1; done(); };
      script.onerror = () => done();
      document.body.append(script);
    });
    for (const mode of ["cors", "no-cors"]) {
      await fetch(base + path, {mode}).then(() => { told[mode + path] = 1; }, () => {});
    }
  }
  await new Promise((done) => {
    const frame = document.createElement("iframe");
    frame.src = base + "/NAME";
    frame.onload = () => done();
    document.body.append(frame);
  });
  await new Promise((done) => {
    const socket = new WebSocket(base.replace("http", "ws") + "/NAME/ws", ["bokeh", "TOKEN"]);
    socket.onopen = () => { told.websocket = 1; done(); };
    socket.onerror = () => done();
  });
  window.told = told;
};
</script><body></body>"""


@contextlib.contextmanager
def another_site(text: str) -> Iterator[int]:
    """Serve a page under another port."""

    class Hostile(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(text.encode())

        def log_message(self, *_: Any) -> None: ...

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Hostile) as site:
        threading.Thread(target=site.serve_forever, daemon=True).start()
        yield site.server_address[1]
        site.shutdown()


@needs_chromium
@pytest.mark.parametrize(
    "name", ["evil.example", *(pytest.param(one, marks=pytest.mark.nightly) for one in ("localhost", "127.0.0.1"))]
)
def test_a_page_of_another_origin_gets_nothing_in_a_browser(server: Any, port: int, name: str) -> None:
    text = HOSTILE.replace("TARGET", own(port)).replace("NAME", NAME)
    with browsing("--host-resolver-rules=MAP *.example 127.0.0.1") as page:
        with another_site(text.replace("TOKEN", wire.ask(port, f"/{NAME}").token)) as other:
            page.goto(f"http://{name}:{other}/")
            page.wait_for_function("() => window.told")
        assert page.evaluate("() => window.told") == {}
        assert all("chrome-error" in frame.url for frame in page.frames[1:])
        assert server.open_pages <= 1
        # Under its own name that points here (DNS rebinding) it gets no more.
        assert page.goto(f"http://evil.example:{port}/{NAME}").status == 403


@pytest.mark.nightly
@needs_chromium
def test_a_link_from_another_page_leads_to_the_bench(server: Any, port: int) -> None:
    text = f'<!doctype html><a href="{own(port)}/{NAME}">the motor</a>'
    with browsing() as page, another_site(text) as other:
        page.goto(f"http://localhost:{other}/")
        page.get_by_role("link").click()
        page.get_by_text("Another page asked for this one").wait_for()
        assert server.open_pages == 0
        page.get_by_role("link").click()
        page.get_by_text("Oscillator <one body>").click()
        page.locator(".noUi-handle").first.wait_for()


@pytest.mark.nightly
@needs_chromium
def test_a_full_bench_opens_the_page_once_there_is_room(
    server: Any, port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chladni.viewers.bench.guard.MOST_PAGES", 1)
    with browsing() as page, join(port, wire.ask(port, f"/{NAME}").token):
        page.goto(f"{own(port)}/{NAME}")
        page.get_by_text("1 open pages, the most there can be").wait_for()
        assert server.open_pages == 1
        monkeypatch.setattr("chladni.viewers.bench.guard.MOST_PAGES", 2)
        page.locator(".noUi-handle").first.wait_for()
        assert server.open_pages == 2


@pytest.mark.nightly
@needs_chromium
def test_a_page_works_under_both_names_without_a_word_of_the_browser(port: int) -> None:
    with browsing() as page:
        for name in ("localhost", "127.0.0.1"):
            open_page(page, f"http://{name}:{port}/{NAME}")
        assert page.complaints == []
