"""NumPy finds one thread asked for when a diagnosis imports it, unless the user asked for another number."""

import os
import subprocess
import sys

import pytest

from chladni.cli.linear_algebra import THREADS, take_one_thread

# Says what the environment holds when NumPy is looked for, then runs the command.
WATCHED = """
import os, sys
class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            print("numpy finds", os.environ.get("OPENBLAS_NUM_THREADS"))
sys.meta_path.insert(0, Watch())
from chladni.cli.main import main
main(sys.argv[1:])
"""


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        (["gap", "absent.toml", "absent.mcap"], "1"),
        (["blind", "run", "absent"], "1"),
        (["psd", "absent.mcap"], "None"),
    ],
)
def test_a_diagnosis_asks_before_numpy_is_imported(arguments: list[str], found: str) -> None:
    clean = {name: value for name, value in os.environ.items() if name not in THREADS}
    finished = subprocess.run(
        [sys.executable, "-c", WATCHED, *arguments], capture_output=True, text=True, check=True, env=clean
    )
    assert finished.stdout.splitlines()[:1] == [f"numpy finds {found}"]


@pytest.mark.parametrize("name", THREADS)
def test_what_the_user_asked_for_stays(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    for one in THREADS:
        monkeypatch.delenv(one, raising=False)
    monkeypatch.setenv(name, "2")
    before = dict(os.environ)
    take_one_thread()
    assert dict(os.environ) == before
