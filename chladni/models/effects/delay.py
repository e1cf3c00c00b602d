"""Delay: dead time between a command and its force."""

from dataclasses import replace

from chladni.models.core.compiled_model import CompiledModel, DelayLine
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.signal_path import free_port, input_row, takes_own_samples


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


DELAY = EffectKind(
    name="delay",
    family="actuator",
    meaning="dead time between command and force",
    sites=("input",),
    parameters=Parameters(
        (Parameter(name="delay", value=1e-3, unit="s", low=0.0, high=0.5, minimum=0.0, maximum=1e3),)
    ),
    neutral={"delay": 0.0},
    linear=True,
    variants=(Variant(name="dead_time", attach=attach, formula="u_acts(t) = u(t - delay)"),),
)
