"""Stribeck friction: it sticks with more force than it slides with."""

from collections.abc import Iterator
from math import exp, tanh
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues, FittedForm, Relative
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.friction_parameters import CREEP_SPEED, PRESLIDING, holds_like_a_loop, slides_from
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, logarithms, numbers, rms
from chladni.signals.arrays import Real


def regularised(_d: float, s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give Stribeck's curve times ``tanh(s/creep_speed)``; parameters coulomb, static, speed, creep speed."""
    ratio = s / parameters[2]
    # Beyond 30 the exponential is nothing, and the square of an extreme speed would overflow.
    bump = exp(-ratio * ratio) if abs(ratio) < 30.0 else 0.0
    return float((parameters[0] + (parameters[1] - parameters[0]) * bump) * tanh(s / parameters[3]))


def bristle(_d: float, s: float, _t: float, parameters: Any, state: Any, rates: Any) -> float:
    """Give LuGre's force; parameters coulomb, static, speed, presliding, bristle damping.

    The state is the bristles' force over the static friction: ``w' = (s - abs(s) w/r(s))/presliding`` with r(s)
    Stribeck's curve over the static friction.
    """
    coulomb, static = parameters[0], parameters[1]
    ratio = s / parameters[2]
    bump = exp(-ratio * ratio) if abs(ratio) < 30.0 else 0.0
    curve = 1.0
    if static > 0.0:
        # Without any sliding friction the bristles would spring back infinitely fast at speed.
        curve = max((coulomb + (static - coulomb) * bump) / static, 1e-3)
    rates[0] = (s - abs(s) * state[0] / curve) / parameters[3]
    # w' times presliding is how fast the bristles bend, in m/s.
    return float(static * state[0] + parameters[4] * rates[0] * parameters[3])


def _regularised_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["coulomb"], values["static"], values["speed"], values["creep_speed"]


def _bristle_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["coulomb"], values["static"], values["speed"], values["presliding"], values["bristle_damping"]


def _check(values: Values) -> str:
    if values["static"] < values["coulomb"]:
        return f"static = {values['static']:g} N must be at least coulomb = {values['coulomb']:g} N"
    return ""


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    s, speed = motion.velocity, rms(motion.velocity)

    def build(shape: Shape) -> Force:
        creep, at = numbers(shape)
        unit = np.tanh(s / creep)
        return Force.of(motion.spectrum(unit), motion.spectrum(unit * np.exp(-((s / at) ** 2))))

    def values(shape: Shape, amplitudes: Real) -> Numbers | None:
        # Less friction at rest than in motion is no Stribeck curve.
        if amplitudes[0] <= 0 or amplitudes[1] <= 0:
            return None
        creep, at = numbers(shape)
        coulomb, more = float(amplitudes[0]), float(amplitudes[1])
        return {"coulomb": coulomb, "static": coulomb + more, "speed": at, "creep_speed": creep}

    yield Trial(
        variant="regularised", build=build,
        grid=logarithms((0.003 * speed, 0.03 * speed), (0.05 * speed, 0.15 * speed, 0.4 * speed, 1.0 * speed)),
        values=values, parameters=4,
    )  # fmt: skip


def _is_degenerate(fitted: FittedForm) -> bool:
    return _is_coulomb(fitted.values, fitted.motion()[1]) or holds_like_a_loop(fitted)


def _is_coulomb(values: Values, s: Real) -> bool:
    """Whether the drop from static to sliding friction is hardly there, or over before anything slides."""
    speed = float(np.sqrt(np.mean(s**2)))
    return values["static"] < 1.05 * values["coulomb"] or not 0.01 * speed < values["speed"] < 5.0 * speed


def _coulombs(fitted: FittedForm) -> Iterator[Relative]:
    """Give the Coulomb friction of the same size and form."""
    values = {"force": fitted.values["coulomb"], **slides_from(fitted)}
    yield Relative(effect="coulomb_friction", values=values, variant=fitted.variant)


STRIBECK_FRICTION = EffectKind(
    name="stribeck_friction",
    said="Stribeck friction",
    family="friction",
    meaning="dry friction that is larger at rest than in motion",
    sites=("joint",),
    parameters=Parameters(
        (
            Parameter(
                name="coulomb", value=5.0, unit="N", low=0.0, high=200.0, minimum=0.0, maximum=1e9, meaning="sliding"
            ),
            Parameter(
                name="static", value=8.0, unit="N", low=0.0, high=400.0, minimum=0.0, maximum=1e9,
                meaning="at the brink of sliding",
            ),
            Parameter(
                name="speed", value=1e-2, unit="m/s", low=1e-4, high=1.0, minimum=1e-9, maximum=1e6,
                meaning="where the excess has fallen to 37 %",
            ),
        )
    ),
    # The speed has no value that switches the law off; both forces have.
    neutral={"coulomb": 0.0, "static": 0.0},
    # Otherwise the curve would rise with speed: that is viscous damping, which the joint has already.
    check=_check,
    clues=Clues(
        trials=_trials,
        is_degenerate=_is_degenerate,
        details=("creep_speed", "presliding", "bristle_damping"),
        sizes=("coulomb", "static"),
        nested=_coulombs,
    ),
    variants=(
        Variant(
            name="regularised",
            attach=LawAtPort(law=regularised, numbers=_regularised_numbers),
            formula="F = (coulomb + (static - coulomb) exp(-(s/speed)^2)) tanh(s/creep_speed)",
            parameters=Parameters((CREEP_SPEED,)),
            odd=True,
        ),
        Variant(
            name="bristle",
            attach=LawAtPort(law=bristle, numbers=_bristle_numbers, state=(0.0,)),
            formula="F = static w + bristle_damping presliding w', w' = (s - |s| w static/g(s))/presliding",
            parameters=Parameters(
                (
                    PRESLIDING,
                    Parameter(
                        name="bristle_damping", value=0.0, unit="N s/m", low=0.0, high=1e3, minimum=0.0, maximum=1e9,
                        meaning="damping of the bristles while they bend",
                    ),
                )
            ),
            odd=True,
        ),
    ),
)  # fmt: skip
