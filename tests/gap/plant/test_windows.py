from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.windows import (
    _horizon_s,
    _lasting,
    nested_windows,
    short_windows,
    training_in_windows,
    windows_for,
)
from chladni.gap.records.measurement import Measurement
from chladni.gap.tuning.output_error import fit_output_error
from chladni.models.effects.attached_effect import attached
from chladni.models.files.model_file import load_model
from chladni.models.integrator.integrator import Integrator
from chladni.models.structures.structure_output import StructureOutput
from tests.gap.made_log import chain, damper, three_bodies, white_floor


def log_of(model, samples=10_000, rate_hz=1000.0):
    compiled = model.compile()
    return Measurement(
        log="log", sample_rate_hz=rate_hz,
        inputs=np.zeros((len(compiled.inputs), samples)), outputs=np.zeros((len(compiled.outputs), samples)),
        input_names=tuple(one.name for one in compiled.inputs),
        output_names=tuple(one.name for one in compiled.outputs),
        output_units=tuple(one.unit for one in compiled.outputs),
    )  # fmt: skip


def horizon_s(windows, sample_rate_hz):
    return np.mean([stop - start for start, stop in windows]) / sample_rate_hz


def test_a_damped_structure_needs_none():
    assert windows_for(three_bodies(), log_of(three_bodies())) is None


def test_short_ones_last_three_of_its_slowest_periods_all_the_same():
    model = chain([1.0], [(2 * np.pi * 10.0) ** 2], [0.1])
    assert horizon_s(short_windows(model, log_of(model)), 1000.0) == pytest.approx(0.3, rel=0.05)


def test_nested_ones_grow_by_threes_from_one_period_and_begin_where_shorter_ones_do():
    model = chain([1.0], [(2 * np.pi * 10.0) ** 2], [0.1])
    log = log_of(model)
    levels = nested_windows(model, log, ((0, 5000), (5000, 10_000)))
    assert [len(level) for level in levels] == [100, 34, 12, 4]
    for shorter, longer in pairwise([*levels, ((0, 5000), (5000, 10_000))]):
        assert {start for start, _ in longer} <= {start for start, _ in shorter}
    for level in levels:
        assert (level[0][0], level[-1][1]) == (0, 10_000)
        assert all(one[1] == other[0] for one, other in pairwise(level))


def test_a_model_without_states_has_a_second_s_time():
    model = damper()
    assert horizon_s(short_windows(model, log_of(model)), 1000.0) == pytest.approx(1.0)
    assert nested_windows(model, log_of(model), ((0, 10_000),))


def test_windows_as_short_as_a_period_have_none_within():
    model = chain([1.0], [(2 * np.pi * 10.0) ** 2], [0.1])
    assert nested_windows(model, log_of(model), ((0, 100), (100, 200))) == []


def test_a_lightly_damped_mode_is_still_a_mode():
    model = chain([1.0], [1e4], [1e-3])
    assert windows_for(model, log_of(model)) is None


def test_a_free_structure_lasts_some_cycles_of_its_slowest_mode():
    # Free as a whole; the two bodies move against each other at sqrt(2 k/m) = 15.9 Hz.
    model = chain([1.0, 1.0], [0.0, 5e3], [0.0, 1.0])
    windows = windows_for(model, log_of(model))
    assert horizon_s(windows, 1000.0) == pytest.approx(3 / 15.9, rel=0.02)
    assert windows[0][0] == 0
    assert windows[-1][1] == 10_000
    assert all(before[1] == after[0] for before, after in pairwise(windows))


def test_what_grows_is_left_before_it_has_grown_far():
    # A falling mass: poles at +-5 rad/s. By e^3, though another time of the model is 10 s.
    poles = np.array([5.0, -5.0, -0.1], dtype=complex)
    lasting = _lasting(poles, 100.0)
    np.testing.assert_array_equal(lasting, [True, False, False])
    assert _horizon_s(poles, lasting) == pytest.approx(0.6)


def test_a_model_without_a_time_of_its_own_is_given_a_second():
    poles = np.zeros(2, dtype=complex)
    assert _horizon_s(poles, _lasting(poles, 10.0)) == 1.0


def test_every_window_shows_its_start_and_its_end_to_a_fit():
    model = chain([1.0, 1.0], [0.0, 5e3], [0.0, 1.0])
    windows = windows_for(model, log_of(model))
    training = training_in_windows(windows)
    for start, stop in windows:
        third = (stop - start) // 3
        assert training[start : start + third].all()
        assert training[stop - third : stop].all()
        assert not training[start + third : stop - third].any()


def test_a_fit_over_windows_predicts_what_it_did_not_see():
    """A free body with friction: two thirds of each window tell the friction, whatever its start is."""
    seen = (StructureOutput(name="d", measures="displacement", at="b0"),)
    model = replace(chain([1.0], [0.0], [3.0]), outputs=seen)
    rate_hz, count = 500.0, 4000
    compiled = model.with_effects([attached("coulomb_friction", "j0", {"force": 2.0, "creep_speed": 1e-3})]).compile()
    push = 8.0 * np.sin(2 * np.pi * 0.7 * np.arange(count) / rate_hz)[None]
    outputs = Integrator(compiled, rate_hz).run(push).outputs
    log = replace(log_of(model, count, rate_hz), inputs=push, outputs=outputs)
    windows = windows_for(model, log)
    start = attached("coulomb_friction", "j0", {"force": 1.5, "creep_speed": 1e-3})
    fit = fit_output_error(
        FreeRun(model, log, windows=windows), white_floor([1e-5]),
        effects=[start], training=training_in_windows(windows), offsets=False,
    )  # fmt: skip
    assert fit.effects[0].values["force"] == pytest.approx(2.0, rel=0.02)
    held = ~training_in_windows(windows)
    assert np.std((outputs - fit.outputs)[:, held]) < 0.02 * np.std(outputs)


def test_the_axis_of_a_robot(shared_data):
    model = load_model(shared_data / "models" / "emps.toml")
    windows = windows_for(model, log_of(model, samples=24_841))
    # Three times 95 kg/(300 N s/m).
    assert horizon_s(windows, 1000.0) == pytest.approx(0.95, rel=0.02)
    closed = load_model(shared_data / "models" / "emps_closed_loop.toml")
    assert windows_for(closed, log_of(closed)) is None
