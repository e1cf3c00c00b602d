"""Mounting resonance: a sensor that rides on a soft mount."""

from dataclasses import replace
from math import pi

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import second_order


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put ``(2 zeta w carried p + w^2)/(p^2 + 2 zeta w p + w^2)`` between the motion and the sensor."""
    damping_ratio = values["damping_ratio"]
    low = second_order(2 * pi * values["frequency"], damping_ratio)
    # The second state is p/w times the first.
    ridden = replace(low, c=np.array([1.0, 2 * damping_ratio * values["carried"]]))
    return pass_through(compiled, site, ridden)


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
            Parameter(
                name="carried", value=0.0, unit="1", low=0.0, high=1.0, minimum=0.0, maximum=1.0,
                meaning="share of the damping that acts between sensor and body and so carries motion, as of a layer "
                "of wax or glue; the rest acts within the sensor",
            ),
        )
    ),
    optional=("carried",),
    # No mount is infinitely stiff; with a damping ratio of 0.05 this one leaves a phase of 1e-7 rad at 1 kHz.
    neutral={"frequency": 1e9},
    linear=True,
    variants=(
        Variant(
            name="soft_mount",
            attach=attach,
            formula="y_recorded/y = (2 damping_ratio carried w p + w^2)/(p^2 + 2 damping_ratio w p + w^2),"
            " w = 2 pi frequency",
        ),
    ),
)  # fmt: skip
