"""Every command that computes, on channels of any size: an answer, or one line that names the channel."""

import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.cli.conftest import Run

RATE_HZ = 500.0
MODEL = """format = "chladni.model/1"
name = "one"
kind = "structure"
[[body]]
name = "mass"
mass = 1.0
[[joint]]
name = "spring"
between = ["ground", "mass"]
stiffness = 1e5
damping = 6.0
[[input]]
name = "f"
at = "mass"
channel = "/a.force"
[[output]]
name = "y"
measures = "acceleration"
at = "mass"
channel = "/a.acc"
"""
#: The least denormal's neighbourhood, what squares lose at both ends, and what only sums or fourth powers lose.
OUTSIDE = [
    *(pytest.param(size, marks=pytest.mark.nightly) for size in (1e-321, 1e-300, 1e-160, 1e-100, 1e61, 1e306)),
    1e-62,
    1e155,
]
INSIDE = [1e-59, *(pytest.param(size, marks=pytest.mark.nightly) for size in (1e-40, 1e38, 1e57))]

Verb = Callable[[Path, Path, Path], list[object]]
VERBS: dict[str, Verb] = {
    "levels": lambda log, folder, _: ["levels", log, "--json", folder / "o.json"],
    "cepstrum": lambda log, folder, _: ["cepstrum", log, "--json", folder / "o.json"],
    "envelope": lambda log, folder, _: ["envelope", log, "--json", folder / "o.json"],
    "octaves": lambda log, folder, _: ["octaves", log, "--json", folder / "o.json"],
    "psd": lambda log, folder, _: ["psd", log, "--json", folder / "o.json"],
    "ods": lambda log, folder, _: [
        "ods",
        log,
        "--reference",
        "/a.acc",
        "--frequency",
        50,
        "--json",
        folder / "o.json",
    ],
    "delay": lambda log, folder, _: [
        "delay",
        log,
        "--reference",
        "/a.force",
        "--response",
        "/a.acc",
        "--json",
        folder / "o.json",
    ],
    "srs": lambda log, folder, _: ["srs", log, "--json", folder / "o.json"],
    "frf": lambda log, folder, _: ["frf", log, "--json", folder / "o.json"],
    "modes": lambda log, folder, _: ["modes", log, "--json", folder / "o.json"],
    "modes alone": lambda log, folder, _: ["modes", log, "--operational", "--json", folder / "o.json"],
    "compare": lambda log, folder, usual: ["compare", usual, log, "--json", folder / "o.json"],
    "view": lambda log, folder, _: ["view", log, "--save", folder / "o.rrd"],
    "gap": lambda log, folder, _: ["gap", folder / "one.toml", log, "--json", folder / "o.json"],
    "gap of two logs": lambda log, folder, usual: ["gap", log, "--simulated", usual, "--json", folder / "o.json"],
}


def write(path: Path, force_size: float, answer_size: float) -> Path:
    path.write_bytes(written(force_size, answer_size))
    return path


@cache
def written(force_size: float, answer_size: float) -> bytes:
    """Content of a log, for all commands that read it."""
    rng = np.random.default_rng(3)
    force = rng.standard_normal(9000)
    ringing = np.exp(-np.arange(400) / 90) * np.sin(0.6 * np.arange(400))
    answer = np.convolve(force, ringing)[: force.size] + 0.01 * rng.standard_normal(force.size)
    series = TimeSeries(
        values=np.stack([force_size * force, answer_size * answer]),
        sample_rate_hz=RATE_HZ,
        channels=(Channel(name="/a.force", unit="N", role="reference"), Channel(name="/a.acc", unit="m/s^2")),
        start_time_ns=10**18,
    )
    with TemporaryDirectory() as folder:
        write_mcap(series, Path(folder) / "log.mcap")
        return (Path(folder) / "log.mcap").read_bytes()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "one.toml").write_text(MODEL)
    return tmp_path


@pytest.fixture(scope="session")
def usual(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("usual") / "usual.mcap", 1.0, 1.0)


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("size", OUTSIDE)
def test_sizes_that_no_estimator_can_square_are_one_line(
    run: Run, folder: Path, usual: Path, verb: str, size: float
) -> None:
    log = write(folder / "log.mcap", size, size)
    outcome = run(*VERBS[verb](log, folder, usual))
    assert outcome.code == 2, outcome.out
    assert outcome.err.count("\n") == 1
    assert "log.mcap" in outcome.err
    assert "holds" in outcome.err
    assert "/a." in outcome.err
    assert not (folder / "o.json").exists()


@pytest.mark.nightly
@pytest.mark.parametrize("size", [pytest.param(1e-200, marks=pytest.mark.nightly), 1e153])
def test_a_diagnosis_says_nothing_else(folder: Path, size: float) -> None:
    # As a program of its own: compiled libraries write to standard output themselves.
    command = ["gap", folder / "one.toml", write(folder / "log.mcap", size, size)]
    done = subprocess.run([sys.executable, "-m", "chladni", *command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb != "gap"])
@pytest.mark.parametrize("size", INSIDE)
def test_other_sizes_are_answered(run: Run, folder: Path, usual: Path, verb: str, size: float) -> None:
    outcome = run(*VERBS[verb](write(folder / "log.mcap", size, size), folder, usual))
    assert outcome.code == 0, outcome.err
    assert "nan" not in outcome.out.lower().replace("resonan", "")


@pytest.mark.nightly
@pytest.mark.parametrize(("force_size", "answer_size"), [(1e-20, 1e-20), (1.0, 1e-40)])
def test_a_diagnosis_answers_though_log_and_model_are_worlds_apart(
    run: Run, folder: Path, usual: Path, force_size: float, answer_size: float
) -> None:
    log = write(folder / "log.mcap", force_size, answer_size)
    outcome = run(*VERBS["gap"](log, folder, usual))
    assert outcome.code == 0, outcome.err


def test_the_remedy_works(run: Run, folder: Path) -> None:
    log = write(folder / "log.mcap", 1e153, 1e-200)
    setup = folder / "setup.toml"
    setup.write_text(
        'format = "chladni.setup/1"\n'
        '[[channel]]\npath = "/a.force"\nunit = "V"\nsensitivity = "1e153 V/N"\n'
        '[[channel]]\npath = "/a.acc"\nunit = "V"\nsensitivity = "1e-200 V/(m/s^2)"\n'
    )
    scaled = run("psd", log, "--setup", setup, "--json", "-")
    assert scaled.code == 0, scaled.err
    plain = run("psd", write(folder / "plain.mcap", 1.0, 1.0), "--json", "-")
    for one, other in zip(scaled.document["channels"], plain.document["channels"], strict=True):
        assert one["rms"] == pytest.approx(other["rms"], rel=1e-9)
