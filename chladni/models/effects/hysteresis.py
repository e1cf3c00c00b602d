"""Hysteresis: a force that remembers which way it came (Bouc-Wen), and one that forgets with time."""

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
    size = min(abs(w), 2.0)
    # A power takes most of the law's time, and the first one is what most hystereses have.
    if parameters[2] != 1.0:
        size = size ** parameters[2]
    sign = 1.0 if w >= 0.0 else -1.0
    rates[0] = (s - 0.5 * size * (abs(s) * sign + s)) / parameters[1]
    return float(parameters[0] * w)


def creeping(_d: float, s: float, _t: float, parameters: Any, state: Any, rates: Any) -> float:
    """Give ``force w``; parameters force, yield displacement, shape, slip speed, loop.

    The element of `bouc_wen` with a dashpot behind it, which moves at ``slip_speed w``: it feels ``u = s - slip_speed
    w``, and ``yield w' = u - (loop abs(u) w abs(w)^(n-1) + (1 - loop) u abs(w)^n)``.
    """
    w = state[0]
    u = s - parameters[3] * w
    size = min(abs(w), 2.0)
    if parameters[2] != 1.0:
        size = size ** parameters[2]
    sign = 1.0 if w >= 0.0 else -1.0
    rates[0] = (u - size * (parameters[4] * abs(u) * sign + (1.0 - parameters[4]) * u)) / parameters[1]
    return float(parameters[0] * w)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["force"], values["yield"], values["shape"]


def _creeping_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["force"], values["yield"], values["shape"], values["slip_speed"], values["loop"]


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
        Variant(
            name="creeping",
            attach=LawAtPort(law=creeping, numbers=_creeping_numbers, state=(0.0,)),
            formula="F = force w, u = s - slip_speed w, "
            "yield w' = u - (loop |u| w |w|^(shape-1) + (1 - loop) u |w|^shape)",
            parameters=Parameters(
                (
                    Parameter(
                        name="slip_speed", value=1e-2, unit="m/s", low=1e-4, high=1.0, minimum=0.0, maximum=1e6,
                        meaning="speed of the dashpot behind it under the full force; below, it never yields",
                    ),
                    # Below a half a cycle could give energy.
                    Parameter(
                        name="loop", value=0.5, unit="1", low=0.5, high=5.0, minimum=0.5, maximum=15.0,
                        meaning="how fast it unloads: at 1/2 along its stiffness, at 1 as it loaded, above faster",
                    ),
                )
            ),
            odd=True,
            fitted=("slip_speed", "loop"),
        ),
    ),
)  # fmt: skip
