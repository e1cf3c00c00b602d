"""Ends commands at random moments by TERM, HUP and KILL: ``python tests/fuzz/kills.py --runs 300 --seed 1``.

Every command that writes is run, on a small machine and its log, over files that are there; it's sent a signal
after a random share of the time that it takes. Half of the TERM and HUP go to the whole group of processes, as from
``timeout`` or a terminal. A run that ended before its signal isn't counted: it is done again. What is checked:

1. A file under its own name is whole, or what it was before.
2. After TERM and HUP the command ends, nothing is left beside the files or among temporary files, there is no
   traceback, and the exit code is 143 or 129 (or that of the signal itself, before the program listens to it).
3. Five seconds after the command's end, in whatever way, no process that it started is there.
4. After KILL, what is left lies under a name that no reader takes; the next run of the same command removes it.
5. A campaign that was ended, resumed and ended again comes to the same cases, answers and score as one left alone.

Prints a table; exits with 1 when anything was broken, and keeps those folders.
"""

import argparse
import io
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from chladni.io.mcap.container import McapContainer
from chladni_withheld.folders import seal_case

# Run as a file, it finds the tests' tools all the same.
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.cli.test_simulate import MODEL

ORPHANS_AFTER_S = 5.0
#: A command that hasn't ended so long after a signal hangs.
PATIENCE_S = 60.0
SIGNALS = (signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)
OLD = b"as it was before"
CASES = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A command line; ``{in}`` is the folder of what it reads, ``{out}`` that of what it writes."""

    name: str
    words: Sequence[str]
    #: Told to end by a signal only: it serves until then.
    serves: bool = False
    is_campaign: bool = False


COMMANDS = (
    Command(name="info", words=["info", "{in}/one.mcap", "--json", "{out}/info.json"]),
    Command(name="psd", words=["psd", "{in}/one.mcap", "--json", "{out}/psd.json", "--figures", "{out}", "--report",
                               "{out}/psd.html"]),
    Command(name="frf", words=["frf", "{in}/one.mcap", "--json", "{out}/frf.json", "--report", "{out}/frf.html"]),
    Command(name="modes", words=["modes", "{in}/one.mcap", "--json", "{out}/modes.json", "--uff", "{out}/modes.uff",
                                 "--csv", "{out}/modes.csv", "--save", "{out}/modes.rrd"]),
    Command(name="view --save", words=["view", "{in}/one.mcap", "--save", "{out}/view.rrd", "--json",
                                       "{out}/view.json"]),
    Command(name="view --web", words=["view", "{in}/one.mcap", "--web"], serves=True),
    Command(name="convert csv", words=["convert", "{in}/long.mcap", "{out}/long.csv", "--overwrite"]),
    Command(name="convert uff", words=["convert", "{in}/long.mcap", "{out}/long.uff", "--overwrite", "--write",
                                       "binary=false"]),
    Command(name="simulate", words=["simulate", "{in}/one.toml", "--seconds", "100", "--rate", "500", "--out",
                                    "{out}/new.mcap", "--json", "{out}/new.json"]),
    Command(name="gap", words=["gap", "{in}/one.toml", "{in}/one.mcap", "--json", "{out}/gap.json", "--html",
                               "{out}/gap.html", "--write-model", "{out}/gap.toml"]),
    Command(name="blind make", words=["blind", "make", "{out}", "--count", str(CASES), "--seed", "5", "--kind",
                                      "none=1", "--jobs", "2", "--json", "{out}/make.json"], is_campaign=True),
    Command(name="blind run", words=["blind", "run", "{out}", "--jobs", "2", "--json", "{out}/run.json"],
            is_campaign=True),
)  # fmt: skip


@dataclass(slots=True)
class Tally:
    """What became of one command's runs."""

    seconds: float = 0.0
    runs: Counter[str] = field(default_factory=Counter)
    ended_s: float = 0.0
    left: int = 0
    resumed: int = 0
    broken: list[str] = field(default_factory=list)


# ---------------------------------------------------------------- what is read


def run_whole(words: Sequence[str], environment: dict[str, str]) -> None:
    """Run a command that must succeed."""
    done = subprocess.run([sys.executable, "-m", "chladni", *words], env=environment, capture_output=True, text=True,
                          check=False)  # fmt: skip
    if done.returncode:
        raise AssertionError(f"{' '.join(words)}: {done.returncode}: {done.stderr}")


def damped(damping: float) -> str:
    """Give the model with another damper."""
    return MODEL.replace("damping = 8.0", f"damping = {damping}")


def make_inputs(folder: Path, environment: dict[str, str]) -> None:
    """Make a model, logs of a machine that is damped otherwise, and a sealed campaign of such."""
    (folder / "one.toml").write_text(damped(8.0))
    (folder / "truth.toml").write_text(damped(16.0))
    for name, seconds in (("one", "8"), ("long", "600")):
        run_whole(["simulate", str(folder / "truth.toml"), "--seconds", seconds, "--rate", "250", "--noise", "0.01",
                   "--out", str(folder / f"{name}.mcap")], environment)  # fmt: skip
    campaign = folder / "campaign"
    for number in range(1, CASES + 1):
        case = campaign / "cases" / f"case-{number}"
        case.mkdir(parents=True)
        (case / "model.toml").write_text(damped(8.0 + number))
        shutil.copy(folder / "one.mcap", case / "log.mcap")
        seal_case(campaign, case.name, {"kind": "parameters", "effects": []})


# ---------------------------------------------------------------- whole files


def _mcap(content: bytes, path: Path) -> bool:
    with McapContainer.open(path) as log:
        for _ in log.batches(set(log.channels)):
            pass
        return not log.damage and content.endswith(b"\x89MCAP0\r\n")


def _parsed(parse: Callable[[str], object]) -> Callable[[bytes, Path], bool]:
    def check(content: bytes, _path: Path) -> bool:
        try:
            parse(content.decode())
        except ValueError:
            return False
        return True

    return check


def _ends(*ends: bytes) -> Callable[[bytes, Path], bool]:
    return lambda content, _path: content.rstrip().endswith(ends)


def _rows(content: bytes, _path: Path) -> bool:
    return content.endswith(b"\r\n") and len({line.count(b",") for line in io.BytesIO(content)}) == 1


def _lines(content: bytes, _path: Path) -> bool:
    return all(json.loads(line) for line in content.decode().splitlines(keepends=True) if line.endswith("\n"))


WHOLE: dict[str, Callable[[bytes, Path], bool]] = {
    ".json": _parsed(json.loads),
    ".jsonl": _lines,
    ".toml": _parsed(tomllib.loads),
    ".html": _ends(b"</html>"),
    ".svg": _ends(b"</svg>"),
    ".png": _ends(b"IEND\xaeB`\x82"),
    ".csv": _rows,
    ".uff": _ends(b"-1"),
    ".mcap": _mcap,
}


def half(path: Path, whole: Path | None) -> bool:
    """Whether a file is neither whole nor as it was before; of sizes that never vary, these are compared, too."""
    content = path.read_bytes()
    if content == OLD:
        return False
    if path.suffix in (".csv", ".uff", ".mcap") and whole is not None and len(content) != whole.stat().st_size:
        return True
    if path.suffix == ".rrd":
        # Its footer ends with the same mark in each.
        return whole is not None and content[-4:] != whole.read_bytes()[-4:]
    return not WHOLE[path.suffix](content, path)


# ---------------------------------------------------------------- one run


def family(session: int) -> list[int]:
    """Processes of a session that still run."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                state, _, _, owner = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
            except (OSError, ValueError):
                continue
            if int(owner) == session and state not in "ZX":
                found.append(int(entry.name))
    return found


@dataclass(slots=True, kw_only=True)
class Bench:
    """Folders of one command's runs."""

    command: Command
    inputs: Path
    folder: Path
    rng: random.Random
    tally: Tally = field(default_factory=Tally)

    @property
    def out(self) -> Path:
        """Where it writes."""
        return self.folder / "out"

    @property
    def reference(self) -> Path:
        """What it writes when it's left alone."""
        return self.folder / "reference"

    @property
    def temporary(self) -> Path:
        """Its TMPDIR."""
        return self.folder / "tmp"

    def words(self) -> list[str]:
        """The command line."""
        return [word.format(**{"in": self.inputs, "out": self.out}) for word in self.command.words]

    def fresh(self, *, old: bool) -> None:
        """Empty the folder; with `old`, put something else under each name."""
        shutil.rmtree(self.out, ignore_errors=True)
        if self.command.name == "blind run":
            shutil.copytree(self.inputs / "campaign", self.out)
        else:
            self.out.mkdir()
        if old and not self.command.is_campaign:
            for path in self.reference.rglob("*.*"):
                self.out.joinpath(path.name).write_bytes(OLD)

    def start(self) -> "subprocess.Popen[bytes]":
        """Start the command in a session of its own."""
        self.temporary.mkdir(exist_ok=True)
        with (self.folder / "said").open("wb") as said:
            return subprocess.Popen([sys.executable, "-m", "chladni", *self.words()], stdin=subprocess.DEVNULL,
                                    stdout=said, stderr=said, start_new_session=True,
                                    env={**os.environ, "TMPDIR": str(self.temporary)})  # fmt: skip

    def alone(self) -> None:
        """Run it to its end, twice for the time that it takes when everything is compiled; keep what it wrote."""
        for _ in range(2):
            self.fresh(old=False)
            began = time.monotonic()
            process = self.start()
            if self.command.serves:
                while b"Ctrl-C" not in (self.folder / "said").read_bytes() and process.poll() is None:
                    time.sleep(0.05)
                time.sleep(1.0)
                process.terminate()
            code = process.wait()
            self.tally.seconds = time.monotonic() - began
            if code != (143 if self.command.serves else 0):
                raise AssertionError(f"{self.command.name}: {code}: {(self.folder / 'said').read_text()}")
        shutil.copytree(self.out, self.reference)

    def kill(self, number: signal.Signals) -> bool:
        """Run it, send the signal after a random time, look at what is left; tell whether the signal ended it."""
        if not self.command.is_campaign or not self.out.exists():
            self.fresh(old=self.rng.random() < 0.5)
        began = time.monotonic()
        process = self.start()
        moment_s = self.rng.uniform(0.02, 1.0) * self.tally.seconds
        to_group = number != signal.SIGKILL and self.rng.random() < 0.5
        try:
            process.wait(timeout=moment_s)
        except subprocess.TimeoutExpired:
            (os.killpg if to_group else os.kill)(process.pid, number)
        sent = time.monotonic()
        try:
            code = process.wait(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.breaks(number, moment_s, f"hasn't ended {PATIENCE_S:g} s after the signal")
            os.killpg(process.pid, signal.SIGKILL)
            code = process.wait()
        ended_s = time.monotonic() - sent
        self.tally.ended_s = max(self.tally.ended_s, ended_s)
        if code == 0 and ended_s > ORPHANS_AFTER_S:
            self.breaks(number, moment_s, "does its work to the end all the same")
        if code == 0 and not self.command.is_campaign:
            # How long it takes now; what is left of a campaign takes less than all of it.
            self.tally.seconds = sent - began
        self.tally.runs["done before" if code == 0 else number.name] += 1
        for problem in (*self.orphans(process.pid), *self.what_is_wrong(number, code)):
            self.breaks(number, moment_s, problem)
        if self.command.is_campaign:
            if code == 0:
                self.compare_campaign(number, moment_s)
        elif number == signal.SIGKILL and self.parts():
            self.tally.left += 1
            self.run_again(number, moment_s)
        return code != 0

    def orphans(self, session: int) -> list[str]:
        """Tell which processes are there five seconds after the end."""
        deadline = time.monotonic() + ORPHANS_AFTER_S
        while (there := family(session)) and time.monotonic() < deadline:
            time.sleep(0.05)
        for pid in there:
            os.kill(pid, signal.SIGKILL)
        return [f"{len(there)} processes outlive it"] if there else []

    def parts(self) -> list[Path]:
        """What is left of files under way."""
        return [path for path in self.out.rglob("*") if path.name.startswith(".")]

    def what_is_wrong(self, number: signal.Signals, code: int) -> list[str]:
        """Tell which rules the run broke."""
        said = (self.folder / "said").read_text(errors="replace")
        files = [path for path in self.out.rglob("*") if path.is_file() and path not in self.parts()]
        wrong = [f"{path.name} is half" for path in files if half(path, self._whole(path))]
        if number == signal.SIGKILL:
            return wrong
        if code not in (0, 128 + number, -number):
            wrong.append(f"exit code {code}")
        if "Traceback" in said or "defect" in said:
            wrong.append(f"said {said[-400:]!r}")
        left = [*self.parts(), *(path for path in self.temporary.iterdir() if "numba" not in path.name)]
        return [*wrong, *(f"{path.name} stays" for path in left)]

    def _whole(self, path: Path) -> Path | None:
        whole = self.reference / path.relative_to(self.out)
        return whole if whole.is_file() else None

    def run_again(self, number: signal.Signals, moment_s: float) -> None:
        """The same command must end well, and leave nothing of the killed one."""
        if self.start().wait():
            self.breaks(number, moment_s, "the next run fails")
        for part in self.parts():
            self.breaks(number, moment_s, f"{part.name} survives the next run")

    def compare_campaign(self, number: signal.Signals, moment_s: float) -> None:
        """What a resumed campaign came to, beside the one that was left alone; begin another."""
        self.tally.resumed += 1
        if self.parts():
            self.breaks(number, moment_s, f"{len(self.parts())} parts survive the campaign")
        if told_of(self.out) != told_of(self.reference):
            self.breaks(number, moment_s, "comes to another table")
        else:
            shutil.rmtree(self.out)

    def breaks(self, number: signal.Signals, moment_s: float, problem: str) -> None:
        """Note a broken rule, and keep the folder."""
        kept = self.folder.parent / f"broken-{self.folder.name}-{len(self.tally.broken)}"
        shutil.copytree(self.out, kept, dirs_exist_ok=True)
        shutil.copy(self.folder / "said", kept)
        self.tally.broken.append(
            f"{self.command.name}, {number.name} after {moment_s:.2f} s: {problem} (kept: {kept})"
        )


def told_of(campaign: Path) -> dict[str, object]:
    """Everything of a campaign that must be the same: cases, truths but for their salt, answers, score."""
    told: dict[str, object] = {}
    for path in sorted(campaign.rglob("*.*")):
        name = str(path.relative_to(campaign))
        if path.name in ("model.toml", "log.mcap"):
            told[name] = path.read_bytes()
        elif path.parent.name in ("truth", "results"):
            content = json.loads(path.read_text())
            told[name] = {key: value for key, value in content.items() if key not in ("salt", "seal")}
    if (campaign / "results").is_dir():
        subprocess.run([sys.executable, "-m", "chladni", "blind", "score", str(campaign)], check=True,
                       capture_output=True)  # fmt: skip
        told["score"] = json.loads((campaign / "score.json").read_text())
        (campaign / "score.json").unlink()
    return told


# ---------------------------------------------------------------- the table


def work(bench: Bench, runs: int) -> Bench:
    """Do all runs of one command; a campaign that is under way at the end is resumed to its end."""
    bench.alone()
    for number in range(runs):
        while not bench.kill(SIGNALS[number % len(SIGNALS)]):
            pass
    sys.stderr.write(f"{bench.command.name}: {runs} kills, {len(bench.tally.broken)} broken\n")
    if bench.command.is_campaign and bench.out.exists():
        if bench.start().wait():
            bench.breaks(signal.SIGKILL, 0.0, "can't be resumed")
        else:
            bench.compare_campaign(signal.SIGKILL, 0.0)
    return bench


def table(benches: Sequence[Bench]) -> str:
    """Tell of each command what its runs came to."""
    head = ("command", "alone [s]", *(one.name for one in SIGNALS), "done before", "ended after [s]", "parts left",
            "resumed", "broken")  # fmt: skip
    rows = [head]
    for bench in benches:
        tally, broken = bench.tally, len(bench.tally.broken)
        counts = (tally.runs[one.name] for one in SIGNALS)
        rows.append((bench.command.name, f"{tally.seconds:.1f}", *map(str, counts), str(tally.runs["done before"]),
                     f"{tally.ended_s:.1f}", str(tally.left), str(tally.resumed), str(broken)))  # fmt: skip
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)


def main() -> int:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(description="End commands at random moments and look at what they leave.")
    parser.add_argument("--runs", type=int, default=36, help="kills in all, shared out over the commands")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", help="names of commands")
    parser.add_argument("--side-by-side", type=int, default=1, metavar="N", help="commands at a time")
    parser.add_argument("--keep", type=Path, default=None, help="folder to work in")
    arguments = parser.parse_args()
    # Commands inherit what is ignored, as under nohup.
    for one in SIGNALS[:2]:
        signal.signal(one, signal.SIG_DFL)
    chosen = [one for one in COMMANDS if not arguments.only or one.name in arguments.only]
    folder = Path(arguments.keep or tempfile.mkdtemp(prefix="kills-"))
    inputs = folder / "inputs"
    inputs.mkdir(parents=True)
    make_inputs(inputs, dict(os.environ))
    benches = []
    for place, command in enumerate(chosen):
        runs = arguments.runs // len(chosen) + (place < arguments.runs % len(chosen))
        home = folder / command.name.replace(" ", "")
        home.mkdir()
        rng = random.Random(f"{arguments.seed} {command.name}")  # noqa: S311  # moments need no cryptography
        benches.append((Bench(command=command, inputs=inputs, folder=home, rng=rng), runs))
    with ThreadPoolExecutor(arguments.side_by_side) as pool:
        done = list(pool.map(lambda one: work(*one), benches))
    broken = [problem for bench in done for problem in bench.tally.broken]
    kills = sum(runs for _, runs in benches)
    sys.stdout.write(f"{table(done)}\n{kills} kills, seed {arguments.seed}: {len(broken)} rules broken\n")
    sys.stdout.writelines(f"{problem}\n" for problem in broken)
    if not broken:
        shutil.rmtree(folder)
    return bool(broken)


if __name__ == "__main__":
    sys.exit(main())
