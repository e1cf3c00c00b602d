import control
import numpy as np
import pytest

from chladni.models.drives.dc_servo import DC_SERVO, tuned
from chladni.models.drives.drive_model import drive_model
from tests.models.drives.oracles import FREQUENCY_HZ, S, assert_same_response, named, response

OUTPUTS = ("current", "torque", "acceleration", "velocity", "position")


def plant(values=None, *, lag=False, gear=False):
    """``(output, input)`` responses of armature and rotor, by hand."""
    p = DC_SERVO.parameters.with_values(values or {}).numbers()
    ratio = p["gear_ratio"] if gear else 1.0
    inertia = p["inertia"] + (p["load_inertia"] / ratio**2 if gear else 0.0)
    electric, mechanic = p["inductance"] * S + p["resistance"], inertia * S + p["viscous_loss"]
    # Over L J, so that the coefficients are of like size.
    scale = p["inductance"] * inertia
    below = (electric * mechanic + p["torque_constant"] * p["back_emf"]) / scale
    converter = 1 / (p["converter_time"] * S + 1) if lag else control.tf(1, 1)
    speed = {"voltage": p["torque_constant"] / scale / below * converter}
    speed["load_torque"] = -electric / scale / below / ratio
    current = {"voltage": mechanic / scale / below * converter, "load_torque": p["back_emf"] / scale / below / ratio}
    found = {}
    for entry in ("voltage", "load_torque"):
        found["current", entry] = response(current[entry])
        found["torque", entry] = p["torque_constant"] * found["current", entry]
        found["velocity", entry] = response(speed[entry])
        found["acceleration", entry] = response(speed[entry] * S)
        found["position", entry] = response(speed[entry] / S)
    return p, found


def cascade(p, loop):
    """The drive with its loops, connected by python-control out of blocks of its own."""

    def block(transfer, entry, exit_):
        return control.ss(transfer, inputs=[entry], outputs=[exit_], name=f"{entry}-{exit_}")

    blocks = [
        block(1 / (p["converter_time"] * S + 1), "voltage", "applied"),
        control.summing_junction(["applied", "-emf"], "driving", name="armature"),
        block(1 / (p["inductance"] * S + p["resistance"]), "driving", "current"),
        block(control.tf(p["torque_constant"], 1), "current", "torque"),
        control.summing_junction(["torque", "-friction", "-load_torque"], "left", name="rotor"),
        block(control.tf(1 / p["inertia"], 1), "left", "acceleration"),
        block(1 / S, "acceleration", "velocity"),
        block(1 / S, "velocity", "position"),
        block(control.tf(p["back_emf"], 1), "velocity", "emf"),
        block(control.tf(p["viscous_loss"], 1), "velocity", "friction"),
    ]
    for name, command, gain, rate, weight in (
        ("current", "voltage", p["current_gain"], 1 / p["current_time"], 1.0),
        ("velocity", "current_reference", p["velocity_gain"], 1 / p["velocity_time"], p["velocity_weight"]),
        ("position", "velocity_reference", p["position_gain"], 0.0, 1.0),
    ):
        # States as python-control makes them: one integral of the error.
        pi = control.ss(
            [[0.0]], [[1.0, -1.0]], [[gain * rate]], [[weight * gain, -gain]],
            inputs=[f"{name}_reference", name], outputs=[command], name=f"{name} loop",
        )  # fmt: skip
        blocks.append(pi)
        if name == loop:
            break
    entries = [f"{loop}_reference", "load_torque"]
    return control.interconnect(blocks, inputs=entries, outputs=list(OUTPUTS)), entries


@pytest.mark.parametrize("lag", [False, True])
@pytest.mark.parametrize("gear", [False, True])
def test_open_drive_is_armature_and_rotor(lag, gear):
    _, found = plant(lag=lag, gear=gear)
    options = {"converter_lag": "on" if lag else "off", "gear": "on" if gear else "off"}
    compiled = drive_model(DC_SERVO, {}, options).compile()
    assert named(compiled.inputs) == ["voltage", "load_torque"]
    for (output, entry), expected in found.items():
        assert_same_response(compiled, output, entry, expected)


@pytest.mark.parametrize("loop", ["current", "velocity", "position"])
@pytest.mark.parametrize("values", [{}, {"velocity_weight": 0.7, "velocity_gain": 0.4, "velocity_time": 0.01}])
def test_loops_are_the_cascade(loop, values):
    acting = values if loop != "current" else {}
    p = DC_SERVO.parameters.with_values(acting).numbers()
    oracle, entries = cascade(p, loop)
    compiled = drive_model(DC_SERVO, acting, {"loop": loop, "converter_lag": "on"}).compile()
    assert named(compiled.inputs) == entries
    expected = oracle(2j * np.pi * FREQUENCY_HZ)
    for row, output in enumerate(OUTPUTS):
        for column, entry in enumerate(entries):
            assert_same_response(compiled, output, entry, expected[row, column])


def test_transfer_function_from_voltage_to_velocity_is_the_textbooks():
    p, _ = plant()
    system = drive_model(DC_SERVO).compile().state_space()
    scale = p["inductance"] * p["inertia"]
    middle = p["inductance"] * p["viscous_loss"] + p["resistance"] * p["inertia"]
    last = p["resistance"] * p["viscous_loss"] + p["torque_constant"] * p["back_emf"]
    np.testing.assert_allclose(np.poly(system.a)[:3], [1.0, middle / scale, last / scale], rtol=1e-12)


def test_velocity_loop_rejects_a_load_in_the_end():
    system = drive_model(DC_SERVO, {}, {"loop": "velocity"}).compile().state_space()
    kept = [place for place, name in enumerate(system.states) if name != "position"]
    static = -np.linalg.solve(system.a[np.ix_(kept, kept)], system.b[kept])
    row = [system.states[place] for place in kept].index("velocity")
    np.testing.assert_allclose(static[row], [1.0, 0.0], atol=1e-9)


def test_voltage_limit_is_a_law_in_front_of_the_power_stage():
    for loop in ("open", "velocity"):
        compiled = drive_model(DC_SERVO, {"voltage_limit": 24.0}, {"loop": loop, "voltage_limiter": "on"}).compile()
        (law,) = compiled.laws
        assert (compiled.ports[law.port].name, compiled.ports[law.port].kind) == ("voltage_limit", "input")
        assert law.function(30.0, 0.0, 0.0, law.parameters, (), ()) == -6.0
        assert law.function(-20.0, 0.0, 0.0, law.parameters, (), ()) == 0.0


def test_current_limit_stands_between_velocity_and_current_loop():
    options = {"loop": "velocity", "current_limiter": "on"}
    compiled = drive_model(DC_SERVO, {"current_limit": 5.0}, options).compile()
    (law,) = compiled.laws
    assert compiled.ports[law.port].name == "current_reference_limit"
    assert law.function(7.0, 0.0, 0.0, law.parameters, (), ()) == -2.0


def test_what_a_limit_takes_away_drives_its_integral_back():
    p = DC_SERVO.parameters.numbers()
    options = {"loop": "velocity", "voltage_limiter": "on", "current_limiter": "on"}
    compiled = drive_model(DC_SERVO, {}, options).compile()
    for command, integral, time in (
        ("voltage", "current_integral", "current_time"),
        ("current_reference", "velocity_integral", "velocity_time"),
    ):
        column = compiled.g[:, compiled.port_index(f"{command}_limit", "input")]
        assert column[compiled.states.index(integral)] == pytest.approx(1 / p[time])
        # What an effect adds behind the limit isn't tracked.
        assert compiled.g[compiled.states.index(integral), compiled.port_index(command, "input")] == 0.0


def test_effects_at_a_limited_command_act_behind_the_limit():
    compiled = drive_model(DC_SERVO, {}, {"loop": "current", "voltage_limiter": "on"}).compile()
    limit, command = (compiled.port_index(name, "input") for name in ("voltage_limit", "voltage"))
    assert compiled.displacement_port[command, limit] == 1.0
    np.testing.assert_array_equal(compiled.displacement_state[command], compiled.displacement_state[limit])


def test_default_gains_are_the_rules_for_the_default_motor():
    p = DC_SERVO.parameters.numbers()
    for name, gain in tuned(p, {"gear": "off"}).items():
        assert p[name] == pytest.approx(gain, rel=1e-12), name


def test_gear_reflects_the_load_by_the_square_of_the_ratio():
    p = DC_SERVO.parameters.numbers()
    with_gear, without = tuned(p, {"gear": "on"}), tuned(p, {"gear": "off"})
    inertia = p["inertia"] + p["load_inertia"] / p["gear_ratio"] ** 2
    assert with_gear["velocity_gain"] / without["velocity_gain"] == pytest.approx(inertia / p["inertia"])
    assert with_gear["position_gain"] == without["position_gain"]
