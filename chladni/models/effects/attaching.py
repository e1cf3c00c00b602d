"""Ways to attach: a law at a port, a shape that a signal takes, a filter that a signal passes."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port
from chladni.models.core.port_law import LawFunction, PortLaw
from chladni.models.effects.effect_kind import Site, Values
from chladni.models.effects.linear_feedback import (
    Signal,
    column,
    displacement,
    output,
    rate,
    state,
    with_columns_replaced,
    with_displacement,
    with_feedback,
    with_output,
    with_rate,
    with_states,
)
from chladni.models.effects.linear_filter import LinearFilter
from chladni.models.effects.signal_path import (
    free_port,
    has_own_samples,
    input_row,
    is_in_loop,
    output_row,
    with_samples_mapped,
)
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True, kw_only=True)
class LawAtPort:
    """Attaches a law to the site's port.

    Attributes
    ----------
    law
        At the top of a module, in the subset that numba compiles, see `PortLaw`.
    numbers
        ``numbers(values, port)`` gives the law's parameters in the order that it reads them.
    state
        Initial values of the law's own states.
    """

    law: LawFunction
    numbers: Callable[[Values, Port], tuple[float, ...]]
    state: tuple[float, ...] = ()

    def __call__(self, compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
        """Give the model with the law added."""
        if site.kind in ("input", "output"):
            compiled, port = free_port(compiled, site)
        else:
            port = compiled.port_index(site.name, site.kind)
        numbers = self.numbers(values, compiled.ports[port])
        law = PortLaw(port=port, function=self.law, parameters=numbers, state=self.state)
        return replace(compiled, laws=(*compiled.laws, law))


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleShape:
    """A map of samples: ``shape(samples, sample_rate_hz, *numbers)``."""

    shape: Callable[..., Real]
    numbers: tuple[float, ...]

    def __call__(self, samples: Real, sample_rate_hz: float) -> Real:
        """Give the samples in their new shape."""
        return self.shape(samples, sample_rate_hz, *self.numbers)


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapedSignal:
    """Gives a signal another shape: outside of loops on its samples, exactly; inside a loop by a law at its port.

    Attributes
    ----------
    shape
        ``shape(samples, sample_rate_hz, *numbers) -> samples``, at the top of a module.
    law
        What it adds to the signal d inside a loop: ``shape(d) - d``.
    numbers
        What both read, in order.
    state
        Initial values of the law's states.
    """

    shape: Callable[..., Real]
    law: LawFunction
    numbers: Callable[[Values, Port], tuple[float, ...]]
    state: tuple[float, ...] = ()

    def __call__(self, compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
        """Give the model with the shape in the way of the signal."""
        if not has_own_samples(compiled, site):
            return LawAtPort(law=self.law, numbers=self.numbers, state=self.state)(compiled, site, values)
        # Shapes are about the signal alone: stiffness and damping of a port play no part.
        numbers = self.numbers(values, Port(name=site.name, kind=site.kind))
        return with_samples_mapped(compiled, site, SampleShape(shape=self.shape, numbers=numbers))


def pass_through(compiled: CompiledModel, site: Site, way: LinearFilter) -> CompiledModel:
    """Put a linear filter in the way of an input or output, behind all that acts there already.

    It becomes part of the linear equations. Only behind a map of samples (a sensor that clips, then a coupling) it
    has to act on samples too; it's then exact for the signal that joins them by straight lines.
    """
    # Outside of loops an output is a row that nothing else reads: no port is needed.
    if site.kind == "output" and not is_in_loop(compiled, site):
        row = output_row(compiled, site.name)
        if any(place == row for place, _ in compiled.output_maps):
            return with_samples_mapped(compiled, site, way)
        compiled, signal = _filtered(compiled, site, output(compiled, row), way)
        return with_output(compiled, row, signal)
    if site.kind == "input" and _prescribes_motion(compiled, site.name):
        return _with_motion_filtered(compiled, site, way)
    # The port's own signal becomes the filtered one, so that what attaches next finds it.
    compiled, port = free_port(compiled, site)
    compiled, after = _filtered(compiled, site, displacement(compiled, port), way)
    compiled, added = with_feedback(compiled, port, after + displacement(compiled, port).scaled(-1.0))
    return with_displacement(compiled, port, displacement(compiled, port) + added)


def _filtered(compiled: CompiledModel, site: Site, before: Signal, way: LinearFilter) -> tuple[CompiledModel, Signal]:
    """Add the filter's states, driven by `before`; give the signal behind it."""
    first = len(compiled.states)
    compiled = with_states(compiled, [f"{site.name}.{site.effect}.{name}" for name in way.states])
    before = before.padded(len(way.states))
    # Signals of the wider model: the one in front has no share of the filter's states.
    own = [state(compiled, first + place) for place in range(len(way.states))]
    for place in range(len(way.states)):
        rate = before.scaled(float(way.b[place]))
        for other, signal in enumerate(own):
            rate += signal.scaled(float(way.a[place, other]))
        compiled = with_rate(compiled, first + place, rate)
    after = before.scaled(way.d)
    for place, signal in enumerate(own):
        after += signal.scaled(float(way.c[place]))
    return compiled, after


def _prescribes_motion(compiled: CompiledModel, name: str) -> bool:
    return any(terminal.name == name and terminal.derivatives > 0 for terminal in compiled.inputs)


def _with_motion_filtered(compiled: CompiledModel, site: Site, way: LinearFilter) -> CompiledModel:
    """Filter a prescribed motion: its derivatives are those of the filtered motion."""
    first, rows = compiled.column_of(site.name), len(compiled.states)
    orders = 1 + compiled.inputs[input_row(compiled, site.name)].derivatives
    compiled, signal = _filtered(compiled, site, column(compiled, first), way)
    passed = [signal]
    for _ in range(1, orders):
        passed.append(rate(compiled, passed[-1], site.name))
    return with_columns_replaced(compiled, first, passed, rows)
