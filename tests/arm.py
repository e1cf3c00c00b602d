"""A short log of the demo's robot arm, for tests of the commands."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from chladni.apps.demo_log import DemoLog, make_demo_log, setup_text
from chladni.io.mcap.writer import write_mcap

FORCE = "/shaker.wrench.force.x"
TOOL = "/tool.accel.linear.x"
WRIST = "/wrist.accel.linear.x"
DURATION_S = 25.0


@cache
def short_arm() -> DemoLog:
    """The demo's arm, 25 s of it: the lost stretch from 20.0 to 20.25 s is inside."""
    made = make_demo_log()
    return replace(made, series=tuple(series.window(end_s=DURATION_S) for series in made.series))


def write_arm(folder: Path, *, gain: float = 1.0, name: str = "arm.mcap") -> Path:
    """Write the log and its setup file to a folder; `gain` multiplies what the tool's sensor reads."""
    (folder / name).write_bytes(_arm_bytes(gain))
    (folder / "setup.toml").write_text(setup_text(short_arm().structure), encoding="utf-8")
    return folder / name


@cache
def _arm_bytes(gain: float) -> bytes:
    """What the log's file holds; to write its messages takes a second."""
    series = [
        replace(one, values=one.values * gain) if one.channels[0].name == TOOL else one for one in short_arm().series
    ]
    with TemporaryDirectory() as folder:
        write_mcap(series, Path(folder) / "arm.mcap")
        return (Path(folder) / "arm.mcap").read_bytes()
