"""Varying stiffness: the joint's spring changes during the log."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues, FittedForm
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, logarithms, numbers
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


def drift(d: float, _s: float, t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``k relative_change min(t/time, 1) d``; parameters k times the change, time."""
    # Tested before dividing: a drift of no duration is complete at once.
    share = 1.0
    if t < parameters[1]:
        share = max(t, 0.0) / parameters[1]
    return float(parameters[0] * share * d)


def step(d: float, _s: float, t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``k relative_change d`` from a time on; parameters k times the change, time, rise.

    The change is spread over `rise` by the polynomial of fifth order whose first and second derivative vanish at
    both ends.
    """
    # A jump in time would meet the integrator inside a step wherever it fell.
    u = min(max((t - parameters[1]) / parameters[2] + 0.5, 0.0), 1.0)
    return float(parameters[0] * u * u * u * (10.0 + u * (6.0 * u - 15.0)) * d)


def _drift_numbers(values: Values, port: Port) -> tuple[float, ...]:
    if port.stiffness <= 0:
        raise ModelError(f"varying_stiffness at {port.name!r}: the joint has no spring that could vary")
    return values["relative_change"] * port.stiffness, values["time"]


def _step_numbers(values: Values, port: Port) -> tuple[float, ...]:
    return (*_drift_numbers(values, port), values["rise"])


#: Standard deviation over reach of a jump that is at 2 % of a log; instants at which a change is looked at.
_JUMP, _INSTANTS = 0.14, 1000


def share_risen(t: Real, time: float, rise: float) -> Real:
    """Give ``[sample]`` which share of a step's change is there at times t."""
    u = np.clip((t - time) / rise + 0.5, 0.0, 1.0)
    return np.asarray(u**3 * (10.0 + u * (6.0 * u - 15.0)), dtype=np.float64)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    stiffness, d, t = motion.port.stiffness, motion.displacement, motion.time_s
    if stiffness <= 0:
        return
    length = float(t[-1])

    def change(shape: Shape, amplitudes: Real) -> Numbers | None:
        relative = float(amplitudes[0]) / stiffness
        return {"relative_change": relative, "time": numbers(shape)[0]} if relative > -0.95 else None

    yield Trial(
        variant="drift",
        build=lambda shape: Force.of(motion.spectrum(d * np.minimum(t / numbers(shape)[0], 1.0))),
        grid=logarithms((0.4 * length, length)), values=change, parameters=2,
    )  # fmt: skip
    # From a jump to a change that takes half of the log.
    rises = (0.01 * length, 0.15 * length, 0.5 * length)

    yield Trial(
        variant="step",
        build=lambda shape: Force.of(motion.spectrum(d * share_risen(t, *numbers(shape)))),
        grid=logarithms(np.linspace(0.1 * length, 0.9 * length, 9).tolist(), rises),
        values=lambda shape, a: _with_rise(change(shape, a), shape), parameters=3,
    )  # fmt: skip


def _with_rise(values: Numbers | None, shape: Shape) -> Numbers | None:
    return None if values is None else {**values, "rise": numbers(shape)[1]}


def _is_degenerate(fitted: FittedForm) -> bool:
    """Whether a log doesn't see the change: what is over at once, or never comes, is a stiffness."""
    values = fitted.values
    if fitted.variant != "step":
        return not values["time"] > 0.1 * fitted.duration_s
    # A slow one may be seen though its middle lies outside of the log.
    share = share_risen(np.linspace(0.0, fitted.duration_s, _INSTANTS), values["time"], values["rise"])
    return not float(np.std(share)) > _JUMP * float(np.ptp(share))


VARYING_STIFFNESS = EffectKind(
    name="varying_stiffness",
    family="stiffness",
    meaning="the joint's spring changes during the log",
    sites=("joint",),
    parameters=Parameters(
        (
            Parameter(
                name="relative_change", value=-0.2, unit="1", low=-0.9, high=1.0, minimum=-1.0, maximum=1e3,
                meaning="stiffness afterwards over stiffness before, less one",
            ),
            Parameter(
                name="time", value=1.0, unit="s", low=0.0, high=3600.0, minimum=0.0, maximum=1e9,
                meaning="from the log's start until the change is complete, or its middle for a step",
            ),
        )
    ),
    neutral={"relative_change": 0.0},
    clues=Clues(
        trials=_trials, is_degenerate=_is_degenerate, details=("rise",), sizes=("relative_change",), timed=True
    ),
    variants=(
        Variant(
            name="drift",
            attach=LawAtPort(law=drift, numbers=_drift_numbers),
            formula="F = k relative_change min(t/time, 1) d",
            odd=True,
        ),
        Variant(
            name="step",
            attach=LawAtPort(law=step, numbers=_step_numbers),
            formula="F = k relative_change S((t - time)/rise + 1/2) d, S(u) = 10 u^3 - 15 u^4 + 6 u^5",
            parameters=Parameters(
                (
                    Parameter(
                        name="rise", value=0.01, unit="s", low=1e-4, high=10.0, minimum=1e-9, maximum=1e9,
                        meaning="how long the step takes",
                    ),
                )
            ),
            odd=True,
        ),
    ),
)  # fmt: skip
