from dataclasses import replace

import numpy as np
import pytest

from chladni.models.effects.linear_feedback import (
    displacement,
    ground_acceleration,
    output,
    rate,
    velocity,
    with_feedback,
)
from chladni.signals.errors import ModelError
from tests.models.effects.small_models import one_body, with_loop
from tests.models.structures.made_models import tree

FREQUENCY_HZ = np.linspace(0.1, 20.0, 30)


def test_a_spring_and_a_damper_by_feedback_are_those_of_the_model() -> None:
    plant = one_body()
    port = plant.port_index("spring")
    force = displacement(plant, port).scaled(200.0) + velocity(plant, port).scaled(1.5)
    stiffer, _ = with_feedback(plant, port, force)
    wanted = one_body(stiffness=1000.0, damping=5.5)
    np.testing.assert_allclose(
        stiffer.frequency_response(FREQUENCY_HZ), wanted.frequency_response(FREQUENCY_HZ), rtol=1e-12
    )


def test_feedback_that_sees_its_own_force_is_solved_for() -> None:
    plant = with_loop(one_body())
    port = plant.port_index("motor", "input")
    sensed = replace(plant, displacement_port=plant.displacement_port + np.outer(np.eye(5)[port], np.eye(5)[port]))
    # d is now the command plus what is added itself: added = 0.5 d means added = 0.5 (command + added), or command.
    _, added = with_feedback(sensed, port, displacement(sensed, port).scaled(0.5))
    np.testing.assert_allclose(added.states, plant.displacement_state[port], rtol=1e-14)
    with pytest.raises(ModelError, match=r"'motor': an algebraic loop with a gain of one has no solution"):
        with_feedback(sensed, port, displacement(sensed, port))


def test_a_rate_is_the_derivative_in_the_frequency_domain() -> None:
    plant = one_body()
    fast = rate(plant, velocity(plant, 0), "spring")
    np.testing.assert_allclose(fast.states, plant.a[1])
    np.testing.assert_allclose(fast.columns, plant.b[1])
    np.testing.assert_allclose(fast.ports, plant.g[1])


def test_what_jumps_has_no_rate() -> None:
    plant = one_body()
    with pytest.raises(ModelError, match=r"'acc': what moves there jumps with a force"):
        rate(plant, output(plant, 0), "acc")
    by_input = replace(output(plant, 0), ports=np.zeros(4))
    with pytest.raises(ModelError, match=r"'acc': what moves there follows an input at once"):
        rate(plant, by_input, "acc")


def test_the_ground_is_felt_where_coordinates_move_with_it() -> None:
    compiled = tree().compile()
    felt = ground_acceleration(compiled, compiled.port_index("left"))
    np.testing.assert_array_equal(felt.columns, [0.0, 0.0, 1.0])
    assert felt.ports[compiled.port_index("ground")] == 1.0
    assert np.sum(felt.ports) == 1.0


def test_the_ground_is_not_felt_where_coordinates_stand_still() -> None:
    plant = one_body()
    still = np.array(plant.g)
    still[1, 2] = 0.0
    assert not np.any(ground_acceleration(replace(plant, g=still), 1).ports)
    without = tuple(replace(port, kind="body") if port.kind == "ground" else port for port in plant.ports)
    assert not np.any(ground_acceleration(replace(plant, ports=without), 1).ports)
