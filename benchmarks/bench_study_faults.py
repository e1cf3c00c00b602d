"""Studies with a random fault each: cut log, ended worker, full disk, dead store; nothing lost in silence, no hang.

``python benchmarks/bench_study_faults.py --runs 100``. What is checked of each run:

1. It ends within the time allowed.
2. Each log has its rows, or a row of failures with the reason; or the run ends with one line that says why.
3. Of a log that was cut, fewer samples come with a failure or a finding.
4. Begun again without the fault, it ends with the tables of a study that met none.

Full disks are small ones made for the purpose (tmpfs), which takes root. Exit code 1 when anything was broken.
"""

import argparse
import os
import random
import shutil
import tempfile
import threading
import time
from collections import Counter
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from small_disk import small_disk
from study_logs import SHORT, tables, write_logs

import chladni
from chladni.apps.study.cluster import cluster
from chladni.apps.study.study import run_study
from chladni.io.study.recipe import load_recipe
from chladni.signals.errors import ChladniError

LOGS = 6
ALLOWED_S = 240.0
FAULTS = ("cut", "worker", "disk", "store")


@dataclass
class Store:
    """A web server of logs that dies on demand."""

    folder: Path
    how: str = "well"
    left: int = 0
    server: ThreadingHTTPServer | None = None
    address: str = ""
    lock: threading.Lock = field(default_factory=threading.Lock)

    def start(self) -> None:
        """Serve the folder on 127.0.0.1."""
        store = self

        class Handler(SimpleHTTPRequestHandler):
            def __init__(self, *words: Any) -> None:
                super().__init__(*words, directory=str(store.folder))

            def do_GET(self) -> None:
                with store.lock:
                    store.left -= 1
                    dead = store.how != "well" and store.left < 0
                if not dead:
                    super().do_GET()
                elif store.how == "stalls":
                    time.sleep(90)
                elif store.how == "refuses":
                    self.send_error(503)
                else:
                    content = (store.folder / Path(self.path).name).read_bytes()
                    self.send_response(200)
                    self.send_header("Content-Length", str(len(content)))
                    self.end_headers()
                    self.wfile.write(content[: len(content) // 2])
                    self.close_connection = True

            def log_message(self, *_: Any) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.address = f"http://127.0.0.1:{self.server.server_address[1]}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()


@dataclass
class Run:
    """One study with a fault."""

    client: Any
    recipe: Any
    logs: list[str]
    out: Path
    error: str = ""

    def go(self) -> bool:
        """Run it; false where it hangs."""

        def work() -> None:
            try:
                run_study(self.recipe, self.logs, self.out, connect=partial(nullcontext, self.client))
                self.error = ""
            except ChladniError as error:
                self.error = str(error)
            except OSError as error:
                self.error = f"the operating system refuses: {error}"

        thread = threading.Thread(target=work, daemon=True)
        thread.start()
        thread.join(ALLOWED_S)
        return not thread.is_alive()

    def silent(self, samples: int) -> list[str]:
        """Logs that lack rows, or samples, without a word."""
        if self.error:
            return []
        found = chladni.results(self.out)
        told = {row["log"] for name in ("failures", "findings") for row in found.table(name).to_pylist()}
        counts: Counter[str] = Counter()
        for row in found.table("channels").to_pylist():
            counts[row["log"]] += row["samples"] or 0
        return [log for log in self.logs if counts[log] < samples and log not in told]


def one(run: Run, fault: str, rng: random.Random, store: Store, samples: int) -> tuple[str, list[str]]:
    """Make a fault, run, heal it, run again; give what was done, and what went wrong."""
    wrong, heal = [], nullcontext
    what = fault
    with small_disk(run.out.parent, rng.randint(4, 120)) if fault == "disk" else nullcontext() as enlarge:
        if fault == "cut":
            victim = Path(rng.choice(run.logs))
            content = victim.read_bytes()
            victim.write_bytes(content[: rng.randrange(len(content))])
            heal = partial(victim.write_bytes, content)
        elif fault == "worker":
            pid = rng.choice(list(run.client.run(os.getpid).values()))
            threading.Timer(rng.uniform(0.0, 1.5), end, (pid,)).start()
        elif fault == "disk":
            heal = enlarge
        elif fault == "store":
            store.how, store.left = (
                rng.choice(("refuses", "refuses", "cuts", "cuts", "cuts", "stalls")),
                rng.randint(0, 12),
            )
            what = f"store {store.how}"
            heal = partial(setattr, store, "how", "well")
        wrong += [] if run.go() else ["hangs"]
        wrong += [f"silent: {log}" for log in run.silent(samples)]
        said = run.error
        heal()
        wrong += [] if run.go() else ["hangs when begun again"]
        wrong += [f"begun again: {run.error}"] if run.error else []
        wrong += [f"silent when begun again: {log}" for log in run.silent(samples)]
        found = tables(run.out)
    return f"{what}{f' ({said[:60]})' if said else ''}", wrong or compared(run, found)


def compared(run: Run, found: dict[str, bytes]) -> list[str]:
    """Say whether the tables differ from those of a study that met no fault."""
    clean = run.out.with_name("clean")
    run_study(run.recipe, run.logs, clean, connect=partial(nullcontext, run.client))
    return [] if tables(clean) == found else ["other tables than without the fault"]


def end(pid: int) -> None:
    """End a worker."""
    try:
        os.kill(pid, 9)
    except ProcessLookupError:
        return


def main(runs: int, seed: int) -> int:
    """Run them all; give the number that were broken."""
    rng, broken = random.Random(seed), 0  # noqa: S311  # no secret
    with tempfile.TemporaryDirectory(prefix="bench-faults-") as name:
        folder = Path(name)
        write_logs(folder / "store", LOGS, seconds=1.0)
        (folder / "recipe.toml").write_text(SHORT)
        store = Store(folder / "store")
        store.start()
        recipe = load_recipe(folder / "recipe.toml")
        counts: Counter[str] = Counter()
        with cluster(workers=2) as client:
            for number in range(runs):
                fault = FAULTS[number % len(FAULTS)]
                place = folder / f"run{number}"
                if fault != "disk":
                    place.mkdir()
                logs = folder / f"logs{number}"
                shutil.copytree(folder / "store", logs)
                named = sorted(str(path) for path in logs.glob("*.mcap"))
                if fault == "store":
                    named = [f"{store.address}/{Path(log).name}" for log in named]
                run = Run(client, recipe, named, place / "out")
                began_s = time.perf_counter()
                done, wrong = one(run, fault, rng, store, 3 * 1000)
                counts[f"{fault} {'broken' if wrong else 'sound'}"] += 1
                broken += bool(wrong)
                took_s = time.perf_counter() - began_s
                print(f"{number} {done}: {'; '.join(wrong) or 'sound'} ({took_s:.1f} s)", flush=True)
                shutil.rmtree(logs)
                shutil.rmtree(place, ignore_errors=True)
    print("\n| fault | runs |\n| --- | --- |")
    for what, count in sorted(counts.items()):
        print(f"| {what} | {count} |")
    return broken


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    raise SystemExit(bool(main(given.runs, given.seed)))
