"""Commands that track, shake and compare, on a long log and on one of 19 000 channels: processor time and memory.

``python -m benchmarks.bench_long_and_wide [SECONDS]`` writes SECONDS (an hour, if not given) of 12 channels, and
a second of 19 000, and runs each command in a process of its own. What needs a whole record refuses the hour in
one line, with the part that fits; that line stands in the table.
"""

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.bench_memory import HOUR_S, write_hour
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

WIDE, WIDE_HZ = 19_000, 1000
LONG = {
    "srs": ["--band", "400-2000", "--lines", "3"],
    "zoom": ["--band", "100-200"],
    "ods": ["--reference", "/daq.ch00", "--frequency", "100", "--resolution", "6.25"],
    "delay": ["--reference", "/daq.ch00", "--response", "/daq.ch01"],
    "orders": ["--ridge", "/daq.ch00", "--channel", "/daq.ch01", "--order", "1"],
}
A, B = "/rig/s000.accel.a00", "/rig/s001.accel.a01"
NAMED = {
    "srs": ["--channel", A],
    "zoom": ["--channel", A, "--band", "10-100"],
    "ods": ["--reference", A, "--channel", B, "--frequency", "30", "--resolution", "2"],
    "delay": ["--reference", A, "--response", B],
    "orders": ["--ridge", A, "--channel", B, "--order", "1"],
}
# What `resource` knows of a child begins with what its parent held.
PEAK = """
import atexit, re
from pathlib import Path
atexit.register(lambda: print(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]))
"""
ALL = {"srs": [], "zoom": ["--band", "10-100"]}


def write_wide(path: Path) -> None:
    """Write a second of a sweep in noise, 100 channels a topic."""
    rng, t = np.random.default_rng(1), np.arange(WIDE_HZ) / WIDE_HZ
    values = rng.standard_normal((WIDE, WIDE_HZ)) + np.sin(2 * np.pi * (20 * t + 10 * t**2))
    channels = tuple(
        Channel(name=f"/rig/s{one // 100:03d}.accel.a{one % 100:02d}", unit="m/s^2") for one in range(WIDE)
    )
    series = TimeSeries(values=values.astype(np.float32), sample_rate_hz=float(WIDE_HZ), channels=channels)
    write_mcap(series, path, layout="batches")


def run(log: Path, command: str, options: list[str]) -> tuple[float, float, str]:
    """Give processor seconds, megabytes and the last line of one command."""
    code = f"import sys; from chladni.cli.main import main; sys.exit(main({[command, str(log), *options]!r}))"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", PEAK + code], check=False, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    told = done.stderr.strip().splitlines()[-1] if done.returncode else "done"
    return after.ru_utime - before.ru_utime, int(done.stdout.split()[-1]) / 1024, told


def main() -> None:
    """Write both logs, run all commands, print the table."""
    seconds = int(sys.argv[1]) if len(sys.argv) > 1 else HOUR_S
    with tempfile.TemporaryDirectory(dir=Path.cwd()) as folder:
        long, wide, setup = Path(folder) / "long.mcap", Path(folder) / "wide.mcap", Path(folder) / "setup.toml"
        write_hour(long, seconds)
        write_wide(wide)
        units = (f'[[channel]]\npath = "/daq.ch{one:02d}"\nunit = "m/s^2"\n' for one in range(12))
        setup.write_text("".join(['format = "chladni.setup/1"\n', *units]))
        print("| log | command | processor time | memory | what it said |")
        print("| --- | --- | ---: | ---: | --- |")
        rows = [
            (
                f"{seconds} s, 12 channels",
                long,
                {name: [*told, "--setup", str(setup)] for name, told in LONG.items()},
            ),
            (f"{WIDE} channels, one or two named", wide, NAMED),
            (f"{WIDE} channels, all", wide, ALL),
        ]
        for title, log, commands in rows:
            for command, options in commands.items():
                spent_s, megabytes, told = run(log, command, options)
                print(f"| {title} | {command} | {spent_s:.1f} s | {megabytes:.0f} MB | {told} |", flush=True)


if __name__ == "__main__":
    main()
