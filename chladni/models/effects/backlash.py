"""Backlash: the joint's spring acts only outside a dead zone."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues, FittedForm
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Trial, TrialMotion, rms, shaped
from chladni.signals.errors import ModelError


def spring(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``k (deadzone(d) - d)``: what the joint's linear spring gives too much; parameters k, half the gap."""
    half = parameters[1]
    # The model's own spring stays in the linear equations; the law takes away what it gives inside the gap.
    return float(-parameters[0] * min(max(d, -half), half))


def contact_damping(d: float, s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give the same and take the joint's damping away inside the gap; parameters k, half the gap, c.

    The damping sets in over a depth of 5 % of the gap, smoothly, or the force would jump at contact.
    """
    half = parameters[1]
    inside = min(max(d, -half), half)
    free = 0.0
    # Without a gap the joint is always in contact, and nothing must be divided by it.
    if half > 0.0:
        depth = min(max((abs(d) - half) / (0.1 * half), 0.0), 1.0)
        free = 1.0 - depth * depth * (3.0 - 2.0 * depth)
    return float(-parameters[0] * inside - parameters[2] * free * s)


def _numbers(values: Values, port: Port) -> tuple[float, ...]:
    if port.stiffness <= 0:
        raise ModelError(f"backlash at {port.name!r}: the joint has no spring that could have play")
    # One order of numbers for both laws; the first leaves the damping alone.
    return port.stiffness, values["gap"] / 2, port.damping


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    stiffness, d = motion.port.stiffness, motion.displacement
    if stiffness <= 0:
        return
    # From hardly any play to one that the motion barely crosses.
    gaps = 2 * rms(d) * np.geomspace(5e-4, 2.0, 24)
    yield shaped(
        lambda gap: motion.spectrum(-stiffness * np.clip(d, -gap / 2, gap / 2)), gaps.tolist(), "gap"
    )  # fmt: skip


def _is_degenerate(fitted: FittedForm) -> bool:
    """Whether the motion never crosses the play."""
    return fitted.values["gap"] > 2.0 * float(np.max(np.abs(fitted.motion()[0])))


BACKLASH = EffectKind(
    name="backlash",
    family="stiffness",
    meaning="play: the joint's spring acts only outside a dead zone",
    sites=("joint",),
    parameters=Parameters(
        (
            Parameter(
                name="gap", value=1e-4, unit="m", low=0.0, high=1e-2, minimum=0.0, maximum=1e3,
                meaning="whole width of the play, half on either side of d = 0",
            ),
        )
    ),
    neutral={"gap": 0.0},
    clues=Clues(trials=_trials, is_degenerate=_is_degenerate, sizes=("gap",)),
    variants=(
        Variant(
            name="spring",
            attach=LawAtPort(law=spring, numbers=_numbers),
            formula="F = k (deadzone(d) - d), deadzone(d) = d - clip(d, -gap/2, gap/2)",
            odd=True,
        ),
        Variant(
            name="contact_damping",
            attach=LawAtPort(law=contact_damping, numbers=_numbers),
            formula="as spring, and the joint's damper too acts in contact only",
            odd=True,
        ),
    ),
)  # fmt: skip
