"""Everything that a virtual instrument shows at one setting of its knobs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from chladni.models.analysis.behaviour import Behaviour, path_behaviour
from chladni.models.analysis.charts import (
    NOW,
    Shown,
    bode_charts,
    locus_chart,
    nyquist_chart,
    pole_chart,
    precision_chart,
    response_chart,
    step_charts,
)
from chladni.models.analysis.linear_path import LinearPath, linear_path
from chladni.models.analysis.precision_stability import precision_stability
from chladni.models.analysis.root_locus import gain_root_locus
from chladni.models.analysis.sampled_behaviour import SampledStep, sampled_quantities, with_sampled
from chladni.models.analysis.step_response import TransientResponse, impulse_response, step_response
from chladni.models.analysis.step_simulation import needs_simulation, simulated_response, step_simulation
from chladni.models.analysis.variants import Variant
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Instrument, Options, Values
from chladni.models.core.model import Model
from chladni.models.core.reading import Chart, InstrumentReading, Quantity
from chladni.models.core.simulation import Simulation

# Units of what loops of drives control.
COMMANDED = ("m", "m/s", "rad", "rad/s", "A")
# The precision-stability field is defined for this many integrators.
MOST_ERRORS = 2
LINEAR_VIEWS = ("step", "bode", "nyquist", "poles", "root-locus")


def read_instrument(
    instrument: Instrument,
    values: Values | None = None,
    options: Options | None = None,
    *,
    output: str | None = None,
    variants: Sequence[Variant] = (),
) -> InstrumentReading:
    """Compute what an instrument shows.

    Parameters
    ----------
    instrument
        Its declaration.
    values
        Parameters that differ from their defaults, SI.
    options
        Options that differ from their defaults.
    output
        Whose Bode, Nyquist, roots and numbers are told; when None that which follows
        the command of a closed loop (has its unit), else the instrument's own choice.
    variants
        Settings whose curves are laid over; the numbers are those of the setting itself.

    Returns
    -------
    InstrumentReading
        Charts ``step.OUTPUT``, ``impulse.OUTPUT``, ``load.OUTPUT``, ``bode.magnitude``, ``bode.phase``, ``nyquist``,
        ``poles``, ``root-locus``, ``precision-stability`` as the instrument's views say, then its own.

    Raises
    ------
    ModelError
        For an unknown parameter, option or output, an impossible value, and a loop that has no solution.
    """
    model = instrument.model(values, options)
    own = tuple(instrument.extra_charts(model)) if instrument.extra_charts is not None else ()
    unusual = tuple(_unusual(model))
    # An instrument that is all law (a damper on a press) has nothing that linear equations could tell.
    if not set(LINEAR_VIEWS) & set(instrument.views):
        return InstrumentReading(charts=own, quantities=(), flags=unusual)
    one = _analysed(instrument, model, output, NOW)
    kept = [
        _analysed(instrument, instrument.model(other.values, other.options), output, other.name).shown
        for other in variants
    ]
    return InstrumentReading(
        charts=(*_charts(instrument, [one.shown, *kept]), *own),
        quantities=one.quantities,
        flags=(*unusual, *_flags(one.shown), *one.flags),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Setting:
    """Everything about one setting."""

    shown: Shown
    quantities: tuple[Quantity, ...]
    flags: tuple[str, ...]


def _analysed(instrument: Instrument, model: Model, output: str | None, label: str) -> _Setting:
    compiled = model.compile()
    source = instrument.step_input or compiled.inputs[0].name
    paths = linear_path(compiled, from_input=source)
    path = paths.to(output or _told_output(instrument, paths))
    found = path_behaviour(path, size=instrument.step_size)
    simulation = step_simulation(model, compiled, from_input=source, size=instrument.step_size)
    step, quantities = _step(compiled, paths, simulation, found, instrument.step_size)
    locus = gain_root_locus(path) if "root-locus" in instrument.views and not path.looped else None
    shown = Shown(
        label=label,
        step=step,
        impulse=None if path.looped else impulse_response(path),
        curve=found.frequency.curve,
        path=path,
        size=instrument.step_size,
        load=_load_response(compiled, instrument.load_input, path.outputs[0].name),
        locus=locus,
        field=precision_stability(path, locus=locus)
        if locus is not None and path.integrators() <= MOST_ERRORS
        else None,
    )
    return _Setting(shown=shown, quantities=quantities, flags=tuple(model.flags(simulation)))


def _step(
    compiled: CompiledModel, paths: LinearPath, simulation: Simulation, found: Behaviour, size: float
) -> tuple[TransientResponse, tuple[Quantity, ...]]:
    """Response to the step and behaviour: by the linear equations, or simulated where laws act."""
    if not needs_simulation(compiled):
        return step_response(paths, size=size), found.quantities
    response = simulated_response(simulation, compiled, paths.source)
    row = [terminal.name for terminal in response.outputs].index(found.path.outputs[0].name)
    sampled = SampledStep(
        time_s=response.time_s[row],
        values=response.values[row],
        output=response.outputs[row],
        source=paths.source,
        size=size,
    )
    return response, with_sampled(found.quantities, sampled_quantities(sampled))


def _told_output(instrument: Instrument, paths: LinearPath) -> str:
    """Output whose behaviour is told: what follows the command of a closed loop, else the instrument's own."""
    chosen = instrument.step_output or paths.outputs[0].name
    if paths.source.unit not in COMMANDED:
        return chosen
    followers = [terminal.name for terminal in paths.outputs if terminal.unit == paths.source.unit]
    # A command is given in the unit of what it's to be followed by.
    return chosen if chosen in followers or not followers else followers[0]


def _load_response(compiled: CompiledModel, load_input: str, output: str) -> TransientResponse | None:
    if load_input not in (terminal.name for terminal in compiled.inputs) or compiled.delays:
        return None
    return step_response(linear_path(compiled, from_input=load_input, to_outputs=(output,)))


def _charts(instrument: Instrument, shown: Sequence[Shown]) -> Iterator[Chart]:
    views, first = instrument.views, shown[0]
    output = first.path.outputs[0].name
    if "step" in views:
        yield from step_charts(shown)
        impulses = [(one.label, one.impulse) for one in shown if one.impulse is not None]
        if impulses:
            title = f"{output} after a unit impulse of {first.path.source.name}"
            yield response_chart(f"impulse.{output}", title, impulses, output)
        loads = [(one.label, one.load) for one in shown if one.load is not None]
        if loads:
            source = loads[0][1].source
            title = f"{output} after a step of {source.name}, 1 {source.unit}"
            yield response_chart(f"load.{output}", title, loads, output)
    if "bode" in views:
        yield from bode_charts(shown)
    if "nyquist" in views:
        yield nyquist_chart(shown)
    if "poles" in views:
        yield pole_chart(shown)
    if first.locus is not None:
        yield locus_chart(first.locus)
    if first.field is not None:
        yield precision_chart(first.field)


def _unusual(model: Model) -> Iterator[str]:
    for parameter in model.parameters.unusual():
        yield (
            f"{parameter.name} = {parameter.value:g} {parameter.unit} lies outside its usual range, "
            f"{parameter.low:g} to {parameter.high:g} {parameter.unit}"
        )


def _flags(shown: Shown) -> Iterator[str]:
    growing = [pole for pole in shown.path.poles if pole.real > 0]
    if growing:
        yield f"unstable: a pole at {growing[0]:.4g} rad/s lies in the right half-plane"
    for note in shown.step.notes:
        yield f"step: {note}"
