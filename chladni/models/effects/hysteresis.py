"""Hysteresis: a force that remembers which way it came (Bouc-Wen; Iwan), and one that forgets with time."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.core.port_law import LawFunction, PortLaw
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues, FittedForm
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.stops import stops_along
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, logarithms, numbers, positive, rms
from chladni.models.integrator.known_motion import force_along_motion
from chladni.signals.arrays import Complex, Real


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


#: Elements in parallel that stand for a continuous distribution of yields.
_SLIDERS = 6


def sliders(_d: float, s: float, _t: float, parameters: Any, state: Any, rates: Any) -> float:
    """Give ``sum(stiffness_k yield_k w_k)``; parameters shape, yields, stiffnesses: of each an element of `bouc_wen`.

    Springs with sliders in parallel yield one after another (W. D. Iwan, Journal of Applied Mechanics 33 (1966)
    893-900): a joint slips at its rim long before it slips as a whole, and loops close on themselves (Masing).
    """
    force = 0.0
    for place in range(_SLIDERS):
        w, bend = state[place], parameters[1 + place]
        size = min(abs(w), 2.0) ** parameters[0] if s * w > 0.0 else 0.0
        rates[place] = s * (1.0 - size) / bend
        force += parameters[1 + _SLIDERS + place] * bend * w
    return float(force)


def _slider_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    """Elements whose yields are the middles of equal parts of their range, with what stiffness yields in each part.

    Of D. J. Segalman's joint (Journal of Applied Mechanics 72 (2005) 752-760) with density ``yield^chi`` the share
    that yields before y goes as ``y^(1 + chi)``: one over that power is the spread.
    """
    power = 1.0 / values["spread"]
    shares = np.diff(np.linspace(0.0, 1.0, _SLIDERS + 1) ** power)
    middles = (np.arange(_SLIDERS) + 0.5) / _SLIDERS
    yields = values["yield"] * middles / float(shares @ middles)
    return values["shape"], *yields.tolist(), *(values["force"] / values["yield"] * shares).tolist()


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["force"], values["yield"], values["shape"]


def _creeping_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["force"], values["yield"], values["shape"], values["slip_speed"], values["loop"]


#: Most steps between two samples along a known motion.
_STEPS = 16
#: Yields over the way's RMS below which there's no loop to be seen, without and with creep.
_LEAST_YIELD, _LEAST_CREEPING = 0.05, 0.01
#: Powers of the yields' spread that the sliders of a joint have, and how sharply each of them yields.
_SPREADS, _SHARP = (0.1, 8.0), 2.0
#: Of the usual way and pace of a joint: a yield below is friction's presliding.
_FRICTION = 0.12


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    yield _plain_trial(motion)
    yield _creeping_trial(motion)
    yield _slider_trial(motion)


def _plain_trial(motion: TrialMotion) -> Trial:
    reach = rms(motion.displacement)

    def build(shape: Shape) -> Force:
        bend, power = _bounded(shape)
        return Force.of(_along(bouc_wen, (1.0, bend, power), bend, motion))

    def values(shape: Shape, a: Real) -> Numbers | None:
        bend, power = _bounded(shape)
        return positive(a, force=a[0], shape=power, **{"yield": bend})

    def _bounded(shape: Shape) -> tuple[float, float]:
        bend, power = numbers(shape)
        return max(bend, _LEAST_YIELD * reach), max(power, 1.0)

    return Trial(
        build=build, grid=logarithms((0.1 * reach, 0.3 * reach, 0.7 * reach, 1.5 * reach), (1.0, 2.0)),
        values=values, parameters=3,
    )  # fmt: skip


def _creeping_trial(motion: TrialMotion) -> Trial:
    """Hysteresis behind a dashpot: loops over velocity, as those of fluid dampers and rubber."""
    reach, speed, fastest = rms(motion.displacement), rms(motion.velocity), float(np.max(np.abs(motion.velocity)))

    def build(shape: Shape) -> Force:
        bend, slip = max(numbers(shape)[0], _LEAST_CREEPING * reach), numbers(shape)[1]
        return Force.of(_along(creeping, (1.0, bend, 1.0, slip, 0.5), bend, motion))

    def values(shape: Shape, a: Real) -> Numbers | None:
        bend, slip = max(numbers(shape)[0], _LEAST_CREEPING * reach), numbers(shape)[1]
        # An element that the motion never makes yield is a spring and a dashpot in series.
        return positive(a, force=a[0], slip_speed=slip, **{"yield": bend}) if slip < fastest else None

    return Trial(
        variant="creeping", build=build,
        grid=logarithms((0.02 * reach, 0.06 * reach, 0.2 * reach), (0.1 * speed, 0.3 * speed)),
        values=values, parameters=4,
    )  # fmt: skip


def _slider_trial(motion: TrialMotion) -> Trial:
    """Sliders that yield at once when they do, whose force along a motion needs no steps."""
    reach = rms(motion.displacement)

    def build(shape: Shape) -> Force:
        bend, spread = _bounded(shape)
        unit = {"force": 1.0, "yield": bend, "shape": _SHARP, "spread": spread}
        yields, stiffnesses = np.reshape(_slider_numbers(unit, motion.port)[1:], (2, _SLIDERS))
        return Force.of(motion.spectrum(stops_along(motion.displacement, yields, stiffnesses)))

    def values(shape: Shape, a: Real) -> Numbers | None:
        bend, spread = _bounded(shape)
        return positive(a, force=a[0], shape=_SHARP, spread=spread, **{"yield": bend})

    def _bounded(shape: Shape) -> tuple[float, float]:
        bend, spread = numbers(shape)
        return max(bend, _LEAST_YIELD * reach), float(np.clip(spread, *_SPREADS))

    return Trial(
        variant="sliders", build=build, grid=logarithms((0.3 * reach, 0.7 * reach, 1.5 * reach), (1.0, 3.0)),
        values=values, parameters=4,
    )  # fmt: skip


def _along(law: LawFunction, parameters: tuple[float, ...], bend: float, motion: TrialMotion) -> Complex:
    """Spectrum of a law with a state that turns round within a way of about `bend`."""
    port_law = PortLaw(port=0, function=law, parameters=parameters, state=(0.0,))
    # Steps of more than 2.8 bends run away; where the motion is that fast the law slides anyway.
    furthest = float(np.max(np.abs(motion.velocity))) / motion.sample_rate_hz
    steps = int(np.clip(np.ceil(0.7 * furthest / bend), 4, _STEPS))
    return motion.spectrum(
        force_along_motion(port_law, motion.displacement, motion.velocity, motion.time_s, substeps=steps)
    )


def _is_degenerate(fitted: FittedForm) -> bool:
    """Whether a loop has closed after a small part of the way, as friction does, or never yields, as a spring."""
    d, s = fitted.motion()
    usual, pace, values = float(np.std(d)), float(np.sqrt(np.mean(s**2))), fitted.values
    stiff = values["yield"] < _FRICTION * usual and values.get("slip_speed", 0.0) < _FRICTION * pace
    return stiff or values["yield"] > 2.0 * float(np.max(np.abs(d)))


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
    clues=Clues(
        trials=_trials, is_degenerate=_is_degenerate, details=("shape",), sizes=("force",), is_loop=True
    ),
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
        Variant(
            name="sliders",
            attach=LawAtPort(law=sliders, numbers=_slider_numbers, state=(0.0,) * _SLIDERS),
            formula="F = force/yield sum share_k yield_k w_k, yield_k ~ k - 1/2, "
            "share_k = (k/6)^(1/spread) - ((k - 1)/6)^(1/spread), sum share_k yield_k = yield, "
            "yield_k w_k' = s - (|s| w_k |w_k|^(shape-1) + s |w_k|^shape)/2",
            parameters=Parameters(
                (
                    Parameter(
                        name="spread", value=1.0, unit="1", low=0.1, high=8.0, minimum=0.1, maximum=20.0,
                        meaning="of their yields: at 0.1 nearly all alike, at 1 even, above it most are small",
                    ),
                )
            ),
            odd=True,
            fitted=("spread", "shape"),
        ),
    ),
)  # fmt: skip
