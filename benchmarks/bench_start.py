"""How long a user waits: import, help, info of a small log, and an hour-long building log."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import chladni
from chladni.io.mcap.writer import write_mcap

PROGRAM = str(Path(sys.executable).with_name("chladni"))


def shortest_s(command: list[str], repeats: int = 5) -> float:
    """Shortest wall time of a few runs of a whole process."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - begun)
    return min(times)


def small_log(path: Path) -> None:
    """Write a log of about a megabyte."""
    values = np.random.default_rng(4).standard_normal((3, 20_000))
    channels = tuple(chladni.Channel(name=f"/imu.linear_acceleration.{axis}", unit="m/s^2") for axis in "xyz")
    write_mcap(chladni.TimeSeries(values=values, sample_rate_hz=1000.0, channels=channels), path)


def main() -> None:
    """Print the table."""
    data = Path(os.environ.get("CHLADNI_DATA", Path(__file__).parents[2] / "shared" / "data"))
    bare = shortest_s([sys.executable, "-c", "pass"])
    rows = [
        (
            "`import chladni`, beyond a bare interpreter",
            shortest_s([sys.executable, "-c", "import chladni"]) - bare,
            0.2,
        ),
        ("`chladni --help`", shortest_s([PROGRAM, "--help"]), 0.4),
    ]
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "small.mcap"
        small_log(log)
        size = log.stat().st_size / 1e6
        rows.append((f"`chladni info` of a log of {size:.1f} MB", shortest_s([PROGRAM, "info", str(log)]), 1.0))
        figures = [PROGRAM, "psd", str(log), "--figures", str(Path(folder) / "figures")]
        rows.append(("`chladni psd --figures` of that log, the first picture", shortest_s(figures), 2.0))
        building = data / "palisaden.mcap"
        if building.exists():
            rrd = str(Path(folder) / "building.rrd")
            for words in (["info"], ["psd"], ["view", "--save", rrd]):
                command = [PROGRAM, words[0], str(building), *words[1:]]
                rows.append((f"`chladni {words[0]}` of the hour-long building log", shortest_s(command, 2), 5.0))
    print("| what | seen [s] | at most [s] |")
    print("| --- | ---: | ---: |")
    for what, seen, limit in rows:
        print(f"| {what} | {seen:.2f} | {limit} |")


if __name__ == "__main__":
    main()
