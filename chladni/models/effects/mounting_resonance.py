"""Mounting resonance: a sensor that rides on a soft mount."""

from collections.abc import Iterator
from dataclasses import replace
from math import pi

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import second_order
from chladni.models.effects.resonances import resonances
from chladni.models.effects.trial import Force, Shape, Trial, TrialMotion, logarithms, numbers


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put ``(2 zeta w carried p + w^2)/(p^2 + 2 zeta w p + w^2)`` between the motion and the sensor."""
    damping_ratio = values["damping_ratio"]
    low = second_order(2 * pi * values["frequency"], damping_ratio)
    # The second state is p/w times the first.
    ridden = replace(low, c=np.array([1.0, 2 * damping_ratio * values["carried"]]))
    return pass_through(compiled, site, ridden)


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    y, s, rate = motion.spectrum(motion.displacement), motion.s, motion.sample_rate_hz

    def ride(shape: Shape) -> Force:
        frequency, damping = numbers(shape)
        omega = 2 * np.pi * frequency
        turning = s**2 + 2 * damping * omega * s + omega**2
        return Force(fixed=y * (omega**2 / turning - 1), basis=np.stack([omega / turning, s / turning]))

    measured = y + motion.spectrum(motion.force)
    yield Trial(
        build=ride,
        grid=[
            *logarithms(np.geomspace(0.02 * rate, 2.0 * rate, 30).tolist(), (0.02, 0.1, 0.4)),
            *resonances(measured, y, motion.believed, motion.frequency_hz, (0.0, 0.5 * rate)),
        ],
        values=lambda shape, _: {"frequency": numbers(shape)[0], "damping_ratio": numbers(shape)[1]}, parameters=2,
    )  # fmt: skip


MOUNTING_RESONANCE = EffectKind(
    name="mounting_resonance",
    said="a mounting resonance",
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
    clues=Clues(trials=_trials, details=("carried",)),
    variants=(
        Variant(
            name="soft_mount",
            attach=attach,
            formula="y_recorded/y = (2 damping_ratio carried w p + w^2)/(p^2 + 2 damping_ratio w p + w^2),"
            " w = 2 pi frequency",
        ),
    ),
)  # fmt: skip
