"""Hardening stiffness: a spring that gets stiffer with displacement (Duffing's)."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Force, Trial, TrialMotion, positive, proportional


def cubic(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``cubic d^3``."""
    # Products, since d**3 raises on overflow in Python where compiled code gives infinity.
    return float(parameters[0] * d * d * d)


def progressive(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``cubic d^3 (1 + (d/range)^2)``; parameters cubic, range."""
    return float(parameters[0] * d * d * d * (1.0 + (d / parameters[1]) * (d / parameters[1])))


def asymmetric(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``cubic d^3 + quadratic d^2``; parameters cubic, quadratic."""
    return float((parameters[0] * d + parameters[1]) * d * d)


def _asymmetric_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["cubic"], values["quadratic"]


def _progressive_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["cubic"], values["range"]


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["cubic"],)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    d = motion.displacement
    yield proportional(motion.spectrum(d**3), "cubic")
    yield Trial(
        variant="progressive", build=lambda _: Force.of(motion.spectrum(d**3), motion.spectrum(d**5)),
        values=lambda _, a: positive(a, cubic=a[0], range=np.sqrt(a[0] / a[1])) if min(a) > 0 else None,
        parameters=2,
    )  # fmt: skip
    yield Trial(
        variant="asymmetric", build=lambda _: Force.of(motion.spectrum(d**3), motion.spectrum(d**2)),
        values=lambda _, a: positive(a, cubic=a[0], quadratic=a[1]), parameters=2,
    )  # fmt: skip


HARDENING_STIFFNESS = EffectKind(
    name="hardening_stiffness",
    family="stiffness",
    meaning="a spring that gets stiffer with displacement",
    sites=("joint",),
    parameters=Parameters(
        (Parameter(name="cubic", value=1e9, unit="N/m^3", low=0.0, high=1e14, minimum=0.0, maximum=1e20),)
    ),
    neutral={"cubic": 0.0},
    clues=Clues(trials=_trials, sizes=("cubic",)),
    variants=(
        Variant(name="cubic", attach=LawAtPort(law=cubic, numbers=_numbers), formula="F = cubic d^3", odd=True),
        Variant(
            name="progressive",
            attach=LawAtPort(law=progressive, numbers=_progressive_numbers),
            formula="F = cubic d^3 (1 + (d/range)^2)",
            parameters=Parameters(
                (
                    Parameter(
                        name="range", value=1e-2, unit="m", low=1e-5, high=1.0, minimum=1e-9, maximum=1e6,
                        meaning="displacement at which the next term is as large as the cubic one",
                    ),
                )
            ),
            odd=True,
            fitted=("range",),
        ),
        Variant(
            name="asymmetric",
            attach=LawAtPort(law=asymmetric, numbers=_asymmetric_numbers),
            formula="F = cubic d^3 + quadratic d^2",
            parameters=Parameters(
                (
                    Parameter(
                        name="quadratic", value=0.0, unit="N/m^2", low=-1e10, high=1e10, minimum=-1e18, maximum=1e18,
                        meaning="-3 cubic times how far the middle of the spring lies beside rest",
                    ),
                )
            ),
            fitted=("quadratic",),
        ),
    ),
)  # fmt: skip
