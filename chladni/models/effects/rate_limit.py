"""Rate limit: a force that changes no faster than the actuator can."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import ShapedSignal
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Trial, TrialMotion, shaped
from chladni.models.integrator.machine_code import machine_code
from chladni.signals.arrays import Real


def tracker(d: float, _s: float, _t: float, parameters: Any, state: Any, rates: Any) -> float:
    """Give ``z - d``: z runs after the command at most at the rate; parameters rate, tracking time.

    ``z' = clip((d - z)/tracking_time, -rate, rate)``
    """
    # The exact limiter has no rate to give between samples: at zero distance it would jump between +rate and -rate.
    rates[0] = min(max((d - state[0]) / parameters[1], -parameters[0]), parameters[0])
    return float(state[0] - d)


def limited_samples(samples: Real, sample_rate_hz: float, rate: float, _tracking_time: float) -> Real:
    """Give samples that change by at most the rate, starting from zero one sample before the first."""
    followed = np.empty(samples.shape)
    _follow(np.ascontiguousarray(samples, dtype=np.float64), rate / sample_rate_hz, followed)
    return followed


@machine_code
def _follow(samples: Real, step: float, followed: Real) -> None:
    # Each sample depends on the one before, so there's nothing to vectorise.
    now = 0.0
    for place in range(samples.size):
        now = min(max(samples[place], now - step), now + step)
        followed[place] = now


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["rate"], values["tracking_time"]


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    if motion.is_still:
        return
    u, sample_rate_hz = motion.displacement, motion.sample_rate_hz
    fastest = float(np.max(np.abs(np.diff(u)))) * sample_rate_hz
    rates = (fastest * np.geomspace(0.002, 0.95, 24)).tolist()
    yield shaped(lambda value: motion.spectrum(limited_samples(u, sample_rate_hz, value, 0.0) - u), rates, "rate")


RATE_LIMIT = EffectKind(
    name="rate_limit",
    said="a rate limit",
    family="actuator",
    meaning="the force changes no faster than the actuator can",
    sites=("input",),
    parameters=Parameters(
        (
            Parameter(name="rate", value=1e3, unit="N/s", low=1.0, high=1e6, minimum=1e-12, maximum=1e18),
            Parameter(
                name="tracking_time", value=1e-3, unit="s", low=1e-4, high=1e-2, minimum=1e-9, maximum=1e3,
                role="function", meaning="inside a loop: time constant of the tracker; outside of loops unused",
            ),
        )
    ),
    # How the limit is computed, not how the actuator is built.
    optional=("tracking_time",),
    neutral={"rate": 1e18},
    clues=Clues(trials=_trials, details=("tracking_time",)),
    variants=(
        Variant(
            name="slew",
            attach=ShapedSignal(shape=limited_samples, law=tracker, numbers=_numbers, state=(0.0,)),
            formula="|u_acts'| <= rate; inside a loop u_acts' = clip((u - u_acts)/tracking_time, -rate, rate)",
            odd=True,
        ),
    ),
)  # fmt: skip
