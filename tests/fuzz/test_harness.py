"""The harness finds what it is there to find: each way to fail is played by a made up format, in a worker."""

import importlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
PROGRAM = """
import sys, warnings, os, time
sys.path.insert(0, {here!r})
import harness
from pathlib import Path
{limits}
harness.MEMORY_BYTES = 300_000_000

def read(path, case):
    {body}
    return harness.WHOLE

case = harness.Case(files={{"a": b"x"}}, how="made")
form = harness.Format(name="made", make=lambda rng: case, read=read, command=lambda path, rng: [])
harness.format_of = lambda name: form
harness.work("made", 1, 0, 2, Path({folder!r}) / "input")
"""


@pytest.fixture
def harness(monkeypatch: pytest.MonkeyPatch):
    """The module, as the programs beside it know it."""
    monkeypatch.syspath_prepend(str(HERE))
    return importlib.import_module("harness")


def worked(body: str, folder: Path, limits: str = "") -> tuple[int, list[list[object]], str]:
    """Run a worker on two inputs; give its exit code, what it told of each, and the rest of what it wrote."""
    program = PROGRAM.format(here=str(HERE), body=body, folder=str(folder), limits=limits)
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    lines = found.stdout.splitlines()
    told = [json.loads(line) for line in lines if line.startswith("[")]
    return found.returncode, told, "\n".join(line for line in lines if not line.startswith("["))


@pytest.mark.parametrize(
    ("body", "outcome", "kind"),
    [
        ("pass", "whole", None),
        ("raise harness.ChladniError('a line')", "refused", None),
        ("raise ValueError('x')", "failed", "ValueError"),
        ("raise harness.BrokenRuleError('a lost sample', 'x')", "failed", "a lost sample"),
        ("sys.exit(1)", "failed", "SystemExit"),
        ("warnings.warn('x', RuntimeWarning)", "whole", "printed"),
        ("print('x')", "whole", "printed"),
        ("os.write(2, b'x')", "whole", "printed"),
    ],
)
def test_what_becomes_of_an_input(body, outcome, kind, tmp_path):
    code, told, _ = worked(body, tmp_path)
    assert code == 0
    assert [one[:2] for one in told] == [[0, outcome], [1, outcome]]
    assert [one[-1] and one[-1][0] for one in told] == [kind, kind]


@pytest.mark.parametrize("body", ["while True: pass", "sum(range(10**12))", "time.sleep(60)", "os.abort()"])
def test_an_input_that_ends_the_worker_leaves_a_trace(body, tmp_path):
    code, told, trace = worked(body, tmp_path, "harness.PROCESSOR_SECONDS, harness.SECONDS = 0.3, 2")
    assert code != 0
    assert told == []
    assert "in read" in trace


def test_memory_is_measured_and_a_fresh_worker_asked_for(tmp_path):
    code, told, _ = worked("bytearray(350_000_000)", tmp_path)
    assert code == 0
    assert [one[-1][0] for one in told] == ["memory"]


def test_an_input_is_made_again_from_its_number(harness):
    for name in ("csv", "wav", "blind", "toml"):
        first, again = (harness.generated(name, 5, 17) for _ in range(2))
        assert first.how == again.how
        if name != "blind":  # whose seal has a salt
            assert first.files == again.files
    assert harness.generated("csv", 5, 18).how != harness.generated("csv", 5, 17).how


@pytest.mark.parametrize(
    ("code", "out", "errors", "kind"),
    [
        (0, b"table\n", b"", None),
        (2, b"", b"chladni: a line\n", None),
        (1, b"", b"chladni: defect\n", "exit code 1"),
        (-9, b"", b"", "exit code -9"),
        (2, b"", b"chladni: a line\nmore\n", "not one line"),
        (2, b"", b"", "not one line"),
        (0, b"", b"warning\n", "standard error"),
        (0, b"\x1b[31m", b"", "unprintable"),
        (0, "\u202e".encode(), b"", "unprintable"),
    ],
)
def test_what_a_command_must_not_do(harness, code, out, errors, kind):
    found = harness._wrong(code, 0.1, 10**8, out, errors)
    assert (found and found[0]) == kind


def test_a_command_that_takes_long_or_much_fails(harness):
    assert harness._wrong(0, 11.0, 10**8, b"", b"")[0] == "time"
    assert harness._wrong(0, 1.0, 501 * 10**6, b"", b"")[0] == "memory"


def test_a_shifted_a_wrong_and_a_lost_sample_break_the_rule(harness, tmp_path):
    samples = importlib.import_module("samples")
    path = tmp_path / "a.csv"
    rows = [f"{row / 100},{row * 1.5}\n" for row in range(40)]

    def checked(kept: list[str], **truth: object) -> str:
        path.write_text("time [s],a [N]\n" + "".join(kept))
        values = {"a": np.arange(40) * 1.5}
        return samples.check_log(path, samples.Truth(channels=values, start_ns=0, **truth))

    assert checked(rows) == harness.WHOLE
    assert checked(rows[:20] + rows[21:]) == harness.TOLD  # as a gap
    with pytest.raises(harness.BrokenRuleError, match="a wrong sample"):
        checked([*rows[:5], "0.05,99\n", *rows[6:]])
    assert checked([*rows[:5], "0.05,99\n", *rows[6:]], foreign=1, intact=np.arange(40) != 5) == harness.WHOLE
    with pytest.raises(harness.BrokenRuleError, match="a wrong sample"):
        checked([f"{row / 100 + 0.02},{row * 1.5}\n" for row in range(40)])
    with pytest.raises(harness.BrokenRuleError, match="a lost sample"):
        checked(rows[:30])


def test_failures_are_told_apart_and_shown_again(harness, tmp_path):
    failure = harness.Failure(name="csv", number=7, how="flip", kind="ValueError", place="io/a.py:b", found="x")
    tally = harness.Tally()
    for _ in range(3):
        tally.add("failed", 0.5, 10**8)
        harness._keep(failure, tally, tmp_path, 3, tmp_path / "kept")
    text = harness.report([("csv", tally)], 3, tmp_path / "kept")
    assert "csv: ValueError io/a.py:b (3 inputs)" in text
    assert "--formats csv --seed 3 --only 7" in text
    assert [one.name for one in (tmp_path / "kept").iterdir()] == ["csv-3-7"]
