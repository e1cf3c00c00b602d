"""A linear problem with more numbers than its model has parameters: what they do to the equations is free."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from chladni.gap.plant.linear_problem import LinearProblem
from chladni.gap.plant.neighbours import Scaled
from chladni.models.core.compiled_model import CompiledModel
from chladni.signals.arrays import Real

Values = Mapping[str, float]
#: ``make(parameters, numbers)``: equations at values of parameters, SI, and ``[number]`` further ones.
Make = Callable[[Values, Real], CompiledModel]


def with_further(problem: LinearProblem, count: int, make: Make) -> LinearProblem:
    """Give the problem with `count` further numbers behind its parameters in z, in the steps that `make` takes.

    Parameters
    ----------
    make
        Gives the equations, with all of the model's states in front; numbers of zero may mean anything.
    """
    names = tuple(f"further {place}" for place in range(count))
    numbers = _Numbers(tunables=problem.tunables, further=names)
    model = _Made(make=make, further=names)
    return LinearProblem(model, problem.measurement, problem.noise, numbers, problem.lines)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Numbers:
    """Parameters of a model, then the further numbers."""

    tunables: Scaled
    further: Sequence[str]

    @property
    def names(self) -> tuple[str, ...]:
        return (*self.tunables.names, *self.further)

    def wrong(self, z: Real) -> tuple[str, ...]:
        return self.tunables.wrong(z[: len(self.tunables.names)])

    def limits(self, freed: Collection[str] = ()) -> Real:
        return np.concatenate([self.tunables.limits(freed), np.full(len(self.further), np.inf)])

    def values(self, z: Real) -> dict[str, float]:
        own = len(self.tunables.names)
        return {**self.tunables.values(z[:own]), **dict(zip(self.further, z[own:].tolist(), strict=True))}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Made:
    """What is made at some values."""

    make: Make
    further: Sequence[str]
    given: Values = field(default_factory=dict)

    def with_values(self, values: Values) -> Self:
        return replace(self, given={**self.given, **values})

    def compile(self) -> CompiledModel:
        parameters = {name: one for name, one in self.given.items() if name not in self.further}
        return self.make(parameters, np.array([self.given.get(name, 0.0) for name in self.further]))
