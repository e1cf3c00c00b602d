"""Compiled models written out by hand: one body on a spring, alone and inside a loop."""

from dataclasses import replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, Terminal
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput

MASS, STIFFNESS, DAMPING = 2.0, 800.0, 4.0
JOINT, BODY, INPUT = "spring", "mass", "motor"
OUTPUTS = ("acc", "speed", "place")
#: Site of each kind of port.
SITES = {
    "joint": JOINT,
    "body": BODY,
    "ground": "ground",
    "input": INPUT,
    "output": "acc",
    "pair": "ground~mass",
    "output_pair": "acc~speed",
}


def one_body(mass: float = MASS, stiffness: float = STIFFNESS, damping: float = DAMPING) -> CompiledModel:
    """``mass x'' = u - stiffness x - damping x' - mass a_ground``, x relative to the ground, no loop.

    Outputs: acceleration as an accelerometer feels it, velocity, displacement. No ports at inputs and outputs.
    """
    # Columns: what the joint's law (resists), the body's, the ground's, and the actuator's law do to x''.
    push = np.array([-1 / mass, 1 / mass, -1.0, 1 / mass])
    row = np.array([-stiffness / mass, -damping / mass])
    motion = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 0.0], [1.0, 0.0]])
    felt = push + np.array([0.0, 0.0, 1.0, 0.0])
    return CompiledModel(
        a=np.array([[0.0, 1.0], row]),
        b=np.array([[0.0], [1 / mass]]),
        c=np.array([row, [0.0, 1.0], [1.0, 0.0]]),
        d=np.array([[1 / mass], [0.0], [0.0]]),
        g=np.vstack([np.zeros(4), push]),
        h=np.vstack([felt, np.zeros((2, 4))]),
        displacement_state=motion,
        displacement_column=np.zeros((4, 1)),
        displacement_port=np.zeros((4, 4)),
        velocity_state=motion[:, ::-1],
        velocity_column=np.zeros((4, 1)),
        velocity_port=np.zeros((4, 4)),
        inputs=(Terminal(name=INPUT, unit="N"),),
        outputs=(
            Terminal(name="acc", unit="m/s^2"),
            Terminal(name="speed", unit="m/s"),
            Terminal(name="place", unit="m"),
        ),
        states=("x", "v"),
        ports=(
            Port(name=JOINT, kind="joint", stiffness=stiffness, damping=damping),
            Port(name=BODY, kind="body"),
            Port(name="ground", kind="ground", unit="m/s^2"),
            Port(name=INPUT, kind="actuation"),
        ),
    )


def with_loop(plant: CompiledModel, gain: float = 300.0) -> CompiledModel:
    """``u = gain (reference - place)``: the input becomes the reference, the motor gets a port inside the loop."""
    place = [terminal.name for terminal in plant.outputs].index("place")
    column, to_f = plant.b[:, 0], plant.h[place]
    states, columns, ports = -gain * plant.c[place], np.zeros(plant.columns), -gain * to_f
    columns[0] = gain
    return replace(
        plant,
        a=plant.a + np.outer(column, states),
        b=np.column_stack([gain * column, plant.b[:, 1:]]),
        c=plant.c + np.outer(plant.d[:, 0], states),
        d=np.column_stack([gain * plant.d[:, 0], plant.d[:, 1:]]),
        g=np.column_stack([plant.g + np.outer(column, ports), column]),
        h=np.column_stack([plant.h + np.outer(plant.d[:, 0], ports), plant.d[:, 0]]),
        displacement_state=np.vstack([plant.displacement_state, states]),
        displacement_column=np.vstack([plant.displacement_column, columns]),
        displacement_port=np.block(
            [[plant.displacement_port, np.zeros((len(plant.ports), 1))], [ports, np.zeros(1)]]
        ),
        velocity_state=np.vstack([plant.velocity_state, np.zeros(len(plant.states))]),
        velocity_column=np.vstack([plant.velocity_column, np.zeros(plant.columns)]),
        velocity_port=np.pad(plant.velocity_port, ((0, 1), (0, 1))),
        inputs=(Terminal(name="reference", unit="m"),),
        ports=(*plant.ports, Port(name=INPUT, kind="input")),
    )


def two_bodies() -> CompiledModel:
    """The same body, and another one on a spring of its own that nothing else holds."""
    measures = {"acc": "acceleration", "speed": "velocity", "place": "displacement"}
    return StructureModel(
        name="two",
        structure=Structure(
            bodies=(Body(name=BODY, mass=MASS), Body(name="other", mass=MASS)),
            joints=(
                Joint(name=JOINT, between=("ground", BODY), stiffness=STIFFNESS, damping=DAMPING),
                Joint(name="second", between=("ground", "other"), stiffness=STIFFNESS, damping=DAMPING),
            ),
        ),
        inputs=(StructureInput(name=INPUT, at=BODY),),
        outputs=tuple(StructureOutput(name=name, measures=what, at=BODY) for name, what in measures.items()),
    ).compile()
