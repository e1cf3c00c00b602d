"""Clipping: the sensor's range ends."""

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import ShapedSignal
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.saturation import KNEE, clipped, clipped_samples, rounded, rounded_samples


# The range of a sensor and the limit of an actuator cut a signal in the same way: one law, two words.
def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return (values["limit"],)


def _rounded_numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["limit"], values["knee"]


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
    variants=(
        Variant(
            name="hard",
            attach=ShapedSignal(shape=clipped_samples, law=clipped, numbers=_numbers),
            formula="y_recorded = clip(y, -limit, limit)",
            odd=True,
        ),
        Variant(
            name="rounded",
            attach=ShapedSignal(shape=rounded_samples, law=rounded, numbers=_rounded_numbers),
            formula="y_recorded = w/2 ln(cosh((y + limit)/w)/cosh((y - limit)/w)), w = knee limit",
            parameters=Parameters((KNEE,)),
            odd=True,
            fitted=("knee",),
        ),
    ),
)  # fmt: skip
