"""A tonal disturbance: a steady tone that is not in the log: unbalance, mains hum."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, sin
from typing import Any

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort, SampleShape
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.signal_path import is_in_loop, with_samples_mapped
from chladni.models.effects.tones import strongest_tones
from chladni.models.effects.trial import Force, Shape, Trial, TrialMotion, logarithms, numbers
from chladni.signals.arrays import Real


def tone(_d: float, _s: float, t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``amplitude sin(omega t + phase)``; parameters amplitude, omega, phase."""
    return float(parameters[0] * sin(parameters[1] * t + parameters[2]))


def with_tone(samples: Real, sample_rate_hz: float, amplitude: float, omega: float, phase: float) -> Real:
    """Add the tone to samples that begin at t = 0."""
    times_s = np.arange(samples.size) / sample_rate_hz
    return np.asarray(samples + amplitude * np.sin(omega * times_s + phase), dtype=np.float64)


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["amplitude"], 2 * pi * values["frequency"], values["phase"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _AtBodyOrOutput:
    """A force on a body; at an output the tone is what the sensor's cable picks up."""

    law: LawAtPort

    def __call__(self, compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
        if site.kind == "body" or is_in_loop(compiled, site):
            return self.law(compiled, site, values)
        # A hum in a cable moves nothing: on samples it is exact, and the model keeps its linear path.
        numbers = _numbers(values, Port(name=site.name, kind=site.kind))
        return with_samples_mapped(compiled, site, SampleShape(shape=with_tone, numbers=numbers))


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    """Give sines at the strongest lines of the force."""
    tones = strongest_tones(motion.force, motion.sample_rate_hz)
    if not tones:
        return

    def build(shape: Shape) -> Force:
        angle = 2 * np.pi * numbers(shape)[0] * motion.time_s
        return Force.of(motion.spectrum(np.sin(angle)), motion.spectrum(np.cos(angle)))

    yield Trial(
        build=build, grid=logarithms(tones),
        values=lambda shape, a: {
            "frequency": numbers(shape)[0], "amplitude": float(np.hypot(a[0], a[1])),
            "phase": float(np.arctan2(a[1], a[0])),
        },
        parameters=3,
    )  # fmt: skip


TONAL_DISTURBANCE = EffectKind(
    name="tonal_disturbance",
    said="a tonal disturbance",
    family="disturbance",
    meaning="a steady tone that is not in the log: unbalance, mains hum",
    sites=("body", "output"),
    parameters=Parameters(
        (
            Parameter(name="frequency", value=50.0, unit="Hz", low=0.1, high=1e3, minimum=0.0, maximum=1e7),
            Parameter(
                name="amplitude", value=1.0, unit="N", low=0.0, high=100.0, minimum=0.0, maximum=1e12,
                meaning="N at a body, the output's unit at an output",
            ),
            Parameter(
                name="phase", value=0.0, unit="rad", low=-pi, high=pi, minimum=-1e3, maximum=1e3,
                meaning="at the log's start",
            ),
        )
    ),
    optional=("phase",),
    neutral={"amplitude": 0.0},
    clues=Clues(trials=_trials, details=("phase",), sizes=("amplitude",), exact=True, several=True),
    variants=(
        Variant(
            name="sine",
            attach=_AtBodyOrOutput(law=LawAtPort(law=tone, numbers=_numbers)),
            formula="f = amplitude sin(2 pi frequency t + phase)",
        ),
    ),
)  # fmt: skip
