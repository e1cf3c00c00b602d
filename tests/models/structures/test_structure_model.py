"""Structures with inputs and outputs against closed forms, and what a model tells about itself."""

from collections.abc import Callable
from dataclasses import fields, replace
from math import pi, sqrt

import numpy as np
import pytest

from chladni.models.structures.robot_arm import robot_arm
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput
from chladni.signals.arrays import Complex
from chladni.signals.errors import ModelError
from tests.models.structures.made_models import axis, tree

FREQUENCY_HZ = np.linspace(0.5, 120.0, 60)
S = 2j * pi * FREQUENCY_HZ
# Both sides solve a system of a few equations whose condition number stays below 1e6.
RTOL = 1e-9


def response(model: StructureModel, output: str, source: str) -> Complex:
    compiled = model.compile()
    row = [terminal.name for terminal in compiled.outputs].index(output)
    column = [terminal.name for terminal in compiled.inputs].index(source)
    return compiled.frequency_response(FREQUENCY_HZ)[row, column]


def test_forces_at_bodies_and_joints_move_the_bodies_as_the_receptance_says() -> None:
    model = tree()
    receptance = model.structure.receptance(FREQUENCY_HZ)
    base, left, right = 0, 1, 2
    np.testing.assert_allclose(response(model, "acc", "hammer"), S**2 * receptance[right, left], rtol=RTOL)
    np.testing.assert_allclose(response(model, "vel", "hammer"), S * receptance[base, left], rtol=RTOL)
    # An actuator pushes the second body and pulls the first.
    actuator = receptance[:, right] - receptance[:, base]
    np.testing.assert_allclose(response(model, "dis", "actuator"), actuator[left], rtol=RTOL)
    stretch = actuator[right] - actuator[left]
    np.testing.assert_allclose(response(model, "stretch", "actuator"), stretch, rtol=RTOL)
    np.testing.assert_allclose(response(model, "stretching", "actuator"), S**2 * stretch, rtol=RTOL)
    np.testing.assert_allclose(response(model, "pull", "actuator"), (2e4 + 3.0 * S) * stretch, rtol=RTOL)


def test_a_shaken_floor_acts_on_every_body_by_its_inertia() -> None:
    model = tree()
    receptance = model.structure.receptance(FREQUENCY_HZ)
    relative = -np.einsum("ijf,j->if", receptance, np.diag(model.structure.mass_matrix()))
    np.testing.assert_allclose(response(model, "dis", "floor"), relative[1], rtol=RTOL)
    np.testing.assert_allclose(response(model, "vel", "floor"), S * relative[0], rtol=RTOL)
    # What accelerometers feel is absolute; between the ends of a joint the floor cancels.
    np.testing.assert_allclose(response(model, "acc", "floor"), 1 + S**2 * relative[2], rtol=RTOL)
    np.testing.assert_allclose(
        response(model, "stretching", "floor"), S**2 * (relative[2] - relative[1]), rtol=RTOL, atol=1e-12
    )


def test_transmissibility_of_one_mass_on_a_shaken_floor_is_the_textbook_formula() -> None:
    model = StructureModel(
        name="one",
        structure=Structure(
            bodies=(Body(name="mass", mass=2.0),),
            joints=(Joint(name="mount", between=("ground", "mass"), stiffness=3e4, damping=40.0),),
        ),
        inputs=(StructureInput(name="floor", at="ground", kind="base_acceleration"),),
        outputs=(StructureOutput(name="acc", measures="acceleration", at="mass"),),
    )
    elastic = 3e4 + 40.0 * S
    np.testing.assert_allclose(response(model, "acc", "floor"), elastic / (elastic + 2.0 * S**2), rtol=RTOL)


def prescribed(**joint: float) -> StructureModel:
    """A rod whose stroke is prescribed, with a slider that hangs on it."""
    return StructureModel(
        name="press",
        structure=Structure(
            bodies=(Body(name="rod", mass=1.0), Body(name="slider", mass=2.0)),
            joints=(
                Joint(name="damper", between=("ground", "rod"), stiffness=1e3, damping=8e3),
                Joint(name="link", between=("rod", "slider"), stiffness=2e4, damping=30.0),
            ),
        ),
        inputs=(StructureInput(name="stroke", at="rod", kind="displacement"),),
        outputs=(
            StructureOutput(name="force", measures="force", at="damper"),
            StructureOutput(name="slide", measures="displacement", at="slider"),
            StructureOutput(name="speed", measures="velocity", at="rod"),
            StructureOutput(name="acc", measures="acceleration", at="rod"),
        ),
    )


def test_a_prescribed_motion_takes_the_body_out_of_the_states() -> None:
    model = prescribed()
    compiled = model.compile()
    assert compiled.states == ("slider.displacement", "slider.velocity")
    assert [terminal.derivatives for terminal in compiled.inputs] == [2]
    np.testing.assert_allclose(response(model, "force", "stroke"), 1e3 + 8e3 * S, rtol=RTOL)
    elastic = 2e4 + 30.0 * S
    np.testing.assert_allclose(response(model, "slide", "stroke"), elastic / (elastic + 2.0 * S**2), rtol=RTOL)
    np.testing.assert_allclose(response(model, "speed", "stroke"), S, rtol=RTOL)
    np.testing.assert_allclose(response(model, "acc", "stroke"), S**2, rtol=RTOL)
    # The slider swings on a rod that stands still.
    np.testing.assert_allclose(model.modes().frequency_hz, [sqrt(2e4 / 2.0) / (2 * pi)], rtol=RTOL)
    assert model.modes().shapes[0, 0] == 0


def test_a_structure_whose_only_body_is_prescribed_has_no_states() -> None:
    model = prescribed()
    alone = replace(
        model,
        structure=Structure(bodies=model.structure.bodies[:1], joints=model.structure.joints[:1]),
        outputs=model.outputs[:1],
    )
    compiled = alone.compile()
    assert compiled.states == ()
    assert compiled.d.tolist() == [[1e3, 8e3, 0.0]]
    np.testing.assert_allclose(response(alone, "force", "stroke"), 1e3 + 8e3 * S, rtol=RTOL)
    assert alone.poles().size == 0
    assert alone.modes().shapes.shape == (0, 1)


def test_ports_see_the_motion_of_their_place_and_push_where_they_stand() -> None:
    compiled = tree().compile()
    mass = {"base": 8.0, "left": 2.0, "right": 3.0}
    state = {name: place for place, name in enumerate(compiled.states)}
    tie, left = compiled.port_index("tie", "joint"), compiled.port_index("left", "body")
    knee, ground = compiled.port_index("actuator", "actuation"), compiled.port_index("ground", "ground")
    for port, seen in ((tie, {"left": -1, "right": 1}), (left, {"left": 1}), (knee, {"base": -1, "right": 1})):
        for rows, kind in ((compiled.displacement_state, "displacement"), (compiled.velocity_state, "velocity")):
            expected = np.zeros(6)
            for name, sign in seen.items():
                expected[state[f"{name}.{kind}"]] = sign
            np.testing.assert_array_equal(rows[port], expected)
    velocity = [state[f"{name}.velocity"] for name in mass]
    np.testing.assert_allclose(compiled.g[velocity, tie], [0, 1 / 2.0, -1 / 3.0])
    np.testing.assert_allclose(compiled.g[velocity, left], [0, 1 / 2.0, 0])
    np.testing.assert_allclose(compiled.g[velocity, knee], [-1 / 8.0, 0, 1 / 3.0])
    np.testing.assert_allclose(compiled.g[velocity, ground], [-1, -1, -1])
    # A law's force belongs to the joint's force; the ground's acceleration cancels in no accelerometer.
    pull = [terminal.name for terminal in compiled.outputs].index("pull")
    assert compiled.h[pull, tie] == 1.0
    assert compiled.ports[tie].stiffness == 2e4
    assert compiled.ports[tie].damping == 3.0


def test_a_law_at_the_tie_acts_as_a_stiffer_tie() -> None:
    # A linear law -kappa d at the port closed by hand must equal the structure with the spring in it.
    model, kappa = tree(), 7e3
    compiled = model.compile()
    tie = compiled.port_index("tie", "joint")
    stiffer = model.with_values({"tie.stiffness": 2e4 + kappa}).compile()
    by_hand = compiled.a + kappa * np.outer(compiled.g[:, tie], compiled.displacement_state[tie])
    np.testing.assert_allclose(by_hand, stiffer.a, rtol=1e-12, atol=1e-9)
    outputs = compiled.c + kappa * np.outer(compiled.h[:, tie], compiled.displacement_state[tie])
    np.testing.assert_allclose(outputs, stiffer.c, rtol=1e-12, atol=1e-9)


def test_rotating_structures_have_their_own_units() -> None:
    model = StructureModel(
        name="shaft",
        structure=Structure(
            bodies=(
                Body(name="motor", mass=0.02, motion="rotation"),
                Body(name="load", mass=0.1, motion="rotation"),
            ),
            joints=(Joint(name="shaft", between=("motor", "load"), stiffness=500.0, damping=0.05),),
        ),
        inputs=(StructureInput(name="torque", at="motor"), StructureInput(name="turn", at="ground",
                                                                          kind="base_acceleration")),
        outputs=(
            StructureOutput(name="speed", measures="velocity", at="load"),
            StructureOutput(name="twist", measures="displacement", at="shaft"),
            StructureOutput(name="twisting", measures="force", at="shaft"),
            StructureOutput(name="angular", measures="acceleration", at="load"),
        ),
    )  # fmt: skip
    compiled = model.compile()
    assert [terminal.unit for terminal in compiled.inputs] == ["N m", "rad/s^2"]
    assert [terminal.unit for terminal in compiled.outputs] == ["rad/s", "rad", "N m", "rad/s^2"]
    units = {one.name: one.unit for one in model.parameters.items_in_order}
    assert units == {
        "motor.inertia": "kg m^2",
        "load.inertia": "kg m^2",
        "shaft.stiffness": "N m/rad",
        "shaft.damping": "N m s/rad",
    }
    # Two free inertias: one mode at sqrt(k (1/J1 + 1/J2)), and a rotation of both that is no oscillation.
    np.testing.assert_allclose(model.modes().frequency_hz, [sqrt(500.0 * (1 / 0.02 + 1 / 0.1)) / (2 * pi)], rtol=1e-6)
    np.testing.assert_allclose(model.modes().shapes[0].real, [1.0, -0.2], rtol=1e-6)


def test_open_loop_modes_are_those_of_the_structure() -> None:
    arm = robot_arm()
    model = StructureModel(name="arm", structure=arm)
    found, expected = model.modes("open"), arm.natural_modes()
    np.testing.assert_allclose(found.frequency_hz, expected.frequency_hz, rtol=RTOL)
    np.testing.assert_allclose(found.damping_ratio, expected.damping_ratio, rtol=1e-7)
    np.testing.assert_allclose(found.shapes, expected.shapes, atol=1e-7)


def test_parameters_carry_values_ranges_and_tolerances() -> None:
    model = replace(tree(), tolerances={"tie.stiffness": 0.3}, default_tolerance=0.1)
    assert model.parameters["tie.stiffness"].tolerance == 0.3
    assert model.parameters["tie.damping"].tolerance == 0.1
    assert model.parameters["base.mass"].value == 8.0
    changed = model.with_values({"tie.stiffness": 9e4, "base.mass": 7.0})
    assert changed.structure.joint_named("tie").stiffness == 9e4
    assert changed.structure.bodies[0].mass == 7.0
    # Ranges stay those of the nominal value, so that a knob doesn't move its own ends.
    assert changed.parameters["tie.stiffness"].high == model.parameters["tie.stiffness"].high
    assert changed.parameters["tie.stiffness"].tolerance == 0.3


def test_parameters_of_a_controller_reach_the_loop() -> None:
    numbers = axis(limit=10.0).parameters.numbers()
    assert numbers == {
        "carriage.mass": 95.0, "guide.stiffness": 0.0, "guide.damping": 300.0,
        "axis.kp": 160.18, "axis.kv": 243.45, "axis.gain": 35.15, "axis.limit": 10.0,
    }  # fmt: skip
    changed = axis(limit=10.0).with_values({"axis.kp": 100.0, "axis.gain": 30.0, "axis.limit": 5.0})
    assert changed.controllers[0] == axis(limit=5.0, gain=30.0, gains={"kp": 100.0, "kv": 243.45}).controllers[0]
    lag = {"law": "transfer-function", "gains": {}, "num": (2.0, 3.0), "den": (0.1, 1.0)}
    model = axis(**lag)
    assert {"axis.num1": 2.0, "axis.num0": 3.0, "axis.den1": 0.1, "axis.den0": 1.0}.items() <= (
        model.parameters.numbers().items()
    )
    assert model.with_values({"axis.num0": 5.0}).controllers[0].num == (2.0, 5.0)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"tie.stiff": 1.0}, "did you mean tie.stiffness"),
        ({"tie.stiffness": -1.0}, "not possible"),
        ({"base.mass": 0.0}, "must be finite and positive"),
    ],
)
def test_impossible_values_are_refused(values: dict[str, float], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        tree().with_values(values)


def test_a_tolerance_of_nothing_is_refused() -> None:
    with pytest.raises(ModelError, match=r"did you mean tie\.stiffness"):
        replace(tree(), tolerances={"tie.stiffnss": 0.1})


def test_declared_parameters_must_be_those_of_the_parts() -> None:
    with pytest.raises(ModelError, match="other values than its parts"):
        replace(tree(), declared=tree().parameters.with_values({"base.mass": 1.0}))


@pytest.mark.parametrize("make", [tree, lambda: axis(limit=10.0)])
def test_other_numbers_give_the_equations_of_a_model_made_with_them(make: Callable[[], StructureModel]) -> None:
    """A changed model skips the checks of its wiring and takes what is laid out for it: nothing else may differ."""
    model = make()
    model.compile()
    rng = np.random.default_rng(0)
    values = {name: number * rng.uniform(0.5, 2.0) for name, number in model.parameters.numbers().items()}
    changed = model.with_values(values)
    anew = StructureModel(
        name=model.name,
        structure=Structure(
            bodies=tuple(replace(body) for body in changed.structure.bodies),
            joints=tuple(replace(joint) for joint in changed.structure.joints),
        ),
        inputs=model.inputs,
        outputs=model.outputs,
        controllers=changed.controllers,
    )
    assert anew.parameters.numbers() == pytest.approx(values)
    assert changed.parameters.numbers() == values
    found, wanted = changed.compile(), anew.compile()
    for field in fields(found):
        np.testing.assert_equal(getattr(found, field.name), getattr(wanted, field.name))
    # And the equations are those of the matrices, with new numbers in them.
    count = len(changed.structure.bodies)
    if not changed.controllers:
        force = np.diag([body.mass for body in changed.structure.bodies]) @ found.a[count:]
        matrices = [-changed.structure.stiffness_matrix(), -changed.structure.damping_matrix()]
        np.testing.assert_allclose(force, np.hstack(matrices), rtol=1e-12, atol=1e-6)
    assert [port.stiffness for port in found.ports if port.kind == "joint"] == [
        joint.stiffness for joint in changed.structure.joints
    ]
