"""Equations of a model at some parameters, and at those with one of them changed."""

from collections.abc import Collection, Mapping
from typing import Protocol, Self

from chladni.gap.calibration import KEPT, STEP
from chladni.gap.plant.kept import Kept
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.effects.pair import PairPorts, unlinked_pairs
from chladni.signals.arrays import Real


class Scaled(Protocol):
    """Parameters that may move, in units of their tolerance."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names."""

    def values(self, z: Real) -> Mapping[str, float]:
        """Values ``nominal exp(tolerance z)`` by name."""

    def wrong(self, z: Real) -> tuple[str, ...]:
        """Names of those outside their tolerance."""

    def limits(self, freed: Collection[str] = ()) -> Real:
        """``[parameter]`` bounds on ``abs(z)``."""


class Varied(Protocol):
    """A model as far as its equations and numbers go."""

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the model with some parameters replaced."""

    def compile(self) -> CompiledModel:
        """Give the equations."""


class Neighbours:
    """Equations of one model, kept while they are asked for again."""

    def __init__(self, model: Varied, tunables: Scaled) -> None:
        self._model, self._tunables = model, tunables
        # Where bodies share no joint the model may lack one. Which do is the same at all numbers.
        compiled = model.compile()
        self._pairs = PairPorts(compiled, unlinked_pairs(compiled))
        self._at: Kept[CompiledModel] = Kept(KEPT)
        self._changed: Kept[tuple[CompiledModel, ...]] = Kept(KEPT)

    def at(self, z: Real) -> CompiledModel:
        """Give the equations at ``z [parameter]``, in units of their tolerance."""
        return self._at.get(z.tobytes(), lambda: self._linked(self._set(z)))

    def changed(self, z: Real) -> tuple[CompiledModel, ...]:
        """``[parameter]``: equations with each parameter `STEP` further than at z."""
        return self._changed.get(z.tobytes(), lambda: self._steps(z))

    def _set(self, z: Real) -> Varied:
        return self._model.with_values(self._tunables.values(z)) if z.size else self._model

    def _steps(self, z: Real) -> tuple[CompiledModel, ...]:
        # From the model at z each takes one new number.
        base, there = self._set(z), self._tunables.values(z + STEP)
        return tuple(self._linked(base.with_values({name: there[name]})) for name in self._tunables.names)

    def _linked(self, model: Varied) -> CompiledModel:
        return self._pairs.of(model.compile())
