"""Coulomb friction: a resisting force of one size, whatever the speed."""

from collections.abc import Iterator
from math import tanh
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.bristles import bristles_along
from chladni.models.effects.clues import Clues, FittedForm, Relative
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.friction_parameters import CREEP_SPEED, PRESLIDING, holds_like_a_loop, slides_from
from chladni.models.effects.trial import Force, Shape, Trial, TrialMotion, logarithms, numbers, positive, rms


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


#: Speeds over the joint's RMS speed at which a Stribeck curve begins its search: from one it may end as Coulomb's.
_STRIBECK_SPEEDS = (0.2, 0.6)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    s, speed, reach = motion.velocity, rms(motion.velocity), rms(motion.displacement)

    def sliding(shape: Shape) -> Force:
        return Force.of(motion.spectrum(np.tanh(s / numbers(shape)[0])))

    def bristles(shape: Shape) -> Force:
        return Force.of(motion.spectrum(bristles_along(s, motion.sample_rate_hz, numbers(shape)[0])))

    yield Trial(
        variant="regularised", build=sliding, grid=logarithms((0.003 * speed, 0.03 * speed, 0.15 * speed)),
        values=lambda shape, a: positive(a, force=a[0], creep_speed=numbers(shape)[0]), parameters=2,
    )  # fmt: skip
    yield Trial(
        variant="bristle", build=bristles, grid=logarithms((0.003 * reach, 0.02 * reach, 0.1 * reach)),
        values=lambda shape, a: positive(a, force=a[0], presliding=numbers(shape)[0]), parameters=2,
    )  # fmt: skip


def _stribecks(fitted: FittedForm) -> Iterator[Relative]:
    """Give Stribeck frictions of the same size and form, somewhat higher at rest."""
    velocity = fitted.motion()[1]
    speed, force = float(np.sqrt(np.mean(velocity**2))), fitted.values["force"]
    for share in _STRIBECK_SPEEDS:
        values = {"coulomb": 0.9 * force, "static": 1.3 * force, "speed": share * speed, **slides_from(fitted)}
        yield Relative(effect="stribeck_friction", values=values, variant=fitted.variant)


def _resisting(force: float, speed: float) -> Values:
    return {"force": force, "creep_speed": speed}


COULOMB_FRICTION = EffectKind(
    name="coulomb_friction",
    said="Coulomb friction",
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
    clues=Clues(
        trials=_trials,
        is_degenerate=holds_like_a_loop,
        details=("offset", "creep_speed"),
        sizes=("force",),
        nested=_stribecks,
        resisting=_resisting,
    ),
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
