"""One large log by many workers: what a part costs beside the whole, and that sums put together are the whole's.

``python benchmarks/bench_study_parts.py --parts 2 4 8``. Processor seconds of each part, and of the worker
that puts the sums together. The longest part and that worker, one after another, are what many workers take. Exit
code 1 when a number of the table differs from that of one worker by more than 1e-12.
"""

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from study_logs import write_one

from chladni.apps.study.parts import PartTask, Sums, sum_part
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


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--channels", type=int, default=6)
    parser.add_argument("--layout", choices=["batches", "messages"], default="batches")
    parser.add_argument("--parts", type=int, nargs="+", default=[2, 4, 8])
    given = parser.parse_args()
    raise SystemExit(not main(given.minutes, given.channels, given.layout, given.parts))
