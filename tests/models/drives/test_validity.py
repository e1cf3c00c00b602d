import numpy as np
import pytest

from chladni.models.core.port import Terminal
from chladni.models.core.simulation import PortMotion, Simulation
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.selection import ChosenSignal
from chladni.models.drives.validity import Limit, acting_laws, broken_limits, unstable_loop
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


def test_a_drive_without_states_is_stable():
    assert unstable_loop(drive_model(DRIVES["mr-damper"]).compile()) == ()


def test_units_of_limits_are_known():
    for kind in DRIVES.values():
        values = kind.parameters.numbers()
        for limit in kind.limits(values, kind.choices({})):
            run = simulation({limit.signal: np.array([-1e30, 1e30])}, {"x": np.zeros(2)})
            assert len(broken_limits([limit], run, [(limit.signal, Terminal(name="x", unit="1"))])) == 2
