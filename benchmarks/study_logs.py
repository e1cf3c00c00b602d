"""Logs, recipes and clusters for the benchmarks of studies."""

import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

from chladni import Channel, TimeSeries, write_mcap

RATE_HZ = 1000.0
START_NS = 1_700_000_000 * 10**9
SHORT = 'format = "chladni.study/1"\n[info]\n[psd]\n[levels]\n'
REAL = 'format = "chladni.study/1"\n[info]\n[psd]\n[levels]\n[modes]\noperational = true\nband_hz = [10, 200]\n'


def write_one(path: Path, *, seed: int, seconds: float, channels: int = 3, layout: str = "batches") -> None:
    """Write a log with a line and noise in each channel."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    values = np.sin(2 * np.pi * (40 + 15 * np.arange(channels)[:, None]) * t) + rng.standard_normal(
        (channels, t.size)
    )
    series = TimeSeries(
        values=values,
        sample_rate_hz=RATE_HZ,
        start_time_ns=START_NS + seed * 3600 * 10**9,
        channels=tuple(Channel(name=f"/imu{number}.x", unit="m/s^2") for number in range(channels)),
    )
    write_mcap(series, path, layout=layout)


def write_logs(folder: Path, count: int, *, seconds: float, distinct: int = 100, channels: int = 3) -> Path:
    """Write `count` logs, of which so many differ: a copy is read, hashed and averaged like any other."""
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        path = folder / f"log{number:06d}.mcap"
        if number < distinct:
            write_one(path, seed=number, seconds=seconds, channels=channels)
        else:
            shutil.copyfile(folder / f"log{number % distinct:06d}.mcap", path)
    return folder


@dataclass
class Usage:
    """Memory and processor time of a program and all that it started."""

    client_mb: float = 0.0
    cpu_s: dict[int, float] = field(default_factory=dict)
    memory_mb: dict[int, float] = field(default_factory=dict)

    def watch(self, pid: int, done: threading.Event) -> None:
        """Look at it until it's done."""
        while not done.wait(0.1):
            try:
                root = psutil.Process(pid)
                self.client_mb = max(self.client_mb, root.memory_info().rss / 2**20)
                for one in (root, *root.children(recursive=True)):
                    times = one.cpu_times()
                    self.memory_mb[one.pid] = max(self.memory_mb.get(one.pid, 0.0), one.memory_info().rss / 2**20)
                    self.cpu_s[one.pid] = max(self.cpu_s.get(one.pid, 0.0), times.user + times.system)
            except psutil.Error:
                continue


def chladni(*words: object) -> list[str]:
    """Give the command line of a command."""
    return [sys.executable, "-m", "chladni", *map(str, words)]


@contextmanager
def watched(command: list[str]) -> Iterator[tuple[subprocess.Popen[bytes], Usage]]:
    """Run a command, and watch what it takes."""
    usage, done = Usage(), threading.Event()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        watcher = threading.Thread(target=usage.watch, args=(process.pid, done))
        watcher.start()
        try:
            yield process, usage
            process.communicate()
        finally:
            done.set()
            watcher.join()


@dataclass
class OwnCluster:
    """A scheduler and workers as programs of their own, to be ended one by one."""

    port: int
    workers: int
    folder: Path
    scheduler: "subprocess.Popen[bytes] | None" = None
    others: "list[subprocess.Popen[bytes]]" = field(default_factory=list)

    @property
    def address(self) -> str:
        """Of the scheduler."""
        return f"tcp://127.0.0.1:{self.port}"

    def keep(self) -> None:
        """Start what isn't running."""
        if self.scheduler is None or self.scheduler.poll() is not None:
            self.scheduler = self._started("dask_scheduler", "--port", self.port, "--no-dashboard")
        self.others = [one for one in self.others if one.poll() is None]
        while len(self.others) < self.workers:
            self.others.append(
                self._started(
                    "dask_worker", self.address, "--nthreads", 1, "--no-dashboard", "--no-nanny", "--memory-limit", 0,
                    "--local-directory", self.folder, "--death-timeout", 60,
                )
            )  # fmt: skip

    def stop(self) -> None:
        """End all of it."""
        for one in (*self.others, *([self.scheduler] if self.scheduler else [])):
            one.kill()
            one.wait()

    def _started(self, module: str, *words: object) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.{module}", "--host", "127.0.0.1", *map(str, words)],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": str(Path.cwd())},
        )  # fmt: skip


@contextmanager
def own_cluster(port: int, workers: int, folder: Path) -> Iterator[OwnCluster]:
    """Start a scheduler and workers, and end them."""
    cluster = OwnCluster(port=port, workers=workers, folder=folder)
    try:
        cluster.keep()
        time.sleep(3)
        yield cluster
    finally:
        cluster.stop()


def tables(out: Path) -> dict[str, bytes]:
    """Give the files of a study's tables."""
    return {str(path.relative_to(out)): path.read_bytes() for path in out.glob("*/day=*/*.parquet")}
