"""Parameters that a fit may move, on the scale of how well they are believed."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from chladni.gap.calibration import FURTHEST, OUTSIDE, SLIP, UNNOTICED
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.signals.arrays import Mask, Real
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tunables(Value):
    """Parameters with a tolerance and a value other than 0, as ``z = ln(value/nominal)/tolerance``.

    On this scale what is believed before any log is seen is the same for all: normal, mean 0, variance 1. A logarithm
    keeps masses and stiffnesses positive, and makes twice and half equally far.

    Attributes
    ----------
    nominal
        ``[parameter]``, SI.
    tolerance
        ``[parameter]``, one sigma over the value.
    units
        SI unit of each.
    """

    names: tuple[str, ...]
    nominal: Real
    tolerance: Real
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        require_shape("nominal", self.nominal, (len(self.names),), "the parameters")
        require_shape("tolerance", self.tolerance, (len(self.names),), "the parameters")
        self._freeze()

    @classmethod
    def of(cls, model: Model) -> Self:
        """Those of a model, in its order; the model's values are the nominal ones."""
        moving = [one for one in model.parameters.values() if one.tolerance > 0 and one.value != 0]
        return cls(
            names=tuple(one.name for one in moving),
            nominal=np.array([one.value for one in moving], dtype=np.float64),
            tolerance=np.array([one.tolerance for one in moving], dtype=np.float64),
            units=tuple(one.unit for one in moving),
        )

    def wrong(self, z: Real) -> tuple[str, ...]:
        """Names of the parameters that are wrong at ``z [parameter]``."""
        return tuple(name for name, one in zip(self.names, z, strict=True) if abs(one) > OUTSIDE + UNNOTICED)

    def limits(self, freed: Collection[str] = ()) -> Real:
        """``[parameter]`` bounds on ``abs(z)``, those of the freed ones as far as a wrong value is searched for."""
        far = np.maximum(FURTHEST / self.tolerance, OUTSIDE)
        return np.where(self._are(freed), far, OUTSIDE)

    def precision(self, freed: Collection[str] = ()) -> Real:
        """``[parameter]`` precision of z before a log is seen: 1, of the freed ones that of a slip."""
        return np.where(self._are(freed), np.minimum(self.tolerance / SLIP, 1.0) ** 2, 1.0)

    def _are(self, names: Collection[str]) -> Mask:
        return np.array([one in names for one in self.names], dtype=np.bool_)

    def values(self, z: Real) -> dict[str, float]:
        """Value of each parameter by name, SI, at ``z [parameter]`` in sigmas of the tolerance."""
        require_shape("z", z, (len(self.names),), "the tunable parameters")
        numbers = self.nominal * np.exp(self.tolerance * z)
        return dict(zip(self.names, numbers.tolist(), strict=True))


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
