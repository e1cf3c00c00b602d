"""Everything that a virtual instrument shows at one setting of its knobs."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from chladni.models.analysis.behaviour import Behaviour, path_behaviour
from chladni.models.analysis.charts import NOW, Shown
from chladni.models.analysis.linear_path import LinearPath, linear_path
from chladni.models.analysis.planned_charts import Setting, planned_charts
from chladni.models.analysis.sampled_behaviour import SampledStep, sampled_quantities, with_sampled
from chladni.models.analysis.step_response import TransientResponse, step_response
from chladni.models.analysis.step_simulation import needs_simulation, simulated_response, step_simulation
from chladni.models.analysis.variants import Variant
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Instrument, Options, Values
from chladni.models.core.model import Model
from chladni.models.core.reading import Chart, InstrumentReading, Quantity
from chladni.models.core.simulation import Simulation
from chladni.signals.units import si_factor

# Units of what loops of drives control.
COMMANDED = ("m", "m/s", "rad", "rad/s", "A")
LINEAR_VIEWS = ("step", "bode", "nyquist", "poles", "root-locus")


def read_instrument(
    instrument: Instrument,
    values: Values | None = None,
    options: Options | None = None,
    *,
    output: str | None = None,
    variants: Sequence[Variant] = (),
    charts: Collection[str] | None = None,
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
    charts
        Names of those to compute; all when None. A name that this setting hasn't got is passed over, since a page
        may ask for what the last setting had.

    Returns
    -------
    InstrumentReading
        Charts ``step.OUTPUT``, ``impulse.OUTPUT``, ``load.OUTPUT``, ``bode.magnitude``, ``bode.phase``, ``nyquist``,
        ``poles``, ``root-locus``, ``precision-stability`` as the instrument's views say, then its own; ``offered``
        names them all, whichever were asked for.

    Raises
    ------
    ModelError
        For an unknown parameter, option or output, an impossible value, and a loop that has no solution.
    """
    model = instrument.model(values, options)
    unusual = tuple(_unusual(model))
    # An instrument that is all law (a damper on a press) has nothing that linear equations could tell.
    if not set(LINEAR_VIEWS) & set(instrument.views):
        own, offered = _own(instrument, model, charts)
        return InstrumentReading(charts=own, quantities=(), flags=unusual, offered=offered)
    one = _analysed(instrument, model, output, NOW, charts)
    kept = [
        _analysed(instrument, instrument.model(other.values, other.options), output, other.name, charts).setting
        for other in variants
    ]
    planned = list(planned_charts(instrument, [one.setting, *kept]))
    drawn = tuple(chart.draw(chart.title) for chart in planned if charts is None or chart.name in charts)
    own, offered = _own(instrument, model, charts)
    return InstrumentReading(
        charts=(*drawn, *own),
        quantities=one.quantities,
        flags=(*unusual, *_flags(one.setting.shown), *_not_unusual(one.flags, model)),
        offered=(*((chart.name, chart.title) for chart in planned), *offered),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Analysed:
    """Everything about one setting."""

    setting: Setting
    quantities: tuple[Quantity, ...]
    flags: tuple[str, ...]


def _own(
    instrument: Instrument, model: Model, charts: Collection[str] | None
) -> tuple[tuple[Chart, ...], tuple[tuple[str, str], ...]]:
    """Charts of the instrument's own, and name and title of each that there is."""
    if instrument.extra_charts is None:
        return (), ()
    titles = instrument.extra_titles
    if titles and charts is not None and not any(name in charts for name, _ in titles):
        return (), titles
    own = tuple(instrument.extra_charts(model))
    shown = tuple(chart for chart in own if charts is None or chart.name in charts)
    return shown, titles or tuple((chart.name, chart.title) for chart in own)


def _analysed(
    instrument: Instrument, model: Model, output: str | None, label: str, charts: Collection[str] | None
) -> _Analysed:
    compiled = model.compile()
    source = instrument.step_input or compiled.inputs[0].name
    paths = linear_path(compiled, from_input=source)
    path = paths.to(output or _told_output(instrument, paths))
    found = path_behaviour(path, size=instrument.step_size)
    simulation = step_simulation(model, compiled, from_input=source, size=instrument.step_size, path=paths)
    drawn = paths if charts is None else paths.seen_by({path.outputs[0].name, *_stepped(charts)})
    step, quantities = _step(compiled, drawn, simulation, found, instrument.step_size)
    shown = Shown(label=label, step=step, curve=found.frequency.curve, path=path)
    return _Analysed(
        setting=Setting(shown=shown, compiled=compiled), quantities=quantities, flags=tuple(model.flags(simulation))
    )


def _stepped(charts: Collection[str]) -> Iterator[str]:
    """Outputs whose step responses are asked for: a large scheme has dozens, a page shows a few."""
    for name in charts:
        kind, _, output = name.partition(".")
        if kind == "step":
            yield output


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


def _unusual(model: Model) -> Iterator[str]:
    for parameter in model.parameters.unusual():
        # As its knob shows it: nobody turns an area in square metres.
        shown = parameter.shown_unit or parameter.unit
        factor = si_factor(shown)[0]
        value, low, high = (f"{number / factor:g}" for number in (parameter.value, parameter.low, parameter.high))
        unit = "" if shown == "1" else f" {shown}"
        yield f"{parameter.name} = {value}{unit} lies outside its usual range, {low} to {high}{unit}"


def _not_unusual(flags: Sequence[str], model: Model) -> Iterator[str]:
    """Leave out what a model says of unusual values itself, in SI units: it's told already."""
    heads = tuple(f"{parameter.name} = " for parameter in model.parameters.unusual())
    return (flag for flag in flags if not (flag.startswith(heads) and "outside its usual range" in flag))


def _flags(shown: Shown) -> Iterator[str]:
    growing = [pole for pole in shown.path.poles if pole.real > 0]
    if growing:
        yield f"unstable: a pole at {growing[0]:.4g} rad/s lies in the right half-plane"
    for note in shown.step.notes:
        yield f"step: {note}"
