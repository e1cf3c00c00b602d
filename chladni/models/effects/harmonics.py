"""Harmonics: a shaker or drive whose force is bent, evenly or oddly, by its own size."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import ShapedSignal
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion, rms
from chladni.signals.arrays import Real


def bent(d: float, _s: float, _t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``second d^2/scale + third d^3/scale^2``; parameters second, third, scale."""
    share = d / parameters[2]
    return float(d * share * (parameters[0] + parameters[1] * share))


def bent_samples(samples: Real, _sample_rate_hz: float, second: float, third: float, scale: float) -> Real:
    """Give the samples as the actuator bends them."""
    share = samples / scale
    return np.asarray(samples * (1.0 + second * share + third * share**2), dtype=np.float64)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["second"], values["third"], values["scale"]


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    if motion.is_still:
        return
    u, scale = motion.displacement, rms(motion.displacement)
    second, third = motion.spectrum(u**2 / scale), motion.spectrum(u**3 / scale**2)

    def values(_: Shape, a: Real) -> Numbers:
        return {"second": float(a[0]), "third": float(a[1]), "scale": scale}

    yield Trial(build=lambda _: Force.of(second, third), values=values, parameters=2)


HARMONICS = EffectKind(
    name="harmonics",
    said="distortion",
    family="actuator",
    meaning="the actuator bends its signal, evenly or oddly: harmonics of a shaker or drive",
    sites=("input",),
    parameters=Parameters(
        (
            Parameter(
                name="second", value=0.02, unit="1", low=-0.3, high=0.3, minimum=-1e6, maximum=1e6,
                meaning="what the square adds to a signal of size `scale`, over it",
            ),
            Parameter(
                name="third", value=0.02, unit="1", low=-0.3, high=0.3, minimum=-1e6, maximum=1e6,
                meaning="what the cube adds likewise",
            ),
            Parameter(
                name="scale", value=1.0, unit="N", low=1e-3, high=1e4, minimum=1e-12, maximum=1e18, role="function",
                meaning="size of the command for which both are told",
            ),
        )
    ),
    optional=("scale",),
    neutral={"second": 0.0, "third": 0.0},
    clues=Clues(trials=_trials, sizes=("second", "third")),
    variants=(
        Variant(
            name="polynomial",
            attach=ShapedSignal(shape=bent_samples, law=bent, numbers=_numbers),
            formula="u_acts = u + second u^2/scale + third u^3/scale^2",
        ),
    ),
)  # fmt: skip
