"""Coulomb friction: a resisting force of one size, whatever the speed."""

from math import tanh
from typing import Any

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.friction_parameters import CREEP_SPEED, PRESLIDING


def regularised(_d: float, s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``force tanh(s/creep_speed) + offset``; parameters force, offset, creep speed."""
    # tanh is smooth everywhere and odd, and unlike exp it can't overflow.
    return float(parameters[0] * tanh(s / parameters[2]) + parameters[1])


def bristle(_d: float, s: float, _t: float, parameters: Any, state: Any, rates: Any) -> float:
    """Give Dahl's ``force w + offset``, ``w' = (s - abs(s) w)/presliding``; parameters force, offset, presliding."""
    # The state is the share of the force, not the bristles' bend: it stays between -1 and 1 whatever the parameters,
    # and a force of zero divides nothing.
    rates[0] = (s - abs(s) * state[0]) / parameters[2]
    return float(parameters[0] * state[0] + parameters[1])


def _regularised_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["force"], values["offset"], values["creep_speed"]


def _bristle_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["force"], values["offset"], values["presliding"]


COULOMB_FRICTION = EffectKind(
    name="coulomb_friction",
    family="friction",
    meaning="dry friction of one size, whatever the speed",
    sites=("joint",),
    parameters=Parameters(
        (
            Parameter(
                name="force", value=5.0, unit="N", low=0.0, high=200.0, minimum=0.0, maximum=1e9, meaning="sliding"
            ),
            Parameter(
                name="offset", value=0.0, unit="N", low=-50.0, high=50.0, minimum=-1e9, maximum=1e9,
                meaning="asymmetry: half of what it resists more along + than along -",
            ),
        )
    ),
    # Most joints resist both ways alike, so the asymmetry need not be given.
    optional=("offset",),
    neutral={"force": 0.0, "offset": 0.0},
    # The slope first: it has no state to start, so a fit may begin with it.
    variants=(
        Variant(
            name="regularised",
            attach=LawAtPort(law=regularised, numbers=_regularised_numbers),
            formula="F = force tanh(s/creep_speed) + offset",
            parameters=Parameters((CREEP_SPEED,)),
            odd=True,
        ),
        Variant(
            name="bristle",
            attach=LawAtPort(law=bristle, numbers=_bristle_numbers, state=(0.0,)),
            formula="F = force w + offset, w' = (s - |s| w)/presliding",
            parameters=Parameters((PRESLIDING,)),
            odd=True,
            fitted=("presliding",),
        ),
    ),
)  # fmt: skip
