"""Softening stiffness: a spring that gets weaker with displacement, up to where it would give way."""

from collections.abc import Iterator
from math import sqrt
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.core.simulation import Simulation
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import (
    Force,
    Numbers,
    Shape,
    Trial,
    TrialMotion,
    logarithms,
    numbers,
    positive,
    proportional,
    rms,
)
from chladni.signals.arrays import Real
from chladni.signals.engineering import engineering
from chladni.signals.errors import ModelError

# Finite, because laws take finite numbers only.
_EVERYWHERE = 1e300


def cubic(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``cubic d^3`` inside the valid range; beyond it the joint's whole force stays what it is at the end.

    Parameters cubic, the joint's stiffness, end of the valid range.
    """
    end = parameters[2]
    # Beyond the end the cubic would push the bodies apart, faster and faster: no joint does.
    inside = min(max(d, -end), end)
    return float(parameters[0] * inside * inside * inside - parameters[1] * (d - inside))


def yielding(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``-lost k d (1 - 1/sqrt(1 + q d^2))``, about ``cubic d^3`` near rest; parameters lost k and q.

    The joint's whole force k d + F never falls: it ends on a line of slope (1 - lost) k.
    """
    return float(-parameters[0] * d * (1.0 - 1.0 / sqrt(1.0 + parameters[1] * d * d)))


def valid_range(cubic_stiffness: float, stiffness: float) -> float:
    """Give the largest valid displacement ``sqrt(k/(3 abs(cubic)))``: there the joint's stiffness has fallen to zero.

    Examples
    --------
    >>> round(valid_range(-1e10, 3e6), 12)
    0.01
    """
    return sqrt(stiffness / (-3 * cubic_stiffness)) if cubic_stiffness else _EVERYWHERE


def _numbers(values: Values, port: Port) -> tuple[float, ...]:
    if port.stiffness <= 0:
        raise ModelError(f"softening_stiffness at {port.name!r}: the joint has no spring that could get softer")
    return values["cubic"], port.stiffness, valid_range(values["cubic"], port.stiffness)


def _yielding_numbers(values: Values, port: Port) -> tuple[float, ...]:
    _numbers(values, port)
    lost = values["lost"] * port.stiffness
    return lost, -2 * values["cubic"] / lost


def _flags(port: Port, values: Values, simulation: Simulation) -> tuple[str, ...]:
    # A spring that yields is valid everywhere.
    if "lost" in values:
        return ()
    end = valid_range(values["cubic"], port.stiffness)
    # The law keeps going beyond its range, so that a simulation ends; the user must know that it was left.
    reached = float(np.max(np.abs(simulation.motion(port.name).displacement), initial=0.0))
    if reached <= end:
        return ()
    told, valid = (engineering(one, None, port.displacement_unit) for one in (reached, end))
    sentence = (
        f"softening_stiffness at {port.name}: displacement {told} leaves the valid range of {valid}; beyond it the "
        "joint's force was kept constant"
    )
    return (sentence,)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    stiffness, d, reach = motion.port.stiffness, motion.displacement, rms(motion.displacement)
    if stiffness <= 0:
        return
    yield proportional(motion.spectrum(d**3), "cubic", sign=-1.0)

    def build(shape: Shape) -> Force:
        return Force.of(motion.spectrum(-d * (1.0 - 1.0 / np.sqrt(1.0 + (d / numbers(shape)[0]) ** 2))))

    def values(shape: Shape, a: Real) -> Numbers | None:
        lost = min(float(a[0]) / stiffness, 1.0)
        return positive(a, cubic=-0.5 * lost * stiffness / numbers(shape)[0] ** 2, lost=lost)

    # From a spring that yields at once to one that only begins to.
    yield Trial(
        variant="yielding", build=build, grid=logarithms((reach * np.geomspace(0.01, 10.0, 7)).tolist()),
        values=values, parameters=2,
    )  # fmt: skip


SOFTENING_STIFFNESS = EffectKind(
    name="softening_stiffness",
    family="stiffness",
    meaning="a spring that gets weaker with displacement",
    sites=("joint",),
    parameters=Parameters(
        (Parameter(name="cubic", value=-1e9, unit="N/m^3", low=-1e14, high=0.0, minimum=-1e20, maximum=0.0),)
    ),
    neutral={"cubic": 0.0},
    flags=_flags,
    clues=Clues(trials=_trials, sizes=("cubic",)),
    variants=(
        Variant(
            name="cubic",
            attach=LawAtPort(law=cubic, numbers=_numbers),
            formula="F = cubic d^3 up to |d| = sqrt(k/(3 |cubic|)); beyond, k d + F stays constant",
            odd=True,
        ),
        Variant(
            name="yielding",
            attach=LawAtPort(law=yielding, numbers=_yielding_numbers),
            formula="F = -lost k d (1 - 1/sqrt(1 + 2 |cubic| d^2/(lost k))), about cubic d^3 near rest",
            parameters=Parameters(
                (
                    Parameter(
                        name="lost", value=1.0, unit="1", low=0.1, high=1.0, minimum=1e-3, maximum=1.0,
                        meaning="share of the joint's stiffness that is gone far out",
                    ),
                )
            ),
            odd=True,
            fitted=("lost",),
        ),
    ),
)  # fmt: skip
