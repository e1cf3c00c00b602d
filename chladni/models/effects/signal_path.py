"""The way of a signal through an input or an output: what acts there already, and where the next effect joins."""

from dataclasses import replace

import numpy as np

from chladni.models.core.compiled_model import CompiledModel, SampleMap
from chladni.models.core.port import Port, PortKind
from chladni.models.effects.effect_kind import Site
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import ModelError


def last_port(compiled: CompiledModel, name: str, kind: PortKind) -> int | None:
    """Give the last port of that name and kind: the end of the chain where several effects act in a row."""
    places = [place for place, port in enumerate(compiled.ports) if (port.name, port.kind) == (name, kind)]
    return places[-1] if places else None


def free_port(compiled: CompiledModel, site: Site) -> tuple[CompiledModel, int]:
    """Give a port of an input or output at which nothing acts yet, behind all that acts there.

    A model needs no ports at its inputs and outputs: one is made when an effect asks for it.
    """
    port = last_port(compiled, site.name, site.kind)
    if port is None:
        compiled = (
            _with_input_port(compiled, site.name) if site.kind == "input" else _with_output_port(compiled, site)
        )
        return compiled, len(compiled.ports) - 1
    if _carries(compiled, port):
        # Laws at one port add up, all seeing the same signal; effects in a row see what those before them leave.
        compiled = _with_stage(compiled, port)
        return compiled, len(compiled.ports) - 1
    return compiled, port


def is_in_loop(compiled: CompiledModel, site: Site) -> bool:
    """Whether what is added to the signal comes back to it.

    Effects at outputs attach before loops are closed, so there a model says it: by a port at each output that feeds
    a controller, or by `Site.in_loop`. At inputs it's seen in the equations: a force at the port reaches the port.
    """
    port = last_port(compiled, site.name, site.kind)
    if site.in_loop or port is None:
        return site.in_loop
    return site.kind == "output" or _reaches_itself(compiled, port)


def has_own_samples(compiled: CompiledModel, site: Site) -> bool:
    """Whether a map of samples does exactly what an effect does that joins the signal here."""
    if is_in_loop(compiled, site):
        return False
    return site.kind == "output" or _gain_to_port(compiled, site.name) is not None


def with_samples_mapped(compiled: CompiledModel, site: Site, action: SampleMap) -> CompiledModel:
    """Let `action` act on the samples of an input or output, after what acts on them already.

    Ask `has_own_samples` first.
    """
    if site.kind == "output":
        row = output_row(compiled, site.name)
        return replace(compiled, output_maps=(*compiled.output_maps, (row, action)))
    factor = _gain_to_port(compiled, site.name)
    if factor is None:
        raise ModelError(
            f"{site.effect} at {site.name!r}: the command there is not made of the input's samples alone"
        )
    inner = action if factor == 1 else _Scaled(action, factor)
    return replace(compiled, input_maps=(*compiled.input_maps, (input_row(compiled, site.name), inner)))


def input_row(compiled: CompiledModel, name: str) -> int:
    """Index of the named input; `ModelError` when it's none that a log or an excitation gives."""
    names = [terminal.name for terminal in compiled.inputs]
    if name not in names:
        raise ModelError(f"input {name!r} takes no samples of its own: a controller drives it")
    return names.index(name)


def output_row(compiled: CompiledModel, name: str) -> int:
    """Index of the named output; `ModelError` naming those there are when it's missing."""
    names = [terminal.name for terminal in compiled.outputs]
    if name not in names:
        raise ModelError(f"no output {name!r}; outputs: {', '.join(names)}")
    return names.index(name)


def takes_own_samples(compiled: CompiledModel, name: str) -> bool:
    """Whether nothing but the input's own samples reaches the place where it acts."""
    names = [terminal.name for terminal in compiled.inputs]
    port = last_port(compiled, name, "input")
    if name not in names or port is None:
        return name in names
    own = compiled.column_of(name)
    # A port exists behind filters too; then the samples' way must not be joined by any other input's.
    others = np.arange(compiled.columns) != own
    reached = _upstream(compiled, port)
    through = np.any(compiled.b[reached] != 0, axis=0) | (compiled.displacement_column[port] != 0)
    return not np.any(through & others) and not _reaches_itself(compiled, port)


# A class and not a closure, because compiled models go to other processes.
class _Scaled:
    """A map behind a gain: ``map(k x)/k`` in front of the gain k does what the map does behind it."""

    __slots__ = ("_action", "_factor")

    def __init__(self, action: SampleMap, factor: float) -> None:
        self._action, self._factor = action, factor

    def __call__(self, samples: Real, sample_rate_hz: float) -> Real:
        return self._action(self._factor * samples, sample_rate_hz) / self._factor


def _gain_to_port(compiled: CompiledModel, name: str) -> float | None:
    """Gain from an input's samples to where the next effect acts; None when more than a gain lies between."""
    if name not in [terminal.name for terminal in compiled.inputs]:
        return None
    port = last_port(compiled, name, "input")
    if port is None:
        return None if _filtered_motion(compiled, name) else 1.0
    through = compiled.displacement_column[port].copy()
    own = float(through[compiled.column_of(name)])
    through[compiled.column_of(name)] = 0.0
    more = np.any(through) or np.any(compiled.displacement_state[port]) or np.any(compiled.displacement_port[port])
    # Behind a gain of zero nothing is left of the samples that a map could act on.
    return None if more or _carries(compiled, port) or own == 0 else own


def _filtered_motion(compiled: CompiledModel, name: str) -> bool:
    """Whether a prescribed motion passes a filter, which leaves no port to tell."""
    moved = next(terminal for terminal in compiled.inputs if terminal.name == name).derivatives > 0
    return moved and any(state.startswith(f"{name}.") for state in compiled.states)


def _carries(compiled: CompiledModel, port: int) -> bool:
    return any(law.port == port for law in compiled.laws) or any(line.port == port for line in compiled.delays)


def _upstream(compiled: CompiledModel, port: int) -> Mask:
    """Which states can move the signal at a port."""
    reached: Mask = compiled.displacement_state[port] != 0
    while True:
        more: Mask = reached | np.any(compiled.a[reached] != 0, axis=0)
        if np.array_equal(more, reached):
            return reached
        reached = more


def _reaches_itself(compiled: CompiledModel, port: int) -> bool:
    # By structure, not by size: a loop of a gain as small as may be is a loop.
    through_states = np.any(compiled.g[_upstream(compiled, port), port] != 0)
    return bool(through_states or compiled.displacement_port[port, port] != 0)


def _with_input_port(compiled: CompiledModel, name: str) -> CompiledModel:
    """Add a port at an input: what acts there takes the same way into the equations as the input itself."""
    terminal = compiled.inputs[input_row(compiled, name)]
    if terminal.derivatives:
        raise ModelError(f"input {name!r} prescribes a motion, to which a law of force can't add; act on its joint")
    column = compiled.column_of(name)
    own = np.zeros(compiled.columns)
    own[column] = 1.0
    return _with_port(
        compiled,
        Port(name=name, kind="input", unit=terminal.unit, displacement_unit=terminal.unit),
        displacement=(np.zeros(len(compiled.states)), own, np.zeros(len(compiled.ports) + 1)),
        effect=(
            compiled.b[:, column],
            compiled.d[:, column],
            compiled.displacement_column[:, column],
            compiled.velocity_column[:, column],
        ),
    )


def _with_output_port(compiled: CompiledModel, site: Site) -> CompiledModel:
    row = output_row(compiled, site.name)
    terminal, ports = compiled.outputs[row], len(compiled.ports)
    # Before loops are closed nothing feeds on the output, so its force moves no state yet.
    added = np.zeros(len(compiled.outputs))
    added[row] = 1.0
    return _with_port(
        compiled,
        Port(name=site.name, kind="output", unit=terminal.unit, displacement_unit=terminal.unit),
        displacement=(compiled.c[row], compiled.d[row], np.append(compiled.h[row], 0.0)),
        effect=(np.zeros(len(compiled.states)), added, np.zeros(ports), np.zeros(ports)),
    )


def _with_stage(compiled: CompiledModel, port: int) -> CompiledModel:
    """Add a port behind one that carries a law: its signal is the old one and what the law adds to it."""
    # The old port's force acts at once on what the new one sees, beside what may come around a loop.
    ahead = np.append(compiled.displacement_port[port], compiled.displacement_port[port, port])
    ahead[port] += 1.0
    return _with_port(
        compiled,
        compiled.ports[port],
        displacement=(compiled.displacement_state[port], compiled.displacement_column[port], ahead),
        effect=(
            compiled.g[:, port],
            compiled.h[:, port],
            compiled.displacement_port[:, port],
            compiled.velocity_port[:, port],
        ),
    )


def _with_port(
    compiled: CompiledModel,
    port: Port,
    *,
    displacement: tuple[Real, Real, Real],
    effect: tuple[Real, Real, Real, Real],
) -> CompiledModel:
    """Append a port; `effect` says what its force does to states, outputs, and the other ports' d and s."""
    states, columns, ports = displacement
    to_states, to_outputs, to_displacement, to_velocity = effect
    return replace(
        compiled,
        g=np.column_stack([compiled.g, to_states]),
        h=np.column_stack([compiled.h, to_outputs]),
        displacement_state=np.vstack([compiled.displacement_state, states]),
        displacement_column=np.vstack([compiled.displacement_column, columns]),
        displacement_port=np.vstack([np.column_stack([compiled.displacement_port, to_displacement]), ports]),
        velocity_state=np.vstack([compiled.velocity_state, np.zeros(len(compiled.states))]),
        velocity_column=np.vstack([compiled.velocity_column, np.zeros(compiled.columns)]),
        velocity_port=np.pad(np.column_stack([compiled.velocity_port, to_velocity]), ((0, 1), (0, 0))),
        ports=(*compiled.ports, port),
    )
