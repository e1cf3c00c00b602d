"""Quadratic damping: the drag of a turbulent fluid, an orifice, a silencer."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Trial, TrialMotion, proportional


def quadratic(_d: float, s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``coefficient s abs(s)``."""
    # s abs(s) in place of s^2 sgn(s): one expression, and its slope is continuous at rest.
    return float(parameters[0] * s * abs(s))


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["coefficient"],)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    yield proportional(motion.spectrum(motion.velocity * np.abs(motion.velocity)), "coefficient")


QUADRATIC_DAMPING = EffectKind(
    name="quadratic_damping",
    family="damping",
    meaning="damping that grows with the square of the speed",
    sites=("joint",),
    parameters=Parameters(
        (Parameter(name="coefficient", value=100.0, unit="N s^2/m^2", low=0.0, high=1e5, minimum=0.0, maximum=1e12),)
    ),
    neutral={"coefficient": 0.0},
    clues=Clues(trials=_trials, sizes=("coefficient",)),
    variants=(
        Variant(
            name="quadratic",
            attach=LawAtPort(law=quadratic, numbers=_numbers),
            formula="F = coefficient s |s|",
            odd=True,
        ),
    ),
)
