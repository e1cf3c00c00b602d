from pathlib import Path

import numpy as np
import pytest

from chladni.cli.output import Output
from tests.cli.conftest import Run

MODEL = """format = "chladni.model/1"
name = "one"
kind = "structure"
[[body]]
name = "mass"
mass = 2.0
[[joint]]
name = "spring"
between = ["ground", "mass"]
stiffness = 800.0
damping = 4.0
[[input]]
name = "hammer"
at = "mass"
[[output]]
name = "motion"
measures = "displacement"
at = "mass"
"""


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "one.toml"
    path.write_text(MODEL)
    return path


def test_json_holds_the_closed_forms_of_one_mass(run: Run, model: Path) -> None:
    outcome = run("influence", model, "--json", "-")
    assert outcome.code == 0, outcome.err
    found = outcome.document
    assert found["format"] == "chladni.influence/1"
    rows, columns = found["construction"], found["behaviour"]
    table = np.array(found["log_derivative"], dtype=float)
    # zeta = c/(2 sqrt(k m)); the damped frequency is sqrt(k/m) sqrt(1 - zeta^2).
    zeta = 4.0 / (2 * np.sqrt(800.0 * 2.0))
    assert found["nominal"]["damping_ratio"] == pytest.approx(zeta, rel=1e-9)
    expected = {"mass.mass": -0.5, "spring.stiffness": -0.5, "spring.damping": 1.0}
    for name, value in expected.items():
        assert table[rows.index(name), columns.index("damping_ratio")] == pytest.approx(value, abs=1e-8)
    slope = 0.5 * (1 + zeta**2 / (1 - zeta**2))
    assert table[rows.index("spring.stiffness"), columns.index("resonance_frequency")] == pytest.approx(
        slope, rel=1e-8
    )


def test_the_finite_coefficient_is_the_papers_quotient(run: Run, model: Path) -> None:
    found = run("influence", model, "--change", "0.4", "--parameter", "spring.damping", "--json", "-").document
    column = found["behaviour"].index("damping_ratio")
    assert found["construction"] == ["spring.damping"]
    assert found["change"] == {"spring.damping": -0.4}
    assert found["relative_change"][0][column] == pytest.approx(-0.4, rel=1e-9)
    assert found["finite"][0][column] == pytest.approx(1.0, rel=1e-9)


def test_the_table_marks_the_strongest_and_defines_its_columns(run: Run, model: Path) -> None:
    outcome = run("influence", model, "--set", "spring.stiffness=1.6 kN/m")
    assert outcome.code == 0, outcome.err
    small = outcome.out[outcome.out.index("small changes") :]
    damping = next(line for line in small.splitlines() if line.startswith("spring.damping"))
    assert "+1.000*†" in damping
    assert "- damping ratio: " in outcome.out


def test_an_unstable_model_is_told(run: Run, model: Path, tmp_path: Path) -> None:
    path = tmp_path / "growing.toml"
    path.write_text(
        'format = "chladni.model/1"\nname = "growing"\nkind = "scheme"\n[[input]]\nname = "command"\n'
        '[[block]]\nname = "plant"\nnum = [2.0]\nden = [0.5, 1.0]\ninput = ["+command", "+plant"]\n'
    )
    assert "- Warning: unstable, with poles at 2 + 0j rad/s" in run("influence", path).out
    assert "unstable" not in run("influence", model).out


@pytest.mark.nightly
def test_figures_are_written(run: Run, tmp_path: Path) -> None:
    outcome = run("influence", "pneumatic-motor", "--figures", tmp_path / "figures")
    assert outcome.code == 0, outcome.err
    assert (tmp_path / "figures" / "influence.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["no-such-thing"], "no instrument of this name; instruments: pneumatic-motor"),
        (["missing.toml"], "missing.toml: no such file"),
        (["pneumatic-motor", "--set", "activ_area=1"], "did you mean active_area?"),
        (["pneumatic-motor", "--set", "active_area"], "not of the form NAME=VALUE"),
        (["pneumatic-motor", "--set", "active_area=3 kg"], "is in kg, the parameter in m^2"),
        (["pneumatic-motor", "--set", "reduced_mass=-1"], "is not possible"),
        (["pneumatic-motor", "--set", "stroke=0.3", "--set", "stroke=0.4"], "given twice"),
        (["pneumatic-motor", "--output", "colour"], "colour"),
    ],
)
def test_mistakes_are_told_in_one_line(run: Run, arguments: list[str], words: str) -> None:
    outcome = run("influence", *arguments)
    assert outcome.code == 2
    assert outcome.err.count("\n") == 1
    assert words in outcome.err


def test_names_and_numbers_stay_whole_in_a_terminal_of_80_columns(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chladni.cli.influence.Output", Narrow)
    lines = run("influence", "robot-arm", "--parameter", "shoulder.stiffness").out.splitlines()
    assert max(map(len, lines)) <= 80
    # Each of the two tables in parts, the name again in each.
    assert sum(line.startswith("shoulder.stiffness ") for line in lines) == 4


class Narrow(Output):
    """A terminal of 80 columns."""

    def __init__(self, json_target: str | None = None) -> None:
        super().__init__(json_target)
        self.console.width = 80
