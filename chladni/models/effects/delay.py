"""Delay: dead time between a command and its force."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel, DelayLine
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.clues import Clues
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.signal_path import free_port, input_row, takes_own_samples
from chladni.models.effects.trial import Trial, TrialMotion, shaped


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Delay the input's own samples, or the command inside a loop."""
    delay_s = values["delay"]
    # A line without length would still cost the integrator its bookkeeping.
    if delay_s == 0:
        return compiled
    # Samples can be delayed exactly and for nothing, a signal inside a loop only by remembering it.
    if takes_own_samples(compiled, site.name) and not site.in_loop:
        delays = list(compiled.input_delays_s)
        delays[input_row(compiled, site.name)] += delay_s
        return replace(compiled, input_delays_s=tuple(delays))
    compiled, port = free_port(compiled, site)
    return replace(compiled, delays=(*compiled.delays, DelayLine(port=port, delay_s=delay_s)))


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    if motion.is_still:
        return
    u, s = motion.spectrum(motion.displacement), motion.s
    times = (np.geomspace(0.05, 100.0, 24) / motion.sample_rate_hz).tolist()
    yield shaped(lambda value: u * np.expm1(-s * value), times, "delay")


DELAY = EffectKind(
    name="delay",
    said="a delay",
    family="actuator",
    meaning="dead time between command and force",
    sites=("input",),
    parameters=Parameters(
        (Parameter(name="delay", value=1e-3, unit="s", low=0.0, high=0.5, minimum=0.0, maximum=1e3),)
    ),
    neutral={"delay": 0.0},
    linear=True,
    clues=Clues(trials=_trials, exact=True),
    variants=(Variant(name="dead_time", attach=attach, formula="u_acts(t) = u(t - delay)"),),
)
