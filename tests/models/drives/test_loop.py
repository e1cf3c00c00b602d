from dataclasses import replace

import numpy as np
import pytest

from chladni.models.core.port import Port, Terminal
from chladni.models.core.port_law import PortLaw
from chladni.models.core.state_space import StateSpace
from chladni.models.drives.equations import PlacedPort, compile_equations
from chladni.models.drives.loop import Loop, close_loop
from chladni.signals.errors import ModelError
from tests.models.drives.oracles import FREQUENCY_HZ, named

U, DISTURBANCE, R = (Terminal(name=name, unit="1") for name in ("u", "disturbance", "r"))
Y, Z = Terminal(name="y", unit="1"), Terminal(name="z", unit="1")


def plant(direct=0.0):
    """Two lags in a row; y the last, z the first with a direct way from u."""
    return compile_equations(
        rates={"x1": {"u": 2.0, "x1": -1.0, "joint:j": -1.0}, "x2": {"x1": 3.0, "disturbance": 1.0, "x2": -4.0}},
        signals={"z": {"x1": 1.0, "u": direct}, "y": {"x2": 1.0}},
        inputs=(DISTURBANCE, U),
        outputs=(Y, Z),
        ports=(PlacedPort(port=Port(name="j", kind="joint"), displacement={"z": 1.0}, velocity={}),),
    )


def controller(feedback=Y, gain=5.0, rate=0.7):
    return StateSpace(
        a=np.array([[-0.2]]), b=np.array([[rate, -rate]]), c=np.array([[1.5]]), d=np.array([[gain, -gain]]),
        inputs=(R, feedback), outputs=(U,), states=("k",),
    )  # fmt: skip


def by_hand(open_plant, feedback, regulator):
    """``Y = P (u) + Pd d``, ``u = K (r - w)`` at each frequency."""
    response = open_plant.state_space().frequency_response(FREQUENCY_HZ)
    k = regulator.frequency_response(FREQUENCY_HZ)[0, 0]
    row = named(open_plant.outputs).index(feedback)
    around = 1 + response[row, 1] * k
    return np.stack(
        [
            response[:, 1] * k / around,
            response[:, 0] - response[:, 1] * k * response[row, 0] / around,
        ],
        axis=1,
    )


@pytest.mark.parametrize(("feedback", "direct"), [(Y, 0.0), (Z, 0.0), (Z, 0.4), (Z, -0.15)])
def test_closed_loop_is_block_algebra(feedback, direct):
    closed = close_loop(plant(direct), Loop(controller=controller(feedback)))
    assert named(closed.inputs) == ["r", "disturbance"]
    assert closed.states == ("x1", "x2", "k")
    expected = by_hand(plant(direct), feedback.name, controller(feedback))
    np.testing.assert_allclose(closed.frequency_response(FREQUENCY_HZ), expected, rtol=1e-9, atol=1e-15)


def test_a_correction_without_feedback_stands_in_series():
    series = replace(controller(), b=np.array([[0.7]]), d=np.array([[5.0]]), inputs=(R,))
    closed = close_loop(plant(), Loop(controller=series))
    response = plant().state_space().frequency_response(FREQUENCY_HZ)
    k = series.frequency_response(FREQUENCY_HZ)[0]
    np.testing.assert_allclose(closed.frequency_response(FREQUENCY_HZ)[:, 0], response[:, 1] * k, rtol=1e-9)
    np.testing.assert_allclose(closed.frequency_response(FREQUENCY_HZ)[:, 1], response[:, 0], rtol=1e-9, atol=1e-15)


def test_a_direct_way_of_gain_one_is_refused():
    # u = -5 (z), z = ... - 0.2 u: around the loop exactly one.
    with pytest.raises(ModelError, match="the loop over 'u' is ill-posed"):
        close_loop(plant(-0.2), Loop(controller=controller(Z)))


def test_laws_inside_act_on_the_loop():
    """What a law adds at the command or a joint reaches every signal as an input there would."""
    closed = close_loop(plant(0.4), Loop(controller=controller(Z)))
    command = closed.port_index("u", "input")
    # An input that adds to u is the same as the port's force.
    adding = compile_equations(
        rates={"x1": {"sum": 2.0, "x1": -1.0}, "x2": {"x1": 3.0, "x2": -4.0}, "k": {"k": -0.2, "z": -0.7}},
        signals={
            # u = 1.5 k - 5 z, z = x1 + 0.4 (u + e), solved for u.
            "u": {"k": 1.5 / 3, "x1": -5 / 3, "e": -2.0 / 3},
            "sum": {"u": 1.0, "e": 1.0},
            "z": {"x1": 1.0, "sum": 0.4},
        },
        inputs=(Terminal(name="e", unit="1"),),
        outputs=(Terminal(name="x2", unit="1"), Z, U),
    )
    np.testing.assert_allclose(closed.g[:, command], adding.b[:, 0], rtol=1e-12)
    np.testing.assert_allclose(closed.h[:, command], adding.d[:2, 0], rtol=1e-12)
    # The port's d is the command before the force, which itself comes back around the loop.
    np.testing.assert_allclose(closed.displacement_state[command], adding.c[2], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(closed.displacement_port[command, command], adding.d[2, 0], rtol=1e-12)


def test_a_limit_stands_at_the_command_and_is_tracked():
    def law(d, s, t, parameters, state, rates):
        return -d

    first = PortLaw(port=0, function=law)
    closed = close_loop(plant(), Loop(controller=controller(), limit=first, tracking=(0.3,)))
    (placed,) = closed.laws
    assert closed.ports[placed.port] == Port(name="u_limit", kind="input", unit="1", displacement_unit="1")
    assert closed.g[closed.states.index("k"), placed.port] == 0.3
    free = close_loop(plant(), Loop(controller=controller(), tracking=(0.3,)))
    assert not np.any(free.g[free.states.index("k")])


def test_maps_and_dead_times_stay_with_their_inputs():
    def double(samples, sample_rate_hz):
        return 2 * samples

    before = replace(plant(), input_maps=((0, double),), input_delays_s=(0.5, 0.25))
    closed = close_loop(before, Loop(controller=controller()))
    assert closed.input_maps == ((1, double),)
    assert closed.input_delays_s == (0.0, 0.5)


def test_what_acts_on_samples_is_refused_inside():
    mapped = replace(plant(), output_maps=((0, abs),))
    with pytest.raises(ModelError, match="output 'y' feeds a loop"):
        close_loop(mapped, Loop(controller=controller()))
    close_loop(mapped, Loop(controller=controller(Z)))


def test_a_late_clock_of_the_log_stays_outside_of_the_loop():
    late, on_time = (
        close_loop(replace(plant(), output_offsets_s=offsets), Loop(controller=controller()))
        for offsets in ((0.1, 0.0), (0.0, 0.0))
    )
    assert late.output_offsets_s == (0.1, 0.0)
    np.testing.assert_array_equal(late.a, on_time.a)
    frequency_hz = np.array([0.3, 2.0])
    shift = np.exp(-2j * np.pi * frequency_hz * 0.1)
    found, expected = (one.frequency_response(frequency_hz) for one in (late, on_time))
    np.testing.assert_allclose(found[0], expected[0] * shift, rtol=1e-12)
    np.testing.assert_array_equal(found[1], expected[1])


def test_names_change_everywhere_in_a_loop():
    loop = Loop(controller=controller()).renamed({"u": "valve", "y": "stroke", "r": "wanted"})
    assert loop.command == "valve"
    assert named(loop.controller.inputs) == ["wanted", "stroke"]
