from itertools import product

import control
import numpy as np
import pytest

from chladni.models.analysis.instrument_reading import read_instrument
from chladni.models.instruments.robot_module import INSTRUMENT, STEP_SIZE, SWITCHES, robot_scheme

AT_REST = np.zeros(1)
SWITCHED = [
    dict(zip(("regulator", "correction", "load"), words, strict=True)) for words in product(("on", "off"), repeat=3)
]


def static(options: dict[str, str], values: dict[str, float] | None = None) -> np.ndarray:
    """Final speed of the arm over reference and over load."""
    model = INSTRUMENT.model(values, options)
    row = [point.terminal.name for point in model.points].index("arm")
    return model.frequency_response(AT_REST)[row, :, 0].real


def plant(v: dict[str, float]) -> float:
    """Static gain from the amplifier's input to the arm's speed, by the torques at rest."""
    n, km, ohm = v["gear_ratio"], v["torque_constant"], v["armature.resistance"]
    friction = n * v["motor.damping"] + v["arm.damping"] / n + n * km**2 / ohm
    return v["amplifier.gain"] * km / ohm / friction


def test_regulator_and_correction_are_the_papers() -> None:
    s = 2j * np.pi * np.geomspace(1e-3, 10, 30)
    regulator, correction = (robot_scheme().block(name).content.transfer for name in ("regulator", "correction"))
    frequency_hz = np.abs(s) / (2 * np.pi)
    np.testing.assert_allclose(regulator.frequency_response(frequency_hz), 0.9 * (9.9 * s + 1) / (3 * s), rtol=1e-12)
    np.testing.assert_allclose(correction.frequency_response(frequency_hz), 1 / (0.7 * s + 1), rtol=1e-12)


@pytest.mark.parametrize("options", SWITCHED, ids=str)
def test_integral_action_makes_the_final_speed_the_same_with_and_without_load(options: dict[str, str]) -> None:
    over_reference, over_load = static(options)
    v = INSTRUMENT.parameters.numbers()
    loop = plant(v) * v["gear_ratio"] * v["tachometer_constant"]
    if options["regulator"] == "on":
        np.testing.assert_allclose([over_reference, over_load], [1.0, 0.0], atol=1e-12)
        return
    assert over_reference == pytest.approx(loop / (1 + loop), rel=1e-9)
    if options["load"] == "off":
        assert over_load == 0.0
    else:
        n, km, ohm = v["gear_ratio"], v["torque_constant"], v["armature.resistance"]
        stiffness = n**2 * v["motor.damping"] + v["arm.damping"] + (n * km) ** 2 / ohm
        assert over_load == pytest.approx(
            -robot_scheme().parameters["load_torque.gain"].value / stiffness / (1 + loop)
        )


def test_shared_constants_move_every_block_that_has_them() -> None:
    changed = INSTRUMENT.model({"gear_ratio": 50.0, "torque_constant": 0.1, "tachometer_constant": 0.04}).parameters
    found = {
        name: changed[name].value for name in ("gear.gain", "shaft_reaction.gain", "torque.gain", "back_emf.gain")
    }
    assert found == {"gear.gain": 0.02, "shaft_reaction.gain": 0.02, "torque.gain": 0.1, "back_emf.gain": 0.1}
    assert (changed["tachometer.gain"].value, changed["set_value.gain"].value) == (0.04, 2.0)


def test_the_elastic_mode_is_that_of_two_inertias_on_a_shaft() -> None:
    v = INSTRUMENT.parameters.numbers()
    free = INSTRUMENT.model({"shaft.damping": 0.0, "motor.damping": 0.0, "arm.damping": 0.0, "torque_constant": 1e-9})
    poles = free.compile().state_space().poles()
    elastic = max(abs(pole) for pole in poles if abs(pole.imag) > 1)
    stiffness, motor = v["shaft.stiffness"], v["gear_ratio"] ** 2 * v["motor.inertia"]
    assert elastic == pytest.approx(np.sqrt(stiffness * (1 / motor + 1 / v["arm.inertia"])), rel=1e-6)


def test_python_control_gives_the_same_speed_after_a_step() -> None:
    # Equations of motion written by hand: current, motor, twist of the shaft, arm, tachometer, correction, integral.
    v = INSTRUMENT.parameters.numbers()
    n, km, kt = v["gear_ratio"], v["torque_constant"], v["tachometer_constant"]
    c, k = v["shaft.damping"], v["shaft.stiffness"]
    current, motor, twist, arm, tacho, lag, integral = np.eye(7)
    error = -tacho
    regulator = v["regulator.gain"] * (error + integral / v["regulator.integral_time"])
    torque = k * twist + c * (motor / n - arm)
    a = np.array([
        (v["amplifier.gain"] * lag - km * motor - v["armature.resistance"] * current) / v["armature.inductance"],
        (km * current - torque / n - v["motor.damping"] * motor) / v["motor.inertia"],
        motor / n - arm,
        (torque - v["arm.damping"] * arm) / v["arm.inertia"],
        (kt * motor - tacho) / v["tachometer.time_constant"],
        (regulator - lag) / v["correction.time_constant"],
        error,
    ])  # fmt: skip
    b = np.zeros((7, 1))
    b[5] = v["regulator.gain"] * n * kt / v["correction.time_constant"]
    b[6] = n * kt
    time_s = np.linspace(0, 15, 301)
    expected = control.step_response(control.ss(a, b, arm[None], 0), time_s).outputs
    compiled = INSTRUMENT.model(options={"load": "off"}).compile()
    ours = control.ss(compiled.a, compiled.b[:, :1], compiled.c[:1], compiled.d[:1, :1])
    np.testing.assert_allclose(control.step_response(ours, time_s).outputs, expected, rtol=1e-8, atol=1e-9)


def test_the_printed_values_are_good_ones() -> None:
    reading = read_instrument(INSTRUMENT)
    found = {quantity.name: quantity.value for quantity in reading.quantities}
    # An integrator with a lag of 0.7 s at the loop gain 0.3 K: damping ratio 1/(2 sqrt(0.7 0.3 K)).
    v = INSTRUMENT.parameters.numbers()
    gain = plant(v) * v["gear_ratio"] * v["tachometer_constant"]
    assert found["damping_ratio"] == pytest.approx(0.5 / np.sqrt(0.7 * 0.3 * gain), rel=0.05)
    assert found["overshoot"] < 6.0
    assert all("is off" in flag for flag in reading.flags)


@pytest.mark.parametrize("loop", ["off", "on"])
def test_the_page_shows_the_answer_with_and_without_load(loop: str) -> None:
    charts = {chart.name: chart for chart in read_instrument(INSTRUMENT, options={"position_loop": loop}).charts}
    alone, loaded = charts["step.with-load"].curves
    assert (alone.label, loaded.label) == ("without load", "with load")
    assert alone.y[-1] == pytest.approx(STEP_SIZE, rel=0.02)
    assert loaded.y[-1] == pytest.approx(STEP_SIZE, rel=0.06)
    assert loaded.y.min() < 0.5 * alone.y.min() or loaded.y[len(loaded.y) // 4] < alone.y[len(alone.y) // 4]


def test_the_position_loop_follows_an_angle() -> None:
    model = INSTRUMENT.model(options={"position_loop": "on"})
    row = [point.terminal.name for point in model.points].index("position")
    np.testing.assert_allclose(model.frequency_response(AT_REST)[row, :, 0].real, [1.0, 0.0], atol=1e-12)
    assert model.compile().state_space().poles().real.max() < 0
    assert model.inputs[0].unit == "rad"


def test_every_knob_at_its_end_is_usual_for_the_blocks_too() -> None:
    for name in ("gear_ratio", "torque_constant", "tachometer_constant"):
        for end in (INSTRUMENT.parameters[name].low, INSTRUMENT.parameters[name].high):
            assert not INSTRUMENT.model({name: end}).parameters.unusual()


def test_every_switch_switches_its_blocks() -> None:
    for option, blocks in SWITCHES.items():
        for word in ("on", "off"):
            model = INSTRUMENT.model(options={option: word})
            assert [model.block(name).on for name in blocks] == [word == "on"] * len(blocks)
