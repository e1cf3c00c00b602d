"""Ripple: a force periodic in position: cogging of a motor, mesh of a gear."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import cos, pi, sin
from typing import Any

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues, FittedForm
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.signal_path import last_port
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, logarithms, numbers
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


def ripple(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``amplitude sin(2 pi d/period + phase)``; parameters amplitude, 2 pi/period, phase."""
    # Two pi over the period comes ready made: one division less in the innermost loop.
    return float(parameters[0] * sin(parameters[1] * d + parameters[2]))


def harmonics(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give the first harmonic and shares of the second, both over ``a = 2 pi d/period + phase``.

    Parameters amplitude, 2 pi/period, phase, second_sine, second_cosine.
    """
    angle = parameters[1] * d + parameters[2]
    second = parameters[3] * sin(2.0 * angle) + parameters[4] * cos(2.0 * angle)
    return float(parameters[0] * (sin(angle) + second))


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["amplitude"], 2 * pi / values["period"], values["phase"]


def _harmonics_numbers(values: Values, port: Port) -> tuple[float, ...]:
    return (*_numbers(values, port), values["second_sine"], values["second_cosine"])


def _share(name: str) -> Parameter:
    # Beyond 1 the second harmonic would be the first of a ripple of half the period.
    return Parameter(
        name=name, value=0.0, low=-0.3, high=0.3, minimum=-1.0, maximum=1.0,
        meaning="of the second harmonic over the first",
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _AtJointOrActuator:
    """At an input the force follows the position of the place where the input acts."""

    law: LawAtPort

    def __call__(self, compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
        if site.kind == "joint":
            return self.law(compiled, site, values)
        # The port of kind input knows the command only; where it acts is the port of kind actuation.
        if last_port(compiled, site.name, "actuation") is None:
            raise ModelError(
                f"{site.effect} at {site.name!r}: this input doesn't act at a place that moves, "
                "so its force has no position to follow"
            )
        return self.law(compiled, replace(site, kind="actuation"), values)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    """Give the trials with one harmonic and with two; of an input, where it acts at a place that moves."""
    if motion.kind == "joint":
        yield from _along(motion, motion.displacement)
    elif last_port(motion.compiled, motion.name, "actuation") is not None:
        yield from _along(motion, motion.position_at(motion.compiled.port_index(motion.name, "actuation")))


def _along(motion: TrialMotion, position: Real) -> Iterator[Trial]:
    span = float(np.quantile(position, 0.98) - np.quantile(position, 0.02)) or 1.0

    def build(shape: Shape, *, orders: tuple[float, ...]) -> Force:
        angle = 2 * np.pi * position / numbers(shape)[0]
        return Force.of(*(motion.spectrum(wave(order * angle)) for order in orders for wave in (np.sin, np.cos)))

    def first(shape: Shape, a: Real) -> Numbers:
        phase = float(np.arctan2(a[1], a[0]))
        return {"amplitude": float(np.hypot(a[0], a[1])), "period": numbers(shape)[0], "phase": phase}

    def both(shape: Shape, a: Real) -> Numbers | None:
        found = first(shape, a)
        # Turned by twice the phase, since the law counts its second harmonic from where the first begins.
        second = complex(a[2], a[3]) * np.exp(-2j * found["phase"])
        if abs(second) >= found["amplitude"]:
            return None
        share = second / found["amplitude"]
        return {**found, "second_sine": float(share.real), "second_cosine": float(share.imag)}

    grid = logarithms(np.geomspace(0.03 * span, span, 32).tolist())
    yield Trial(
        variant="sine", build=partial(build, orders=(1.0,)), grid=grid, values=first, parameters=3,
    )  # fmt: skip
    yield Trial(
        variant="harmonics", build=partial(build, orders=(1.0, 2.0)), grid=grid, values=both, parameters=5,
    )  # fmt: skip


def _is_degenerate(fitted: FittedForm) -> bool:
    """Whether the motion goes through fewer than two periods: then it's a spring that bends."""
    return 2.0 * fitted.values["period"] > float(np.ptp(fitted.motion()[0]))


RIPPLE = EffectKind(
    name="ripple",
    family="actuator",
    meaning="a force periodic in position: cogging, gear mesh",
    sites=("joint", "input"),
    parameters=Parameters(
        (
            Parameter(name="amplitude", value=1.0, unit="N", low=0.0, high=100.0, minimum=0.0, maximum=1e12),
            Parameter(name="period", value=0.02, unit="m", low=1e-4, high=10.0, minimum=1e-12, maximum=1e6),
            Parameter(
                name="phase", value=0.0, unit="rad", low=-pi, high=pi, minimum=-1e3, maximum=1e3, meaning="at d = 0"
            ),
        )
    ),
    optional=("phase",),
    neutral={"amplitude": 0.0},
    clues=Clues(trials=_trials, is_degenerate=_is_degenerate, sizes=("amplitude",)),
    variants=(
        Variant(
            name="sine",
            attach=_AtJointOrActuator(law=LawAtPort(law=ripple, numbers=_numbers)),
            formula="F = amplitude sin(2 pi d/period + phase)",
            odd=True,
            fitted=("phase",),
        ),
        Variant(
            name="harmonics",
            attach=_AtJointOrActuator(law=LawAtPort(law=harmonics, numbers=_harmonics_numbers)),
            formula="F = amplitude (sin a + second_sine sin 2a + second_cosine cos 2a), a = 2 pi d/period + phase",
            parameters=Parameters((_share("second_sine"), _share("second_cosine"))),
            fitted=("phase", "second_sine", "second_cosine"),
        ),
    ),
)
