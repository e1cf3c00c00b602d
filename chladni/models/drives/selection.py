"""Which of a drive's signals a model shows, under which names, from which channels."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import HoldKind, Terminal
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenSignal:
    """An input or output of a drive that a model shows.

    Attributes
    ----------
    signal
        The kind's word for it, such as ``flow``.
    name
        Its name in the model, which is also its site; empty for the word itself.
    channel
        Channel of a log that holds it, or None.
    hold
        See `Terminal`.
    """

    signal: str
    name: str = ""
    channel: str | None = None
    hold: HoldKind | None = None

    @property
    def shown_as(self) -> str:
        """Its name in the model."""
        return self.name or self.signal


def signal_names(chosen: Sequence[ChosenSignal]) -> dict[str, str]:
    """Name in the model of each signal that has one of its own."""
    return {choice.signal: choice.shown_as for choice in chosen}


def renamed(compiled: CompiledModel, names: Mapping[str, str]) -> CompiledModel:
    """Give the model with other names of its inputs, its outputs and their ports.

    Raises
    ------
    ModelError
        When two signals or sites would share a name.
    """
    inputs = tuple(replace(t, name=names.get(t.name, t.name)) for t in compiled.inputs)
    outputs = tuple(replace(t, name=names.get(t.name, t.name)) for t in compiled.outputs)
    ports = tuple(
        port if port.kind in ("joint", "body", "ground") else replace(port, name=names.get(port.name, port.name))
        for port in compiled.ports
    )
    # One name may stand at several ports of a signal, but not at two signals or a signal and a joint.
    fixed = {port.name for port in ports if port.kind in ("joint", "body", "ground")}
    taken = [*sorted(fixed), *(t.name for t in inputs), *(t.name for t in outputs)]
    for name in taken:
        if taken.count(name) > 1:
            raise ModelError(f"name {name!r} is used twice; names of inputs, outputs, joints and bodies are unique")
    return replace(compiled, inputs=inputs, outputs=outputs, ports=ports)


def selected(
    compiled: CompiledModel, inputs: Sequence[ChosenSignal], outputs: Sequence[ChosenSignal]
) -> CompiledModel:
    """Give the model with the chosen inputs and outputs only, in the order chosen; other inputs stay at zero."""
    # Names are those of the model by now: signals were renamed before anything attached.
    taken = [_place(compiled.inputs, choice, "input") for choice in inputs]
    shown = [_place(compiled.outputs, choice, "output") for choice in outputs]
    columns = [column for place in taken for column in _columns(compiled, place)]
    # Computed inputs act whether or not anyone asks for them.
    columns += range(compiled.columns - len(compiled.generated), compiled.columns)
    return replace(
        compiled,
        b=compiled.b[:, columns],
        c=compiled.c[shown],
        d=compiled.d[shown][:, columns],
        h=compiled.h[shown],
        displacement_column=compiled.displacement_column[:, columns],
        velocity_column=compiled.velocity_column[:, columns],
        inputs=_with_channels(compiled.inputs, taken, inputs),
        outputs=_with_channels(compiled.outputs, shown, outputs),
        input_maps=tuple((taken.index(place), action) for place, action in compiled.input_maps if place in taken),
        output_maps=tuple((shown.index(place), action) for place, action in compiled.output_maps if place in shown),
        input_delays_s=tuple(compiled.input_delays_s[place] for place in taken),
        output_offsets_s=tuple(compiled.output_offsets_s[place] for place in shown),
    )


def _place(terminals: tuple[Terminal, ...], choice: ChosenSignal, what: str) -> int:
    names = [terminal.name for terminal in terminals]
    if choice.shown_as not in names:
        raise ModelError(f"no {what} {choice.signal!r}; {what}s: {', '.join(names)}")
    return names.index(choice.shown_as)


def _columns(compiled: CompiledModel, place: int) -> range:
    first = compiled.column_of(compiled.inputs[place].name)
    return range(first, first + 1 + compiled.inputs[place].derivatives)


def _with_channels(
    terminals: tuple[Terminal, ...], places: Sequence[int], chosen: Sequence[ChosenSignal]
) -> tuple[Terminal, ...]:
    return tuple(
        replace(terminals[place], channel=choice.channel, hold=choice.hold)
        for place, choice in zip(places, chosen, strict=True)
    )
