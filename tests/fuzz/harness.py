"""What the fuzzing programs share: inputs made from numbers, a watchdog an input, the table, what is kept.

An input is made from the seed, the format and its number alone, so that one of a hundred thousand can be made again::

    python tests/fuzz/all.py --inputs 100000 --seed 7 --command 500
    python tests/fuzz/all.py --formats csv --seed 7 --only 1234

Inputs are read in worker processes, which are replaced when an input ends them. An input fails when

- reading it ends with anything but a result or a `ChladniError`,
- it takes more than 10 s of processor time, or a minute, or ends the process,
- the process has ever had more than 500 MB in memory,
- anything is written to standard output or standard error: warnings, lines of a library,
- it breaks a rule of its format: a number is read that wasn't recorded, or is lost, without a word.

Through the command the same holds; the exit code is 0 or 2, and 2 comes with one line on standard error. What is
printed holds nothing that a terminal obeys or hides; no file is left over, and JSON is JSON.
"""

import argparse
import contextlib
import faulthandler
import importlib
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import unicodedata
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TextIO

ROOT = Path(__file__).parents[2]
# The package beside these programs is what they fuzz, and the tests' own makers of files are theirs.
sys.path.insert(0, str(ROOT))

from chladni.signals.errors import ChladniError  # noqa: E402

PROCESSOR_SECONDS = 10
"""Processor time of an input: wall time would blame the reader for a busy machine."""
SECONDS = 60
"""An input that waits for something doesn't use the processor."""
MEMORY_BYTES = 500_000_000
ADDRESS_BYTES = 8 << 30
"""What a worker may ask for: more would end the machine rather than the input."""
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"}
RANGE = 2500
"""Inputs of a worker, after which another one begins with fresh memory."""
REFUSED, TOLD, WHOLE = "refused", "told", "whole"


class BrokenRuleError(Exception):
    """A rule of a format is broken: which one, and what was found."""

    def __init__(self, rule: str, found: str) -> None:
        super().__init__(f"{rule}: {found}")
        self.rule = rule


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One input.

    Attributes
    ----------
    files
        Content by name; the first is the one that is read.
    how
        How it was made.
    truth
        What its format has to know to judge what is read of it.
    """

    files: Mapping[str, bytes]
    how: str
    truth: Any = None

    def written(self, folder: Path) -> Path:
        """Write the files and give the path of the first."""
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        return folder / next(iter(self.files))


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """What the programs differ in.

    Attributes
    ----------
    name
        Of the format.
    make
        Makes an input; whatever it draws comes from the generator.
    read
        Reads it and gives `TOLD` or `WHOLE`; raises `ChladniError` where it's refused, `BrokenRuleError` where a
        rule is broken.
    command
        Arguments of a command that reads it.
    """

    name: str
    make: Callable[[random.Random], Case]
    read: Callable[[Path, Case], str]
    command: Callable[[Path, random.Random], Sequence[str]]


def format_of(name: str) -> Format:
    """Give the format of the program ``fuzz_NAME.py``."""
    found: Format = importlib.import_module(f"fuzz_{name}").FORMAT
    return found


def generator(*parts: object) -> random.Random:
    """Give a generator whose numbers depend on the parts alone."""
    return random.Random("/".join(map(str, parts)))  # noqa: S311 - damage needs no cryptography


# ---------------------------------------------------------------- one input, in a worker


def work(name: str, seed: int, first: int, stop: int, folder: Path) -> None:
    """Read the inputs of a range, one line of JSON on standard output for each; a trace where one ends the worker."""
    told = os.fdopen(os.dup(1), "w", buffering=1)
    printed = os.open(folder.with_suffix(".printed"), os.O_RDWR | os.O_CREAT)
    # Libraries in C write past sys.stdout.
    os.dup2(printed, 1)
    os.dup2(printed, 2)
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_BYTES, ADDRESS_BYTES))
    faulthandler.enable(told)
    faulthandler.register(signal.SIGPROF, file=told, chain=True)
    try:
        form = format_of(name)
        for number in range(first, stop):
            case = generated(name, seed, number)
            shutil.rmtree(folder, ignore_errors=True)
            path = case.written(folder)
            began = time.process_time()
            with _watched(told):
                outcome, problem = _read(form, path, case)
            seconds = time.process_time() - began
            problem = problem or _printed(printed)
            peak = _peak()
            if peak > MEMORY_BYTES:
                problem = problem or ("memory", outcome, f"{peak / 1e6:.0f} MB")
            told.write(json.dumps([number, outcome, seconds, peak, case.how, problem]) + "\n")
            if peak > MEMORY_BYTES:
                return
    except BaseException:
        traceback.print_exc(file=told)
        raise


@contextlib.contextmanager
def _watched(told: TextIO) -> Iterator[None]:
    """End the process when it takes too long; its trace goes where the driver reads."""
    faulthandler.dump_traceback_later(SECONDS, exit=True, file=told)
    signal.setitimer(signal.ITIMER_PROF, PROCESSOR_SECONDS)
    try:
        with warnings.catch_warnings():
            # Each of them, though the one before came from the same line; those for developers stay unseen, as usual.
            for kind in (RuntimeWarning, UserWarning, SyntaxWarning, UnicodeWarning, BytesWarning):
                warnings.simplefilter("always", kind)
            yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        faulthandler.cancel_dump_traceback_later()


def _peak() -> int:
    """Give this process' peak in bytes; what the kernel counts for its usage begins with its parent's."""
    status = Path("/proc/self/status")
    if status.exists():
        return int(re.findall(r"VmHWM:\s+(\d+)", status.read_text())[0]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _printed(file: int) -> tuple[str, str, str] | None:
    """Give what was written since last time as a problem."""
    sys.stdout.flush()
    size = os.lseek(file, 0, os.SEEK_END)
    if not size:
        return None
    said = os.pread(file, 2000, 0).decode(errors="replace").strip()
    os.ftruncate(file, 0)
    os.lseek(file, 0, os.SEEK_SET)
    line = next((line for line in said.splitlines() if "Warning: " in line), said[:60])
    return "printed", line.rpartition("chladni/")[2][:100], said


def _read(form: Format, path: Path, case: Case) -> tuple[str, tuple[str, str, str] | None]:
    """Give what became of an input, and what is wrong with that: kind, place and what was found."""
    try:
        return form.read(path, case), None
    except ChladniError:
        return REFUSED, None
    except BrokenRuleError as error:
        return "failed", (error.rule, "", str(error)[:300])
    except (Exception, SystemExit) as error:  # noqa: BLE001 - any crash at all is the finding
        return "failed", (type(error).__name__, _place(error), str(error)[:300])


def _place(error: BaseException) -> str:
    """Give the innermost line of ours that an exception went through."""
    frames = traceback.extract_tb(error.__traceback__)
    ours = [one for one in frames if "/chladni/" in one.filename] or frames
    return f"{ours[-1].filename.rpartition('chladni/')[2]}:{ours[-1].name}"


def unprintable(text: str) -> str:
    """Give the letters of a text that a terminal obeys or hides: controls, directions of writing, separators."""
    return "".join(one for one in text if one != "\n" and unicodedata.category(one) in ("Cc", "Cf", "Cs", "Zl", "Zp"))


# ---------------------------------------------------------------- all inputs


@dataclass(slots=True, kw_only=True)
class Tally:
    """What became of the inputs of one format."""

    outcomes: Counter[str] = field(default_factory=Counter)
    slowest_s: float = 0.0
    peak_bytes: int = 0
    failures: list["Failure"] = field(default_factory=list)

    def add(self, outcome: str, seconds: float, peak_bytes: int) -> None:
        """Count one input."""
        self.outcomes[outcome] += 1
        self.slowest_s = max(self.slowest_s, seconds)
        self.peak_bytes = max(self.peak_bytes, peak_bytes)


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """An input that failed: the kind of failure and its place tell findings apart."""

    name: str
    number: int
    how: str
    kind: str
    place: str
    found: str
    command: bool = False

    @property
    def key(self) -> tuple[str, ...]:
        """Failures of one key are one finding."""
        return (self.name, self.kind, self.place)


def read_range(name: str, seed: int, numbers: range, keep: Path) -> Tally:
    """Read the inputs of a range in workers, a fresh one after each that ended."""
    tally, first = Tally(), numbers.start
    while first < numbers.stop:
        with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
            folder = Path(scratch) / "input"
            arguments = [sys.executable, __file__, name, str(seed), str(first), str(numbers.stop), str(folder)]
            lines = []
            with subprocess.Popen(arguments, stdout=subprocess.PIPE, text=True, env=ENVIRONMENT) as worker:
                for line in worker.stdout or ():
                    if not line.startswith("["):
                        lines.append(line)
                        continue
                    number, outcome, seconds, peak, how, problem = json.loads(line)
                    first = number + 1
                    tally.add(outcome if problem is None else "failed", seconds, peak)
                    if problem is not None:
                        kind, place, found = problem
                        failure = Failure(name=name, number=number, how=how, kind=kind, place=place, found=found)
                        _keep(failure, tally, Path(scratch) / "input", seed, keep)
            if worker.returncode:
                how = generated(name, seed, first).how
                place = next((line.strip() for line in lines if "/chladni/" in line), "no line of ours")
                failure = Failure(
                    name=name, number=first, how=how, kind=f"ended with {worker.returncode}",
                    place=place.rpartition("chladni/")[2], found="".join(lines[:2]).strip(),
                )  # fmt: skip
                tally.add("failed", 0.0, 0)
                _keep(failure, tally, folder, seed, keep)
                first += 1
    return tally


def generated(name: str, seed: int, number: int) -> Case:
    """Make an input; libraries may warn of what it holds."""
    with warnings.catch_warnings(action="ignore"):
        return format_of(name).make(generator(seed, name, number))


def _keep(failure: Failure, tally: Tally, folder: Path, seed: int, keep: Path) -> None:
    """Note a failure, and keep the first input of each kind."""
    if failure.key not in [one.key for one in tally.failures]:
        generated(failure.name, seed, failure.number).written(keep / f"{failure.name}-{seed}-{failure.number}")
    tally.failures.append(failure)


def run_command(name: str, seed: int, number: int, keep: Path) -> Tally:
    """Read one input through the real command."""
    tally = Tally()
    case = generated(name, seed, number)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as scratch:
        folder = Path(scratch) / "input"
        path = case.written(folder)
        words = format_of(name).command(path, generator(seed, name, number, "command"))
        out, errors = Path(scratch) / "out", Path(scratch) / "errors"
        code, seconds, peak = _timed([sys.executable, "-m", "chladni", *words], out, errors)
        problem = _wrong(code, seconds, peak, out.read_bytes(), errors.read_bytes()) or _left(folder, case)
    tally.add("failed" if problem else REFUSED if code == 2 else WHOLE, seconds, peak)
    if problem:
        how = f"{case.how}; chladni {' '.join(words)}".replace(str(folder), "DIR")
        failure = Failure(
            name=name, number=number, how=how, kind=problem[0], place="", found=problem[1], command=True
        )
        _keep(failure, tally, folder, seed, keep)
    return tally


def _timed(arguments: Sequence[str], out: Path, errors: Path) -> tuple[int, float, int]:
    """Run a program and give its exit code, processor time and most memory."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (3 * PROCESSOR_SECONDS, 3 * PROCESSOR_SECONDS))
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_BYTES, ADDRESS_BYTES))

    with out.open("wb") as stdout, errors.open("wb") as stderr:
        process = subprocess.Popen(
            arguments, stdout=stdout, stderr=stderr, stdin=subprocess.DEVNULL, preexec_fn=limit, cwd=out.parent,
            env=ENVIRONMENT,
        )  # fmt: skip
    deadline = time.monotonic() + 2 * SECONDS
    pid, status, usage = os.wait4(process.pid, os.WNOHANG)
    while not pid:
        time.sleep(0.01)
        if time.monotonic() > deadline:
            process.kill()
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024


def _wrong(code: int, seconds: float, peak: int, out: bytes, errors: bytes) -> tuple[str, str] | None:
    """Give which promise of the command is broken, and what was found."""
    said = errors.decode(errors="backslashreplace")
    if code not in (0, 2):
        return f"exit code {code}", said[-300:]
    if code == 2 and (said.count("\n") != 1 or not said.startswith("chladni: ")):
        return "not one line", said[:300]
    if code == 0 and said:
        return "standard error", said[:300]
    if odd := unprintable(said + out.decode(errors="backslashreplace")):
        return "unprintable", repr(odd)[:100]
    if seconds > PROCESSOR_SECONDS:
        return "time", f"{seconds:.1f} s"
    return ("memory", f"{peak / 1e6:.0f} MB") if peak > MEMORY_BYTES else None


def _left(folder: Path, case: Case) -> tuple[str, str] | None:
    """Give what is wrong with the files that a command wrote: one that is left over, or JSON that isn't."""
    for path in folder.rglob("*"):
        if path.name.startswith("."):
            return "a stale file", path.name
        if path.suffix == ".json" and str(path.relative_to(folder)) not in case.files:
            try:
                json.dumps(json.loads(path.read_text()), allow_nan=False)
            except ValueError as error:
                return "no JSON", str(error)
    return None


# ---------------------------------------------------------------- the program


def main(names: Sequence[str]) -> int:
    """Fuzz the formats of these names, or those of them that the command line chooses; 1 when an input failed."""
    parser = argparse.ArgumentParser(description=f"Fuzz: {', '.join(names)}.")
    parser.add_argument("--inputs", type=int, default=1000 * len(names), help="over all formats")
    parser.add_argument("--command", type=int, default=0, help="how many go through the real command beside")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--formats", nargs="+", choices=names, default=names)
    parser.add_argument("--only", type=int, metavar="NUMBER", help="the input of this number, once more")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", type=Path, default=Path(tempfile.gettempdir()) / "fuzz-kept")
    given = parser.parse_args()
    formats, seed, keep = given.formats, given.seed, given.keep
    began = time.monotonic()
    jobs: list[tuple[str, Callable[[], Tally]]] = []
    if given.only is not None:
        once = range(given.only, given.only + 1)
        run = run_command if given.command else read_range
        jobs = [(name, partial(run, name, seed, given.only if given.command else once, keep)) for name in formats]
    else:
        share = -(-given.inputs // len(formats))
        ranges = [range(start, min(start + RANGE, share)) for start in range(0, share, RANGE)]
        jobs = [(name, partial(read_range, name, seed, part, keep)) for part in ranges for name in formats]
        through = [(formats[number % len(formats)], number) for number in range(given.command)]
        jobs += [(f"{name} command", partial(run_command, name, seed, number, keep)) for name, number in through]
    with ThreadPoolExecutor(given.processes) as pool:
        found = list(zip((name for name, _ in jobs), pool.map(lambda job: job[1](), jobs), strict=True))
    sys.stdout.write(report(found, seed, keep))
    sys.stdout.write(f"seed {seed}, {time.monotonic() - began:.0f} s\n")
    return int(any(tally.failures for _, tally in found))


def report(found: Sequence[tuple[str, Tally]], seed: int, keep: Path) -> str:
    """Give the table, and each finding with the line that shows it again."""
    row = "{:<22}{:>8}{:>9}{:>8}{:>8}{:>8}{:>12}{:>11}\n"
    text = row.format("format", "inputs", "refused", "told", "whole", "failed", "slowest [s]", "peak [MB]")
    for name in dict.fromkeys(name for name, _ in found):
        parts = [tally for one, tally in found if one == name]
        sums = sum((one.outcomes for one in parts), Counter[str]())
        counts = [sums[outcome] for outcome in (REFUSED, TOLD, WHOLE, "failed")]
        slowest, peak = max(one.slowest_s for one in parts), max(one.peak_bytes for one in parts)
        text += row.format(name, sums.total(), *counts, f"{slowest:.2f}", f"{peak / 1e6:.0f}")
    failures: dict[tuple[str, ...], list[Failure]] = {}
    for one in (failure for _, tally in found for failure in tally.failures):
        failures.setdefault(one.key, []).append(one)
    for alike in failures.values():
        one = alike[0]
        again = f"python tests/fuzz/all.py --formats {one.name} --seed {seed} --only {one.number}"
        text += (
            f"\n{one.name}: {one.kind} {one.place} ({len(alike)} inputs)\n  {one.how}: {one.found}\n"
            f"  {again}{' --command 1' if one.command else ''}  # {keep / f'{one.name}-{seed}-{one.number}'}\n"
        )
    return text


if __name__ == "__main__":
    # The formats know this module by its name, and its classes with it.
    importlib.import_module("harness").work(
        sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), Path(sys.argv[5])
    )
