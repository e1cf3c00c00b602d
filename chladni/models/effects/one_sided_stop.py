"""A one-sided stop: a contact that acts beyond one displacement: end stop, rub, crack that opens and closes."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues, FittedForm
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, logarithms, numbers, positive
from chladni.signals.arrays import Real


def stop(d: float, s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give the force of the contact; parameters stiffness, clearance, side, exponent, depth, dissipation.

    ``side stiffness p (p/depth)^(exponent - 1) max(1 + dissipation p', 0)``, p = side d - clearance > 0.
    """
    side = parameters[2]
    p = side * d - parameters[1]
    if p <= 0.0:
        return 0.0
    force = parameters[0] * p
    # The power costs more than all the rest, and most stops are linear.
    if parameters[3] != 1.0:
        force *= (p / parameters[4]) ** (parameters[3] - 1.0)
    # A contact pushes and never pulls, however fast the bodies part.
    return float(side * force * max(1.0 + parameters[5] * side * s, 0.0))


def _spring(values: Values, _port: Port) -> tuple[float, ...]:
    return values["stiffness"], values["clearance"], values["side"], 1.0, 1.0, values.get("dissipation", 0.0)


def _hertz(values: Values, _port: Port) -> tuple[float, ...]:
    numbers = (values["stiffness"], values["clearance"], values["side"])
    return (*numbers, 1.5, values["depth"], values.get("dissipation", 0.0))


def _check(values: Values) -> str:
    return "" if abs(values["side"]) == 1 else f"side = {values['side']:g} must be 1 (above) or -1 (below)"


# Damping in proportion to the force (Hunt & Crossley): a plain damper would make the force jump at contact.
_DISSIPATION = Parameter(
    name="dissipation", value=0.5, unit="s/m", low=0.0, high=10.0, minimum=0.0, maximum=1e6,
    meaning="share of the force that a contact speed of 1 m/s adds",
)  # fmt: skip
# Keeps the stiffness in N/m: the constant of a 3/2 power in N/m^1.5 means nothing to most people.
_DEPTH = Parameter(
    name="depth", value=1e-4, unit="m", low=1e-6, high=1e-2, minimum=1e-12, maximum=1e3,
    meaning="penetration at which the contact's secant stiffness is `stiffness`",
)  # fmt: skip


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    for side in (1.0, -1.0):
        yield _trial(motion, side, "spring", 1.0)
        yield _trial(motion, side, "hertz_damper", 1.5)


def _trial(motion: TrialMotion, side: float, variant: str, power: float) -> Trial:
    d, s = side * motion.displacement, side * motion.velocity
    # How much of the way to the furthest point is free, so that a search can't leave the motion.
    low, high = float(np.quantile(d, 0.3)), float(np.max(d))
    depth = 0.1 * (high - low)

    def clearance(shape: Shape) -> float:
        return high - (high - low) * min(numbers(shape)[0], 1.0)

    def build(shape: Shape) -> Force:
        pressed = side * np.maximum(d - clearance(shape), 0.0) ** power
        return Force.of(*(motion.spectrum(one) for one in ([pressed] if power == 1.0 else [pressed, pressed * s])))

    def values(shape: Shape, a: Real) -> Numbers | None:
        if power == 1.0:
            return positive(a, stiffness=a[0], clearance=clearance(shape), side=side)
        stiffness, loss = a[0] * np.sqrt(depth), max(a[1] / a[0], 0.0) if a[0] > 0 else 0.0
        return positive(a, stiffness=stiffness, clearance=clearance(shape), side=side, depth=depth, dissipation=loss)

    return Trial(
        variant=variant, build=build, grid=logarithms((0.08, 0.2, 0.35, 0.5, 0.7, 0.9)), values=values,
        parameters=2 if power == 1.0 else 3,
    )  # fmt: skip


def _is_degenerate(fitted: FittedForm) -> bool:
    """Whether the stop is never reached, or never left."""
    touching = float(np.mean(fitted.values["side"] * fitted.motion()[0] > fitted.values["clearance"]))
    return not 1e-4 < touching < 0.7


ONE_SIDED_STOP = EffectKind(
    name="one_sided_stop",
    said="a one-sided stop",
    family="stiffness",
    meaning="a contact beyond one displacement: end stop, rub, open crack",
    sites=("joint",),
    parameters=Parameters(
        (
            Parameter(
                name="stiffness", value=1e6, unit="N/m", low=0.0, high=1e9, minimum=0.0, maximum=1e15,
                meaning="of the contact",
            ),
            Parameter(
                name="clearance", value=1e-4, unit="m", low=0.0, high=1e-2, minimum=-1e3, maximum=1e3,
                meaning="free way to the stop; negative when it presses at rest",
            ),
            Parameter(
                name="side", value=1.0, unit="1", low=-1.0, high=1.0, minimum=-1.0, maximum=1.0, role="function",
                meaning="1: stops d from rising; -1: from falling",
            ),
        )
    ),
    optional=("side",),
    # A stop that is never reached is none either, but how far is never depends on the motion.
    neutral={"stiffness": 0.0},
    check=_check,
    clues=Clues(trials=_trials, is_degenerate=_is_degenerate, details=("dissipation",)),
    variants=(
        Variant(
            name="spring",
            attach=LawAtPort(law=stop, numbers=_spring),
            formula="F = side stiffness p where p = side d - clearance > 0, else 0",
        ),
        Variant(
            name="spring_damper",
            attach=LawAtPort(law=stop, numbers=_spring),
            formula="F = side stiffness p max(1 + dissipation p', 0)",
            parameters=Parameters((_DISSIPATION,)),
        ),
        Variant(
            name="hertz",
            attach=LawAtPort(law=stop, numbers=_hertz),
            formula="F = side stiffness p sqrt(p/depth)",
            parameters=Parameters((_DEPTH,)),
        ),
        Variant(
            name="hertz_damper",
            attach=LawAtPort(law=stop, numbers=_hertz),
            formula="F = side stiffness p sqrt(p/depth) max(1 + dissipation p', 0)",
            parameters=Parameters((_DEPTH, _DISSIPATION)),
        ),
    ),
)  # fmt: skip
