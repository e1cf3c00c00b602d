"""What strangers' files once did to the commands, each as it should be: ``python benchmarks/bench_hostile.py``.

Every finding of ``../shared/data/hostile`` is given to the command that it broke. A row is right when the exit code
is 0, or 2 with one line on standard error; no control character is printed; it takes 10 s of processor time and
500 MB at most; nothing is left behind; and the answer is what the finding's README asks. An attack on the bench,
kills at random moments and full disks have programs of their own: ``attack_bench.py``, ``kills.py`` and
``full_disk.py`` in ``tests/fuzz``.

Exits with 1 when a row isn't right.
"""

import json
import os
import re
import resource
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from chladni_withheld.folders import seal_case

DATA = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data")) / "hostile"
MOST_SECONDS, MOST_MB = 10.0, 500.0
CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


@dataclass(frozen=True, slots=True)
class Run:
    """A command that has ended; ``folder`` is where it ran."""

    code: int
    out: str
    err: str
    seconds: float
    megabytes: float
    folder: Path


@dataclass(frozen=True, slots=True)
class Row:
    """A finding: the command, and the question whether its answer is right."""

    finding: str
    command: str
    right: Callable[[Run], bool]
    prepare: Callable[[Path], None] = lambda _folder: None


def run(command: str, folder: Path, prefix: tuple[str, ...] = ()) -> Run:
    """Run a command of chladni in a folder, and measure what it took."""
    words = [word.replace("{data}", str(DATA)) for word in command.split()]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    made = [*prefix, "/usr/bin/env", "time", "-f", "%M", "-o", str(folder / ".memory")]
    program = [*made, sys.executable, "-m", "chladni", *words]
    try:
        ended = subprocess.run(program, cwd=folder, capture_output=True, timeout=120, check=False)
    except subprocess.TimeoutExpired:
        return Run(-1, "", "still running after 120 s", 120.0, 0.0, folder)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    memory = (folder / ".memory").read_text().split()[-1]
    (folder / ".memory").unlink()
    out, err = (text.decode(errors="backslashreplace") for text in (ended.stdout, ended.stderr))
    return Run(ended.returncode, out, err, took, int(memory) / 1024, folder)


# What is asked of an answer


def says(words: str, code: int = 0) -> Callable[[Run], bool]:
    """Ask for the exit code and for words, a regular expression, in what is printed."""
    return lambda ended: ended.code == code and re.search(words, ended.out + ended.err, re.IGNORECASE) is not None


def refuses(words: str) -> Callable[[Run], bool]:
    """Ask for a refusal that holds the words."""
    return says(words, code=2)


def _table(ended: Run) -> list[list[str]]:
    return [line.split(",") for line in (ended.folder / "out.csv").read_text().splitlines()]


def _six_rows(ended: Run) -> bool:
    rows = [row for row in _table(ended) if row[0].replace(".", "").isdigit()]
    return ended.code == 0 and [float(row[1]) for row in rows] == [1.5, 2.5, 3.5, 4.5, 5.5, 6.5]


def _elements(ended: Run) -> bool:
    rows = _table(ended)
    titles = next(row for row in rows if any("b[1].c[0]" in cell for cell in row))
    place = next(number for number, cell in enumerate(titles) if "b[1].c[0]" in cell)
    return ended.code == 0 and rows[1][place : place + 2] == ["100.0", "150.0"]


def _still(kind: Callable[[int], bool], name: str) -> Callable[[Run], bool]:
    return lambda ended: ended.code == 0 and kind((ended.folder / name).stat().st_mode)


def _piped(ended: Run) -> bool:
    got = ended.folder / "got.json"
    for _ in range(50):
        if got.exists() and got.stat().st_size:
            break
        time.sleep(0.1)
    return ended.code == 0 and "channels" in json.loads(got.read_text())


def _reader(folder: Path) -> None:
    os.mkfifo(folder / "p")

    def read() -> None:
        content = (folder / "p").read_bytes()
        (folder / "got.json").write_bytes(content)

    threading.Thread(target=read, daemon=True).start()


def _null(folder: Path) -> None:
    os.mknod(folder / "null", stat.S_IFCHR | 0o666, os.makedev(1, 3))


def _nothing_written(ended: Run) -> bool:
    return ended.code == 2 and not (ended.folder / "o.mcap").exists()


def _campaign(truth: Path) -> Callable[[Path], None]:
    def prepare(folder: Path) -> None:
        (folder / "cases/one").mkdir(parents=True)
        (folder / "results").mkdir()
        for name in ("model.toml", "log.mcap"):
            (folder / "cases/one" / name).write_bytes(b"sealed")
        seal_case(folder, "one", json.loads(truth.read_text()))

    return prepare


def rows() -> Iterator[Row]:
    """All findings that a command shows."""
    log = "{data}/two-channels-one-topic/one.mcap"
    yield Row("array-in-array-mislabelled", "convert {data}/array-in-array-mislabelled/arr.mcap out.csv", _elements)
    for truth in sorted((DATA / "blind-score-json").glob("*.json")):
        yield Row("blind-score-json", "blind score .", refuses("one.json"), _campaign(truth))
    for name in ("bomb20.mcap", "bomb-zstd-500-None.mcap"):
        yield Row("chunk-bomb", f"info {{data}}/chunk-bomb/{name}", says("chunk"))
    for name in ("ff.csv", "ls.csv"):
        yield Row(
            "csv-header-separator-drops-rows",
            f"convert {{data}}/csv-header-separator-drops-rows/{name} out.csv",
            _six_rows,
        )
    yield Row(
        "csv-header-separator-drops-rows", "info {data}/csv-header-separator-drops-rows/stop.csv", refuses("stop.csv")
    )
    yield Row("device-and-pipe-replaced", f"psd {log} --json null", _still(stat.S_ISCHR, "null"), _null)
    yield Row("device-and-pipe-replaced", f"info {log} --json p", _piped, _reader)
    yield Row("device-and-pipe-replaced", f"info {log} --json /dev/stdout", says('"channels"'))
    gap = "{data}/gap-extreme-amplitudes"
    for name in ("1e155.mcap", "1e-200.mcap"):
        yield Row("gap-extreme-amplitudes", f"gap {gap}/m.toml {gap}/{name}", refuses(r"/a\."))
    yield Row("gap-extreme-amplitudes", f"psd {gap}/1e-200.mcap", refuses(r"/a\."))
    for name in ("grid300.mcap", "grid20.mcap"):
        yield Row("grid-inflation", f"psd {{data}}/grid-inflation/{name}", refuses(name))
        yield Row("grid-inflation", f"convert {{data}}/grid-inflation/{name} out.csv", refuses(name))
    yield Row("grid-inflation", "psd {data}/grid-inflation/killed-7-3899.mcap", says("."))
    yield Row("idl-many-dimensions-hang", "info {data}/idl-many-dimensions-hang/idl-dims.mcap", says("."))
    yield Row("idl-superscript", "info {data}/idl-superscript/idl-superscript-size.mcap", says("."))
    yield Row(
        "joint-name-flip-refuses-log",
        "psd {data}/joint-name-flip-refuses-log/flip.mcap",
        says("left out|lost|damage"),
    )
    lazy = "{data}/lazy-channels-false-damage/lazy.mcap"
    yield Row(
        "lazy-channels-false-damage", f"info {lazy}", lambda ended: ended.code == 0 and "contradicts" not in ended.out
    )
    yield Row("mat-ragged-cell", "convert {data}/mat-ragged-cell/ragged.mat o.mcap", refuses("ragged.mat"))
    damaged = "{data}/one-damaged-cdr-header-refuses-log/plcdr.mcap"
    yield Row("one-damaged-cdr-header-refuses-log", f"psd {damaged}", says("left out|lost|damage"))
    direction = "{data}/setup-direction-overflow"
    yield Row(
        "setup-direction-overflow",
        f"info {direction}/a.mcap --setup {direction}/s.toml",
        lambda ended: ended.code in (0, 2),
    )
    model = "{data}/simulate-writes-nan/m.toml"
    yield Row("simulate-writes-nan", f"simulate {model} --out o.mcap --seconds 0.05 --rate 200", _nothing_written)
    yield Row(
        "small-defects",
        f"convert {log} loop.csv",
        refuses("loop.csv"),
        lambda at: (at / "loop.csv").symlink_to("loop.csv"),
    )
    yield Row("small-defects", f"convert {log} {'n' * 300}.csv", refuses("nnn"))
    yield Row(
        "small-defects",
        f"convert {log} gone/out.csv",
        refuses("gone"),
        lambda at: (at / "gone").symlink_to("nowhere"),
    )
    yield Row("small-defects", "simulate fifo --out o.mcap", refuses("fifo"), lambda at: os.mkfifo(at / "fifo"))
    yield Row("small-defects", f"info {log} --setup fifo", refuses("fifo"), lambda at: os.mkfifo(at / "fifo"))
    strange = os.fsdecode(b"x\xff.mcap")
    yield Row(
        "small-defects", f"view {strange} --save o.rrd", says("."),
        lambda at: shutil.copy(DATA / "two-channels-one-topic/one.mcap", at / strange),
    )  # fmt: skip
    yield Row("summary-lists-nothing", "info {data}/summary-lists-nothing/nosummary.mcap", says(r"\b2000\b"))
    yield Row("surrogate-json-key", "info {data}/surrogate-json-key/sur-key.mcap", says("."))
    for name in ("esc-joint", "esc-key", "esc-schemaname", "esc-topic", "nul"):
        yield Row("terminal-injection", f"info {{data}}/terminal-injection/{name}.mcap", says("."))
    big, deep, many = "{data}/toml-big-integer", "{data}/toml-deep-dotted-key", "{data}/toml-many-mistakes-hang"
    for folder, name in (
        (big, "s-bigint"),
        (deep, "s-deepdots"),
        (many, "s-1point-many"),
        (many, "s-300unknown"),
        (many, "s-manyunknown"),
    ):
        yield Row(Path(folder).name, f"info {folder}/a.mcap --setup {folder}/{name}.toml", refuses(name))
    for folder, name in ((big, "bigint"), (deep, "m-deepdots")):
        yield Row(Path(folder).name, f"simulate {folder}/{name}.toml --out o.mcap", refuses(name))
    yield Row(
        "toml-big-integer", f"bench pneumatic-motor --variants {big}/v-bigint.toml --no-open", refuses("v-bigint")
    )
    for name in ("one", "two"):
        yield Row("two-channels-one-topic", f"psd {{data}}/two-channels-one-topic/{name}.mcap", says(r"\b80\.00"))
    for name in ("sch-fields", "sch-shared", "json20k"):
        yield Row("wide-schemas-slow", f"info {{data}}/wide-schemas-slow/{name}.mcap", says("."))
        yield Row(
            "wide-schemas-slow", f"psd {{data}}/wide-schemas-slow/{name}.mcap", lambda ended: ended.code in (0, 2)
        )
    yield Row("zip-bombs", "convert {data}/zip-bombs/b3.npz o.mcap", refuses("b3.npz"))
    yield Row("zip-bombs", "convert {data}/zip-bombs/b.mat o.mcap --rate 100", refuses("b.mat"))


def judge(row: Row) -> tuple[Run, list[str]]:
    """Run a row; gives what isn't right about it."""
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        row.prepare(folder)
        before = {path.name for path in folder.iterdir()}
        ended = run(row.command, folder)
        wrong = [] if row.right(ended) else ["the answer isn't what is asked"]
        if ended.code not in (0, 2):
            wrong.append(f"exit code {ended.code}")
        if ended.code == 2 and ended.err.count("\n") != 1:
            wrong.append(f"{ended.err.count(chr(10))} lines on standard error")
        if CONTROLS.search(ended.out + ended.err):
            wrong.append("control characters are printed")
        if ended.seconds > MOST_SECONDS:
            wrong.append("too slow")
        if ended.megabytes > MOST_MB:
            wrong.append("too much memory")
        named = set(row.command.split())
        left = {path.name for path in folder.iterdir()} - before - named - {"got.json"}
        if left or (ended.code and ({path.name for path in folder.iterdir()} - before)):
            wrong.append(f"left behind: {', '.join(sorted(left)) or 'the target'}")
    return ended, wrong


def terminated() -> list[str]:
    """End a conversion by TERM and by HUP: nothing may stay."""
    wrong = []
    log = str(DATA / "wide-schemas-slow/sch-fields.mcap")
    for number in (signal.SIGTERM, signal.SIGHUP):
        for wait in (0.3, 1.0, 2.0):
            with tempfile.TemporaryDirectory() as made:
                program = [sys.executable, "-m", "chladni", "convert", log, "out.csv"]
                started = subprocess.Popen(program, cwd=made, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                time.sleep(wait)
                started.send_signal(number)
                started.wait(timeout=30)
                if left := [path.name for path in Path(made).iterdir()]:
                    wrong.append(f"{signal.Signals(number).name} after {wait} s leaves {', '.join(left)}")
    return wrong


def main() -> int:
    """Judge all findings; 1 when one isn't right."""
    if not DATA.is_dir():
        print(f"there is no {DATA}; set CHLADNI_DATA to the folder of data")
        return 1
    failed, count = 0, 0
    print("| finding | command | code | s | MB | |\n| --- | --- | --- | --- | --- | --- |")
    for row in rows():
        ended, wrong = judge(row)
        count, failed = count + 1, failed + bool(wrong)
        command = row.command.replace("{data}/", "")[:70]
        said = "; ".join(wrong) or "right"
        print(
            f"| {row.finding} | `{command}` | {ended.code} | {ended.seconds:.1f} | {ended.megabytes:.0f} | {said} |"
        )
        if wrong:
            print((ended.err or ended.out)[-600:], file=sys.stderr)
        sys.stdout.flush()
    wrong = terminated()
    print(f"| sigterm-stale-files | `convert`, TERM and HUP | | | | {'; '.join(wrong) or 'right'} |")
    print(f"\n{count + 1 - failed - bool(wrong)} of {count + 1} right")
    return 1 if failed or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
