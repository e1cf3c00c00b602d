"""Saturation: an actuator whose force is limited."""

from collections.abc import Iterator, Sequence
from math import exp, log1p, tanh
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import ShapedSignal
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Force, Shape, Trial, TrialMotion, logarithms, numbers, shaped
from chladni.signals.arrays import Real

#: Wider ones would bend the line at rest, which is a gain.
KNEE = Parameter(
    name="knee", value=0.2, unit="1", low=0.02, high=0.5, minimum=1e-6, maximum=0.5,
    meaning="width of the corners over the limit",
)  # fmt: skip


def clipped(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``clip(d, -limit, limit) - d``."""
    # A law adds to the command, so it gives what the limit takes away.
    return float(min(max(d, -parameters[0]), parameters[0]) - d)


def smooth(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``limit tanh(d/limit) - d``."""
    return float(parameters[0] * tanh(d / parameters[0]) - d)


def rounded(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give the clip of d, averaged over a bell ``sech(./width)^2`` of the corners' width, less d."""
    limit, width = parameters[0], parameters[0] * parameters[1]
    # ln cosh x = abs(x) + ln(1 + exp(-2 abs(x))) - ln 2: the first is the clip, what is left doesn't overflow.
    corners = log1p(exp(-2.0 * abs(d + limit) / width)) - log1p(exp(-2.0 * abs(d - limit) / width))
    return float(min(max(d, -limit), limit) + 0.5 * width * corners - d)


def clipped_samples(samples: Real, _sample_rate_hz: float, limit: float) -> Real:
    """Give the samples, none beyond the limit."""
    return np.clip(samples, -limit, limit)


def smooth_samples(samples: Real, _sample_rate_hz: float, limit: float) -> Real:
    """Give the samples, approaching the limit smoothly."""
    return np.asarray(limit * np.tanh(samples / limit), dtype=np.float64)


def rounded_samples(samples: Real, _sample_rate_hz: float, limit: float, knee: float) -> Real:
    """Give the samples, none beyond the limit, bent away from the line over the corners' width."""
    width = limit * knee
    above, below = (np.log1p(np.exp(-2.0 * np.abs(samples + side) / width)) for side in (limit, -limit))
    return np.asarray(np.clip(samples, -limit, limit) + 0.5 * width * (above - below), dtype=np.float64)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["limit"],)


def _rounded_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["limit"], values["knee"]


#: What ends at a limit, sharply or with round corners: an actuator's force, or a sensor's range.
CLIPPED = ShapedSignal(shape=clipped_samples, law=clipped, numbers=_numbers)
ROUNDED = ShapedSignal(shape=rounded_samples, law=rounded, numbers=_rounded_numbers)

#: Widths of a limit's corners over the limit that are tried.
_KNEES = (0.08, 0.25)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    u = motion.displacement
    size = float(np.max(np.abs(u)))
    shares = (0.3, 0.5, 0.65, 0.75, 0.83, 0.89, 0.93, 0.96, 0.98, 0.99, 0.997)
    # By how often it's reached, and by size: steps stand at few levels.
    limits = [*np.quantile(np.abs(u), shares).tolist(), *(size * np.array([0.1, 0.3, 0.6, 0.9])).tolist()]
    limits = sorted({limit for limit in limits if 0 < limit < size})
    if not limits:
        return
    yield shaped(lambda value: motion.spectrum(np.clip(u, -value, value) - u), limits, "limit", "clipped")
    yield shaped(lambda value: motion.spectrum(value * np.tanh(u / value) - u), limits, "limit", "smooth")
    yield rounded_limit(motion, limits)


def rounded_limit(motion: TrialMotion, limits: Sequence[float]) -> Trial:
    """Give the trial of the variant `rounded`, with no free amplitude: an actuator's, or the end of a range."""
    signal, rate = motion.displacement, motion.sample_rate_hz

    def ends(shape: Shape) -> tuple[float, float]:
        limit, knee = numbers(shape)
        return limit, min(knee, KNEE.maximum)

    def build(shape: Shape) -> Force:
        return Force.known(motion.spectrum(rounded_samples(signal, rate, *ends(shape)) - signal))

    return Trial(
        variant="rounded", build=build, grid=logarithms(limits, _KNEES),
        values=lambda shape, _: dict(zip(("limit", "knee"), ends(shape), strict=True)),
        parameters=2,
    )  # fmt: skip


SATURATION = EffectKind(
    name="saturation",
    family="actuator",
    meaning="the actuator's force is limited",
    sites=("input",),
    parameters=Parameters(
        (Parameter(name="limit", value=100.0, unit="N", low=1.0, high=1e4, minimum=1e-12, maximum=1e18),)
    ),
    # No finite limit is none, but this one no force reaches.
    neutral={"limit": 1e18},
    clues=Clues(trials=_trials),
    variants=(
        Variant(
            name="clipped",
            attach=CLIPPED,
            formula="u_acts = clip(u, -limit, limit)",
            odd=True,
        ),
        Variant(
            name="smooth",
            attach=ShapedSignal(shape=smooth_samples, law=smooth, numbers=_numbers),
            formula="u_acts = limit tanh(u/limit)",
            odd=True,
        ),
        Variant(
            name="rounded",
            attach=ROUNDED,
            formula="u_acts = w/2 ln(cosh((u + limit)/w)/cosh((u - limit)/w)), w = knee limit",
            parameters=Parameters((KNEE,)),
            odd=True,
            fitted=("knee",),
        ),
    ),
)  # fmt: skip
