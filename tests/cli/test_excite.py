import json
from pathlib import Path

import numpy as np
import pytest

import chladni
from tests.cli.conftest import Run
from tests.robots.made import URDF, written

pytest.importorskip("mujoco")


@pytest.mark.nightly
def test_a_table_that_is_read_again_and_what_it_uses(run: Run, tmp_path: Path) -> None:
    robot, out = written(tmp_path, URDF, "arm.urdf"), tmp_path / "motion.csv"
    document = tmp_path / "motion.json"
    outcome = run("excite", robot, "--out", out, "--rate", 100, "--joints", "shoulder, lift", "--pose",
                  "shoulder=30 deg", "--speed", 0.3, "--json", document)  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert "Condition number of" in outcome.out
    assert "aren't checked" in outcome.out
    with chladni.open(out) as log:
        series = log.read()
    names = ["shoulder", "elbow", "lift"]
    assert [one.name for one in series.channels] == [*names, *(f"{name}.velocity" for name in names)]
    assert [one.unit for one in series.channels] == ["rad", "rad", "m", "rad/s", "rad/s", "m/s"]
    assert series.values.shape == (6, 1001)
    np.testing.assert_allclose(series.values[:3, [0, -1]], [[np.pi / 6] * 2, [0.0] * 2, [0.0] * 2], atol=1e-12)
    assert np.abs(series.values[3]).max() <= 0.3 * 3.0
    found = json.loads(document.read_text())
    assert (found["format"], found["moved"]) == ("chladni.excite/1", ["shoulder", "lift"])
    assert found["condition"] < found["random_condition"]
    (shoulder, _) = found["joints"]
    assert shoulder["speed_limit"] == 3.0
    assert shoulder["torque"] < shoulder["torque_limit"] == 30.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--out", "motion.mcap"), "give a name that ends with .csv"),
        (("--out", "motion.csv", "--joints", "wrist"), "has no joint 'wrist'"),
        (("--out", "motion.csv", "--pose", "elbow"), "is not of the form NAME=VALUE"),
        (("--out", "motion.csv", "--pose", "elbow=1", "--pose", "elbow=2"), "--pose elbow is given twice"),
        (("--out", "motion.csv", "--pose", "elbow=0.2 m"), "'0.2 m' is in m, the parameter in rad"),
        (("--out", "nowhere/motion.csv"), "nowhere"),
    ],
)
def test_bad_input_is_one_line(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], message: str
) -> None:
    robot = written(tmp_path, URDF, "arm.urdf")
    monkeypatch.chdir(tmp_path)
    outcome = run("excite", robot, *options)
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert message in outcome.err
    assert not list(tmp_path.glob("*.csv"))
