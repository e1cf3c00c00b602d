"""Mounting resonance: a sensor that rides on a soft mount."""

from math import pi

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import second_order


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put ``w^2/(p^2 + 2 zeta w p + w^2)`` between the motion and the sensor."""
    return pass_through(compiled, site, second_order(2 * pi * values["frequency"], values["damping_ratio"]))


MOUNTING_RESONANCE = EffectKind(
    name="mounting_resonance",
    family="sensor",
    meaning="the sensor rides on a soft mount: second-order low-pass with a peak",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="frequency", value=500.0, unit="Hz", low=10.0, high=5e4, minimum=1e-6, maximum=1e9,
                meaning="natural frequency of the sensor on its mount",
            ),
            Parameter(name="damping_ratio", value=0.05, unit="1", low=0.005, high=1.0, minimum=1e-6, maximum=1e3),
        )
    ),
    # No mount is infinitely stiff; with a damping ratio of 0.05 this one leaves a phase of 1e-7 rad at 1 kHz.
    neutral={"frequency": 1e9},
    linear=True,
    variants=(
        Variant(
            name="soft_mount",
            attach=attach,
            formula="y_recorded/y = w^2/(p^2 + 2 damping_ratio w p + w^2), w = 2 pi frequency",
        ),
    ),
)  # fmt: skip
