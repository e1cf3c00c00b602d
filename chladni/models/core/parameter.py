"""Named parameters of a model: value, unit, usual and possible range, tolerance."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import Literal, Self

from chladni.signals.errors import ModelError
from chladni.signals.number_range import LARGEST_OF_MODEL, SMALLEST_OF_MODEL
from chladni.signals.wording import near_words

Role = Literal["construction", "function"]


def not_workable(value: float, unit: str = "") -> str:
    """Say of a finite number that equations can't hold it; an empty text when they can.

    Examples
    --------
    >>> not_workable(2.0), not_workable(1e200, " kg")
    ('', '1e+200 kg is too large to work with; give a size from 4e-103 to 2e+102, or 0')
    """
    if value == 0 or SMALLEST_OF_MODEL <= abs(value) <= LARGEST_OF_MODEL:
        return ""
    size = "large" if abs(value) > 1 else "small"
    return (
        f"{value:g}{unit} is too {size} to work with; "
        f"give a size from {SMALLEST_OF_MODEL:.1g} to {LARGEST_OF_MODEL:.1g}, or 0"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """One number of a model.

    Attributes
    ----------
    name
        What files and results call it: ``active_area``, ``elbow.stiffness``.
    value
        In `unit`.
    unit
        SI unit text.
    low, high
        Usual range, such as the paper's, in `unit`: what a knob spans. A value outside is flagged.
    minimum, maximum
        Physically possible range, in `unit`; a value outside is refused. Both ends are allowed.
    symbol
        The paper's letter.
    shown_unit
        Unit that people read it in, such as ``cm^2``; empty for `unit`.
    tolerance
        How well the value is believed: one sigma over the value.
    role
        ``construction`` for what is built, ``function`` for an operating condition (flow, load, pressure).
    meaning
        A few words.

    Raises
    ------
    ModelError
        When the value is not finite, outside its possible range, or of a size that can't be computed with.
    """

    name: str
    value: float
    unit: str = "1"
    low: float
    high: float
    minimum: float = -inf
    maximum: float = inf
    symbol: str = ""
    shown_unit: str = ""
    tolerance: float = 0.05
    role: Role = "construction"
    meaning: str = ""

    def __post_init__(self) -> None:
        # Nobody says "0.5 1".
        unit = "" if self.unit == "1" else f" {self.unit}"
        if not isfinite(self.value):
            raise ModelError(f"{self.name}: {self.value} is not finite; give a number{unit and f' in{unit}'}")
        if wrong := not_workable(self.value, unit):
            raise ModelError(f"{self.name}: {wrong}")
        if not self.minimum <= self.value <= self.maximum:
            raise ModelError(
                f"{self.name}: {self.value:g}{unit} is not possible; "
                f"give a value from {self.minimum:g} to {self.maximum:g}"
            )

    def with_value(self, value: float) -> Self:
        """Give the same parameter with another value."""
        if value == self.value:
            return self
        return replace(self, value=float(value))

    @property
    def usual(self) -> bool:
        """Whether the value lies in its usual range."""
        # A value that was converted to SI and back may miss its end by rounding.
        slack = 1e-9 * max(abs(self.low), abs(self.high))
        return self.low - slack <= self.value <= self.high + slack


@dataclass(frozen=True, slots=True)
class Parameters(Mapping[str, Parameter]):
    """Parameters by name, in order.

    Examples
    --------
    >>> mass = Parameter(name="mass", value=2.0, unit="kg", low=1.0, high=5.0, minimum=0.0)
    >>> Parameters((mass,)).with_values({"mass": 3.0})["mass"].value
    3.0
    """

    items_in_order: tuple[Parameter, ...]

    def __post_init__(self) -> None:
        times = Counter(parameter.name for parameter in self.items_in_order)
        for name, count in times.items():
            if count > 1:
                raise ModelError(f"parameter {name!r} is declared {count} times; names are unique")

    def __getitem__(self, name: str) -> Parameter:
        for parameter in self.items_in_order:
            if parameter.name == name:
                return parameter
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return (parameter.name for parameter in self.items_in_order)

    def __len__(self) -> int:
        return len(self.items_in_order)

    def numbers(self) -> dict[str, float]:
        """Value of each parameter by name."""
        return {parameter.name: parameter.value for parameter in self.items_in_order}

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the same parameters with some values replaced.

        Raises
        ------
        ModelError
            When a name is unknown (the nearest one is named) or a value is not possible.
        """
        for name in values.keys() - set(self):
            self.require(name)
        return type(self)(
            tuple(
                parameter.with_value(values[parameter.name]) if parameter.name in values else parameter
                for parameter in self.items_in_order
            )
        )

    def require(self, name: str) -> Parameter:
        """Give the named parameter; `ModelError` that names the nearest one when it's missing."""
        if name in self:
            return self[name]
        near = near_words(name, list(self))
        advice = f"did you mean {near[0]}?" if near else f"parameters: {', '.join(self)}"
        raise ModelError(f"no parameter {name!r}; {advice}")

    def unusual(self) -> tuple[Parameter, ...]:
        """Give those whose value lies outside the usual range."""
        return tuple(parameter for parameter in self.items_in_order if not parameter.usual)
