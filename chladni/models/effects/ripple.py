"""Ripple: a force periodic in position: cogging of a motor, mesh of a gear."""

from dataclasses import dataclass, replace
from math import pi, sin
from typing import Any

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.signal_path import last_port
from chladni.signals.errors import ModelError


def ripple(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``amplitude sin(2 pi d/period + phase)``; parameters amplitude, 2 pi/period, phase."""
    # Two pi over the period comes ready made: one division less in the innermost loop.
    return float(parameters[0] * sin(parameters[1] * d + parameters[2]))


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["amplitude"], 2 * pi / values["period"], values["phase"]


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
    variants=(
        Variant(
            name="sine",
            attach=_AtJointOrActuator(law=LawAtPort(law=ripple, numbers=_numbers)),
            formula="F = amplitude sin(2 pi d/period + phase)",
            odd=True,
        ),
    ),
)
