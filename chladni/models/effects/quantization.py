"""Quantization: the sensor's converter has coarse steps."""

from math import floor
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import ShapedSignal
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.lattice import lattice_of
from chladni.signals.arrays import Real


def staircase(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``step round(d/step) - d``, each riser spread over 5 % of the step.

    A true jump inside a loop would make the integrator chatter on it.
    """
    step = parameters[0]
    # Beyond that rounding to a step is finer than the numbers themselves.
    if step <= 0.0 or abs(d) > 1e15 * step:
        return 0.0
    steps = d / step
    nearest = floor(steps + 0.5)
    from_middle = steps - nearest
    # Up to half a step on either side; the last 2.5 % before the riser already climb to its middle.
    climbed = max(abs(from_middle) - 0.475, 0.0) / 0.05
    return float(step * (nearest + (climbed if from_middle > 0.0 else -climbed)) - d)


def rounded_samples(samples: Real, _sample_rate_hz: float, step: float) -> Real:
    """Give the nearest steps."""
    if step <= 0:
        return samples
    return np.asarray(step * np.round(samples / step), dtype=np.float64)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["step"],)


QUANTIZATION = EffectKind(
    name="quantization",
    family="sensor",
    meaning="coarse steps of the sensor's converter",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="step", value=0.01, unit="m/s^2", low=0.0, high=10.0, minimum=0.0, maximum=1e12,
                meaning="in the output's unit",
            ),
        )
    ),
    neutral={"step": 0.0},
    clues=Clues(in_samples=lattice_of),
    variants=(
        Variant(
            name="rounded",
            attach=ShapedSignal(shape=rounded_samples, law=staircase, numbers=_numbers),
            formula="y_recorded = step round(y/step)",
            odd=True,
        ),
    ),
)  # fmt: skip
