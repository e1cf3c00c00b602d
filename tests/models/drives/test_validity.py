from dataclasses import replace

import numpy as np
import pytest

from chladni.models.core.port import Terminal
from chladni.models.core.simulation import PortMotion, Simulation
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.selection import ChosenSignal
from chladni.models.drives.validity import Limit, acting_laws, broken_limits, unstable_loop
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.excitations.step import Step
from chladni.models.integrator.simulate import simulate
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries

RATE_HZ = 10.0


def simulation(states, inputs, motions=()):
    channels = tuple(Channel(name=name, unit="1") for name in inputs)
    series = TimeSeries(values=np.array(list(inputs.values())), sample_rate_hz=RATE_HZ, channels=channels)
    return Simulation(
        model="motor", inputs=series, outputs=series, states=np.array(list(states.values())),
        state_names=tuple(states), motions=motions,
    )  # fmt: skip


def at_rest(**changes):
    still = {"displacement": np.zeros(5), "velocity": np.zeros(5), "pressure_drop": np.zeros(5)}
    return {**still, **{name: np.asarray(samples, dtype=float) for name, samples in changes.items()}}


MOTOR = drive_model(DRIVES["pneumatic-motor"])


def test_nothing_is_said_inside_the_limits():
    found = MOTOR.flags(simulation(at_rest(displacement=[0, 0.1, 0.17, -0.17, 0]), {"flow": [0.0, 1e-4, 0, 0, 0]}))
    assert found == ()


@pytest.mark.parametrize(
    ("states", "inputs", "words"),
    [
        (
            {"displacement": [0, 0.1, 0.2, 0.25, 0.1]},
            {},
            "displacement reaches 25 cm, above 17.5 cm from 0.2 s on: the stroke ends there",
        ),
        ({"displacement": [0, -0.3, 0, 0, 0]}, {}, "displacement reaches -30 cm, below -17.5 cm from 0.1 s on"),
        ({"pressure_drop": [0, 0, 0, 0, 1.5e5]}, {}, "pressure drop reaches 1.5 bar, above 1 bar from 0.4 s on"),
        ({}, {"flow": [2e-4, 0, 0, 0, 0]}, "flow reaches 200 cm^3/s, above 100 cm^3/s from 0 s on"),
        ({}, {"load": [0, 0, 400.0, 0, 0]}, "load reaches 400 N, above 300 N from 0.2 s on: beyond the rated load"),
    ],
)
def test_what_leaves_its_limit_is_said_with_numbers_and_time(states, inputs, words):
    (sentence,) = MOTOR.flags(simulation(at_rest(**states), {"flow": np.zeros(5), **inputs}))
    assert sentence.startswith(words)


def test_rounding_at_an_end_of_the_stroke_is_no_leaving_of_it():
    rear = drive_model(DRIVES["pneumatic-motor"], {"start_position": 0.0})
    assert rear.flags(simulation(at_rest(displacement=[0, -1e-17, 0, 0, 0]), {"flow": np.zeros(5)})) == ()
    assert rear.flags(simulation(at_rest(displacement=[0, -1e-6, 0, 0, 0]), {"flow": np.zeros(5)})) != ()


def test_both_ends_are_told():
    found = MOTOR.flags(simulation(at_rest(displacement=[0.5, -0.5, 0, 0, 0]), {"flow": np.zeros(5)}))
    assert len(found) == 2


def test_an_input_is_found_by_its_channel_or_its_name_in_the_model():
    for choice, recorded in (
        (ChosenSignal(signal="flow", name="supply", channel="/flow"), "/flow"),
        (ChosenSignal(signal="flow", name="supply"), "supply"),
    ):
        model = drive_model(DRIVES["pneumatic-motor"], inputs=[choice])
        assert len(model.flags(simulation(at_rest(), {recorded: [1.0, 0, 0, 0, 0]}))) == 1


def test_with_stops_their_giving_way_is_no_leaving_of_the_stroke():
    model = drive_model(DRIVES["pneumatic-motor"], {}, {"end_stops": "on"})
    assert model.flags(simulation(at_rest(displacement=[0, 0.178, 0, 0, 0]), {"flow": np.zeros(5)})) == ()
    (sentence,) = model.flags(simulation(at_rest(displacement=[0, 0.18, 0, 0, 0]), {"flow": np.zeros(5)}))
    assert "the stops gave way by more than 1 % of the stroke" in sentence


def test_limits_of_a_signal_that_was_not_recorded_are_passed_over():
    limit = Limit(signal="temperature", high=1.0, unit="K", what="temperature", why="too hot")
    assert broken_limits([limit], simulation(at_rest(), {"flow": np.zeros(5)}), []) == ()


def test_laws_that_acted_are_said_with_their_share_of_the_time():
    def motion(name, force):
        zero = np.zeros(5)
        return PortMotion(name=name, kind="input", displacement=zero, velocity=zero, force=np.asarray(force))

    run = simulation(at_rest(), {"flow": np.zeros(5)}, (motion("voltage", [0.0, -1.0, 0, 0, 0]),))
    (sentence,) = acting_laws({"voltage": "the voltage limit", "current": "another"}, run)
    assert sentence.startswith("the voltage limit acts 20 % of the time")
    idle = simulation(at_rest(), {"flow": np.zeros(5)}, (motion("voltage", np.zeros(5)),))
    assert acting_laws({"voltage": "the voltage limit"}, idle) == ()


def test_a_limit_is_told_whatever_the_model_calls_its_input():
    model = drive_model(
        DRIVES["dc-servo"], {}, {"voltage_limiter": "on"}, inputs=[ChosenSignal(signal="voltage", name="drive")]
    )
    zero = np.zeros(5)
    motion = PortMotion(name="voltage_limit", kind="input", displacement=zero, velocity=zero, force=np.ones(5))
    states = dict.fromkeys(model.compile().states, zero)
    (sentence,) = model.flags(simulation(states, {"drive": zero}, (motion,)))
    assert "the voltage limit acts 100 %" in sentence


def test_an_unstable_loop_is_said_with_its_poles():
    kind = DRIVES["hydraulic-motor"]
    unstable = drive_model(kind, {"position_gain": 0.2}, {"loop": "position"})
    (sentence,) = unstable.flags(simulation(at_rest(), {"flow": np.zeros(5)}))
    assert sentence.startswith("unstable: poles at ")
    assert unstable_loop(drive_model(kind).compile()) == ()


def test_a_loop_that_dead_time_makes_unstable_is_said():
    # The current loop crosses over at K_i/L = 3333 rad/s; half pi over that is 0.47 ms.
    servo = drive_model(DRIVES["dc-servo"], {}, {"loop": "current"})
    for delay_s, told in ((0.4e-3, False), (0.55e-3, True)):
        late = servo.with_effects([attached("delay", "voltage", {"delay": delay_s})])
        flags = step(late, "current_reference", 0.1, seconds=5e-3, rate_hz=2e4).flags
        assert any(flag.startswith("unstable: poles at ") for flag in flags) == told


def test_a_drive_without_states_is_stable():
    assert unstable_loop(drive_model(DRIVES["mr-damper"]).compile()) == ()


def test_units_of_limits_are_known():
    for kind in DRIVES.values():
        values = kind.parameters.numbers()
        for limit in kind.limits(values, kind.choices({})):
            run = simulation({limit.signal: np.array([-1e30, 1e30])}, {"x": np.zeros(2)})
            assert len(broken_limits([limit], run, [(limit.signal, Terminal(name="x", unit="1"))])) == 2


def step(model, name, size, seconds=0.1, rate_hz=5e3):
    return simulate(model, {name: Step(size=size)}, duration_s=seconds, sample_rate_hz=rate_hz)


@pytest.mark.parametrize("shown", [(), (ChosenSignal(signal="displacement"),)], ids=["all", "without the flow"])
@pytest.mark.parametrize(("name", "size"), [("reference", 0.03), ("flow", 450e-6)])
def test_the_flow_through_the_valve_is_told_whatever_asks_for_it(shown, name, size):
    # 0.015 m^2/s times 0.03 m of error is 450 cm^3/s; the valve is rated for 400.
    model = drive_model(DRIVES["hydraulic-motor"], {}, {"loop": "position"}, outputs=shown)
    words = "flow through the valve reaches 450 cm^3/s, above 400 cm^3/s from 0 s on: beyond the rated flow"
    assert any(flag.startswith(words) for flag in step(model, name, size).flags)
    assert not any("flow through" in flag for flag in step(model, name, size / 2).flags)


def test_a_correction_that_asks_for_twice_the_flow_is_told():
    model = drive_model(DRIVES["hydraulic-motor"], {}, {"correction": "pd2"})
    assert any("flow through the valve reaches 498.9 cm^3/s" in flag for flag in step(model, "flow", 250e-6).flags)


def test_a_saturated_valve_gives_no_more_than_it_is_rated_for():
    options = {"loop": "position", "saturation": "on"}
    model = drive_model(DRIVES["hydraulic-motor"], {}, options, outputs=[ChosenSignal(signal="displacement")])
    flags = step(model, "reference", 0.03).flags
    assert not any("flow through" in flag for flag in flags)
    assert any("the valve's dead zone or saturation acts" in flag for flag in flags)


def test_nothing_is_guessed_of_a_signal_behind_dead_time():
    model = drive_model(DRIVES["hydraulic-motor"], {}, {"loop": "position"})
    run = step(model, "reference", 0.03)
    late = model.with_effects([attached("delay", "flow", {"delay": 2e-3})])
    # The same states mean another flow there, which nothing recorded.
    assert any("flow through" in flag for flag in model.flags(run))
    assert not any("flow through" in flag for flag in late.flags(run))


@pytest.mark.parametrize(
    ("loop", "told"), [("open", True), ("current", True), ("velocity", False), ("position", False)]
)
def test_a_limiter_without_anything_to_limit_is_told(loop, told):
    model = drive_model(DRIVES["dc-servo"], {}, {"loop": loop, "current_limiter": "on"})
    name = "voltage" if loop == "open" else f"{loop}_reference"
    assert any("current_limiter is on, but limits nothing" in flag for flag in step(model, name, 0.1).flags) == told


@pytest.mark.parametrize("law", ["paper", "asymmetric"])
def test_a_current_that_no_log_had_is_told(law):
    for current, told in ((1.0, False), (1.5, True)):
        model = drive_model(DRIVES["mr-damper"], {"current": current}, {"law": law})
        still = simulation({}, {"displacement": np.zeros(5)})
        assert any("current = 1.5 A lies outside of the fitted 0 to 1 A" in one for one in model.flags(still)) == told


def _far(port, values, _simulation):
    return (f"far at {port.name} ({port.kind}) with {values['gain']:g}",)


FLAGGING = replace(CATALOGUE["gain_error"], name="own", sites=("joint", "input", "output"), flags=_far)


@pytest.mark.parametrize(
    ("site", "kind", "shown"),
    [
        ("supply", "input", ()),
        ("pressure_drop", "output", ()),
        ("pressure_drop", "output", (ChosenSignal(signal="velocity"),)),
    ],
)
def test_what_effects_say_is_said(site, kind, shown):
    model = drive_model(
        DRIVES["pneumatic-motor"], inputs=[ChosenSignal(signal="flow", name="supply")], outputs=shown
    ).with_effects([attached(FLAGGING, site, {"gain": 2.0})])
    assert model.flags(simulation(at_rest(), {"supply": np.zeros(5)})) == (f"far at {site} ({kind}) with 2",)
