"""Tables of modes and shapes."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from chladni.io.files.modes_table import write_modes_csv
from chladni.modal.shapes.validation import validate
from chladni.signals.channel import AXES, Channel
from chladni.signals.errors import LogError
from chladni.signals.mode_set import ModeSet
from tests import strategies as ours
from tests.modal.mode_makers import mode_set
from tests.modal.shapes.test_joint_treatment import scaled_modes


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_modes_and_shapes_are_two_tables(tmp_path: Path) -> None:
    modes = scaled_modes()
    checks = validate(modes)
    table, shapes = write_modes_csv(tmp_path / "arm.csv", modes, validation=checks)
    assert (table.name, shapes.name) == ("arm.csv", "arm_shapes.csv")
    rows = rows_of(table)
    assert [row["mode"] for row in rows] == ["1", "2", "3", "4"]
    np.testing.assert_array_equal([float(row["frequency [Hz]"]) for row in rows], modes.frequency_hz)
    np.testing.assert_array_equal([float(row["damping ratio std [1]"]) for row in rows], modes.damping_std)
    np.testing.assert_array_equal([float(row["modal mass [kg]"]) for row in rows], modes.scale.modal_mass)  # type: ignore[union-attr]
    np.testing.assert_array_equal([float(row["MPC [1]"]) for row in rows], checks.mpc)
    assert {row["model orders [1]"] for row in rows} == {""}
    components = rows_of(shapes)
    assert len(components) == 16
    assert components[5] == components[5] | {"mode": "2", "channel": "/column.a", "point": "column"}
    np.testing.assert_array_equal([float(row["real [1]"]) for row in components], modes.shapes.real.ravel())
    np.testing.assert_array_equal([float(row["real std [1]"]) for row in components], modes.shape_std.real.ravel())
    assert {row["direction x [1]"] for row in components} == {"1"}


def test_what_isnt_known_is_empty(tmp_path: Path) -> None:
    modes = mode_set([[1.0, 0.5]], frequency_std_hz=np.array([np.nan]))
    table, shapes = write_modes_csv(tmp_path / "a.csv", modes)
    (row,) = rows_of(table)
    assert [row[name] for name in ("frequency std [Hz]", "modal mass [kg]", "MPC [1]")] == ["", "", ""]
    assert [(one["point"], one["direction z [1]"]) for one in rows_of(shapes)] == [("", ""), ("", "")]


def test_no_name_becomes_a_formula(tmp_path: Path) -> None:
    wild = Channel(name="=HYPERLINK(1)", point='@,"\n', direction=AXES["+z"])
    modes = replace(mode_set([[1.0]]), channels=(wild,))
    (row,) = rows_of(write_modes_csv(tmp_path / "a.csv", modes)[1])
    assert (row["channel"], row["point"]) == ("'=HYPERLINK(1)", "'@,\"\\n")


@pytest.mark.parametrize("existing", ["a.csv", "a_shapes.csv"])
def test_an_existing_file_stays_unless_it_may_go(tmp_path: Path, existing: str) -> None:
    (tmp_path / existing).write_text("mine")
    with pytest.raises(LogError, match="exists already"):
        write_modes_csv(tmp_path / "a.csv", mode_set([[1.0]]), overwrite=False)
    assert [path.name for path in tmp_path.iterdir()] == [existing], "both tables appear, or neither"
    assert (tmp_path / existing).read_text() == "mine"


@settings(max_examples=20)
@given(modes=ours.mode_sets())
def test_numbers_come_back_to_the_bit(tmp_path_factory: pytest.TempPathFactory, modes: ModeSet) -> None:
    table, shapes = write_modes_csv(tmp_path_factory.mktemp("t") / "a.csv", modes)
    np.testing.assert_array_equal([float(row["damping ratio [1]"]) for row in rows_of(table)], modes.damping_ratio)
    components = [complex(float(row["real [1]"]), float(row["imaginary [1]"])) for row in rows_of(shapes)]
    np.testing.assert_array_equal(components, modes.shapes.ravel())
