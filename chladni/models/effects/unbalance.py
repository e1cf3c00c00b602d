"""Unbalance: a rotor whose mass lies beside its axis, with a speed that the log doesn't hold."""

from collections.abc import Iterator
from itertools import product
from math import pi, sin
from typing import Any

import numpy as np

from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port
from chladni.models.effects.attaching import LawAtPort
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Values, Variant
from chladni.models.effects.tones import strongest_tones
from chladni.models.effects.trial import Force, Numbers, Shape, Trial, TrialMotion
from chladni.signals.arrays import Real

#: Share of a log over which a speed is read at its start and at its end, and lines by which they must differ.
_END, _APART = 0.2, 2.0


def rotor(_d: float, _s: float, t: float, parameters: Any, _state: Any, _rates: Any) -> float:
    """Give ``moment w^2 sin(angle)``, w = omega + alpha t and angle its integral; parameters those and the phase."""
    omega = parameters[1] + parameters[2] * t
    angle = (parameters[1] + 0.5 * parameters[2] * t) * t + parameters[3]
    return float(parameters[0] * omega * omega * sin(angle))


def _numbers(values: Values, _port: Port) -> tuple[float, ...]:
    return values["moment"], 2 * pi * values["frequency"], 2 * pi * values["rise"], values["phase"]


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    """Give rotors between the strongest tones of the force's start and of its end, where these differ.

    One that keeps its speed is a tone.
    """
    part = int(_END * motion.force.size)
    ends = [strongest_tones(piece, motion.sample_rate_hz) for piece in (motion.force[:part], motion.force[-part:])]
    between_s = (motion.force.size - part) / motion.sample_rate_hz
    least_hz = _APART * motion.sample_rate_hz / max(part, 1)
    # The middle of the first part is where its tone was read.
    runs = [
        (first - rise * 0.5 * part / motion.sample_rate_hz, rise)
        for first, last in product(*ends)
        if abs(last - first) > least_hz
        for rise in [(last - first) / between_s]
    ]
    runs = [(start, rise) for start, rise in runs if start > 0]
    if not runs:
        return
    t = motion.time_s

    def build(shape: Shape) -> Force:
        # As they are, no logarithms: a speed may fall.
        start, rise = shape
        omega, angle = 2 * np.pi * (start + rise * t), 2 * np.pi * (start + 0.5 * rise * t) * t
        return Force.of(*(motion.spectrum(omega**2 * wave(angle)) for wave in (np.sin, np.cos)))

    def values(shape: Shape, a: Real) -> Numbers:
        moment, phase = float(np.hypot(a[0], a[1])), float(np.arctan2(a[1], a[0]))
        return {"moment": moment, "frequency": shape[0], "rise": shape[1], "phase": phase}

    yield Trial(variant="run_up", build=build, grid=runs, values=values, parameters=4)


UNBALANCE = EffectKind(
    name="unbalance",
    family="disturbance",
    meaning="a rotor whose mass lies beside its axis: a force that grows with the square of the speed",
    sites=("body",),
    parameters=Parameters(
        (
            Parameter(
                name="moment", value=1e-3, unit="kg m", low=0.0, high=1.0, minimum=0.0, maximum=1e9,
                meaning="mass times eccentricity",
            ),
            Parameter(
                name="frequency", value=25.0, unit="Hz", low=0.1, high=1e3, minimum=0.0, maximum=1e6,
                meaning="speed at the log's start",
            ),
            Parameter(
                name="phase", value=0.0, unit="rad", low=-pi, high=pi, minimum=-1e3, maximum=1e3,
                meaning="at the log's start",
            ),
            Parameter(
                name="rise", value=0.0, unit="Hz/s", low=-100.0, high=100.0, minimum=-1e6, maximum=1e6,
                meaning="how fast the speed rises",
            ),
        )
    ),
    optional=("phase", "rise"),
    neutral={"moment": 0.0},
    clues=Clues(trials=_trials, details=("phase",), sizes=("moment",), exact=True, timed=True),
    variants=(
        Variant(
            name="run_up",
            attach=LawAtPort(law=rotor, numbers=_numbers),
            formula="f = moment w^2 sin(a), w = 2 pi (frequency + rise t), a = phase + integral of w",
            fitted=("rise", "phase"),
        ),
    ),
)  # fmt: skip
