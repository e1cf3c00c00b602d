"""A drive that can be simulated: a kind with its values, options, signals and effects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Effect, ModelKind, flags_of_effects
from chladni.models.core.parameter import Parameters
from chladni.models.core.port import HoldKind, Terminal, require_named
from chladni.models.core.simulation import Simulation
from chladni.models.drives.computed_output import computed_output
from chladni.models.drives.drive_kind import DriveKind
from chladni.models.drives.loop import close_loop
from chladni.models.drives.selection import ChosenSignal, renamed, selected, signal_names
from chladni.models.drives.signal_ports import with_port
from chladni.models.drives.validity import acting_laws, broken_limits, unstable_loop
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DriveModel:
    """One drive; made by `drive_model`.

    Attributes
    ----------
    name
        For people and files.
    drive
        What it is a drive of.
    parameters
        Those that act with the options chosen.
    options
        Word of every option.
    inputs, outputs
        Signals that the model shows, in order; all that the drive has when none is given. An input that isn't shown
        stays at zero.
    effects
        In the order they attach.
    """

    name: str
    drive: DriveKind
    parameters: Parameters
    options: Mapping[str, str]
    inputs: tuple[ChosenSignal, ...]
    outputs: tuple[ChosenSignal, ...]
    effects: tuple[Effect, ...] = field(default=())
    # Nothing of a drive changes, so its equations are made once: for its checks, its response and its flags.
    _kept: list[CompiledModel] = field(default_factory=list, init=False, repr=False)

    def __post_init__(self) -> None:
        if not self.inputs:
            object.__setattr__(self, "inputs", _signals(self._closed().inputs))
        if not self.outputs:
            object.__setattr__(self, "outputs", _signals(self._closed().outputs))

    @property
    def kind(self) -> ModelKind:
        """``drive``, the word in the model file."""
        return "drive"

    def with_values(self, values: Mapping[str, float]) -> Self:
        """Give the drive with some parameters replaced; `ModelError` for an unknown name or impossible value."""
        return replace(self, parameters=self.parameters.with_values(values))

    def with_effects(self, effects: Sequence[Effect]) -> Self:
        """Give the drive with these effects in place of those it has."""
        return replace(self, effects=tuple(effects))

    def with_holds(self, holds: Mapping[str, HoldKind]) -> Self:
        """Give the drive with other holds of the named signals that it shows; `ModelError` for another name."""
        require_named(holds, [one.shown_as for one in (*self.inputs, *self.outputs)])
        inputs, outputs = (
            tuple(replace(one, hold=holds.get(one.shown_as, one.hold)) for one in chosen)
            for chosen in (self.inputs, self.outputs)
        )
        return replace(self, inputs=inputs, outputs=outputs)

    def compile(self) -> CompiledModel:
        """Give the equations.

        Effects at joints and bodies attach first, then those at outputs, so that the loops feed back what the
        sensors see; then loops are closed, then effects at inputs attach.
        """
        return selected(self._closed(), self.inputs, self.outputs)

    def flags(self, simulation: Simulation) -> tuple[str, ...]:
        """Sentences on the setting, an unstable loop, limits left (number, time), laws that acted, and of effects."""
        # Before signals are chosen: what isn't shown has its limits too.
        closed, values = self._closed(), self.parameters.numbers()
        shown = selected(closed, self.inputs, self.outputs)
        inputs = tuple(zip((choice.signal for choice in self.inputs), shown.inputs, strict=True))
        limits, names = self.drive.limits(values, self.options), signal_names(self.outputs)
        computed = {
            limit.signal: computed_output(
                closed, simulation, names.get(limit.signal, limit.signal), driven=shown.inputs
            )
            for limit in limits
        }
        return (
            *self.drive.remarks(values, self.options),
            *unstable_loop(closed),
            *broken_limits(limits, simulation, inputs, computed),
            *acting_laws(self.drive.law_words, simulation),
            *flags_of_effects(self.effects, closed, simulation),
        )

    def _closed(self) -> CompiledModel:
        """Equations with all loops closed and all effects attached, every signal still there."""
        if not self._kept:
            self._kept.append(self._made())
        return self._kept[0]

    def _made(self) -> CompiledModel:
        values, names = self.parameters.numbers(), signal_names((*self.inputs, *self.outputs))
        compiled = renamed(self.drive.build(values, self.options), names)
        # Sorted by where they act; inside each group the order given stays.
        outputs = {terminal.name for terminal in compiled.outputs}
        moving = {port.name for port in compiled.ports if port.kind in ("joint", "body", "ground")}
        # Loops speak of signals by the kind's words; the model may call them otherwise.
        loops = [loop.renamed(names) for loop in self.drive.loops(values, self.options)]
        for name in (terminal.name for loop in loops for terminal in loop.controller.inputs):
            compiled = with_port(compiled, name, "output") if name in outputs else compiled
        compiled = _attached(compiled, [effect for effect in self.effects if effect.site in moving])
        compiled = _attached(compiled, [effect for effect in self.effects if effect.site in outputs])
        for loop in loops:
            compiled = close_loop(compiled, loop)
        return _attached(compiled, [e for e in self.effects if e.site not in moving | outputs])


def drive_model(
    drive: DriveKind,
    values: Mapping[str, float] | None = None,
    options: Mapping[str, str] | None = None,
    *,
    name: str = "",
    inputs: Sequence[ChosenSignal] = (),
    outputs: Sequence[ChosenSignal] = (),
) -> DriveModel:
    """Make a drive of some kind.

    Parameters
    ----------
    drive
        One of `chladni.models.drives.catalogue.DRIVES`.
    values
        Parameters in SI that differ from their defaults.
    options
        Words that differ from their defaults.
    name
        Empty for the kind's.
    inputs, outputs
        Signals to show; none for all that the drive has with its options.

    Raises
    ------
    ModelError
        When a parameter, option or signal is unknown, a value impossible, or a name used twice.

    Examples
    --------
    >>> from chladni.models.drives.catalogue import DRIVES
    >>> motor = drive_model(DRIVES["pneumatic-motor"], {"active_area": 60e-4})
    >>> motor.compile().states
    ('displacement', 'velocity', 'pressure_drop')
    """
    # Options first: they say which parameters there are.
    chosen = drive.choices(options or {})
    parameters = drive.with_values(values or {}, chosen)
    _require_signals(drive, (*inputs, *outputs))
    model = DriveModel(
        name=name or drive.name,
        drive=drive,
        parameters=parameters,
        options=chosen,
        inputs=tuple(inputs),
        outputs=tuple(outputs),
    )
    # Compiled here for its checks: a mistake belongs to who makes the model, not to who simulates it.
    model.compile()
    return model


def _signals(terminals: Sequence[Terminal]) -> tuple[ChosenSignal, ...]:
    return tuple(ChosenSignal(signal=terminal.name) for terminal in terminals)


def _require_signals(drive: DriveKind, chosen: Sequence[ChosenSignal]) -> None:
    signals = [choice.signal for choice in chosen]
    known = [terminal.name for terminal in (*drive.inputs, *drive.outputs)]
    for signal in signals:
        if signal not in known:
            raise ModelError(f"{drive.name}: no signal {signal!r}; signals: {', '.join(known)}")
        if signals.count(signal) > 1:
            raise ModelError(f"{drive.name}: signal {signal!r} is chosen twice")


def _attached(compiled: CompiledModel, effects: Sequence[Effect]) -> CompiledModel:
    for effect in effects:
        compiled = effect.attach(compiled)
    return compiled
