"""Runs every command where it can't write: ``python tests/fuzz/full_disk.py --seed 1``.

Disks that fill up at once or at a random byte, folders that can't be written to, no HOME, no TMPDIR. What is checked:

1. Where the output has no room or no leave, the command says so in one line and exits with 2.
2. Where only HOME, TMPDIR or the current folder is missing or read-only, it does its work all the same.
3. Whatever happened, no file under its own name is half, no part of one is left, and no traceback is shown.

A full disk is a small one made for the purpose (tmpfs) when root may mount one; besides, files are limited in size.
Root, who may write anywhere, gives that power up (setpriv) before folders that can't be written to.

Prints a table; exits with 1 when anything was broken.
"""

import argparse
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from kills import CASES, COMMANDS, Command, half, make_inputs

UNUSABLE = 2
#: What a small disk is made of, and what takes the last of it: a disk without any would have no bound.
PAGE, FILLER = 4096, "filler"
IS_ROOT = os.geteuid() == 0
#: Root without the capabilities that let it pass by the rights of files.
PLAIN = ("setpriv", "--inh-caps=-all", "--bounding-set=-all")

MORE = (
    Command(name="compare", words=["compare", "{in}/one.mcap", "{in}/long.mcap", "--json", "{out}/compare.json",
                                   "--figures", "{out}"]),
    Command(name="influence", words=["influence", "{in}/one.toml", "--json", "{out}/influence.json"]),
    Command(name="blind score", words=["blind", "score", "{out}", "--json", "{out}/told.json"], is_campaign=True),
    Command(name="demo", words=["demo", "--out", "{out}", "--no-open"]),
)  # fmt: skip


@dataclass(slots=True)
class Setting:
    """What a command meets."""

    environment: dict[str, str | None] = field(default_factory=dict)
    folder: Path | None = None
    file_bytes: int | None = None
    is_plain: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What a command left."""

    code: int
    told: str


@dataclass(slots=True, kw_only=True)
class Stand:
    """One command, what it reads, and what it writes where it can."""

    command: Command
    inputs: Path
    home: Path
    rng: random.Random

    @property
    def out(self) -> Path:
        """Where it writes."""
        return self.home / "out"

    @property
    def reference(self) -> Path:
        """What it writes when all is well."""
        return self.home / "reference"

    def fresh(self) -> None:
        """Give an output folder with what the command needs there."""
        self.out.mkdir(exist_ok=True)
        for path in self.out.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        if self.command.name in ("blind run", "blind score"):
            shutil.copytree(self.inputs / "campaign", self.out, dirs_exist_ok=True)
        if self.command.name == "blind score":
            shutil.copytree(self.inputs / "answers", self.out / "results")

    def run(self, setting: Setting) -> Run:
        """Run the command."""
        words = [word.format(**{"in": self.inputs, "out": self.out}) for word in self.command.words]
        environment = {**os.environ, **setting.environment}
        plain = PLAIN if setting.is_plain and IS_ROOT else ()
        done = subprocess.run(
            [*plain, sys.executable, "-m", "chladni", *words],
            env={name: value for name, value in environment.items() if value is not None},
            cwd=setting.folder,
            capture_output=True,
            text=True,
            check=False,
            preexec_fn=None if setting.file_bytes is None else _limit(setting.file_bytes),
        )
        return Run(code=done.returncode, told=done.stderr)

    def mistakes(self, run: Run, *, may_succeed: bool, must_succeed: bool) -> list[str]:
        """Tell which rules a run broke."""
        wrong = []
        lines = [line for line in run.told.splitlines() if line.startswith("chladni: ")]
        if run.code == UNUSABLE and not must_succeed:
            if len(lines) != 1 or run.told.count("\n") != 1:
                wrong.append(f"told {run.told!r:.300}")
        elif run.code != 0 or not (may_succeed or must_succeed):
            wrong.append(f"code {run.code}: {run.told[-300:]!r}")
        files = [path for path in self.out.rglob("*") if path.is_file() and path.name != FILLER]
        wrong += [f"{path.name} stays" for path in files if path.name.startswith(".")]
        wrong += [f"{path.name} is half" for path in files if not path.name.startswith(".") and self._is_half(path)]
        return wrong

    def _is_half(self, path: Path) -> bool:
        whole = self.reference / path.relative_to(self.out)
        return half(path, whole if whole.is_file() else None)

    def bytes_written(self) -> int:
        """Bytes that the command writes when all is well."""
        return sum(path.stat().st_size for path in self.reference.rglob("*") if path.is_file())


def _limit(file_bytes: int) -> Callable[[], None]:
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, file_bytes))


# ---------------------------------------------------------------- settings


@contextmanager
def small_disk(folder: Path, size_bytes: int) -> Iterator[bool]:
    """Mount a disk of a size over a folder; False when that can't be done."""
    options = f"size={size_bytes},mode=777"
    mounted = IS_ROOT and not subprocess.run(
        ["mount", "-t", "tmpfs", "-o", options, "none", folder], check=False, capture_output=True
    ).returncode  # fmt: skip
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", folder], check=True)


def full_disk(stand: Stand, share: float) -> list[str]:
    """A disk on which that share of what is written has room."""
    before = sum(-(-path.stat().st_size // PAGE) * PAGE for path in stand.out.rglob("*") if path.is_file())
    room = int(share * (stand.bytes_written() - before)) // PAGE * PAGE
    with small_disk(stand.out, before + room + PAGE) as mounted:
        if not mounted or (share and not room):
            return []
        try:
            stand.fresh()
        except OSError:
            # Not even what the command reads there has room.
            return []
        (stand.out / FILLER).write_bytes(bytes(PAGE))
        return stand.mistakes(stand.run(Setting()), may_succeed=False, must_succeed=False)


def small_files(stand: Stand, share: float) -> list[str]:
    """Files that can't grow beyond a share of the largest; a command whose files are smaller may succeed."""
    largest = max((path.stat().st_size for path in stand.reference.rglob("*") if path.is_file()), default=1)
    run = stand.run(Setting(file_bytes=int(share * largest)))
    return stand.mistakes(run, may_succeed=share > 0, must_succeed=False)


def read_only(stand: Stand) -> list[str]:
    """A folder that may be read only."""
    paths = [stand.out, *(path for path in stand.out.rglob("*") if path.is_dir())]
    for path in paths:
        path.chmod(0o555)
    try:
        run = stand.run(Setting(is_plain=True, environment={"HOME": None}))
    finally:
        for path in paths:
            path.chmod(0o755)
    return stand.mistakes(run, may_succeed=False, must_succeed=False)


def without(stand: Stand, **environment: str | None) -> list[str]:
    """Variables that are missing, or name no folder; the current folder is read-only."""
    for path in [stand.out, *stand.out.rglob("*")]:
        path.chmod(0o777 if path.is_dir() else 0o666)
    run = stand.run(Setting(is_plain=True, environment=environment, folder=stand.home / "closed"))
    return stand.mistakes(run, may_succeed=True, must_succeed=True)


SETTINGS: dict[str, Callable[[Stand], list[str]]] = {
    "disk full": lambda stand: full_disk(stand, 0.0),
    "fills up": lambda stand: full_disk(stand, stand.rng.uniform(0.05, 0.9)),
    "no file": lambda stand: small_files(stand, 0.0),
    "small files": lambda stand: small_files(stand, stand.rng.uniform(0.05, 0.9)),
    "read-only": read_only,
    "no HOME": lambda stand: without(stand, HOME=None, XDG_CACHE_HOME=None, XDG_CONFIG_HOME=None),
    "HOME closed": lambda stand: without(stand, HOME=str(stand.home / "closed")),
    "no TMPDIR": lambda stand: without(stand, HOME="/nonexistent", TMPDIR="/nonexistent"),
}


# ---------------------------------------------------------------- the table


def stands(folder: Path, only: Sequence[str] | None, seed: int) -> Iterator[Stand]:
    """Run each command once where it can write, and give what it takes to run it elsewhere."""
    inputs = folder / "inputs"
    inputs.mkdir()
    make_inputs(inputs, dict(os.environ))
    shutil.copytree(inputs / "campaign", folder / "answered")
    chosen = [one for one in (*COMMANDS, *MORE) if not one.serves and (not only or one.name in only)]
    if any(one.name == "blind score" for one in chosen):
        subprocess.run([sys.executable, "-m", "chladni", "blind", "run", folder / "answered"], check=True,
                       capture_output=True)  # fmt: skip
        shutil.copytree(folder / "answered" / "results", inputs / "answers")
    for command in chosen:
        home = folder / command.name.replace(" ", "")
        (home / "closed").mkdir(parents=True)
        (home / "closed").chmod(0o555)
        rng = random.Random(f"{seed} {command.name}")  # noqa: S311  # sizes need no cryptography
        stand = Stand(command=command, inputs=inputs, home=home, rng=rng)
        stand.fresh()
        run = stand.run(Setting())
        if run.code:
            raise AssertionError(f"{command.name}: {run.code}: {run.told}")
        shutil.copytree(stand.out, stand.reference)
        yield stand


def main() -> int:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(description="Run commands where they can't write.")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="*", help="names of commands")
    parser.add_argument("--settings", nargs="*", choices=[*SETTINGS], default=[*SETTINGS])
    arguments = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="full-disk-"))
    broken: list[str] = []
    runs = 0
    sys.stdout.write(f"{'':>12}  {'  '.join(arguments.settings)}\n")
    for stand in stands(folder, arguments.only, arguments.seed):
        cells = []
        for name in arguments.settings:
            stand.fresh()
            mistakes = SETTINGS[name](stand)
            runs += 1
            cells.append(("broken" if mistakes else "ok").rjust(len(name)))
            broken += [f"{stand.command.name}, {name}: {mistake}" for mistake in mistakes]
        sys.stdout.write(f"{stand.command.name:>12}  {'  '.join(cells)}\n")
        sys.stdout.flush()
    sys.stdout.write(f"{runs} runs, seed {arguments.seed}, {CASES} cases a campaign: {len(broken)} rules broken\n")
    sys.stdout.writelines(f"{problem}\n" for problem in broken)
    shutil.rmtree(folder)
    return bool(broken)


if __name__ == "__main__":
    sys.exit(main())
