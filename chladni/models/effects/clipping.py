"""Clipping: the sensor's range ends."""

from collections.abc import Iterator

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Variant
from chladni.models.effects.saturation import CLIPPED, KNEE, ROUNDED, rounded_limit
from chladni.models.effects.trial import Numbers, Trial, TrialMotion, shaped
from chladni.signals.arrays import Real

#: Of the limit, what noise may add to a sample there; share of the samples that may lie beyond all the same.
_BEYOND, _FEW = 1.1, 0.01


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    y = motion.displacement
    # A sensor that clips shows its limit itself: nothing is far beyond where its samples pile up.
    shares = (0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.999)
    limits = np.quantile(np.abs(motion.outputs[motion.name]), shares).tolist()
    inside = [limit for limit in limits if 0 < limit < float(np.max(np.abs(y)))]
    if inside:
        yield shaped(lambda value: motion.spectrum(np.clip(y, -value, value) - y), inside, "limit")
        yield rounded_limit(motion, inside)


def _is_possible(recorded: Real, values: Numbers) -> bool:
    """Whether hardly a sample lies beyond the limit: a force that only stops growing goes on there."""
    beyond = np.abs(recorded) > _BEYOND * values["limit"]
    return bool(np.mean(beyond) < _FEW)


CLIPPING = EffectKind(
    name="clipping",
    family="sensor",
    meaning="the sensor's range ends",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="limit", value=100.0, unit="m/s^2", low=1.0, high=5e3, minimum=1e-12, maximum=1e18,
                meaning="in the output's unit",
            ),
        )
    ),
    neutral={"limit": 1e18},
    clues=Clues(trials=_trials, possible=_is_possible),
    # The range of a sensor and the limit of an actuator cut a signal in the same way: one law, two words.
    variants=(
        Variant(
            name="hard",
            attach=CLIPPED,
            formula="y_recorded = clip(y, -limit, limit)",
            odd=True,
        ),
        Variant(
            name="rounded",
            attach=ROUNDED,
            formula="y_recorded = w/2 ln(cosh((y + limit)/w)/cosh((y - limit)/w)), w = knee limit",
            parameters=Parameters((KNEE,)),
            odd=True,
            fitted=("knee",),
        ),
    ),
)  # fmt: skip
