"""Simulate a model: excitation in, recorded channels out."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.core.port import Terminal
from chladni.models.core.simulation import PortMotion, Simulation
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import ModelError
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.renamed import renamed
from chladni.signals.time_series import TimeSeries
from chladni.signals.visible import place_of

if TYPE_CHECKING:
    from chladni.models.integrator.integrator import Integration


class Samples(Protocol):
    """An excitation: samples at any rate."""

    def samples(self, count: int, sample_rate_hz: float, rng: np.random.Generator) -> Real:
        """``[sample]`` in the input's unit."""


Excitation = TimeSeries | Mapping[str, Samples] | Samples


@renamed(rate_hz="sample_rate_hz", seconds="duration_s")
@in_one_thread()
def simulate(
    model: Model,
    excitation: Excitation,
    *,
    duration_s: float | None = None,
    sample_rate_hz: float | None = None,
    initial: Mapping[str, float] | Real | None = None,
    seed: int = 0,
    tolerance: float = 1e-7,
) -> Simulation:
    """Simulate a model under an excitation.

    Between samples the inputs run as their `hold` says, along straight lines by default. The linear part is exact for
    them, laws are integrated with an error of `tolerance` a step (see docs/methods/integrator.md).

    Parameters
    ----------
    model
        The model.
    excitation
        A series, whose channels are matched to inputs by the input's channel or name; or a mapping from names of
        inputs to excitations; or one excitation, for the first input. Inputs without any are zero, which is flagged.
    duration_s
        How long; by default the whole series.
    sample_rate_hz
        Samples a second; of a series its own.
    initial
        States at the start: values by name, or ``[state]``; at rest by default.
    seed
        For excitations that are random.
    tolerance
        Largest error of a step, relative to the largest magnitude of each state so far.

    Returns
    -------
    Simulation
        Outputs named by their channels, else by their names; rate and start time are those of the series.

    Raises
    ------
    ModelError
        When the excitation doesn't fit, a sample isn't finite, or the model diverges.
    """
    from chladni.models.integrator.integrator import Integrator

    compiled = model.compile()
    if isinstance(excitation, TimeSeries):
        signals, driven = _from_series(compiled, excitation, duration_s, sample_rate_hz)
        rate, start_ns = excitation.sample_rate_hz, excitation.start_time_ns
    else:
        count, rate, start_ns = *_grid(duration_s, sample_rate_hz), 0
        signals, driven = _from_excitations(compiled, excitation, count, rate, seed)
    integration = Integrator(compiled, rate, tolerance=tolerance).run(signals, initial=initial)
    simulation = Simulation(
        model=model.name,
        inputs=_series(compiled.inputs, signals, rate, start_ns, role="reference"),
        outputs=_series(compiled.outputs, integration.outputs, rate, start_ns, role="response"),
        states=integration.states,
        state_names=compiled.states,
        motions=_motions(compiled, integration),
        flags=_undriven(compiled, driven),
        refined_steps=integration.refined_steps,
    )
    return _with_flags(simulation, model.flags(simulation))


def _with_flags(simulation: Simulation, flags: tuple[str, ...]) -> Simulation:
    from dataclasses import replace

    return replace(simulation, flags=simulation.flags + tuple(flags)) if flags else simulation


def _grid(duration_s: float | None, sample_rate_hz: float | None) -> tuple[int, float]:
    if duration_s is None or sample_rate_hz is None:
        raise ModelError("an excitation has no length of its own; give duration_s and sample_rate_hz")
    for name, value in (("duration_s", duration_s), ("sample_rate_hz", sample_rate_hz)):
        if not (np.isfinite(value) and value > 0):
            raise ModelError(f"{name} = {value} must be finite and positive")
    count = round(duration_s * sample_rate_hz)
    if count < 1:
        raise ModelError(f"{duration_s:g} s at {sample_rate_hz:g} Hz hold no sample; simulate longer or faster")
    return count, float(sample_rate_hz)


def _from_series(
    compiled: CompiledModel, series: TimeSeries, duration_s: float | None, sample_rate_hz: float | None
) -> tuple[Real, set[str]]:
    if sample_rate_hz is not None and abs(sample_rate_hz - series.sample_rate_hz) > 1e-9 * series.sample_rate_hz:
        raise ModelError(
            f"sample_rate_hz = {sample_rate_hz:g}, but the series has {series.sample_rate_hz:g} Hz; resample it "
            "first, or leave sample_rate_hz out"
        )
    if duration_s is not None:
        if not 0 < duration_s <= series.duration_s * (1 + 1e-9):
            raise ModelError(f"duration_s = {duration_s:g}, but the series is {series.duration_s:g} s long")
        series = series.window(end_s=duration_s)
    names = [channel.name for channel in series.channels]
    signals = np.zeros((len(compiled.inputs), series.samples))
    driven = set()
    for place, terminal in enumerate(compiled.inputs):
        rows = [place_of(name, names) for name in (terminal.channel, terminal.name) if name is not None]
        if (row := next((row for row in rows if row is not None), None)) is not None:
            signals[place] = _sound(series, row, terminal)
            driven.add(terminal.name)
    if compiled.inputs and not driven:
        wanted = ", ".join(terminal.channel or terminal.name for terminal in compiled.inputs)
        raise ModelError(f"no channel drives the model: it listens to {wanted}; the series has {', '.join(names)}")
    return signals, driven


def _sound(series: TimeSeries, row: int, terminal: Terminal) -> Real:
    channel, values = series.channels[row], np.asarray(series.values[row], dtype=np.float64)
    good = np.isfinite(values) if series.valid is None else np.isfinite(values) & series.valid[row]
    if not good.all():
        first = int(np.flatnonzero(~good)[0])
        raise ModelError(
            f"channel {channel.name!r}: {int((~good).sum())} of {good.size} samples are missing, the first at "
            f"{first / series.sample_rate_hz:g} s; an excitation has no gaps, take a window without them"
        )
    if channel.unit not in (terminal.unit, "1"):
        raise ModelError(
            f"channel {channel.name!r} is in {channel.unit}, input {terminal.name!r} takes {terminal.unit}; "
            "state the channel's unit in the setup, or connect another channel"
        )
    return values


def _from_excitations(
    compiled: CompiledModel, excitation: Mapping[str, Samples] | Samples, count: int, sample_rate_hz: float, seed: int
) -> tuple[Real, set[str]]:
    from chladni.models.integrator.integrator import require_memory

    names = [terminal.name for terminal in compiled.inputs]
    if not isinstance(excitation, Mapping):
        if not names:
            raise ModelError("the model has no input to excite")
        excitation = {names[0]: excitation}
    for name in excitation:
        if name not in names:
            raise ModelError(f"no input {name!r}; inputs: {', '.join(names) or 'none'}")
    require_memory(compiled, count, sample_rate_hz)
    signals = np.zeros((len(names), count))
    # One generator for each input: what drives one doesn't depend on whether another is driven.
    for place, name in enumerate(names):
        if name in excitation:
            rng = np.random.default_rng([seed, place])
            found = np.asarray(excitation[name].samples(count, sample_rate_hz, rng), dtype=np.float64)
            if found.shape != (count,):
                raise ModelError(f"excitation of {name!r} gave shape {found.shape}, {(count,)} was expected")
            signals[place] = found
    return signals, set(excitation)


def _undriven(compiled: CompiledModel, driven: set[str]) -> tuple[str, ...]:
    idle = [terminal.name for terminal in compiled.inputs if terminal.name not in driven]
    return (f"not driven, taken as zero: {', '.join(idle)}",) if idle else ()


def _series(terminals: tuple[Terminal, ...], values: Real, rate_hz: float, start_ns: int, *, role: str) -> TimeSeries:
    channels = tuple(
        Channel(
            name=terminal.channel or terminal.name,
            unit=terminal.unit,
            role="reference" if role == "reference" else "response",
        )
        for terminal in terminals
    )
    return TimeSeries(values=values, sample_rate_hz=rate_hz, channels=channels, start_time_ns=start_ns)


def _motions(compiled: CompiledModel, integration: "Integration") -> tuple[PortMotion, ...]:
    with_laws = {law.port for law in compiled.laws}
    return tuple(
        PortMotion(
            name=compiled.ports[port].name,
            kind=compiled.ports[port].kind,
            displacement=integration.displacement[row],
            velocity=integration.velocity[row],
            force=integration.force[row],
        )
        for row, port in enumerate(integration.ports)
        if port in with_laws
    )
