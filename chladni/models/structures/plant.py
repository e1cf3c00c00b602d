"""The equations of a structure before its loops are closed.

With x the displacement of all bodies relative to the ground, f what acts on them, a the ground's acceleration::

    M x'' + C x' + K x = f - M 1 a

In coordinates that move with the ground a floor that shakes needs no states of its own. A body whose motion is
prescribed has no state either: its displacement, velocity and acceleration are columns of u.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, PortKind, Terminal
from chladni.models.structures.structure import GROUND, Body, Joint, Motion, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_output import StructureOutput, measure_unit
from chladni.signals.arrays import Real


# One setting is compiled for its charts and for its flags.
@lru_cache(maxsize=2)
def compile_plant(
    structure: Structure,
    inputs: tuple[StructureInput, ...],
    outputs: tuple[StructureOutput, ...],
    *,
    fed_back: tuple[str, ...] = (),
) -> CompiledModel:
    """Compile a structure with its inputs and outputs, all loops open.

    Parameters
    ----------
    inputs
        Without disturbances of controllers.
    fed_back
        Outputs that feed a controller: they have an ``output`` port, since what acts on them acts in the loop.

    Returns
    -------
    States are displacement and velocity of each body that is free to move; ports are of kind ``joint``, ``body``,
    ``ground``, ``actuation`` for each force, and ``output`` for each of `fed_back`.
    """
    bodies = tuple((body.name, body.motion) for body in structure.bodies)
    joints = tuple((joint.name, joint.between) for joint in structure.joints)
    return _plant(bodies, joints, inputs, outputs, fed_back).compiled(structure)


def force_pattern(structure: Structure, at: str) -> Real:
    """``[body]``: how a unit force at a body, or of an actuator at a joint, acts on the bodies."""
    if any(body.name == at for body in structure.bodies):
        return structure.pattern((GROUND, at))
    return structure.pattern(structure.joint_named(at).between)


def motion_at(structure: Structure, at: str) -> Motion:
    """Whether what a body or joint does is a translation or a rotation."""
    for body in structure.bodies:
        if body.name == at:
            return body.motion
    return structure.motion_of(structure.joint_named(at))


def shaken_motion(structure: Structure) -> Motion:
    """What the ground does when it shakes: it translates, unless all bodies rotate."""
    return "translation" if any(body.motion == "translation" for body in structure.bodies) else "rotation"


def input_terminal(structure: Structure, one: StructureInput) -> Terminal:
    """Name, unit and channel of an input that isn't a disturbance."""
    if one.kind == "base_acceleration":
        unit = measure_unit("acceleration", shaken_motion(structure))
    else:
        unit = measure_unit("force" if one.kind == "force" else "displacement", motion_at(structure, one.at))
    derivatives = 2 if one.kind == "displacement" else 0
    return Terminal(name=one.name, unit=unit, channel=one.channel, derivatives=derivatives, hold=one.hold)


def output_terminal(structure: Structure, one: StructureOutput) -> Terminal:
    """Name, unit and channel of an output."""
    unit = measure_unit(one.measures, motion_at(structure, one.at))
    return Terminal(name=one.name, unit=unit, channel=one.channel, hold=one.hold)


# Fits and charts ask for one plant with thousands of numbers.
@lru_cache(maxsize=8)
def _plant(
    bodies: tuple[tuple[str, Motion], ...],
    joints: tuple[tuple[str, tuple[str, str]], ...],
    inputs: tuple[StructureInput, ...],
    outputs: tuple[StructureOutput, ...],
    fed_back: tuple[str, ...],
) -> "_Plant":
    structure = Structure(
        bodies=tuple(Body(name=name, motion=motion, mass=1.0) for name, motion in bodies),
        joints=tuple(Joint(name=name, between=between, stiffness=0.0, damping=0.0) for name, between in joints),
    )
    return _Plant(structure, inputs, outputs, fed_back)


class _Plant:
    """Writes every signal as a row over (states, columns of u, what laws add at ports).

    All that holds for any masses, stiffnesses and dampings is laid out once.

    Parameters
    ----------
    structure
        Of any numbers.
    """

    def __init__(
        self,
        structure: Structure,
        inputs: tuple[StructureInput, ...],
        outputs: tuple[StructureOutput, ...],
        fed_back: tuple[str, ...],
    ) -> None:
        self._structure, self._inputs, self._outputs, self._fed_back = structure, inputs, outputs, fed_back
        self._terminals = tuple(input_terminal(structure, one) for one in inputs)
        self._output_terminals = tuple(output_terminal(structure, one) for one in outputs)
        # A prescribed body keeps its rows of motion, made of columns of u, so that joints see it like any other.
        prescribed = {one.at for one in inputs if one.kind == "displacement"}
        self._free = [row for row, body in enumerate(structure.bodies) if body.name not in prescribed]
        self._ports = self._all_ports()
        self._port_places = {(port.name, port.kind): place for place, port in enumerate(self._ports)}
        self._n = 2 * len(self._free)
        self._m = sum(1 + terminal.derivatives for terminal in self._terminals)
        self._size = self._n + self._m + len(self._ports)
        self._prescribed = [
            (structure.body_index(one.at), self._column(one.name)) for one in inputs if one.kind == "displacement"
        ]
        self._ground = self._ground_row()
        self._shaken = self._shaken_bodies()
        self._displacement, self._velocity = self._motion()
        self._joints = np.array([structure.pattern(joint.between) for joint in structure.joints])
        self._joints = self._joints.reshape(len(structure.joints), len(structure.bodies))
        self._applied = self._all_applied()
        self._port_displacement, self._port_velocity = self._port_rows()
        self._patterns = [_Pattern(force_pattern(structure, one.at)) for one in outputs]
        self._names = [structure.bodies[row].name for row in self._free]

    def compiled(self, structure: Structure) -> CompiledModel:
        """Give the model with the numbers of a structure that is wired like this one."""
        acceleration = self._acceleration(structure)
        # Ports of outputs see what the output is before anything is added to it.
        rows = [self._output_row(structure, place, acceleration) for place in range(len(self._outputs))]
        outputs = np.array(rows, dtype=np.float64).reshape(len(rows), self._size)
        displacement = self._port_displacement.copy()
        for name in self._fed_back:
            row, port = self._output_place(name), self._port_places[name, "output"]
            displacement[port] = outputs[row]
            outputs[row, self._port(name, "output")] += 1.0
        rates = np.vstack([self._velocity[self._free], acceleration[self._free]])
        n, u, f = slice(0, self._n), slice(self._n, self._n + self._m), slice(self._n + self._m, None)
        return CompiledModel(
            a=rates[:, n],
            b=rates[:, u],
            c=outputs[:, n],
            d=outputs[:, u],
            g=rates[:, f],
            h=outputs[:, f],
            displacement_state=displacement[:, n],
            displacement_column=displacement[:, u],
            displacement_port=displacement[:, f],
            velocity_state=self._port_velocity[:, n],
            velocity_column=self._port_velocity[:, u],
            velocity_port=self._port_velocity[:, f],
            inputs=self._terminals,
            outputs=self._output_terminals,
            states=(
                *(f"{name}.displacement" for name in self._names),
                *(f"{name}.velocity" for name in self._names),
            ),
            ports=self._ports_of(structure),
        )

    def _ports_of(self, structure: Structure) -> tuple[Port, ...]:
        """Ports with the springs and dampers of a structure; those of joints are in front."""
        joints = [
            replace(port, stiffness=joint.stiffness, damping=joint.damping)
            for port, joint in zip(self._ports, structure.joints, strict=False)
        ]
        return (*joints, *self._ports[len(joints) :])

    def _all_ports(self) -> tuple[Port, ...]:
        structure = self._structure
        ports = []
        for joint in structure.joints:
            force, motion = _units(structure.motion_of(joint))
            ports.append(Port(name=joint.name, kind="joint", unit=force, displacement_unit=motion))
        for body in structure.bodies:
            force, motion = _units(body.motion)
            ports.append(Port(name=body.name, kind="body", unit=force, displacement_unit=motion))
        shaken = shaken_motion(structure)
        ports.append(Port(name=GROUND, kind="ground", unit=measure_unit("acceleration", shaken)))
        for one in self._inputs:
            if one.kind == "force":
                force, motion = _units(motion_at(structure, one.at))
                ports.append(Port(name=one.name, kind="actuation", unit=force, displacement_unit=motion))
        for name in self._fed_back:
            unit = self._output_terminals[self._output_place(name)].unit
            ports.append(Port(name=name, kind="output", unit=unit, displacement_unit=unit))
        return tuple(ports)

    def _motion(self) -> tuple[Real, Real]:
        """Displacement and velocity of each body, relative to the ground, ``[body, signal]``."""
        displacement, velocity = np.zeros((2, len(self._structure.bodies), self._size))
        for place, row in enumerate(self._free):
            displacement[row, place] = velocity[row, len(self._free) + place] = 1.0
        for row, column in self._prescribed:
            displacement[row, column] = velocity[row, column + 1] = 1.0
        return displacement, velocity

    def _acceleration(self, structure: Structure) -> Real:
        """Acceleration of each body, relative to the ground, ``[body, signal]``."""
        stiffness = self._assembled([joint.stiffness for joint in structure.joints])
        damping = self._assembled([joint.damping for joint in structure.joints])
        force = self._applied - stiffness @ self._displacement - damping @ self._velocity
        # Relative to a ground that accelerates, every body is pulled back by its inertia.
        mass = np.array([body.mass for body in structure.bodies])
        acceleration = force / mass[:, None] - np.outer(self._shaken, self._ground)
        # Whatever acts on a prescribed body is borne by what prescribes its motion.
        for row, column in self._prescribed:
            acceleration[row] = self._unit(column + 2)
        return np.asarray(acceleration, dtype=np.float64)

    def _assembled(self, coefficients: Sequence[float]) -> Real:
        """``[body, body]`` as `Structure.stiffness_matrix`, from patterns that are kept."""
        return np.asarray(self._joints.T @ (np.array(coefficients)[:, None] * self._joints))

    def _all_applied(self) -> Real:
        """Force on each body from inputs and laws, ``[body, signal]``."""
        structure = self._structure
        applied = np.zeros((len(structure.bodies), self._size))
        for one in self._inputs:
            if one.kind == "force":
                pattern = force_pattern(structure, one.at)
                applied[:, self._column(one.name)] = pattern
                applied[:, self._port(one.name, "actuation")] = pattern
        for joint in structure.joints:
            # A joint's law resists: it pulls the second body back and the first one after.
            applied[:, self._port(joint.name, "joint")] = -structure.pattern(joint.between)
        for row, body in enumerate(structure.bodies):
            applied[row, self._port(body.name, "body")] = 1.0
        return applied

    def _ground_row(self) -> Real:
        row = self._unit(self._port(GROUND, "ground"))
        for one in self._inputs:
            if one.kind == "base_acceleration":
                row[self._column(one.name)] = 1.0
        return row

    def _shaken_bodies(self) -> Real:
        """``[body]``: 1 for a body that feels the ground's acceleration."""
        motion = shaken_motion(self._structure)
        return np.array([float(body.motion == motion) for body in self._structure.bodies])

    def _output_row(self, structure: Structure, place: int, acceleration: Real) -> Real:
        one, pattern = self._outputs[place], self._patterns[place]
        if one.measures == "force":
            joint = structure.joint_named(one.at)
            linear = joint.stiffness * self._displacement + joint.damping * self._velocity
            return np.asarray(pattern.of(linear) + self._unit(self._port(joint.name, "joint")))
        if one.measures == "displacement":
            return pattern.of(self._displacement)
        if one.measures == "velocity":
            return pattern.of(self._velocity)
        # An accelerometer feels the ground's acceleration too; between the ends of a joint it cancels.
        if any(joint.name == one.at for joint in structure.joints):
            return pattern.of(acceleration)
        return pattern.of(acceleration + np.outer(self._shaken, self._ground))

    def _port_rows(self) -> tuple[Real, Real]:
        """Displacement and velocity at each port but those of outputs, ``[port, signal]``."""
        structure = self._structure
        displacement, velocity = np.zeros((2, len(self._ports), self._size))
        at = {one.name: one.at for one in self._inputs}
        for place, port in enumerate(self._ports):
            if port.kind not in ("output", "ground"):
                pattern = _Pattern(force_pattern(structure, at[port.name] if port.kind == "actuation" else port.name))
                displacement[place] = pattern.of(self._displacement)
                velocity[place] = pattern.of(self._velocity)
        return displacement, velocity

    def _column(self, name: str) -> int:
        """Place of the input's first column among all signals."""
        place = self._n
        for terminal in self._terminals:
            if terminal.name == name:
                return place
            place += 1 + terminal.derivatives
        raise AssertionError(name)

    def _port(self, name: str, kind: PortKind) -> int:
        """Place of what laws add at a port, among all signals."""
        return self._n + self._m + self._port_places[name, kind]

    def _output_place(self, name: str) -> int:
        return next(place for place, one in enumerate(self._outputs) if one.name == name)

    def _unit(self, place: int) -> Real:
        row = np.zeros(self._size)
        row[place] = 1.0
        return row


class _Pattern:
    """Product with a pattern that is mostly zero: one or two bodies of a thousand."""

    def __init__(self, pattern: Real) -> None:
        self._places = np.flatnonzero(pattern)
        self._signs = pattern[self._places]

    def of(self, rows: Real) -> Real:
        return np.asarray(self._signs @ rows[self._places])


def _units(motion: Motion) -> tuple[str, str]:
    return measure_unit("force", motion), measure_unit("displacement", motion)
