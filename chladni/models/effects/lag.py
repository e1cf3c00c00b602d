"""Lag: an actuator of limited bandwidth."""

from collections.abc import Iterator

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.clues import Clues, FittedForm, Relative
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import first_order, second_order
from chladni.models.effects.trial import Force, Shape, Trial, TrialMotion, logarithms, numbers, shaped


def attach_first_order(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put ``1/(tau s + 1)`` between the command and its place."""
    # Infinitely fast is no filter at all; its pole would be at infinity.
    if values["time_constant"] == 0:
        return compiled
    return pass_through(compiled, site, first_order(values["time_constant"]))


def attach_second_order(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put ``1/(tau^2 s^2 + 2 zeta tau s + 1)`` between the command and its place."""
    if values["time_constant"] == 0:
        return compiled
    return pass_through(compiled, site, second_order(1 / values["time_constant"], values["damping_ratio"]))


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    if motion.is_still:
        return
    u, s = motion.spectrum(motion.displacement), motion.s
    times = (np.geomspace(0.05, 100.0, 24) / motion.sample_rate_hz).tolist()

    def second(shape: Shape) -> Force:
        time_s, damping = numbers(shape)
        return Force.known(u * (1 / (time_s**2 * s**2 + 2 * damping * time_s * s + 1) - 1))

    yield shaped(lambda value: u * (1 / (value * s + 1) - 1), times, "time_constant", "first_order")
    yield Trial(
        variant="second_order", build=second, grid=logarithms(times, (0.5, 0.9)),
        values=lambda shape, _: {"time_constant": numbers(shape)[0], "damping_ratio": numbers(shape)[1]},
        parameters=2,
    )  # fmt: skip


#: Usual range of the second order's damping ratio: beyond it one of its two poles is far above the other.
_DAMPING = (0.2, 2.0)


def _is_degenerate(fitted: FittedForm) -> bool:
    """Whether it's of second order in name only: the first order does the same with one number."""
    return fitted.variant == "second_order" and fitted.values["damping_ratio"] > _DAMPING[1]


def _delays(fitted: FittedForm) -> Iterator[Relative]:
    """Give the dead time that slow commands are as late by: well below its corner a lag does the same."""
    damping = fitted.values.get("damping_ratio", 0.5)
    yield Relative(effect="delay", values={"delay": 2.0 * damping * fitted.values["time_constant"]})


LAG = EffectKind(
    name="lag",
    said="a lag",
    family="actuator",
    meaning="limited bandwidth of an actuator",
    sites=("input",),
    parameters=Parameters(
        (
            Parameter(
                name="time_constant", value=5e-3, unit="s", low=0.0, high=1.0, minimum=0.0, maximum=1e6,
                meaning="1 over the corner in rad/s; second order: 1 over the natural frequency",
            ),
        )
    ),
    neutral={"time_constant": 0.0},
    linear=True,
    clues=Clues(trials=_trials, is_degenerate=_is_degenerate, details=("damping_ratio",), nested=_delays),
    variants=(
        Variant(name="first_order", attach=attach_first_order, formula="u_acts/u = 1/(time_constant p + 1)"),
        Variant(
            name="second_order",
            attach=attach_second_order,
            formula="u_acts/u = 1/(time_constant^2 p^2 + 2 damping_ratio time_constant p + 1)",
            parameters=Parameters(
                (
                    Parameter(
                        # Zero would ring for ever: no actuator does.
                        name="damping_ratio", value=0.7, unit="1", low=_DAMPING[0], high=_DAMPING[1], minimum=1e-6,
                        maximum=1e3,
                    ),
                )
            ),
        ),
    ),
)  # fmt: skip
