"""Damping that grows with the cube of the speed: an effect of one's own, in one file."""

from collections.abc import Mapping
from typing import Any

from chladni import EffectKind, LawAtPort, Parameter, Parameters, Port, Variant


def cubic_damping(_d: float, s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``coefficient s^3``."""
    return float(parameters[0] * s * s * s)


def _numbers(values: Mapping[str, float], _port: Port) -> tuple[float, ...]:
    return (values["coefficient"],)


CUBIC_DAMPING = EffectKind(
    name="cubic_damping",
    family="damping",
    meaning="damping that grows with the cube of the speed",
    sites=("joint",),
    parameters=Parameters(
        (Parameter(name="coefficient", value=50.0, unit="N s^3/m^3", low=0.0, high=1e4, minimum=0.0, maximum=1e12),)
    ),
    neutral={"coefficient": 0.0},
    variants=(
        Variant(
            name="cubic",
            attach=LawAtPort(law=cubic_damping, numbers=_numbers),
            formula="F = coefficient s^3",
            odd=True,
        ),
    ),
)
