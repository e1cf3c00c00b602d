"""Saturation: an actuator whose force is limited."""

from math import tanh
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import ShapedSignal
from chladni.models.effects.effect_kind import EffectKind, Values, Variant

Matrix = NDArray[np.float64]


def clipped(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``clip(d, -limit, limit) - d``."""
    # A law adds to the command, so it gives what the limit takes away.
    return float(min(max(d, -parameters[0]), parameters[0]) - d)


def smooth(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``limit tanh(d/limit) - d``."""
    return float(parameters[0] * tanh(d / parameters[0]) - d)


def clipped_samples(samples: Matrix, _sample_rate_hz: float, limit: float) -> Matrix:
    """Give the samples, none beyond the limit."""
    return np.clip(samples, -limit, limit)


def smooth_samples(samples: Matrix, _sample_rate_hz: float, limit: float) -> Matrix:
    """Give the samples, approaching the limit smoothly."""
    return np.asarray(limit * np.tanh(samples / limit), dtype=np.float64)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["limit"],)


SATURATION = EffectKind(
    name="saturation",
    family="actuator",
    meaning="the actuator's force is limited",
    sites=("input",),
    parameters=Parameters(
        (Parameter(name="limit", value=100.0, unit="N", low=1.0, high=1e4, minimum=1e-12, maximum=1e18),)
    ),
    # No finite limit is none, but this one no force reaches.
    neutral={"limit": 1e18},
    variants=(
        Variant(
            name="clipped",
            attach=ShapedSignal(shape=clipped_samples, law=clipped, numbers=_numbers),
            formula="u_acts = clip(u, -limit, limit)",
            odd=True,
        ),
        Variant(
            name="smooth",
            attach=ShapedSignal(shape=smooth_samples, law=smooth, numbers=_numbers),
            formula="u_acts = limit tanh(u/limit)",
            odd=True,
        ),
    ),
)
