import numpy as np
import pytest

from chladni.models.core.port import Port, Terminal
from chladni.models.core.port_law import PortLaw
from chladni.models.drives.equations import PlacedPort, compile_equations
from chladni.signals.errors import ModelError

FORCE = Terminal(name="force", unit="N")
POSITION = Terminal(name="position", unit="m")
ACCELERATION = Terminal(name="acceleration", unit="m/s^2")


def law(d, s, t, parameters, state, rates):
    return parameters[0] * d


def oscillator(**changes):
    acceleration = {"position": -4.0, "velocity": -0.5, "force": 2.0, "joint:guide": -2.0}
    given = {
        "rates": {"position": {"velocity": 1.0}, "velocity": {"acceleration": 1.0}},
        "signals": {"acceleration": acceleration, "jerk": {"acceleration": 3.0, "velocity": 1.0}},
        "inputs": (FORCE,),
        "outputs": (ACCELERATION, POSITION, Terminal(name="jerk", unit="1")),
        "ports": (
            PlacedPort(
                port=Port(name="guide", kind="joint"),
                displacement={"position": 1.0},
                velocity={"velocity": 1.0},
                laws=(PortLaw(port=0, function=law, parameters=(3.0,)),),
            ),
            PlacedPort(port=Port(name="position", kind="output"), displacement={"position": 1.0}, velocity={}),
        ),
        **changes,
    }
    return compile_equations(**given)


def test_rows_are_the_sums_with_signals_put_in():
    compiled = oscillator()
    np.testing.assert_array_equal(compiled.a, [[0, 1], [-4, -0.5]])
    np.testing.assert_array_equal(compiled.b, [[0], [2]])
    np.testing.assert_array_equal(compiled.c, [[-4, -0.5], [1, 0], [-12, -0.5]])
    np.testing.assert_array_equal(compiled.d, [[2], [0], [6]])
    np.testing.assert_array_equal(compiled.g, [[0, 0], [-2, 0]])
    # The force of the joint reaches what is made of the acceleration; the output's port only its output.
    np.testing.assert_array_equal(compiled.h, [[-2, 0], [0, 1], [-6, 0]])


def test_ports_see_their_motion_and_carry_their_laws():
    compiled = oscillator()
    np.testing.assert_array_equal(compiled.displacement_state, [[1, 0], [1, 0]])
    np.testing.assert_array_equal(compiled.velocity_state, [[0, 1], [0, 0]])
    assert [law.port for law in compiled.laws] == [0]
    assert compiled.laws[0].parameters == (3.0,)


def test_a_second_ports_law_knows_its_place():
    first, second = oscillator().ports, PlacedPort(
        port=Port(name="hand", kind="body"), displacement={"position": 1.0}, velocity={"velocity": 1.0},
        laws=(PortLaw(port=0, function=law, parameters=(1.0,)),),
    )  # fmt: skip
    empty = PlacedPort(port=first[0], displacement={}, velocity={})
    assert [law.port for law in oscillator(ports=(empty, second)).laws] == [1]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"rates": {"position": {"speed": 1.0}, "velocity": {}}},
            "position: 'speed' is no signal; there are: position",
        ),
        ({"outputs": (Terminal(name="torque", unit="N m"),)}, "output torque: 'torque' is no signal"),
        ({"signals": {"jerk": {"acceleration": 1.0}, "acceleration": {}}}, "jerk: 'acceleration' is no signal"),
    ],
)
def test_a_name_that_is_not_there_is_told(changes, message):
    with pytest.raises(ModelError, match=message):
        oscillator(**changes)
