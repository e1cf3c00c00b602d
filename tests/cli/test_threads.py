"""What the program writes is the same, to the last bit, however many threads linear algebra may take."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import chladni
from chladni.cli.entry import THREADS
from chladni.modal.experimental.polyreference import PolyReferenceLeastSquares
from tests.arm import write_arm


def program(folder: Path, threads: int, *command: object) -> dict[str, bytes]:
    """Run the program where so many threads are asked for; give the files that it wrote."""
    folder.mkdir()
    environment = dict(os.environ, **dict.fromkeys(THREADS, str(threads)))
    called = [sys.executable, "-m", "chladni", *map(str, command)]
    done = subprocess.run(called, cwd=folder, env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr.decode()
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "threads"),
    [
        (("modes", "arm.mcap", "--json", "out.json", "--csv", "out.csv"), (1, 4)),
        *(
            pytest.param(command, (1, 2, 4), marks=pytest.mark.nightly)
            for command in (
                ("modes", "arm.mcap", "--json", "out.json", "--csv", "out.csv"),
                ("modes", "arm.mcap", "--operational", "--json", "out.json"),
                ("frf", "arm.mcap", "--json", "out.json"),
                ("simulate", "robot-arm", "--seconds", 2, "--noise", 0.01, "--out", "out.mcap", "--json", "out.json"),
                ("convert", "arm.mcap", "out.mat", "--json", "out.json"),
            )
        ),
    ],
    ids=lambda parts: " ".join(map(str, parts[:3])),
)
def test_files_are_the_same_at_any_number_of_threads(
    tmp_path: Path, command: tuple[object, ...], threads: tuple[int, ...]
) -> None:
    log = write_arm(tmp_path)
    placed = [log if part == "arm.mcap" else part for part in command]
    one, *others = (program(tmp_path / str(count), count, *placed) for count in threads)
    assert one
    assert all(other == one for other in others)


def test_a_warning_of_a_library_is_one_line_without_its_source(tmp_path: Path) -> None:
    script = (
        "import sys, warnings\n"
        "import chladni.cli.main as program\n"
        "def main():\n"
        "    for _ in range(2):\n"
        "        warnings.warn('overflow encountered in matmul', RuntimeWarning)\n"
        "    return int(sys.argv[1])\n"
        "program.main = main\n"
        "from chladni.cli.entry import run\n"
        "run()\n"
    )
    done = [
        subprocess.run(
            [sys.executable, "-c", script, code], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        for code in ("0", "2")
    ]
    assert done[0].stderr == (
        "chladni: take extreme values with care: overflow encountered in matmul; CHLADNI_TRACEBACK=1 shows where\n"
    )
    # A failure has said its own line.
    assert (done[1].returncode, done[1].stderr) == (2, "")


def identified(response: chladni.FrequencyResponse, threads: int) -> chladni.ModeSet:
    with threadpool_limits(limits=threads, user_api="blas"):
        return chladni.identify_modes(response, method=PolyReferenceLeastSquares(max_order=30))


def test_a_script_that_gives_linear_algebra_threads_identifies_the_same_modes(tmp_path: Path) -> None:
    with chladni.open(write_arm(tmp_path)) as log:
        response = chladni.frf(log)
    one, two = (identified(response, threads) for threads in (1, 2))
    for name in ("frequency_hz", "damping_ratio", "shapes"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
