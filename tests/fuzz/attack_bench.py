"""Attacks the bench as other pages, programs and slow clients would: ``python tests/fuzz/attack_bench.py``.

The bench runs in a process of its own; its memory and its number of open pages are watched. What must hold:

1. A request of a foreign origin or host gets 403 whatever it asks for, and makes no page. What serves to put a page
   into another one (``autoload.js``) isn't there. No answer allows another origin to read it.
2. A page of another origin in a real browser gets neither frame, script, text nor websocket, also under a name of its
   own that points at this computer (DNS rebinding).
3. However many pages are asked for, there are at most `MOST_PAGES`, and they go when nobody looks at them.
4. A websocket joins only a page that was made, once, with the token that stands in it.
5. Messages of 16 MB, messages in endless pieces, bodies and headers of megabytes are refused.
6. Clients that send or read slowly don't keep others out, and are let go.
7. The server stays below 1 GB, and afterwards answers an honest page as fast as before.

Prints a row an attack; exits with 1 when one of them got through.
"""

import argparse
import contextlib
import http.server
import itertools
import multiprocessing
import socket
import statistics
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import psutil

# Run as a file, it finds the tests' tools all the same.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.viewers.bench import wire
from tests.viewers.bench.serving import ARGUMENTS, CHROMIUM

NAME = "pneumatic-motor"
MOST_BYTES = 1_000_000_000
BIG = 16_000_000


def serve(pipe: Connection) -> None:
    """Serve all instruments, and tell how many pages are open."""
    from chladni.apps.bench import open_bench
    from chladni.models.instruments.catalogue import INSTRUMENTS

    server, ready = open_bench(INSTRUMENTS.values()), threading.Event()
    thread = threading.Thread(target=server.run, args=(ready.set,), daemon=True)
    thread.start()
    ready.wait(60)
    pipe.send(server.port)
    while pipe.recv() == "pages":
        pipe.send(server.open_pages)
    server.stop()
    thread.join(10)


class Bench:
    """The bench in its own process, watched ten times a second."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs,), daemon=True)
        self._process.start()
        self.port: int = self._pipe.recv()
        self._watched = psutil.Process(self._process.pid)
        self.peak_bytes = self.most_pages = 0
        self._ended = threading.Event()
        self._watcher = threading.Thread(target=self._watch, daemon=True)
        self._watcher.start()

    def bytes_now(self) -> int:
        """Resident memory."""
        return int(self._watched.memory_info().rss)

    def pages(self) -> int:
        """Open pages."""
        self._pipe.send("pages")
        return int(self._pipe.recv())

    def until_empty(self, seconds: float) -> float:
        """Wait until no page is open; give how long it took, infinity when it took too long."""
        begun = time.monotonic()
        while time.monotonic() - begun < seconds:
            if self.pages() == 0:
                return time.monotonic() - begun
            time.sleep(0.2)
        return float("inf")

    def end(self) -> None:
        """End the process."""
        self._ended.set()
        self._watcher.join()
        self._pipe.send("end")
        self._process.join(30)

    def _watch(self) -> None:
        while not self._ended.wait(0.05):
            self.peak_bytes = max(self.peak_bytes, self.bytes_now())


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One attack and its outcome."""

    attack: str
    tries: int
    outcome: str
    held: bool


def counted(statuses: Sequence[int]) -> str:
    """Say how often each status came."""
    return ", ".join(f"{count} x {status or 'closed'}" for status, count in sorted(Counter(statuses).items()))


PATHS = ["/", f"/{NAME}", f"/{NAME}/", f"/{NAME}/ws", f"/{NAME}/autoload.js?bokeh-autoload-element=x",
         f"/{NAME}/metadata", "/static/js/bokeh.min.js", "/start.js", "/favicon.ico", "/nowhere"]  # fmt: skip


def foreign_origins(bench: Bench) -> Row:
    """Ask with origins and relations that aren't our own."""
    own = f"http://127.0.0.1:{bench.port}"
    origins = ["http://evil.example", "null", own.replace("http", "https"), f"http://localhost:{bench.port}",
               f"http://127.0.0.1:{bench.port + 1}", "http://127.0.0.1", f"{own}.evil.example",
               f"http://evil@127.0.0.1:{bench.port}", "file://", ""]  # fmt: skip
    lines = [[f"Origin: {origin}"] for origin in origins]
    lines += [[f"Sec-Fetch-Site: {relation}"] for relation in ("cross-site", "same-site", "nonsense")]
    lines += [[f"Origin: {own}", "Sec-Fetch-Site: cross-site"], [f"Origin: {own}", "Origin: http://evil.example"]]
    answers = [wire.ask(bench.port, path, *line) for path, line in itertools.product(PATHS, lines)]
    answers += [wire.ask(bench.port, f"/{NAME}/ws", *wire.upgrade_lines(origin=origin)) for origin in origins]
    answers += [wire.ask(bench.port, path, "Origin: http://evil.example", method="OPTIONS") for path in PATHS]
    return refused("foreign origin", bench, answers)


def foreign_hosts(bench: Bench) -> Row:
    """Ask under names that aren't this computer's, as DNS rebinding does."""
    port = bench.port
    hosts = ["evil.example", f"evil.example:{port}", f"127.0.0.1.evil.example:{port}", f"localhost.evil:{port}",
             "[::1]",
             "0.0.0.1", f"127.0.0.2:{port}", "127.1", "2130706433", f"127.0.0.1:{port}.evil", "127.0.0.1:x",
             f"localhost:{port}@evil.example", "."]  # fmt: skip
    answers = [wire.ask(port, path, host=host) for path, host in itertools.product(PATHS, hosts)]
    answers += [
        wire.ask(port, f"/{NAME}/ws", *wire.upgrade_lines(origin=f"http://{host}"), host=host) for host in hosts
    ]
    return refused("foreign host (DNS rebinding)", bench, answers)


def refused(attack: str, bench: Bench, answers: Sequence[wire.Answer]) -> Row:
    """Hold answers against rule 1; a request that isn't HTTP any more may get 400."""
    readable = [one for one in answers if any(name.startswith("access-control") for name in one.headers)]
    held = all(one.status in (400, 403) for one in answers) and not readable and bench.pages() == 0
    return Row(attack=attack, tries=len(answers), outcome=counted([one.status for one in answers]), held=held)


def embedding(bench: Bench) -> Row:
    """Ask for what puts a page into another one, as our own page; and look at the headers of what there is."""
    ends = ["autoload.js", "autoload.js?bokeh-autoload-element=x", "metadata", "components/x"]
    gone = [wire.ask(bench.port, f"/{NAME}/{end}", method=method) for end in ends for method in ("GET", "OPTIONS")]
    there = [wire.ask(bench.port, path) for path in ("/", "/start.js", "/static/js/bokeh.min.js", "/nowhere")]
    framed = [
        one for one in (*gone, *there) if "frame-ancestors 'none'" not in one.headers["content-security-policy"]
    ]
    open_to = [one for one in (*gone, *there) if any(name.startswith("access-control") for name in one.headers)]
    held = all(one.status == 404 for one in gone) and not framed and not open_to and bench.pages() == 0
    return Row(attack="embedding (autoload.js, metadata)", tries=len(gone), outcome=counted([o.status for o in gone]),
               held=held)  # fmt: skip


def hostile_pages(bench: Bench) -> Iterator[Row]:
    """Let pages of other origins try, in a browser: another site, another port, and a name that points at us."""
    from playwright.sync_api import sync_playwright

    token = wire.ask(bench.port, f"/{NAME}").token
    made = bench.pages()
    target = f"http://127.0.0.1:{bench.port}"
    text = (
        Path(__file__)
        .with_name("hostile.html")
        .read_text()
        .replace("TARGET", target)
        .replace("NAME", NAME)
        .replace("TOKEN", token)
    )
    with another_server(text) as port, sync_playwright() as driver:
        names = ["--host-resolver-rules=MAP *.example 127.0.0.1"]
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=[*ARGUMENTS, *names])
        page = chromium.new_page()
        for attack, origin in (
            ("other site", f"http://evil.example:{port}"),
            ("other port", f"http://127.0.0.1:{port}"),
        ):
            page.goto(origin)
            page.wait_for_function("() => window.told", timeout=30_000)
            told: dict[str, str] = page.evaluate("() => window.told")
            frames = [frame.url for frame in page.frames if frame != page.main_frame]
            told["frame"] = "refused" if all("chrome-error" in url for url in frames) else f"shown {frames}"
            got = {what: how for what, how in told.items() if how != "refused"}
            # A new page shows that something was done, though nothing was read.
            yield Row(attack=f"hostile page, {attack}, in Chromium", tries=len(told),
                      outcome=str(got) if got else f"{len(told)} x refused",
                      held=not got and bench.pages() <= made)  # fmt: skip
        statuses = [page.goto(f"http://evil.example:{bench.port}{path}").status for path in ("/", f"/{NAME}")]
        yield Row(attack="rebound name, in Chromium", tries=2, outcome=counted(statuses), held=statuses == [403, 403])
        page.goto(f"http://evil.example:{port}/link")
        with page.expect_navigation():
            page.evaluate(f"() => {{ location.href = '{target}/{NAME}'; }}")
        words = page.inner_text("body")
        page.get_by_role("link").click()
        page.get_by_text("turn a knob and watch").wait_for()
        yield Row(attack="led there from another site, in Chromium", tries=1, outcome=words.split("\n")[0][:60],
                  held="Another page asked" in words)  # fmt: skip
        chromium.close()


@contextlib.contextmanager
def another_server(text: str) -> Iterator[int]:
    """Serve a hostile page under another port."""

    class Hostile(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            content = text.encode() if self.path == "/" else b"<!doctype html><title>link</title>"
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, *_: Any) -> None: ...

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Hostile) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_address[1]
        server.shutdown()


def many_pages(bench: Bench, count: int, most: int, unused_s: float) -> Row:
    """Ask for many pages at once, and join none."""
    begun = time.monotonic()
    with ThreadPoolExecutor(count) as pool:
        statuses = [one.status for one in pool.map(lambda _: wire.ask(bench.port, f"/{NAME}"), range(count))]
    seconds = time.monotonic() - begun
    made, freed = bench.pages(), bench.until_empty(60)
    # As many again each time that those before have been given up.
    held = made <= most and statuses.count(200) <= most * (1 + seconds // unused_s)
    return Row(attack=f"{count} pages at once, never joined", tries=count,
               held=held and set(statuses) <= {200, 503, 0} and freed < unused_s + 5,
               outcome=f"{counted(statuses)} in {seconds:.0f} s; {made} open, freed after {freed:.0f} s")  # fmt: skip


def many_joined(bench: Bench, count: int, most: int) -> Row:
    """Ask for many pages and hold each with a websocket."""
    statuses: list[int] = []
    with ExitStack() as stack:
        sockets: list[socket.socket] = []
        for _ in range(count):
            answer = wire.ask(bench.port, f"/{NAME}")
            statuses.append(answer.status)
            if answer.status == 200:
                sockets.append(stack.enter_context(wire.joined(bench.port, NAME, answer.token)))
            # As a living browser answers.
            for one in sockets:
                one.sendall(wire.frame(b"", wire.PONG))
        made = bench.pages()
        words = answer.body.decode()
    freed = bench.until_empty(30)
    held = made == most and statuses.count(200) == most and set(statuses) == {200, 503} and freed < 5
    return Row(attack=f"{count} pages, each joined", tries=count, held=held and f"{most} open pages" in words,
               outcome=f"{counted(statuses)}; {made} open, freed {freed:.1f} s after closing")  # fmt: skip


def false_tokens(bench: Bench) -> Row:
    """Join with tokens that aren't those of a page: made up, signed by nobody, used already, of a chosen name."""
    from bokeh.util.token import generate_jwt_token

    answer = wire.ask(bench.port, f"/{NAME}?bokeh-session-id=mine", "Bokeh-Session-Id: mine")
    chosen = wire.ask(bench.port, f"/{NAME}?bokeh-token={answer.token}")
    tokens = [generate_jwt_token("mine"), generate_jwt_token("x" * 44), "none", "", "e30", "a.b", answer.token[:-1],
              answer.token + "A", "\x7f" * 8]  # fmt: skip
    with wire.joined(bench.port, NAME, answer.token):
        tokens += [answer.token]
        path = f"/{NAME}/ws"
        origin = f"http://127.0.0.1:{bench.port}"
        refusals = [wire.ask(bench.port, path, *wire.upgrade_lines(token, origin)).status for token in tokens]
    # Nor has a page of somebody else come of it.
    different = len({answer.token, chosen.token}) == 2 and bench.until_empty(30) < 20
    return Row(attack="tokens made up, or used twice", tries=len(tokens), outcome=counted(refusals),
               held=set(refusals) <= {400, 403} and different)  # fmt: skip


def messages(bench: Bench) -> Iterator[Row]:
    """Send messages that are too long, on a page that was joined: each way, all pages at once."""
    big = b"x" * BIG
    half = b"x" * 500_000
    ways: dict[str, Callable[[], Iterator[bytes]]] = {
        "16 MB text": lambda: iter([wire.frame(big)]),
        "16 MB binary": lambda: iter([wire.frame(big, wire.BINARY)]),
        "16 MB in pieces of 0.5 MB": lambda: (
            wire.frame(half, wire.TEXT if number == 0 else 0, last=number == 31) for number in range(32)
        ),
        "length of 2^62": lambda: iter([wire.frame(b"x" * 100, length=1 << 62)]),
        "a billion buffers": lambda: itertools.chain(
            wire.message({}, buffers=10**9),
            itertools.chain.from_iterable(
                (wire.frame(b'{"id": "a"}'), wire.frame(half, wire.BINARY)) for _ in range(400)
            ),
        ),
        "a billion empty buffers": lambda: itertools.chain(
            wire.message({}, buffers=10**9),
            itertools.repeat(wire.frame(b'{"id": "a"}') + wire.frame(b"", wire.BINARY), 200_000),
        ),
        "a million brackets": lambda: iter([*wire.message({})[:2], wire.frame(b"[" * 1_000_000)]),
        "not a message": lambda: iter([wire.frame(b"[]"), wire.frame(b"3"), wire.frame(b'"x"')]),
    }
    for name, way in ways.items():
        with ThreadPoolExecutor(4) as pool:
            closed = list(pool.map(lambda _, way=way: send_all(bench.port, way()), range(4)))
        yield Row(attack=f"message: {name}", tries=4, outcome=f"{sum(closed)} closed", held=all(closed))
        bench.until_empty(30)


def send_all(port: int, frames: Iterator[bytes]) -> bool:
    """Send frames on a page of its own; say whether the server hung up."""
    answer = wire.ask(port, f"/{NAME}")
    with wire.joined(port, NAME, answer.token) as connection:
        try:
            for one in frames:
                connection.sendall(one)
        except ConnectionError:
            return True
        connection.settimeout(15)
        return wire.until_closed(connection)


def big_requests(bench: Bench) -> Row:
    """Send bodies and headers of megabytes."""
    body = b"x" * BIG
    chunked = b"".join(b"f4240\r\n" + b"x" * 1_000_000 + b"\r\n" for _ in range(16))
    paths = ("/", f"/{NAME}", "/nowhere")
    answers = [wire.ask(bench.port, p, f"Content-Length: {BIG}", method="POST", body=body) for p in paths]
    answers += [wire.ask(bench.port, p, "Transfer-Encoding: chunked", method="POST", body=chunked) for p in paths]
    answers += [wire.ask(bench.port, p, "Content-Length: " + "9" * 400, method="POST") for p in paths]
    answers += [wire.ask(bench.port, p, "X: " + "x" * BIG) for p in paths]
    answers += [wire.ask(bench.port, p, *(f"X{n}: y" for n in range(100_000))) for p in paths]
    answers += [wire.ask(bench.port, f"{p}?theme=" + "x" * BIG) for p in paths]
    statuses = [one.status for one in answers]
    return Row(attack="bodies and headers of 16 MB", tries=len(answers), outcome=counted(statuses),
               held=all(status in (0, 400, 405, 413, 431) for status in statuses) and bench.pages() == 0)  # fmt: skip


def slow_senders(bench: Bench, count: int, patience_s: float) -> Row:
    """Keep connections busy with a header that never ends, or with nothing; ask honestly meanwhile."""
    with ExitStack() as kept:
        slow = [kept.enter_context(wire.connect(bench.port)) for _ in range(count)]
        meanwhile: list[float] = []
        begun = time.monotonic()
        for second in range(int(patience_s) + 5):
            for number, connection in enumerate(slow):
                with contextlib.suppress(OSError):
                    connection.sendall(b"GET / HTTP/1.1\r\nX: "[second : second + 1] if number % 2 else b"")
            meanwhile.append(answer_s(bench.port, "/"))
            time.sleep(max(0.0, begun + second + 1 - time.monotonic()))
        closed = 0
        for connection in slow:
            connection.settimeout(0.1)
            closed += wire.until_closed(connection)
    return Row(attack=f"{count} connections that send slowly or nothing", tries=count,
               outcome=f"{closed} closed; honest page meanwhile {1e3 * max(meanwhile):.0f} ms at most",
               held=closed == count and max(meanwhile) < 5)  # fmt: skip


def slow_readers(bench: Bench, count: int) -> Row:
    """Ask for a large file and read none of it; ask honestly meanwhile."""
    with ExitStack() as kept:
        for _ in range(count):
            connection = kept.enter_context(socket.socket())
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            connection.connect(("127.0.0.1", bench.port))
            with contextlib.suppress(OSError):
                connection.sendall(wire.request(bench.port, "/static/js/bokeh.min.js"))
        # The first one stands in line behind all that were asked before.
        first, *meanwhile = (answer_s(bench.port, "/") for _ in range(6))
    return Row(attack=f"{count} connections that read nothing", tries=count,
               outcome=f"honest page after {first:.1f} s, then {1e3 * max(meanwhile):.0f} ms at most",
               held=first < 60 and max(meanwhile) < 5)  # fmt: skip


def deaf_page(bench: Bench) -> Row:
    """Join a page, ask for its whole document again and again, and read nothing."""
    answer, before = wire.ask(bench.port, f"/{NAME}"), bench.bytes_now()
    with wire.joined(bench.port, NAME, answer.token) as connection:
        connection.settimeout(1)
        orders = b"".join(wire.message({}, kind="PULL-DOC-REQ"))
        sent, begun = 0, time.monotonic()
        with contextlib.suppress(OSError):
            while sent < 5000 and time.monotonic() - begun < 30:
                connection.sendall(orders)
                sent += 1
        grown = bench.bytes_now() - before
        meanwhile = answer_s(bench.port, f"/{NAME}")
    return Row(attack="a page that asks 5000 times and reads nothing", tries=sent,
               held=grown < 2e8 and meanwhile < 10,
               outcome=f"grown by {grown / 1e6:.0f} MB; another page meanwhile {1e3 * meanwhile:.0f} ms")  # fmt: skip


def answer_s(port: int, path: str) -> float:
    """Seconds until an honest request is answered."""
    begun = time.monotonic()
    answer = wire.ask(port, path)
    return time.monotonic() - begun if answer.status == 200 else float("inf")


def honest_s(bench: Bench) -> tuple[float, float]:
    """Seconds of an honest page: until it's answered, median of five, and until a browser has drawn it."""
    answered = statistics.median(answer_s(bench.port, f"/{NAME}") for _ in range(5))
    drawn = float("nan")
    if CHROMIUM is not None:
        from tests.viewers.bench.serving import browsing, open_page

        with browsing() as page:
            begun = time.monotonic()
            open_page(page, f"http://127.0.0.1:{bench.port}/{NAME}")
            drawn = time.monotonic() - begun
            assert page.complaints == [], page.complaints
    bench.until_empty(30)
    return answered, drawn


def attacks(bench: Bench, count: int) -> Iterator[Row]:
    """Make them all."""
    from chladni.viewers.bench.guard import MOST_PAGES, MOST_UNJOINED, UNUSED_MS
    from chladni.viewers.bench.server import PATIENCE_S

    yield foreign_origins(bench)
    yield foreign_hosts(bench)
    yield embedding(bench)
    if CHROMIUM is not None:
        yield from hostile_pages(bench)
    bench.until_empty(30)
    yield false_tokens(bench)
    yield many_pages(bench, count, MOST_UNJOINED, UNUSED_MS / 1000)
    yield many_joined(bench, 2 * MOST_PAGES, MOST_PAGES)
    yield from messages(bench)
    yield big_requests(bench)
    yield slow_senders(bench, count, PATIENCE_S)
    yield slow_readers(bench, count)
    yield deaf_page(bench)


def tell(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> int:
    """Attack, print the table, give the exit code."""
    parser = argparse.ArgumentParser(description="Attack the bench.")
    parser.add_argument("--count", type=int, default=500, help="pages and connections at once")
    count = parser.parse_args().count
    bench = Bench()
    failures = 0
    before, idle = honest_s(bench), bench.bytes_now()
    tell("| attack | tries | outcome | s | server MB | |\n| --- | --- | --- | --- | --- | --- |")
    begun = time.monotonic()
    for row in attacks(bench, count):
        failures += not row.held
        seconds, megabytes = f"{time.monotonic() - begun:.0f}", f"{bench.bytes_now() / 1e6:.0f}"
        verdict = "held" if row.held else "GOT THROUGH"
        tell(f"| {' | '.join([row.attack, str(row.tries), row.outcome, seconds, megabytes, verdict])} |")
    after = honest_s(bench)
    megabytes = [f"{size / 1e6:.0f} MB" for size in (idle, bench.peak_bytes, bench.bytes_now())]
    tell("server: {} before, {} at most, {} after".format(*megabytes))
    tell(f"an honest page, answered in {before[0]:.2f} s before and {after[0]:.2f} s after")
    tell(f"an honest page, drawn in {before[1]:.1f} s before and {after[1]:.1f} s after")
    failures += bench.peak_bytes > MOST_BYTES or after[0] > 2 * before[0] + 0.5
    bench.end()
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
