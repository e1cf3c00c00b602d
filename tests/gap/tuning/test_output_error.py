"""Fits to logs whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.plant.free_run import FreeRun
from chladni.gap.plant.windows import windows_for
from chladni.gap.records.measurement import Measurement
from chladni.gap.tuning.output_error import fit_output_error
from chladni.models.effects.attached_effect import attached
from chladni.models.files.model_file import load_model
from chladni.signals.errors import EstimateError
from tests.gap.made_log import band_noise, chain, measured, three_bodies, white_floor

SAMPLES = 6000
TRAINING = np.arange(SAMPLES) // 700 % 2 == 0


def moved(z):
    model = three_bodies()
    return model.with_values(FreeRun(model, measured(model, band_noise(10))[0]).tunables.values(z))


def true_z(seed=3, size=0.4):
    return size * np.random.default_rng(seed).standard_normal(9)


@pytest.fixture(scope="module")
def signals():
    return band_noise(SAMPLES)


@pytest.mark.parametrize("start", ["rest", "motion"])
def test_parameters_are_found_with_their_spread(start, signals):
    z = true_z()
    initial = None if start == "rest" else np.array([1e-4, -3e-4, 2e-4, 0.05, 0.1, -0.05])
    log, floor = measured(moved(z), signals, initial=initial, offset=0.3)
    fit = fit_output_error(FreeRun(three_bodies(), log), floor, training=TRAINING)
    # Two outputs' worth of a chi-square with N degrees of freedom: sqrt(2/(3 N)) is 1.5 % here.
    assert fit.misfit == pytest.approx(1.0, abs=0.06)
    assert np.mean(fit.held_by_output) == pytest.approx(1.0, abs=0.06)
    std = np.sqrt(np.diag(fit.covariance))
    assert np.all(np.abs(fit.z - z) < 4.5 * std + 1e-12)
    assert np.sqrt(np.mean(((fit.z - z) / std) ** 2)) < 2.0
    np.testing.assert_allclose(fit.offsets, 0.3, atol=5 * floor.rms.max() / np.sqrt(TRAINING.sum()))
    assert fit.prior_cost == pytest.approx(fit.z @ fit.z)
    if initial is not None:
        np.testing.assert_allclose(fit.initial[0], initial, rtol=0.1)


def test_a_start_at_rest_is_not_taken_for_motion(signals):
    log, floor = measured(three_bodies(), signals)
    fit = fit_output_error(FreeRun(three_bodies(), log), floor)
    moving = FreeRun(three_bodies(), log).outputs(initial=fit.initial[0]) - FreeRun(three_bodies(), log).outputs()
    assert np.all(np.sqrt(np.mean(moving**2, axis=1)) < 0.2 * floor.rms)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("true", "start", "fitted"),
    [
        pytest.param(
            attached("coulomb_friction", "j1", {"force": 8.0, "creep_speed": 1e-3}),
            attached("coulomb_friction", "j1", {"force": 4.0, "creep_speed": 1e-3}),
            ["force"],
            marks=pytest.mark.nightly,
        ),
        (
            attached("hysteresis", "j1", {"force": 10.0, "yield": 3e-5}),
            attached("hysteresis", "j1", {"force": 6.0, "yield": 6e-5}),
            ["force", "yield"],
        ),
        pytest.param(
            attached("quadratic_damping", "j1", {"coefficient": 2e3}),
            attached("quadratic_damping", "j1", {"coefficient": 5e2}),
            ["coefficient"],
            marks=pytest.mark.nightly,
        ),
        (attached("delay", "hammer", {"delay": 1.3e-3}), attached("delay", "hammer", {"delay": 2e-3}), ["delay"]),
        pytest.param(
            attached("gain_error", "a1", {"gain": 0.8}),
            attached("gain_error", "a1", {"gain": 1.0}),
            ["gain"],
            marks=pytest.mark.nightly,
        ),
        (
            attached("time_offset", "a1", {"offset": 4e-4}),
            attached("time_offset", "a1", {"offset": 1e-5}),
            ["offset"],
        ),
        pytest.param(
            attached("saturation", "hammer", {"limit": 100.0}),
            attached("saturation", "hammer", {"limit": 150.0}),
            ["limit"],
            marks=pytest.mark.nightly,
        ),
    ],
    ids=lambda each: each.effect if hasattr(each, "effect") else None,
)  # fmt: skip
def test_effects_are_found_with_the_parameters(true, start, fitted, signals):
    z = true_z()
    log, floor = measured(moved(z).with_effects([true]), signals)
    run = FreeRun(three_bodies(), log)
    fit = fit_output_error(run, floor, effects=[start], fitted=[fitted], training=TRAINING, max_iterations=20)
    without = fit_output_error(run, floor, training=TRAINING)
    assert fit.misfit < 1.08
    assert np.mean(fit.held_by_output) < 1.08
    assert without.misfit > 1.5
    for name in fitted:
        assert abs(fit.effects[0].values[name] - true.values[name]) < 5 * fit.effect_std[0][name]
        assert fit.effect_std[0][name] < 0.05 * abs(true.values[name])
    # What isn't fitted stays.
    kept = {name: value for name, value in start.values.items() if name not in fitted}
    assert kept.items() <= fit.effects[0].values.items()


def test_without_tuning_the_parameters_stay(signals):
    true = attached("gain_error", "a1", {"gain": 0.8})
    z = true_z()
    log, floor = measured(moved(z).with_effects([true]), signals)
    start = attached("gain_error", "a1", {"gain": 1.0})
    fit = fit_output_error(FreeRun(three_bodies(), log), floor, effects=[start], start_z=z, tune=False)
    np.testing.assert_array_equal(fit.z, z)
    assert not fit.parameter_std.any()
    assert fit.effects[0].values["gain"] == pytest.approx(0.8, rel=1e-3)


def test_bounds_hold_against_any_amount_of_data(signals):
    z = np.zeros(9)
    place = FreeRun(three_bodies(), measured(three_bodies(), signals)[0]).tunables.names.index("j1.stiffness")
    z[place] = 4.0
    log, floor = measured(moved(z), signals)
    run = FreeRun(three_bodies(), log)
    held = fit_output_error(run, floor, start_z=np.clip(z, -3.0, 3.0))
    assert np.abs(held.z).max() <= 3.0
    assert held.misfit > 1.5
    wider = fit_output_error(run, floor, start_z=held.z, freed=["j1.stiffness"])
    assert wider.z[place] == pytest.approx(4.0, abs=0.1)
    assert wider.misfit < 1.08


def test_a_bad_guess_of_the_noise_changes_little(signals):
    z = true_z()
    log, floor = measured(moved(z), signals, noise=0.05)
    run = FreeRun(three_bodies(), log)
    right = fit_output_error(run, floor)
    guess = replace(floor, innovation_rms=floor.innovation_rms / 30, rms=floor.rms / 30)
    wrong = fit_output_error(run, guess)
    np.testing.assert_allclose(wrong.z, right.z, atol=0.05)
    np.testing.assert_allclose(np.diag(wrong.covariance), np.diag(right.covariance), rtol=0.2)


def test_what_the_log_does_not_show_is_named_and_stays_where_it_was_believed():
    # A body on a stiff joint behind the sensor's: its damping hardly moves a log of low frequencies.
    model = chain([2.0, 1e-3], [5e5, 5e8], [40.0, 1e-3])
    log, floor = measured(model, band_noise(3000), outputs=[0], noise=0.02)
    fit = fit_output_error(FreeRun(model, log), floor)
    assert "j1.damping" in fit.undetermined
    assert "j0.stiffness" not in fit.undetermined
    assert abs(fit.z[FreeRun(model, log).tunables.names.index("j1.damping")]) < 0.5


def test_the_same_fit_twice_is_the_same_to_the_byte(signals):
    log, floor = measured(moved(true_z()), signals)
    start = attached("coulomb_friction", "j1", {"force": 1.0})
    first, second = (fit_output_error(FreeRun(three_bodies(), log), floor, effects=[start]) for _ in range(2))
    assert first.outputs.tobytes() == second.outputs.tobytes()
    assert first.effects == second.effects


def test_no_training_sample_is_refused(signals):
    log, floor = measured(three_bodies(), signals)
    with pytest.raises(EstimateError, match="no sample is left"):
        fit_output_error(FreeRun(three_bodies(), log), floor, training=np.zeros(SAMPLES, dtype=bool))


def axis_log(folder, model, outputs, inputs):
    import chladni

    with chladni.open_log(folder / "emps.mcap") as log:
        series = log.read([*inputs, *outputs])
    compiled = model.compile()
    count = len(inputs)
    return Measurement(
        log="emps", sample_rate_hz=series.sample_rate_hz,
        inputs=series.values[:count], outputs=series.values[count:],
        input_names=tuple(one.name for one in compiled.inputs),
        output_names=tuple(one.name for one in compiled.outputs)[: len(outputs)],
        output_units=tuple(one.unit for one in compiled.outputs)[: len(outputs)],
    )  # fmt: skip


@pytest.mark.nightly
def test_friction_of_a_robot_axis_open_loop_in_windows(shared_data):
    """Published: 95.1 kg, 203.5 N s/m, 20.4 N, offset -3.2 N; a linear fit takes 409 N s/m for the viscous part."""
    model = load_model(shared_data / "models" / "emps.toml")
    log = axis_log(shared_data, model, ["/axis.position[0]"], ["/axis.effort[0]"])
    run = FreeRun(model, log, windows=windows_for(model, log))
    floor = white_floor([2e-6])
    linear = fit_output_error(run, floor)
    assert linear.values["guide.damping"] == pytest.approx(409, rel=0.06)
    start = attached("coulomb_friction", "guide", {"force": 10.0}, variant="bristle")
    fit = fit_output_error(run, floor, effects=[start], fitted=[["force", "offset"]])
    assert fit.values["carriage.mass"] == pytest.approx(95.1, rel=0.02)
    assert fit.values["guide.damping"] == pytest.approx(203.5, rel=0.06)
    assert fit.effects[0].values["force"] == pytest.approx(20.4, rel=0.06)
    assert fit.effects[0].values["offset"] == pytest.approx(-3.2, rel=0.1)
    assert fit.misfit < 0.1 * linear.misfit


def test_friction_of_a_robot_axis_in_its_loop(shared_data):
    model = load_model(shared_data / "models" / "emps_closed_loop.toml")
    log = axis_log(shared_data, model, ["/axis.position[0]", "/axis.effort[0]"], ["/command.position[0]"])
    run, floor = FreeRun(model, log), white_floor([2e-6, 1.0])
    assert fit_output_error(run, floor).values["guide.damping"] == pytest.approx(409, rel=0.03)
    fit = fit_output_error(run, floor, effects=[attached("coulomb_friction", "guide", {"force": 10.0})])
    assert fit.values["carriage.mass"] == pytest.approx(95.1, rel=0.02)
    assert fit.values["guide.damping"] == pytest.approx(203.5, rel=0.06)
    assert fit.effects[0].values["force"] == pytest.approx(20.4, rel=0.06)
