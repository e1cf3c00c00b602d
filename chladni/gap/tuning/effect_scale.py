"""Parameters of effects as numbers that a fit can step in: logarithms of what is positive, scaled values else."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.gap.calibration import SHARE_OF_RANGE, UNNOTICED
from chladni.models.core.parameter import Parameter
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectNumber:
    """One parameter that a fit moves, as ``x`` with ``value = start exp(x)`` or ``value = start + scale x``.

    Attributes
    ----------
    effect
        Place of the effect.
    start
        Value at x = 0.
    scale
        Of a step, in the parameter's unit; 0 for a logarithm.
    low, high
        Bounds on x.
    """

    effect: int
    name: str
    start: float
    scale: float
    low: float
    high: float

    def value(self, x: float) -> float:
        """Parameter at x, SI."""
        return self.start + self.scale * x if self.scale else self.start * float(np.exp(x))

    def slope(self, x: float) -> float:
        """Change of the value for a small change of x."""
        return self.scale or self.value(x)


def effect_numbers(
    effects: Sequence[AttachedEffect], fitted: Sequence[Sequence[str]] | None = None
) -> tuple[EffectNumber, ...]:
    """Numbers of all parameters that move.

    Parameters
    ----------
    effects
        With the values that the fit starts from.
    fitted
        Names for each effect, one that is given twice counts once; by default those that it can't do without, as far
        as they are numbers to fit at all.

    Raises
    ------
    ModelError
        When a name is no parameter of its effect.
    """
    if fitted is None:
        fitted = [effect.usually_fitted for effect in effects]
    if len(fitted) != len(effects):
        raise ModelError(f"names to fit are given for {len(fitted)} effects, there are {len(effects)}")
    return tuple(
        _number(place, effect.parameters.require(name))
        for place, (effect, names) in enumerate(zip(effects, fitted, strict=True))
        for name in dict.fromkeys(names)
    )


def with_numbers(
    effects: Sequence[AttachedEffect], numbers: Sequence[EffectNumber], x: Real
) -> tuple[AttachedEffect, ...]:
    """Give the effects with the parameters that `x` says."""
    values = [dict(effect.values) for effect in effects]
    for number, one in zip(numbers, x.tolist(), strict=True):
        values[number.effect][number.name] = number.value(one)
    return tuple(replace(effect, values=one) for effect, one in zip(effects, values, strict=True))


def _number(place: int, parameter: Parameter) -> EffectNumber:
    value, name = parameter.value, parameter.name
    if parameter.minimum >= 0 and value > 0:
        lowest = max(parameter.minimum, UNNOTICED * value)
        low, high = np.log(lowest / value), np.log(parameter.maximum / value)
        return EffectNumber(effect=place, name=name, start=value, scale=0.0, low=float(low), high=float(high))
    scale = abs(value) or SHARE_OF_RANGE * (parameter.high - parameter.low)
    low, high = (parameter.minimum - value) / scale, (parameter.maximum - value) / scale
    return EffectNumber(effect=place, name=name, start=value, scale=scale, low=low, high=high)
