"""A simulator's inputs and outputs as a model, for what asks a model for no more than their names and channels."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Self

from chladni.gap.simulators.effects_around import unconnected
from chladni.gap.simulators.simulator import Simulator
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect, ModelKind
from chladni.models.core.parameter import Parameters
from chladni.models.core.port import HoldKind
from chladni.models.core.simulation import Simulation


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalModel:
    """Implements `Model` with equations that hold nothing; the simulator has its own.

    Attributes
    ----------
    simulator
        Whose inputs and outputs these are.
    """

    simulator: Simulator

    @property
    def name(self) -> str:
        """The simulator's."""
        return self.simulator.name

    @property
    def kind(self) -> ModelKind:
        """Signals only: a scheme without blocks."""
        return "scheme"

    @property
    def parameters(self) -> Parameters:
        """The simulator's."""
        return self.simulator.parameters

    @property
    def effects(self) -> Sequence[Effect]:
        """None: a `WrappedSimulator` holds them."""
        return ()

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the same: its signals keep their names; a wrong name is told."""
        self.parameters.with_values(values)
        return self

    def with_effects(self, effects: Sequence[Effect]) -> Self:  # noqa: ARG002 - what a model offers
        """Give the same: effects are wrapped around the simulator."""
        return self

    def with_holds(self, holds: Mapping[str, HoldKind]) -> Self:  # noqa: ARG002 - what a model offers
        """Give the same: what happens between samples is the simulator's."""
        return self

    def compile(self) -> CompiledModel:
        """Give inputs, outputs and joints, with nothing in between."""
        return unconnected(self.simulator.inputs, self.simulator.outputs, self.simulator.joints)

    def flags(self, simulation: Simulation) -> tuple[str, ...]:  # noqa: ARG002 - what a model offers
        """None."""
        return ()
