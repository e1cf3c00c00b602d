"""An elementary block: a kind with named parameters, and one of that kind with its values."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, Self

import numpy as np

from chladni.models.core.parameter import Parameters
from chladni.models.elements.transfer_function import TransferFunction

Group = Literal["basic", "regulator", "correction", "electrical", "mechanical"]
Values = Mapping[str, float]
Transfer = Callable[[Values], TransferFunction]


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementKind:
    """A kind of element, such as PT1.

    Attributes
    ----------
    name
        Word in files: ``pt1``, ``dead-time``.
    title
        For people.
    formula
        Transfer function as text, with the parameters' symbols.
    group
        What it's for.
    parameters
        With defaults, units, usual and possible ranges.
    transfer
        ``transfer(values) -> TransferFunction`` from every parameter's value.
    input_unit, output_unit
        SI units where the element has its own (ohm, newton); ``1`` where it takes those of its surroundings.
    """

    name: str
    title: str
    formula: str
    group: Group
    parameters: Parameters
    transfer: Transfer
    input_unit: str = "1"
    output_unit: str = "1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """One element: its kind and the values of its parameters.

    Examples
    --------
    >>> from chladni.models.elements.catalogue import element
    >>> element("pt1", gain=2.0, time_constant=0.1).transfer
    TransferFunction(num=(2.0,), den=(0.1, 1.0), delay_s=0.0)
    """

    kind: ElementKind
    parameters: Parameters

    @property
    def transfer(self) -> TransferFunction:
        """Its transfer function; `ModelError` when its coefficients are too large for floating point numbers."""
        return _transfer(self.kind.transfer, tuple(self.parameters.numbers().items()))

    def with_values(self, values: Values) -> Self:
        """Give the element with some values replaced; `ModelError` for an unknown name or impossible value."""
        return replace(self, parameters=self.parameters.with_values(values))

    def with_tolerances(self, tolerances: Values) -> Self:
        """Give the element with some values believed more or less: one sigma over the value, by parameter."""
        for name in tolerances:
            self.parameters.require(name)
        declared = (
            replace(item, tolerance=tolerances.get(item.name, item.tolerance)) for item in self.parameters.values()
        )
        return replace(self, parameters=Parameters(tuple(declared)))

    def with_usual_value(self, name: str, value: float) -> Self:
        """Give the element with one value as its user states it: what is usual then reaches at least there.

        The kind's range fits its default; around a value outside it goes a decade to both sides.
        """
        found = self.parameters.require(name).with_value(value)
        if not found.usual:
            low, high = sorted((value / 10, value * 10))
            found = replace(found, low=max(low, found.minimum), high=min(high, found.maximum))
        declared = (found if item.name == name else item for item in self.parameters.values())
        return replace(self, parameters=Parameters(tuple(declared)))


# A scheme asks each of its elements several times, and while one knob turns all others stay what they are.
@lru_cache(maxsize=4096)
def _transfer(make: Transfer, numbers: tuple[tuple[str, float], ...]) -> TransferFunction:
    # What overflows becomes infinite, and a transfer function refuses that in words.
    with np.errstate(over="ignore", invalid="ignore"):
        return make(dict(numbers))
