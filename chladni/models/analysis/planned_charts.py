"""Every chart that an instrument has at a setting, by name and title, computed only when it's looked at."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from chladni.models.analysis.charts import (
    Shown,
    locus_chart,
    magnitude_chart,
    nyquist_chart,
    phase_chart,
    pole_chart,
    precision_chart,
    response_chart,
)
from chladni.models.analysis.linear_path import linear_path
from chladni.models.analysis.precision_stability import precision_stability
from chladni.models.analysis.root_locus import gain_root_locus
from chladni.models.analysis.step_response import TransientResponse, impulse_response, step_response
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Instrument
from chladni.models.core.reading import Chart

# The precision-stability field is defined for this many integrators.
MOST_ERRORS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedChart:
    """A chart that can be computed: `draw` gives it its title."""

    name: str
    title: str
    draw: Callable[[str], Chart]


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One setting as charts need it: what is analysed already, and the equations for the rest."""

    shown: Shown
    compiled: CompiledModel


def planned_charts(instrument: Instrument, settings: Sequence[Setting]) -> Iterator[PlannedChart]:
    """Name the charts of an instrument's views in the order of its page; of several settings the first is told."""
    shown, views, path = [one.shown for one in settings], instrument.views, settings[0].shown.path
    output = path.outputs[0].name.replace("_", " ")
    way = f"{output} over {path.source.name.replace('_', ' ')}"
    if "step" in views:
        yield from _in_time(instrument, settings)
    if "bode" in views:
        yield PlannedChart(name="bode.magnitude", title=f"Gain: {way}", draw=partial(_of, magnitude_chart, shown))
        yield PlannedChart(name="bode.phase", title=f"Phase: {way}", draw=partial(_of, phase_chart, shown))
    if "nyquist" in views:
        yield PlannedChart(name="nyquist", title=f"Nyquist: {way}", draw=partial(_of, nyquist_chart, shown))
    if "poles" in views:
        yield PlannedChart(name="poles", title=f"Poles: {way}", draw=partial(_of, pole_chart, shown))
    # With dead time in the loop there are roots without end.
    if "root-locus" in views and not path.looped:
        yield PlannedChart(
            name="root-locus",
            title=f"Root locus of {output} over loop gain",
            draw=lambda title: locus_chart(title, gain_root_locus(path)),
        )
        if path.integrators() <= MOST_ERRORS:
            yield PlannedChart(
                name="precision-stability",
                title="Precision and stability over loop gain",
                draw=lambda title: precision_chart(title, precision_stability(path)),
            )


def _in_time(instrument: Instrument, settings: Sequence[Setting]) -> Iterator[PlannedChart]:
    first, shown = settings[0], [one.shown for one in settings]
    path, steps = first.shown.path, [(one.label, one.step) for one in shown]
    source, output = path.source, path.outputs[0].name
    for terminal in first.compiled.outputs:
        name = f"step.{terminal.name}"
        title = stepped(terminal.name, source.name, instrument.step_size, source.unit)
        yield PlannedChart(name=name, title=title, draw=partial(_response, name, steps, terminal.name))
    impulses = [one for one in shown if not one.path.looped]
    if impulses:
        name = f"impulse.{output}"
        title = f"{output}: unit impulse of {source.name}".replace("_", " ")
        yield PlannedChart(name=name, title=title, draw=lambda title: _impulse_chart(name, title, impulses, output))
    loaded = [one for one in settings if _has_load(one.compiled, instrument.load_input)]
    if loaded:
        load = next(one for one in loaded[0].compiled.inputs if one.name == instrument.load_input)
        yield PlannedChart(
            name=f"load.{output}",
            title=stepped(output, load.name, instrument.load_size, load.unit),
            draw=partial(_load_chart, instrument, loaded, output),
        )


def stepped(output: str, source: str, size: float, unit: str) -> str:
    """Title of a step response, short enough for a sixth of a page.

    Examples
    --------
    >>> stepped("pressure_drop", "flow", 5e-5, "m^3/s")
    'pressure drop: flow +5e-05 m^3/s'
    """
    told = "" if unit == "1" else f" {unit}"
    return f"{output.replace('_', ' ')}: {source.replace('_', ' ')} {size:+g}{told}"


def _of(draw: Callable[[str, Sequence[Shown]], Chart], shown: Sequence[Shown], title: str) -> Chart:
    return draw(title, shown)


def _response(name: str, responses: Sequence[tuple[str, TransientResponse]], output: str, title: str) -> Chart:
    return response_chart(name, title, responses, output)


def _impulse_chart(name: str, title: str, shown: Sequence[Shown], output: str) -> Chart:
    return response_chart(name, title, [(one.label, impulse_response(one.path)) for one in shown], output)


def _load_chart(instrument: Instrument, settings: Sequence[Setting], output: str, title: str) -> Chart:
    responses = []
    for one in settings:
        path = linear_path(one.compiled, from_input=instrument.load_input, to_outputs=(output,))
        responses.append((one.shown.label, step_response(path, size=instrument.load_size)))
    return response_chart(f"load.{output}", title, responses, output)


def _has_load(compiled: CompiledModel, load_input: str) -> bool:
    return load_input in (terminal.name for terminal in compiled.inputs) and not compiled.delays
