"""A structure with what drives it, what is measured on it and what controls it: a `Model`."""

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Literal, Self

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect, ModelKind, flags_of_effects
from chladni.models.core.parameter import Parameters
from chladni.models.core.port import HoldKind, Terminal, require_named
from chladni.models.core.simulation import Simulation
from chladni.models.core.stability import growing_poles
from chladni.models.effects.pair import TILDE
from chladni.models.structures.closed_loop import close_loop, limit_port
from chladni.models.structures.controller import Controller
from chladni.models.structures.motion_modes import motion_modes, ordered_poles
from chladni.models.structures.plant import compile_plant, input_terminal, output_terminal
from chladni.models.structures.structure import NaturalModes, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_output import StructureOutput
from chladni.models.structures.structure_parameters import (
    DEFAULT_TOLERANCE,
    controller_with_numbers,
    structure_parameters,
    with_numbers,
)
from chladni.models.structures.wiring import Wiring, WiringMistake, name_mistakes, wiring_mistakes
from chladni.signals.arrays import Complex
from chladni.signals.errors import ModelError
from chladni.signals.unit_text import with_unit

Loop = Literal["closed", "open"]
Stage = Literal["structure", "output", "input"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StructureModel:
    """A lumped structure with inputs, outputs, controllers and effects; implements `Model`.

    Attributes
    ----------
    name
        For people and files.
    structure
        Bodies and joints.
    inputs, outputs
        What drives it, and what is measured.
    controllers
        Close loops, in this order.
    effects
        Known effects, in the order they attach.
    tolerances
        How well parameters are believed, by name: one sigma over the value; others have `default_tolerance`.
    declared
        The parameters, when their ranges are to stay as they were for other values; None to take them around the
        present values.

    Raises
    ------
    ModelError
        When names repeat or name nothing, or inputs contradict each other.

    Examples
    --------
    >>> from chladni.models.structures.structure import Body, Joint
    >>> model = StructureModel(
    ...     name="one",
    ...     structure=Structure(
    ...         bodies=(Body(name="mass", mass=2.0),),
    ...         joints=(Joint(name="spring", between=("ground", "mass"), stiffness=8.0, damping=0.4),),
    ...     ),
    ...     inputs=(StructureInput(name="hammer", at="mass"),),
    ...     outputs=(StructureOutput(name="acc", measures="acceleration", at="mass"),),
    ... )
    >>> model.poles().round(3)
    array([-0.1+1.997j, -0.1-1.997j])
    >>> model.with_values({"spring.stiffness": 18.0}).compile().a.tolist()
    [[0.0, 1.0], [-9.0, -0.2]]
    """

    name: str
    structure: Structure
    inputs: tuple[StructureInput, ...] = ()
    outputs: tuple[StructureOutput, ...] = ()
    controllers: tuple[Controller, ...] = ()
    effects: tuple[Effect, ...] = ()
    tolerances: Mapping[str, float] = field(default_factory=dict)
    default_tolerance: float = DEFAULT_TOLERANCE
    declared: Parameters | None = None

    def __post_init__(self) -> None:
        for mistake in (*self._name_mistakes(), *self._wiring_mistakes()):
            raise ModelError(f"model {self.name!r}: {mistake.part} {mistake.name!r}: {mistake.text}")
        for name in self.tolerances:
            self.parameters.require(name)
        if self.declared is not None and self.declared.numbers() != self._own_parameters().numbers():
            raise ModelError(f"model {self.name!r}: the declared parameters have other values than its parts")

    @property
    def kind(self) -> ModelKind:
        """Word in the model file."""
        return "structure"

    @property
    def parameters(self) -> Parameters:
        """Every number: ``wrist.mass``, ``elbow.stiffness``, ``axis.kp``."""
        return self._own_parameters() if self.declared is None else self.declared

    def _own_parameters(self) -> Parameters:
        return structure_parameters(
            self.structure,
            [(controller, self._controller_units(controller)) for controller in self.controllers],
            tolerances=self.tolerances,
            default_tolerance=self.default_tolerance,
        )

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the model with some parameters replaced; their usual ranges stay.

        Raises
        ------
        ModelError
            When a name is unknown or a value not possible.
        """
        # Ranges stay those of the nominal values: a knob that is turned must not move its own ends.
        changes: dict[str, object] = {
            "declared": self.parameters.with_values(values),
            "structure": with_numbers(self.structure, values),
            "controllers": tuple(controller_with_numbers(controller, values) for controller in self.controllers),
        }
        # Other numbers are wired as these are, which was checked: fits ask for thousands of settings.
        other = copy(self)
        for name, content in changes.items():
            object.__setattr__(other, name, content)
        return other

    def with_effects(self, effects: Sequence[Effect]) -> Self:
        """Give the model with these effects in place of those it has."""
        return replace(self, effects=tuple(effects))

    def with_holds(self, holds: Mapping[str, HoldKind]) -> Self:
        """Give the model with other holds of the named inputs and outputs, of a reference by its controller's name.

        Raises
        ------
        ModelError
            When there's no such name, or a prescribed motion can't run like that.
        """
        parts = (self.inputs, self.outputs, self.controllers)
        require_named(holds, [one.name for part in parts for one in part])
        return replace(
            self,
            inputs=tuple(replace(one, hold=holds.get(one.name, one.hold)) for one in self.inputs),
            outputs=tuple(replace(one, hold=holds.get(one.name, one.hold)) for one in self.outputs),
            controllers=tuple(replace(one, hold=holds.get(one.name, one.hold)) for one in self.controllers),
        )

    def compile(self) -> CompiledModel:
        """Give the equations: plant, effects at bodies, joints and ground, at outputs, loops, effects at inputs.

        Raises
        ------
        ModelError
            When an effect doesn't fit its site or a loop has no solution.
        """
        # Numbers far outside of physics overflow; that what comes of it isn't finite is an error of its own.
        with np.errstate(over="ignore", invalid="ignore"):
            compiled = self._attached(self._attached(self._open_loop(), "structure"), "output")
            for controller in self.controllers:
                compiled = close_loop(compiled, controller, self._disturbances(controller))
            return self._attached(compiled, "input")

    def poles(self, loop: Loop = "closed") -> Complex:
        """Eigenvalues in rad/s of the linear equations, those of slowest decay first; `loop` open: no controller."""
        return ordered_poles(self.compile() if loop == "closed" else self._open_loop())

    def modes(self, loop: Loop = "closed") -> NaturalModes:
        """Modes by rising frequency, shapes over the bodies; bodies whose motion is prescribed stand still."""
        compiled = self.compile() if loop == "closed" else self._open_loop()
        return motion_modes(compiled, [body.name for body in self.structure.bodies])

    def flags(self, simulation: Simulation) -> tuple[str, ...]:
        """Sentences on an unstable loop, a limit that was reached, laws and numbers that left their range."""
        compiled = self.compile()
        of_effects = flags_of_effects(self.effects, compiled, simulation)
        return (*self._instability(compiled), *self._reached(simulation), *of_effects, *self._unusual())

    def _name_mistakes(self) -> Iterator[WiringMistake]:
        kinds: dict[str, list[str]] = {
            "body": [body.name for body in self.structure.bodies],
            "joint": [joint.name for joint in self.structure.joints],
            "input": [one.name for one in self.inputs],
            "output": [one.name for one in self.outputs],
            "controller": [one.name for one in self.controllers],
        }
        return name_mistakes(
            [(kind, place, name) for kind, names in kinds.items() for place, name in enumerate(names)]
        )

    def _wiring_mistakes(self) -> Iterator[WiringMistake]:
        return wiring_mistakes(
            {body.name: body.motion for body in self.structure.bodies},
            {joint.name: joint.between for joint in self.structure.joints},
            self.inputs,
            self.outputs,
            [Wiring(one.name, one.feedback, one.drives, one.reference) for one in self.controllers],
        )

    def _open_loop(self) -> CompiledModel:
        return compile_plant(
            self.structure,
            tuple(one for one in self.inputs if one.kind != "disturbance"),
            tuple(self.outputs),
            fed_back=tuple(dict.fromkeys(controller.feedback for controller in self.controllers)),
        )

    def _attached(self, compiled: CompiledModel, stage: Stage) -> CompiledModel:
        for effect in self.effects:
            if self._stage(effect) == stage:
                compiled = effect.attach(compiled)
        return compiled

    def _stage(self, effect: Effect) -> Stage:
        # Names are unique over all parts, so a bare name tells the stage. Two outputs that a recorder exchanged are
        # what they were to a controller: the last stage.
        if effect.site.partition(TILDE)[2] in {one.name for one in self.outputs}:
            return "input"
        if effect.site in {one.name for one in self.outputs}:
            return "output"
        if effect.site in {one.name for one in self.inputs} | {one.name for one in self.controllers}:
            return "input"
        return "structure"

    def _disturbances(self, controller: Controller) -> list[Terminal]:
        unit = self._controller_units(controller)["command"]
        return [
            Terminal(name=one.name, unit=unit, channel=one.channel, hold=one.hold)
            for one in self.inputs
            if one.kind == "disturbance" and one.at == controller.name
        ]

    def _controller_units(self, controller: Controller) -> dict[str, str]:
        """Units of a controller's numbers by key, and of its ``command``."""
        driven = next(one for one in self.inputs if one.name == controller.drives)
        feedback = next(one for one in self.outputs if one.name == controller.feedback)
        return controller.units(
            driven_unit=input_terminal(self.structure, driven).unit,
            feedback_unit=output_terminal(self.structure, feedback).unit,
        )

    def _instability(self, compiled: CompiledModel) -> tuple[str, ...]:
        # A structure without a controller can't be unstable, only free.
        if not self.controllers:
            return ()
        unstable = growing_poles(compiled)
        if not unstable.size:
            return ()
        listed = ", ".join(f"{pole.real:.4g}{pole.imag:+.4g}j" for pole in unstable[:6])
        names = ", ".join(controller.name for controller in self.controllers)
        return (f"the closed loop is unstable: poles at {listed} rad/s; lower the gains of {names}",)

    def _reached(self, simulation: Simulation) -> list[str]:
        found = []
        for controller in self.controllers:
            motions = [one for one in simulation.motions if one.name == limit_port(controller)]
            share = float(np.mean(motions[0].force != 0)) if motions else 0.0
            if share:
                unit = controller.limit_unit or self._controller_units(controller)["command"]
                limit = with_unit(f"{controller.limit:g}", unit)
                found.append(f"{controller.name} is at its limit of {limit} for {share:.1%} of the time")
        return found

    def _unusual(self) -> list[str]:
        return [
            f"{one.name} = {with_unit(f'{one.value:g}', one.unit)} is outside its usual range "
            f"{one.low:g} to {one.high:g}"
            for one in self.parameters.unusual()
        ]
