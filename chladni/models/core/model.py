"""What every simulated system can do, whatever it is made of."""

from collections.abc import Mapping, Sequence
from typing import Literal, Protocol, Self, runtime_checkable

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameters
from chladni.models.core.port import HoldKind
from chladni.models.core.simulation import Simulation

ModelKind = Literal["structure", "drive", "scheme"]


class Effect(Protocol):
    """Something unmodelled that was attached to a site of a model."""

    @property
    def effect(self) -> str:
        """Its word in the vocabulary, such as ``coulomb_friction``."""

    @property
    def site(self) -> str:
        """Name of the joint, body, input or output; ``ground``."""

    @property
    def values(self) -> Mapping[str, float]:
        """Its parameters, SI."""

    def attach(self, compiled: CompiledModel) -> CompiledModel:
        """Give the model with the effect in it; `ModelError` when the site can't carry it."""


@runtime_checkable
class FlaggingEffect(Protocol):
    """An effect whose law isn't valid everywhere, and which says where a simulation left that."""

    def flags(self, compiled: CompiledModel, simulation: Simulation) -> tuple[str, ...]:
        """Sentences; none while the law is valid."""


def flags_of_effects(effects: Sequence[Effect], compiled: CompiledModel, simulation: Simulation) -> tuple[str, ...]:
    """Sentences of those effects that have any to say, in order; what `Model.flags` adds to its own."""
    return tuple(
        sentence
        for effect in effects
        if isinstance(effect, FlaggingEffect)
        for sentence in effect.flags(compiled, simulation)
    )


class Model(Protocol):
    """A system that can be simulated."""

    @property
    def name(self) -> str:
        """Its name, for people and files."""

    @property
    def kind(self) -> ModelKind:
        """Word in the model file."""

    @property
    def parameters(self) -> Parameters:
        """Every number that may be varied: ``active_area``, ``elbow.stiffness``."""

    @property
    def effects(self) -> Sequence[Effect]:
        """Effects already known, in the order they attach."""

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the model with some parameters replaced; `ModelError` for an unknown name or impossible value."""

    def with_effects(self, effects: Sequence[Effect]) -> Self:
        """Give the model with these effects in place of those it has."""

    def with_holds(self, holds: Mapping[str, HoldKind]) -> Self:
        """Give the model with other holds of the named inputs and outputs; `ModelError` when there's no such name."""

    def compile(self) -> CompiledModel:
        """Give the equations. Joints, bodies and ground first, then outputs, then loops are closed, then inputs."""

    def flags(self, simulation: Simulation) -> tuple[str, ...]:
        """Sentences about where the simulation left what the model is valid for (stroke, flow, pressure)."""
