"""Dead zone: no force under a threshold, as behind a valve whose spool overlaps."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import ShapedSignal
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Trial, TrialMotion, shaped
from chladni.signals.arrays import Real


def dead_zone(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``-clip(d, -width, width)``: what the zone takes away from the command."""
    # (d - clip d) - d, without the difference of two large numbers.
    return float(-min(max(d, -parameters[0]), parameters[0]))


def dead_zone_samples(samples: Real, _sample_rate_hz: float, width: float) -> Real:
    """Give what is left of the samples outside the zone."""
    return np.asarray(samples - np.clip(samples, -width, width), dtype=np.float64)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["width"],)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    if motion.is_still:
        return
    u = motion.displacement
    widths = (float(np.sqrt(np.mean(u**2))) * np.geomspace(0.01, 1.5, 18)).tolist()
    yield shaped(lambda value: motion.spectrum(-np.clip(u, -value, value)), widths, "width")


DEAD_ZONE = EffectKind(
    name="dead_zone",
    said="a dead zone",
    family="actuator",
    meaning="no force under a threshold: valve overlap",
    sites=("input",),
    parameters=Parameters(
        (
            Parameter(
                name="width", value=1.0, unit="N", low=0.0, high=1e3, minimum=0.0, maximum=1e18,
                meaning="the threshold, on either side of zero",
            ),
        )
    ),
    neutral={"width": 0.0},
    clues=Clues(trials=_trials),
    variants=(
        Variant(
            name="overlap",
            attach=ShapedSignal(shape=dead_zone_samples, law=dead_zone, numbers=_numbers),
            formula="u_acts = u - clip(u, -width, width)",
            odd=True,
        ),
    ),
)  # fmt: skip
