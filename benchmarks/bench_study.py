"""Studies of many logs: overhead, memory, speed of two workers, questions, kills, and scaling to 64 workers.

``python benchmarks/bench_study.py overhead``, or ``speed``, ``query``, ``kills``, ``scale``, ``tables``.
Each prints a Markdown table. Overhead is told twice. By the clock, it's the time of two workers less what their logs
took. By processor time, it's that of client, scheduler and workers, less what the logs took; others don't change it.
"""

import argparse
import json
import os
import random
import subprocess
import tempfile
import time
from datetime import date, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from nap import nap
from study_logs import REAL, SHORT, chladni, own_cluster, tables, watched, write_logs

if TYPE_CHECKING:
    from distributed import Client


def study(folder: Path, recipe: str, out: str, *words: object) -> tuple[dict[str, float], float, float, float]:
    """Run a study: its report, seconds by the clock, the client's largest memory in MB, processor time of all."""
    (folder / "recipe.toml").write_text(recipe)
    target = folder / f"{out}.json"
    began_s = time.perf_counter()
    command = chladni(
        "study", folder / "recipe.toml", folder / "logs", "--out", folder / out, "--json", target, *words
    )
    with watched(command) as (process, usage):
        pass
    took_s = time.perf_counter() - began_s
    assert process.returncode == 0, process.returncode
    return json.loads(target.read_text()), took_s, usage.client_mb, sum(usage.cpu_s.values())


def overhead(folder: Path, logs: int) -> None:
    """10 000 one-second logs on two workers: what the engine adds to each."""
    write_logs(folder / "logs", logs, seconds=1.0)
    report, took_s, client_mb, cpu_s = study(folder, SHORT, "out", "--workers", 2)
    assert report["done"] == logs, report
    assert not report["failures"]
    print(
        "| logs | seconds | client [MB] | work a log [ms] | overhead: by the clock [ms] | by processor [ms] | load |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    clock_ms = (2 * took_s - report["seconds"]) / logs * 1e3
    processor_ms = (cpu_s - report["cpu_s"]) / logs * 1e3
    work_ms = report["cpu_s"] / logs * 1e3
    print(
        f"| {logs} | {took_s:.0f} | {client_mb:.0f} | {work_ms:.1f} | {clock_ms:.1f} | {processor_ms:.1f} "
        f"| {os.getloadavg()[0]:.1f} |"
    )
    query(folder / "out")


def query(out: Path) -> None:
    """Time of questions to the table of a study, in one program that has it open."""
    import chladni

    found = chladni.results(out)
    print("\n| question | rows | first [ms] | median of 20 [ms] | its processor time [ms] |")
    print("| --- | --- | --- | --- | --- |")
    for sql in (
        "select status, count(*) as n from logs group by status",
        "select channel, avg(rms) as rms from levels group by channel",
        "select * from peaks where rank = 1 and step = 'psd'",
        "select l.day, count(*) as n from logs l join channels c using (log) group by l.day",
    ):
        took = []
        for _ in range(21):
            began_s, began_cpu = time.perf_counter(), time.process_time()
            answer = found.query(sql)
            took.append((time.perf_counter() - began_s, time.process_time() - began_cpu))
        warm, work = (sorted(one[place] for one in took[1:])[10] * 1e3 for place in (0, 1))
        print(f"| `{sql}` | {answer.num_rows} | {took[0][0] * 1e3:.0f} | {warm:.0f} | {work:.0f} |")


def client_tables(folder: Path, logs: int) -> None:
    """What the client does for each log: its journal, and the tables of days of 500 logs."""
    from chladni.io.study.folder import opened_folder
    from chladni.io.study.tables import packed, tables_of

    def answer(first: int) -> bytes:
        named = [
            {"log": f"/data/log{number:06d}.mcap", "day": date(2026, 1, 1) + timedelta(days=number // 500)}
            for number in range(first, first + 80)
        ]
        each = [{**one, "channel": f"/imu{place}.x", "rms": 1.0} for one in named for place in range(3)]
        peaks = [{**one, "step": "psd", "rank": rank, "frequency_hz": 1.0} for one in each for rank in range(5)]
        peaks = [{key: value for key, value in one.items() if key != "rms"} for one in peaks]
        channels = [{key: value for key, value in one.items() if key != "rms"} for one in each]
        logs = [{**one, "content": "ab" * 32, "status": "done"} for one in named]
        return packed(tables_of({"logs": logs, "levels": each, "channels": channels, "peaks": peaks}))

    answers = [answer(first) for first in range(0, logs, 80)]
    with opened_folder(folder / "out", "a recipe", "{}") as out:
        began_s = time.process_time()
        for place, content in enumerate(answers):
            stamps = {f"/data/log{number:06d}.mcap": "1" for number in range(80 * place, 80 * place + 80)}
            out.take(content, stamps, source="a worker")
        taken_s = time.process_time()
        out.settle()
        settled_s = time.process_time()
    print("| logs | journal a log [ms] | tables a log [ms] |\n| --- | --- | --- |")
    print(f"| {logs} | {(taken_s - began_s) / logs * 1e3:.3f} | {(settled_s - taken_s) / logs * 1e3:.3f} |")


def speed(folder: Path, logs: int, rounds: int) -> None:
    """Real work on one worker and on two, in turn: logs of ten minutes, seconds of work each."""
    write_logs(folder / "logs", logs, seconds=600.0, distinct=logs)
    times: dict[int, list[float]] = {1: [], 2: []}
    print("| workers | seconds | processor of all [s] | of the logs' work [s] |\n| --- | --- | --- | --- |")
    for place in range(rounds):
        for workers in (1, 2):
            report, took_s, _, cpu_s = study(folder, REAL, f"out{place}{workers}", "--workers", workers)
            times[workers].append(took_s)
            print(f"| {workers} | {took_s:.1f} | {cpu_s:.1f} | {report['cpu_s']:.1f} |", flush=True)
    print("\n| logs of 600 s | ratio of the fastest | load |\n| --- | --- | --- |")
    print(f"| {logs} | {min(times[1]) / min(times[2]):.2f} (asked: 1.7) | {os.getloadavg()[0]:.1f} |")


def kills(folder: Path, runs: int, logs: int, seed: int) -> None:
    """End client, worker and scheduler in turn at random moments, begin again, and compare the tables."""
    write_logs(folder / "logs", logs, seconds=20.0, distinct=logs)
    study(folder, REAL, "whole", "--workers", 2)
    expected, rng = tables(folder / "whole"), random.Random(seed)  # noqa: S311  # no secret
    print("| run | ended | after [s] | said | begun again | same tables |\n| --- | --- | --- | --- | --- | --- |")
    wrong = 0
    with own_cluster(18786, 2, folder) as cluster:
        for run in range(runs):
            victim = ("client", "worker", "scheduler")[run % 3]
            out, after_s = folder / f"run{run}", rng.uniform(2.0, 12.0)
            words = ("study", folder / "recipe.toml", folder / "logs", "--out", out, "--scheduler", cluster.address)
            process = subprocess.Popen(chladni(*words), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            time.sleep(after_s)
            {"client": process, "worker": cluster.others[0], "scheduler": cluster.scheduler}[victim].kill()
            time.sleep(1)
            cluster.keep()
            _, said = process.communicate(timeout=400)
            again = 0
            while tables(out) != expected and again < 3:
                again += 1
                subprocess.run(chladni(*words), check=False, timeout=400, capture_output=True)
                cluster.keep()
            same = tables(out) == expected
            wrong += not same
            told = said.decode().strip()[-90:] or f"exit {process.returncode}"
            print(f"| {run} | {victim} | {after_s:.1f} | {told} | {again} | {'yes' if same else 'NO'} |", flush=True)
    print(f"\n{runs - wrong} of {runs} the same")
    raise SystemExit(bool(wrong))


def scale(seconds: float, logs: int, processes: bool) -> None:
    """Sleeping logs on 1 to 64 workers: how much of their time they sleep, and what a batch costs the scheduler.

    The model says that they are busy all the time until the scheduler's core is: with N batches of cost c, for the
    share ``ideal / max(ideal, N c)``. Workers in one process (not ``--processes``) count their own part in c.
    """
    from distributed import Client, LocalCluster

    from chladni.apps.study.cluster import quiet, settings

    print(
        "| workers | batches | a batch [s] | seconds | ideal [s] | busy | by the model | a batch costs [ms] | load |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    options = {"processes": processes, "dashboard_address": "127.0.0.1:0", "scheduler_kwargs": {"dashboard": False}}
    with quiet(), settings():
        for workers in (1, 4, 16, 64):
            with LocalCluster(n_workers=workers, threads_per_worker=1, **options) as local, Client(local) as client:
                client.wait_for_workers(workers)
                for batch_s in (2.0, 0.2):
                    print(row(client, workers, batch_s, seconds, logs * workers), flush=True)


def row(client: "Client", workers: int, batch_s: float, seconds: float, count: int) -> str:
    """Measure one row of `scale`."""
    from chladni.apps.study.engine import Engine

    engine = Engine(client, nap, batch_s=batch_s)
    engine.note_seconds(seconds)
    began_s, began_cpu = time.perf_counter(), time.process_time()
    batches = sum(1 for _ in engine.run([seconds] * count))
    took_s, ideal_s = time.perf_counter() - began_s, count * seconds / workers
    cost_s = (time.process_time() - began_cpu) / batches
    busy, by_model = ideal_s / took_s, ideal_s / max(ideal_s, batches * cost_s)
    return (
        f"| {workers} | {batches} | {batch_s} | {took_s:.1f} | {ideal_s:.1f} | {busy:.0%} | {by_model:.0%} "
        f"| {cost_s * 1e3:.1f} | {os.getloadavg()[0]:.1f} |"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["overhead", "speed", "query", "kills", "scale", "tables"])
    parser.add_argument("--logs", type=int)
    parser.add_argument("--runs", type=int, default=30)
    parser.add_argument("--rounds", type=int, default=3, help="of speed")
    parser.add_argument("--processes", action="store_true", help="of scale: each worker is a program of its own")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, help="of query: the folder of a study")
    given = parser.parse_args()
    if given.what == "query" and given.out is None:
        parser.error("query asks a study that is there: give its folder by --out")
    with tempfile.TemporaryDirectory(prefix="bench-study-") as name:
        match given.what:
            case "overhead":
                overhead(Path(name), given.logs or 10_000)
            case "speed":
                speed(Path(name), given.logs or 24, given.rounds)
            case "query":
                query(given.out)
            case "kills":
                kills(Path(name), given.runs, given.logs or 24, given.seed)
            case "tables":
                client_tables(Path(name), given.logs or 8000)
            case "scale":
                scale(0.05, given.logs or 200, given.processes)
