"""Clipping: the sensor's range ends."""

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.effect_kind import EffectKind, Variant
from chladni.models.effects.saturation import CLIPPED, KNEE, ROUNDED

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
