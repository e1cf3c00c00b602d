"""Everything that a virtual instrument shows at one setting of its knobs."""

from collections.abc import Iterator, Sequence

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
from chladni.models.analysis.step_response import TransientResponse, impulse_response, step_response
from chladni.models.analysis.variants import Variant
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Instrument, Options, Values
from chladni.models.core.model import Model
from chladni.models.core.reading import Chart, InstrumentReading

#: What the input of a closed loop is called.
REFERENCE = "reference"
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
        Whose Bode, Nyquist, roots and numbers are told; when None one that follows
        the command (has its unit), else the instrument's own choice.
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
    if not set(LINEAR_VIEWS) & set(instrument.views):
        return InstrumentReading(charts=own, quantities=(), flags=unusual)
    shown, found = _analysed(instrument, model, output, NOW)
    kept = [_analysed(instrument, instrument.model(one.values, one.options), output, one.name)[0] for one in variants]
    return InstrumentReading(
        charts=(*_charts(instrument, [shown, *kept]), *own),
        quantities=found.quantities,
        flags=(*unusual, *_flags(shown)),
    )


def _analysed(instrument: Instrument, model: Model, output: str | None, label: str) -> tuple[Shown, Behaviour]:
    compiled = model.compile()
    paths = linear_path(compiled, from_input=_stepped_input(instrument, compiled))
    path = paths.to(output or _told_output(instrument, paths))
    found = path_behaviour(path, size=instrument.step_size)
    locus = gain_root_locus(path) if "root-locus" in instrument.views else None
    return (
        Shown(
            label=label,
            step=step_response(paths, size=instrument.step_size),
            impulse=impulse_response(path),
            curve=found.frequency.curve,
            path=path,
            size=instrument.step_size,
            load=_load_response(compiled, instrument.load_input, path.outputs[0].name),
            locus=locus,
            field=precision_stability(path, locus=locus) if locus is not None else None,
        ),
        found,
    )


def _stepped_input(instrument: Instrument, compiled: CompiledModel) -> str:
    """Input that steps: the command of a closed loop where there is one, else the instrument's own choice."""
    return REFERENCE if REFERENCE in (terminal.name for terminal in compiled.inputs) else instrument.step_input


def _told_output(instrument: Instrument, paths: LinearPath) -> str:
    """Output whose behaviour is told: one that follows the command, else the instrument's own choice."""
    chosen = instrument.step_output or paths.outputs[0].name
    if paths.source.name != REFERENCE:
        return chosen
    units = {terminal.name: terminal.unit for terminal in paths.outputs}
    followers = [name for name, unit in units.items() if unit == paths.source.unit]
    # A command is given in the unit of what it's to be followed by.
    return chosen if chosen in followers or not followers else followers[0]


def _load_response(compiled: CompiledModel, load_input: str, output: str) -> TransientResponse | None:
    if load_input not in (terminal.name for terminal in compiled.inputs):
        return None
    return step_response(linear_path(compiled, from_input=load_input, to_outputs=(output,)))


def _charts(instrument: Instrument, shown: Sequence[Shown]) -> Iterator[Chart]:
    views, first = instrument.views, shown[0]
    output = first.path.outputs[0].name
    if "step" in views:
        yield from step_charts(shown)
        impulses = [(one.label, one.impulse) for one in shown if one.impulse is not None]
        yield response_chart(
            f"impulse.{output}", f"{output} after a unit impulse of {first.path.source.name}", impulses, output
        )
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
    if first.locus is not None and first.field is not None:
        yield locus_chart(first.locus)
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
