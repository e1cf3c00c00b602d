"""Closed loops against python-control, and what a loop says when it can't be closed or doesn't settle."""

from dataclasses import replace
from math import pi
from typing import Any

import control
import numpy as np
import pytest
from scipy.signal import StateSpace as ScipyStateSpace
from scipy.signal import step as scipy_step

from chladni.models.core.port import Terminal
from chladni.models.core.simulation import PortMotion, Simulation
from chladni.models.effects.attached_effect import attached
from chladni.models.structures.closed_loop import close_loop
from chladni.models.structures.controller import Controller
from chladni.models.structures.limiter import limiter
from chladni.models.structures.structure_model import StructureModel
from chladni.signals.arrays import Complex
from chladni.signals.channel import Channel
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries
from tests.models.structures.made_models import GAIN, KP, KV, MASS, VISCOUS, axis

FREQUENCY_HZ = np.geomspace(0.05, 400.0, 80)
S = 2j * pi * FREQUENCY_HZ
# A free axis and a stiff loop: the equations lose some six digits of sixteen at the ends of the band.
RTOL = 1e-9
s = control.tf("s")
PLANT = 1 / (MASS * s**2 + VISCOUS * s)

# What each law makes of reference and feedback, as python-control has it: u = forward r - back y.
LAWS: dict[str, tuple[dict[str, Any], Any, Any]] = {
    "p": ({"law": "p", "gains": {"kp": 900.0}}, 900.0, 900.0),
    "pd": ({"law": "pd", "gains": {"kp": 900.0, "kd": 40.0}}, 900.0, 900.0 + 40.0 * s),
    "pd of the error": (
        {"law": "pd", "gains": {"kp": 900.0, "kd": 40.0}, "rate_of": "error"}, 900.0 + 40.0 * s, 900.0 + 40.0 * s,
    ),
    "pd with a filter": (
        {"law": "pd", "gains": {"kp": 900.0, "kd": 40.0, "filter": 2e-3}}, 900.0, 900.0 + 40.0 * s / (2e-3 * s + 1),
    ),
    "pd of the error with a filter": (
        {"law": "pd", "gains": {"kp": 900.0, "kd": 40.0, "filter": 2e-3}, "rate_of": "error"},
        900.0 + 40.0 * s / (2e-3 * s + 1), 900.0 + 40.0 * s / (2e-3 * s + 1),
    ),
    "pi": ({"law": "pi", "gains": {"kp": 900.0, "ki": 50.0}}, 900.0 + 50.0 / s, 900.0 + 50.0 / s),
    "pid": (
        {"law": "pid", "gains": {"kp": 900.0, "ki": 50.0, "kd": 40.0}}, 900.0 + 50.0 / s, 900.0 + 50.0 / s + 40.0 * s,
    ),
    "p-p": ({"law": "p-p", "gains": {"kp": KP, "kv": KV}}, KV * KP, KV * KP + KV * s),
    "p-p with a filter": (
        {"law": "p-p", "gains": {"kp": KP, "kv": KV, "filter": 1e-3}}, KV * KP, KV * KP + KV * s / (1e-3 * s + 1),
    ),
    "lead": (
        {"law": "transfer-function", "gains": {}, "num": (30.0, 900.0), "den": (1e-3, 1.0)},
        (30.0 * s + 900.0) / (1e-3 * s + 1), (30.0 * s + 900.0) / (1e-3 * s + 1),
    ),
    "resonant filter": (
        {"law": "transfer-function", "gains": {}, "num": (3.0, 20.0, 2e4), "den": (2.0, 30.0, 700.0, 8e3)},
        (3 * s**2 + 20 * s + 2e4) / (2 * s**3 + 30 * s**2 + 700 * s + 8e3),
        (3 * s**2 + 20 * s + 2e4) / (2 * s**3 + 30 * s**2 + 700 * s + 8e3),
    ),
    "constant transfer function": (
        {"law": "transfer-function", "gains": {}, "num": (900.0,), "den": (2.0,)}, 450.0, 450.0,
    ),
}  # fmt: skip


def value(transfer: Any) -> Complex:
    """An oracle's transfer function on the axis; numbers are constant."""
    return transfer(S) if callable(transfer) else np.full(S.shape, transfer, dtype=complex)


@pytest.mark.parametrize("law", LAWS)
def test_frequency_responses_of_every_law_are_python_control_s(law: str) -> None:
    changes, forward, back = LAWS[law]
    compiled = axis(**changes).compile()
    found = compiled.frequency_response(FREQUENCY_HZ)
    outputs = [terminal.name for terminal in compiled.outputs]
    # y = (P g F r + P g w)/(1 + P g B), u = g (F r - B y + w), with the disturbance w before the gain.
    plant, sensitivity = value(PLANT) * GAIN, 1 / (1 + value(PLANT) * GAIN * value(back))
    reference = plant * value(forward) * sensitivity
    np.testing.assert_allclose(found[outputs.index("position"), 0], reference, rtol=RTOL)
    np.testing.assert_allclose(found[outputs.index("speed"), 0], S * reference, rtol=RTOL)
    np.testing.assert_allclose(found[outputs.index("acceleration"), 0], S**2 * reference, rtol=RTOL)
    np.testing.assert_allclose(found[outputs.index("motor"), 0], GAIN * value(forward) * sensitivity, rtol=RTOL)
    np.testing.assert_allclose(found[outputs.index("position"), 1], plant * sensitivity, rtol=RTOL)
    np.testing.assert_allclose(found[outputs.index("motor"), 1], GAIN * sensitivity, rtol=RTOL)


@pytest.mark.parametrize("law", [law for law in LAWS if law != "pd of the error"])
def test_step_responses_of_every_law_are_python_control_s(law: str) -> None:
    changes, forward, back = LAWS[law]
    system = axis(**changes).compile().state_space()
    time_s = np.linspace(0.0, 0.3, 31)
    loop = control.minreal(forward * GAIN * PLANT / (1 + GAIN * PLANT * back), verbose=False)
    expected = control.forced_response(control.ss(loop), time_s, np.ones(time_s.size)).outputs
    ours = ScipyStateSpace(system.a, system.b[:, :1], system.c[:1], system.d[:1, :1])
    _, found = scipy_step(ours, T=time_s)
    # The oracle cancels common factors of polynomials numerically, which costs it digits.
    np.testing.assert_allclose(np.ravel(found), np.ravel(expected), atol=1e-7 * np.max(np.abs(expected)))


def test_poles_of_the_measured_axis_are_the_roots_of_its_polynomial() -> None:
    expected = np.roots([MASS, VISCOUS + GAIN * KV, GAIN * KV * KP])
    np.testing.assert_allclose(np.sort_complex(axis().poles()), np.sort_complex(expected), rtol=1e-12)
    np.testing.assert_allclose(np.sort(axis().poles("open").real), [-VISCOUS / MASS, 0.0], atol=1e-15)
    mode = axis().modes()
    np.testing.assert_allclose(mode.frequency_hz, [abs(expected[0]) / (2 * pi)], rtol=1e-12)
    assert axis().modes("open").frequency_hz.size == 0


def test_the_rate_of_the_error_needs_the_reference_s_rate() -> None:
    compiled = axis(**LAWS["pd of the error"][0]).compile()
    assert compiled.inputs[0].derivatives == 1
    assert compiled.columns == 3


def test_terminals_and_ports_of_a_closed_loop() -> None:
    compiled = axis(limit=10.0).compile()
    assert compiled.inputs == (
        Terminal(name="axis", unit="m", channel="/command"),
        Terminal(name="pulses", unit="V", channel="/pulses"),
    )
    assert compiled.outputs[-1] == Terminal(name="motor", unit="N", channel="/effort")
    limit, motor = compiled.port_index("axis.limit", "input"), compiled.port_index("motor", "input")
    # The limit sees the command, what comes behind sees what is left of it, and the force takes both.
    assert compiled.displacement_port[motor, limit] == 1.0
    assert compiled.displacement_port[limit, motor] == 0.0
    np.testing.assert_array_equal(compiled.displacement_state[limit], compiled.displacement_state[motor])
    velocity = compiled.states.index("carriage.velocity")
    np.testing.assert_allclose(compiled.g[velocity, [limit, motor]], 1 / MASS)
    # The recorded command is what the controller asks for: a limit is in it, a lag of the motor isn't.
    np.testing.assert_array_equal(compiled.h[-1, [limit, motor]], [1.0, 0.0])
    assert [(law.port, law.function, law.parameters) for law in compiled.laws] == [(limit, limiter, (351.5,))]


def test_without_limit_nothing_acts_at_the_command() -> None:
    compiled = axis().compile()
    assert compiled.laws == ()
    assert "axis.limit" not in [port.name for port in compiled.ports]


def test_a_command_without_channel_is_no_output() -> None:
    model = axis()
    quiet = replace(model, inputs=(replace(model.inputs[0], channel=None), model.inputs[1]))
    assert [terminal.name for terminal in quiet.compile().outputs] == ["position", "speed", "acceleration"]


def test_acceleration_feedback_closes_an_algebraic_loop() -> None:
    # F = g (kp (r - a)), M a = F - c v: the acceleration follows the force at once, and the loop has a solution.
    model = axis(feedback="acceleration", law="p", gains={"kp": 2.0})
    found = model.compile().frequency_response(FREQUENCY_HZ)
    loop = GAIN * 2.0 * S**2 / (MASS * S**2 + VISCOUS * S)
    np.testing.assert_allclose(found[2, 0], loop / (1 + loop), rtol=RTOL)
    np.testing.assert_allclose(found[3, 0], GAIN * 2.0 / (1 + loop), rtol=RTOL)


def test_an_algebraic_loop_with_gain_one_is_refused() -> None:
    with pytest.raises(ModelError, match=r"controller 'axis': its command reaches its own feedback at once"):
        axis(feedback="acceleration", law="p", gains={"kp": -MASS / GAIN}).compile()


@pytest.mark.parametrize("law", ["pd", "p-p"])
def test_an_acceleration_has_no_rate_but_a_filtered_one(law: str) -> None:
    gains = {"kp": 2.0, "kd": 0.5, "kv": 0.5}
    used = {name: gains[name] for name in {"pd": ("kp", "kd"), "p-p": ("kp", "kv")}[law]}
    with pytest.raises(ModelError, match="follows a force at once, so it has no rate for the law"):
        axis(feedback="acceleration", law=law, gains=used).compile()
    filtered = axis(feedback="acceleration", law=law, gains=used | {"filter": 0.01}).compile()
    outer = 0.5 if law == "p-p" else 1.0
    back = outer * 2.0 + 0.5 * S / (0.01 * S + 1)
    plant = GAIN * S**2 / (MASS * S**2 + VISCOUS * S)
    found = filtered.frequency_response(FREQUENCY_HZ)[2, 0]
    np.testing.assert_allclose(found, plant * outer * 2.0 / (1 + plant * back), rtol=RTOL)


def test_the_rate_of_a_velocity_is_exact_though_it_follows_the_force() -> None:
    model = axis(feedback="speed", law="pi", gains={"kp": 2.0, "ki": 3.0})
    expected = value(control.feedback(GAIN * (2.0 + 3.0 / s) * s * PLANT, 1))
    found = model.compile().frequency_response(FREQUENCY_HZ)[1, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-8)
    rate = axis(feedback="speed", law="pd", gains={"kp": 2.0, "kd": 3.0}).compile()
    plant = GAIN * S / (MASS * S**2 + VISCOUS * S)
    np.testing.assert_allclose(
        rate.frequency_response(FREQUENCY_HZ)[1, 0], 2.0 * plant / (1 + plant * (2.0 + 3.0 * S)), rtol=RTOL
    )


def test_the_rate_of_a_prescribed_motion_is_its_own_column() -> None:
    # The displacement across a spring whose far end is prescribed: its rate holds the prescribed velocity.
    press = StructureModel(
        name="press",
        structure=replace(
            axis().structure,
            bodies=(*axis().structure.bodies, replace(axis().structure.bodies[0], name="table")),
            joints=(replace(axis().structure.joints[0], between=("table", "carriage"), stiffness=4e3, damping=20.0),),
        ),
        inputs=(
            replace(axis().inputs[0], name="shaker", at="table", kind="displacement"),
            replace(axis().inputs[0], channel="/force"),
        ),
        outputs=(replace(axis().outputs[0], name="gap", at="guide"),),
        controllers=(
            Controller(name="hold", feedback="gap", drives="motor", law="pd", gains={"kp": 9.0, "kd": 2.0}),
        ),
    )
    compiled = press.compile()
    shaker = [terminal.name for terminal in compiled.inputs].index("shaker")
    elastic = 4e3 + 20.0 * S + 9.0 + 2.0 * S
    # m (gap + table)'' = -(k + c s + kp + kd s) gap
    expected = -MASS * S**2 / (MASS * S**2 + elastic)
    np.testing.assert_allclose(compiled.frequency_response(FREQUENCY_HZ)[0, shaker], expected, rtol=RTOL)


def two_loops() -> StructureModel:
    """A velocity loop around the motor, and a hammer with a slow position hold beside it."""
    model = axis(law="p", feedback="speed", gains={"kp": 7.0}, reference=None)
    return replace(
        model,
        inputs=(*model.inputs, replace(model.inputs[0], name="hammer", channel=None)),
        controllers=(
            *model.controllers,
            Controller(name="hold", feedback="position", drives="hammer", law="p", gains={"kp": 90.0}),
        ),
    )


def test_several_loops_act_together() -> None:
    compiled = two_loops().compile()
    assert [terminal.name for terminal in compiled.inputs] == ["hold", "axis", "pulses"]
    total = MASS * S**2 + VISCOUS * S + GAIN * 7.0 * S + 90.0
    found = compiled.frequency_response(FREQUENCY_HZ)[0]
    np.testing.assert_allclose(found, np.stack([90.0 / total, GAIN * 7.0 / total, GAIN / total]), rtol=RTOL)


def test_effects_at_the_feedback_act_inside_the_loop() -> None:
    model = axis().with_effects([attached("gain_error", "position", {"gain": 1.25})])
    loop = GAIN * (KV * KP + KV * S) / (MASS * S**2 + VISCOUS * S) * 1.25
    expected = 1.25 * GAIN * KV * KP / (MASS * S**2 + VISCOUS * S) / (1 + loop)
    found = model.compile().frequency_response(FREQUENCY_HZ)[0, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_dead_time_of_the_motor_acts_inside_the_loop() -> None:
    model = axis().with_effects([attached("delay", "motor", {"delay": 4e-3})])
    late = np.exp(-4e-3 * S)
    plant = GAIN / (MASS * S**2 + VISCOUS * S)
    sensitivity = 1 / (1 + late * plant * (KV * KP + KV * S))
    found = model.compile().frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(found[0, 0], late * plant * KV * KP * sensitivity, rtol=1e-8)
    # The recorded command isn't late: the motor is.
    np.testing.assert_allclose(found[3, 0], GAIN * KV * KP * sensitivity, rtol=1e-8)


def test_a_floor_that_shakes_stays_behind_the_inputs_of_a_loop() -> None:
    shaken = axis().with_effects([attached("base_vibration", "ground", {"level": 0.1, "band": 50.0})]).compile()
    still = axis().compile()
    assert shaken.inputs == still.inputs
    np.testing.assert_array_equal(shaken.b[:, :2], still.b)
    np.testing.assert_allclose(shaken.b[:, 2], [0.0, -1.0])
    np.testing.assert_allclose(
        shaken.frequency_response(FREQUENCY_HZ), still.frequency_response(FREQUENCY_HZ), rtol=1e-12
    )


def test_what_acts_on_samples_can_t_act_inside_a_loop() -> None:
    compiled = replace(axis(), controllers=(), inputs=axis().inputs[:1]).compile()
    mapped = replace(compiled, output_maps=((0, lambda samples, _rate_hz: samples),))
    with pytest.raises(ModelError, match=r"can't act inside the loop"):
        close_loop(mapped, axis().controllers[0])
    early = replace(compiled, input_delays_s=(0.01,))
    with pytest.raises(ModelError, match="closed before effects act on inputs"):
        close_loop(early, axis().controllers[0])


def test_a_late_clock_of_the_recording_leaves_the_loop_alone() -> None:
    late = axis().with_effects([attached("time_offset", "position", {"offset": 2e-3})]).compile()
    np.testing.assert_array_equal(late.a, axis().compile().a)
    found, expected = late.frequency_response(FREQUENCY_HZ), axis().compile().frequency_response(FREQUENCY_HZ)
    np.testing.assert_allclose(found[0], expected[0] * np.exp(-2e-3 * S), rtol=RTOL)
    np.testing.assert_array_equal(found[1:], expected[1:])


def simulation(motions: tuple[PortMotion, ...] = ()) -> Simulation:
    series = TimeSeries(values=np.zeros((1, 4)), sample_rate_hz=100.0, channels=(Channel(name="/c", unit="m"),))
    return Simulation(
        model="axis", inputs=series, outputs=series, states=np.zeros((0, 4)), state_names=(), motions=motions
    )


def test_an_unstable_loop_is_told_with_its_poles() -> None:
    model = axis(law="pi", gains={"kp": 1.0, "ki": 90.0})
    (sentence,) = model.flags(simulation())
    worst = model.poles()[0]
    worst = complex(worst.real, abs(worst.imag))
    assert sentence.startswith("the closed loop is unstable: poles at ")
    assert f"{worst.real:.4g}{worst.imag:+.4g}j" in sentence
    assert "lower the gains of axis" in sentence
    assert axis().flags(simulation()) == ()


def test_a_loop_that_dead_time_makes_unstable_is_told() -> None:
    late = attached("delay", "motor", {"delay": 0.05})
    assert axis().flags(simulation()) == ()
    (sentence,) = axis().with_effects([late]).flags(simulation())
    assert sentence.startswith("the closed loop is unstable: poles at ")


def test_a_limit_that_was_reached_is_told_with_its_share() -> None:
    motion = PortMotion(
        name="axis.limit", kind="input", displacement=np.zeros(4), velocity=np.zeros(4),
        force=np.array([0.0, -3.0, 0.0, 0.0]),
    )  # fmt: skip
    assert axis(limit=10.0).flags(simulation((motion,))) == ("axis is at its limit of 10 V for 25.0% of the time",)


def test_numbers_outside_their_usual_range_are_told() -> None:
    (sentence,) = axis().with_values({"carriage.mass": 1000.0}).flags(simulation())
    assert sentence == "carriage.mass = 1000 kg is outside its usual range 23.75 to 380"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"gains": {"kp": 1.0}}, "gain kv is missing; law p-p has gains kp, kv, filter"),
        ({"gains": {"kp": 1.0, "kv": 1.0, "ki": 1.0}}, "gain ki is unknown"),
        ({"gains": {"kp": float("nan"), "kv": 1.0}}, "gain kp = nan must be finite"),
        ({"gains": {"kp": 1.0, "kv": 1.0, "filter": 0.0}}, "gain filter = 0.0 s must be positive"),
        ({"law": "transfer-function"}, "gain kp is unknown; law transfer-function has no gains"),
        ({"law": "transfer-function", "gains": {}}, "needs num and den"),
        ({"law": "transfer-function", "gains": {}, "num": (1.0,), "den": (0.0, 1.0)}, "begin with a coefficient"),
        ({"law": "transfer-function", "gains": {}, "num": (1.0, 1.0), "den": (1.0,)}, "num has degree 1, more than"),
        ({"num": (1.0,)}, "law p-p has no num and den"),
        ({"rate_of": "error"}, "rate_of is for the laws pd and pid, not for p-p"),
        ({"gain": 0.0}, "gain 0.0 must be finite and not zero"),
        ({"gain_unit": "N/mV"}, "gain_unit 'N/mV' is no SI unit"),
        ({"limit": 0.0}, "limit 0.0 must be finite and positive"),
        ({"feedback": "positn"}, "did you mean 'position'"),
    ],
)
def test_impossible_controllers_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        axis(**changes)


def test_the_limiter_takes_away_what_is_above() -> None:
    commands = np.linspace(-5.0, 5.0, 21)
    left = [d + limiter(d, 0.0, 0.0, (2.0,), (), ()) for d in commands]
    np.testing.assert_array_equal(left, np.clip(commands, -2.0, 2.0))
