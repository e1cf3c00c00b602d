"""AC coupling: an amplifier that keeps what is steady away."""

from collections.abc import Iterator
from math import pi

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import high_pass, two_stage_high_pass
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, logarithms, numbers
from chladni.signals.arrays import Real


def attach_first_order(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put ``p/(p + w_c)`` behind the sensor."""
    # Down to zero nothing is held back; the state would stay at rest and only cost time.
    if values["corner"] == 0:
        return compiled
    return pass_through(compiled, site, high_pass(2 * pi * values["corner"]))


def attach_second_order(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put ``p^2/(p^2 + 2 zeta w_c p + w_c^2)`` behind the sensor."""
    if values["corner"] == 0:
        return compiled
    return pass_through(compiled, site, two_stage_high_pass(2 * pi * values["corner"], values["damping_ratio"]))


#: Damping ratio of two coupling stages that are as good as one.
_UNLIKE = 3.0


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    y, s, rate = motion.spectrum(motion.displacement), motion.s, motion.sample_rate_hz

    def once(shape: Shape) -> Force:
        omega = 2 * np.pi * numbers(shape)[0]
        # A slow corner still remembers the start at the end.
        return Force(fixed=-y * omega / (s + omega), basis=np.stack([omega / (s + omega)]))

    def twice(shape: Shape) -> Force:
        corner, damping = numbers(shape)
        omega = 2 * np.pi * corner
        turning = s**2 + 2 * damping * omega * s + omega**2
        return Force(fixed=y * (s**2 / turning - 1), basis=np.stack([omega / turning, s / turning]))

    corners = np.geomspace(5e-4 * rate, 0.15 * rate, 20).tolist()
    yield Trial(
        build=once, grid=logarithms(corners), values=lambda shape, _: {"corner": numbers(shape)[0]}, parameters=1,
    )  # fmt: skip
    yield Trial(
        variant="second_order", build=twice, grid=logarithms(corners, (0.7, 1.2)), values=_two_stages, parameters=2,
    )  # fmt: skip


def _two_stages(shape: Shape, _: Real) -> Numbers | None:
    corner, damping = numbers(shape)
    # Far apart, the upper corner is one stage's and the lower one shows nowhere.
    return {"corner": corner, "damping_ratio": damping} if damping < _UNLIKE else None


AC_COUPLING = EffectKind(
    name="ac_coupling",
    said="AC coupling",
    family="sensor",
    meaning="high-pass in the amplifier or the sensor",
    sites=("output",),
    parameters=Parameters(
        (
            Parameter(
                name="corner", value=0.5, unit="Hz", low=0.0, high=20.0, minimum=0.0, maximum=1e7,
                meaning="where 3 dB are lost; second order: where 1/(2 damping_ratio) is left",
            ),
        )
    ),
    neutral={"corner": 0.0},
    linear=True,
    clues=Clues(trials=_trials),
    variants=(
        Variant(name="first_order", attach=attach_first_order, formula="y_recorded/y = p/(p + 2 pi corner)"),
        Variant(
            name="second_order",
            attach=attach_second_order,
            formula="y_recorded/y = p^2/(p^2 + 2 damping_ratio w p + w^2), w = 2 pi corner",
            parameters=Parameters(
                (
                    Parameter(
                        name="damping_ratio", value=1.0, unit="1", low=0.3, high=2.0, minimum=1e-6, maximum=1e3,
                        meaning="1 for two equal stages, more for unlike ones",
                    ),
                )
            ),
            fitted=("damping_ratio",),
        ),
    ),
)  # fmt: skip
