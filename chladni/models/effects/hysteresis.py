"""Hysteresis: a force that remembers which way it came (Bouc-Wen)."""

from typing import Any

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.effect_kind import EffectKind, Values, Variant


def bouc_wen(_d: float, s: float, _t: float, parameters: Any, state: Any, rates: Any) -> float:
    """Give ``force w``; parameters force, yield displacement, shape.

    ``yield w' = s - (abs(s) w abs(w)^(n-1) + s abs(w)^n)/2``: w runs to +-1, and leaves it as a straight line.
    """
    w = state[0]
    # A step that the integrator will throw away may leave +-1 far behind; a high power must not overflow there.
    size = min(abs(w), 2.0) ** parameters[2]
    sign = 1.0 if w >= 0.0 else -1.0
    rates[0] = (s - 0.5 * size * (abs(s) * sign + s)) / parameters[1]
    return float(parameters[0] * w)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["force"], values["yield"], values["shape"]


HYSTERESIS = EffectKind(
    name="hysteresis",
    family="friction",
    meaning="a force that remembers which way it came: micro-slip, rubber, wire rope",
    sites=("joint",),
    parameters=Parameters(
        (
            Parameter(
                name="force", value=10.0, unit="N", low=0.0, high=500.0, minimum=0.0, maximum=1e9,
                meaning="at which it yields",
            ),
            Parameter(
                # Force and yield, not force and stiffness: a yield beyond the motion shows that it is a spring.
                name="yield", value=1e-4, unit="m", low=1e-6, high=1e-2, minimum=1e-12, maximum=1e3,
                meaning="displacement at which it yields: force over initial stiffness",
            ),
            # Below 1 the law's slope over w is infinite at w = 0, where every loop passes.
            Parameter(
                name="shape", value=1.0, unit="1", low=1.0, high=10.0, minimum=1.0, maximum=50.0,
                meaning="how sharply it yields",
            ),
        )
    ),
    optional=("shape",),
    neutral={"force": 0.0},
    variants=(
        Variant(
            name="bouc_wen",
            attach=LawAtPort(law=bouc_wen, numbers=_numbers, state=(0.0,)),
            formula="F = force w, yield w' = s - (|s| w |w|^(shape-1) + s |w|^shape)/2",
            odd=True,
        ),
    ),
)  # fmt: skip
