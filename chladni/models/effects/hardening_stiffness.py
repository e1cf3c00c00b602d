"""Hardening stiffness: a spring that gets stiffer with displacement (Duffing's)."""

from typing import Any

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.effect_kind import EffectKind, Values, Variant


def cubic(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``cubic d^3``."""
    # Products, since d**3 raises on overflow in Python where compiled code gives infinity.
    return float(parameters[0] * d * d * d)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["cubic"],)


HARDENING_STIFFNESS = EffectKind(
    name="hardening_stiffness",
    family="stiffness",
    meaning="a spring that gets stiffer with displacement",
    sites=("joint",),
    parameters=Parameters(
        (Parameter(name="cubic", value=1e9, unit="N/m^3", low=0.0, high=1e14, minimum=0.0, maximum=1e20),)
    ),
    neutral={"cubic": 0.0},
    variants=(
        Variant(name="cubic", attach=LawAtPort(law=cubic, numbers=_numbers), formula="F = cubic d^3", odd=True),
    ),
)
