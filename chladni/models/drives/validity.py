"""Where a simulation leaves what a drive's equations are valid for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from types import MappingProxyType

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Terminal
from chladni.models.core.simulation import Simulation
from chladni.models.core.stability import growing_poles
from chladni.signals.arrays import Real
from chladni.signals.units import si_factor

_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """A range that a signal must not leave.

    Attributes
    ----------
    signal
        Name of a state, or of an input or output as the kind calls it.
    low, high
        SI; the ends belong to the range.
    unit
        That people read, such as ``cm``.
    what
        Of the signal, in words: ``displacement``.
    why
        What is no longer true outside, a clause: ``the piston would leave its stroke``.
    """

    signal: str
    low: float = -inf
    high: float = inf
    unit: str
    what: str
    why: str


def broken_limits(
    limits: Sequence[Limit],
    simulation: Simulation,
    inputs: Sequence[tuple[str, Terminal]],
    computed: Mapping[str, Real | None] = MappingProxyType({}),
) -> tuple[str, ...]:
    """Give a sentence for each limit that the simulation breaks, with the numbers and the time.

    `inputs` pairs the kind's word for each input with the model's terminal; `computed` holds samples of signals that
    are neither states nor inputs.
    """
    names = {signal: terminal.channel or terminal.name for signal, terminal in inputs}
    sentences = []
    for limit in limits:
        samples = _samples(limit.signal, simulation, names)
        samples = computed.get(limit.signal) if samples is None else samples
        if samples is not None and samples.size:
            sentences.extend(_sentences(limit, samples, simulation.inputs.sample_rate_hz))
    return tuple(sentences)


def acting_laws(words: Mapping[str, str], simulation: Simulation) -> tuple[str, ...]:
    """Give a sentence for each named port at which a law acted, with its share of the time.

    `words` says by the port's name what acts there, such as ``the voltage limit``.
    """
    sentences = []
    for name, what in words.items():
        motion = next((motion for motion in simulation.motions if motion.name == name), None)
        # A law that adds nothing leaves exact zeros.
        share = 0.0 if motion is None else float(np.mean(motion.force != 0))
        if share:
            sentences.append(f"{what} acts {100 * share:.3g} % of the time; what holds for the linear model doesn't")
    return tuple(sentences)


def unstable_loop(compiled: CompiledModel) -> tuple[str, ...]:
    """Give a sentence when a pole of the linear equations, dead time included, lies in the right half-plane."""
    growing = growing_poles(compiled)
    listed = ", ".join(f"{pole.real:.4g} + {pole.imag:.4g}j" for pole in growing)
    return (f"unstable: poles at {listed} rad/s; lower the gain of the loop",) if growing.size else ()


def _samples(signal: str, simulation: Simulation, inputs: dict[str, str]) -> Real | None:
    # States are the truth; outputs may carry a sensor's faults.
    if signal in simulation.state_names:
        return np.asarray(simulation.states[simulation.state_names.index(signal)])
    recorded = [channel.name for channel in simulation.inputs.channels]
    if signal in inputs and inputs[signal] in recorded:
        return np.asarray(simulation.inputs.values[recorded.index(inputs[signal])], dtype=np.float64)
    return None


def _sentences(limit: Limit, samples: Real, sample_rate_hz: float) -> list[str]:
    factor, _ = si_factor(limit.unit)
    # What a law holds at its limit lies there but for rounding; so does a piston that rests at an end of its stroke.
    slack = _ROUNDING * max((abs(end) for end in (limit.low, limit.high) if isfinite(end)), default=0.0)
    found = []
    for extreme, end, side, outside in (
        (float(samples.max()), limit.high, "above", samples > limit.high + slack),
        (float(samples.min()), limit.low, "below", samples < limit.low - slack),
    ):
        # The first instant helps to find the cause, the extreme says how bad it is.
        if outside.any():
            first_s = int(np.argmax(outside)) / sample_rate_hz
            found.append(
                f"{limit.what} reaches {extreme / factor:.4g} {limit.unit}, {side} {end / factor:.4g} {limit.unit} "
                f"from {first_s:.4g} s on: {limit.why}"
            )
    return found
