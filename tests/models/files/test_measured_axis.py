"""A measured robot axis: the model file's loop with the vocabulary's friction follows its log."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.bench_emps import (
    FORCE,
    HOLD_S,
    PUBLISHED,
    axis_model,
    equation_error,
    loop_error,
    read_log,
)
from chladni.models.files.model_file import load_model
from chladni.models.structures.structure_model import StructureModel


def test_the_equation_of_motion_gives_the_published_parameters(shared_data: Path) -> None:
    series = read_log(shared_data, "emps")
    found = equation_error(series)
    mass, viscous, coulomb, offset = np.abs(np.array(found.parameters) / PUBLISHED - 1)
    assert mass < 0.02
    assert viscous < 0.02
    assert coulomb < 0.03
    assert offset < 0.03
    # Without Coulomb friction the viscous coefficient hides it: twice as large, and four times the residual.
    linear = equation_error(series, coulomb=False)
    assert linear.parameters[1] > 1.9 * PUBLISHED[1]
    assert linear.residual > 3.5 * found.residual


def test_the_loop_with_published_values_follows_the_log(shared_data: Path) -> None:
    error = loop_error(axis_model(shared_data, PUBLISHED), read_log(shared_data, "emps"))
    assert error.force < 0.06
    assert error.position_m < 5e-6


def test_the_disturbance_enters_at_the_controller(shared_data: Path) -> None:
    series = read_log(shared_data, "emps_pulses").window(end_s=6.0)
    model = axis_model(shared_data, PUBLISHED, pulses=True, hold_s=HOLD_S)
    assert [terminal.unit for terminal in model.compile().inputs] == ["m", "V"]
    assert loop_error(model, series).force < 0.09
    # Without it the model misses what the pulses do to the force.
    assert loop_error(axis_model(shared_data, PUBLISHED, hold_s=HOLD_S), series).force > 0.3


def test_the_open_axis_is_a_double_pole_with_damping(shared_data: Path) -> None:
    model = load_model(shared_data / "models" / "emps.toml")
    assert isinstance(model, StructureModel)
    assert model.compile().inputs[0].channel == FORCE
    assert np.sort(model.poles().real) == pytest.approx([-300.0 / 95.0, 0.0], abs=1e-12)
