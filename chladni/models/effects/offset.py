"""Offset: a sensor that adds a constant."""

from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import ShapedSignal
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.signals.arrays import Real


def constant(_d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give the value."""
    return float(parameters[0])


def lifted(samples: Real, _sample_rate_hz: float, value: float) -> Real:
    """Give the samples with the value added."""
    return np.asarray(samples + value, dtype=np.float64)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["value"],)


def _no_trials(_motion: object) -> tuple[()]:
    # Every fit leaves the constants of outputs free, which have other reasons too: gravity, charge.
    return ()


OFFSET = EffectKind(
    name="offset",
    said="an offset",
    family="sensor",
    meaning="the sensor adds a constant",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="value", value=0.1, unit="m/s^2", low=-10.0, high=10.0, minimum=-1e18, maximum=1e18,
                meaning="in the output's unit",
            ),
        )
    ),
    neutral={"value": 0.0},
    clues=Clues(trials=_no_trials, sizes=("value",), exact=True, of_constant=True),
    variants=(
        Variant(
            name="constant",
            attach=ShapedSignal(shape=lifted, law=constant, numbers=_numbers),
            formula="y_recorded = y + value",
        ),
    ),
)  # fmt: skip
