"""One large log by many workers: what a part costs beside the whole, and that sums put together are the whole's.

``python benchmarks/bench_study_parts.py --parts 2 4 8``. Processor seconds of each part, and of the worker
that puts the sums together. The longest part and that worker, one after another, are what many workers take.

``python benchmarks/bench_study_parts.py --whole --minutes 180 --channels 12``. A log beyond a gigabyte through the
command `chladni study`, which shares it among two workers by itself, beside `chladni psd`, `frf` and `levels`: memory
of each program, and the largest difference of all numbers of the documents.

Exit code 1 when a number differs by more than 1e-12 from that of one worker, or of the command.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from study_logs import chladni, watched, write_one

from chladni import results
from chladni.apps.study.parts import LARGE_BYTES, PartTask, Sums, sum_part
from chladni.apps.study.work import Task, work_on
from chladni.io.study.recipe import load_recipe
from chladni.io.study.tables import unpacked

RECIPE = 'format = "chladni.study/1"\n[psd]\n[frf]\nreferences = ["/imu0.x"]\n[levels]\nbands_hz = [[10, 200]]\n'


def seconds(work: Any) -> tuple[Any, float]:
    """Give what work gives, and its processor time."""
    began = time.process_time()
    return work(), time.process_time() - began


def numbers(content: bytes) -> np.ndarray:
    """Give all numbers of the tables of peaks, channels and levels, in order."""
    tables = unpacked(content, source="a worker")
    rows = [row for name in ("peaks", "channels", "levels") for row in tables[name].to_pylist()]
    return np.array([value for row in rows for value in row.values() if isinstance(value, float)])


def main(minutes: float, channels: int, layout: str, counts: list[int]) -> bool:
    """Measure; false when numbers differ."""
    with tempfile.TemporaryDirectory(prefix="bench-parts-") as name:
        log, recipe = Path(name) / "long.mcap", Path(name) / "recipe.toml"
        write_one(log, seed=1, seconds=60 * minutes, channels=channels, layout=layout)
        recipe.write_text(RECIPE)
        text = load_recipe(recipe).to_json()
        whole, alone_s = seconds(lambda: work_on(text, [Task(str(log))]))
        expected = numbers(whole)
        print(f"{layout}, {channels} channels x 1 kHz x {minutes:g} min, {log.stat().st_size / 2**20:.0f} MB")
        print(f"one worker: {alone_s:.1f} s of processor\n")
        print("| parts | longest part [s] | sums together [s] | one over both | all over one | largest difference |")
        print("| --- | --- | --- | --- | --- | --- |")
        sound = True
        for count in counts:
            done = [seconds(lambda n=n, k=count: sum_part(text, [PartTask(str(log), n, k)])) for n in range(count)]
            sums = [Sums.of(content) for content, _ in done]
            assert not any(one.why_whole for one in sums), sums[0].why_whole
            task = Task(str(log), sums=tuple(one.content for one in sums), seen=sums[0].seen)
            rows, last_s = seconds(lambda task=task: work_on(text, [task]))
            longest_s, total_s = max(took for _, took in done), sum(took for _, took in done) + last_s
            found = numbers(rows)
            apart = np.abs(found - expected) / np.maximum(np.abs(expected), 1e-3)
            sound &= bool(apart.max() < 1e-12)
            print(
                f"| {count} | {longest_s:.1f} | {last_s:.1f} | {alone_s / (longest_s + last_s):.2f} "
                f"| {total_s / alone_s:.2f} | {apart.max():.1e} |",
                flush=True,
            )
        return sound


def apart(one: Any, other: Any) -> float:
    """Give the largest relative difference of two documents; infinite where more than numbers differs."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        if {"mean", "rms"} <= one.keys():
            # What a band passes has no mean but rounding: the RMS is the measure.
            one, other = ({**each, "mean": each["mean"] + each["rms"]} for each in (one, other))
        return max((apart(one[key], other[key]) for key in one), default=0.0)
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        numbers = all(isinstance(each, float) for each in (*one, *other))
        # Of a curve the largest value is the measure: a line that is nearly nothing has the rounding of the others.
        scale = max(map(abs, one), default=0.0) if numbers else 0.0
        if numbers and scale:
            return max(abs(a - b) for a, b in zip(one, other, strict=True)) / scale
        return max((apart(a, b) for a, b in zip(one, other, strict=True)), default=0.0)
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) / max(abs(one), abs(other), 1e-300)
    return 0.0 if one == other else np.inf


def through_commands(minutes: float, channels: int, layout: str) -> bool:
    """Compare the study of a log that is shared with the single commands; false when numbers differ."""
    with tempfile.TemporaryDirectory(prefix="bench-parts-") as name:
        folder = Path(name)
        log, recipe, out = folder / "long.mcap", folder / "recipe.toml", folder / "out"
        making = [sys.executable, "-c", MAKE, Path(__file__).parent, log, 60 * minutes, channels, layout]
        subprocess.run(list(map(str, making)), check=True)
        recipe.write_text(RECIPE.replace("\n", "\ndocuments = true\n", 1))
        assert log.stat().st_size > LARGE_BYTES, "a smaller log isn't shared; give more minutes or channels"
        words = {"psd": (), "frf": ("--reference", "/imu0.x"), "levels": ("--band", "10-200")}
        print(f"{layout}, {channels} channels x 1 kHz x {minutes:g} min, {log.stat().st_size / 2**20:.0f} MB\n")
        print("| command | seconds | processor [s] | memory of each program [MB] | largest difference |")
        print("| --- | --- | --- | --- | --- |")
        row("study", ("study", recipe, log, "--out", out, "--workers", 2))
        rows = results(out).query("select step, document from documents").to_pylist()
        told = {one["step"]: json.loads(one["document"]) for one in rows}
        sound = True
        for step, options in words.items():
            document = folder / f"{step}.json"
            largest = row(step, (step, log, *options, "--json", document), lambda d=document, s=step: apart(
                json.loads(d.read_text()), told[s]))  # fmt: skip
            sound &= largest < 1e-12
        return sound


def row(name: str, words: tuple[object, ...], difference: Callable[[], float] = float) -> float:
    """Run a command and print what it took."""
    began_s = time.perf_counter()
    with watched(chladni(*words)) as (process, usage):
        pass
    assert process.returncode == 0, process.returncode
    took_s, largest = time.perf_counter() - began_s, difference()
    memory = ", ".join(f"{one:.0f}" for one in sorted(usage.memory_mb.values(), reverse=True) if one > 50)
    print(f"| {name} | {took_s:.0f} | {sum(usage.cpu_s.values()):.0f} | {memory} | {largest:.1e} |", flush=True)
    return largest


# In a program of its own: the samples of the log are in no memory that is told.
MAKE = """
import sys
from pathlib import Path
sys.path.append(sys.argv[1])
from study_logs import write_one
write_one(Path(sys.argv[2]), seed=1, seconds=float(sys.argv[3]), channels=int(sys.argv[4]), layout=sys.argv[5])
"""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--channels", type=int, default=6)
    parser.add_argument("--layout", choices=["batches", "messages"], default="batches")
    parser.add_argument("--parts", type=int, nargs="+", default=[2, 4, 8])
    parser.add_argument("--whole", action="store_true", help="the command itself, on a log beyond a gigabyte")
    given = parser.parse_args()
    if given.whole:
        raise SystemExit(not through_commands(given.minutes, given.channels, given.layout))
    raise SystemExit(not main(given.minutes, given.channels, given.layout, given.parts))
