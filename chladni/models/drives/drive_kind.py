"""What a kind of drive is made of: its parameters, options, signals, equations and limits."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.instrument import Option
from chladni.models.core.parameter import Parameters
from chladni.models.core.port import Terminal
from chladni.models.drives.loop import Loop
from chladni.models.drives.validity import Limit
from chladni.signals.errors import ModelError

Numbers = Mapping[str, float]
Words = Mapping[str, str]


def no_loops(_values: Numbers, _options: Words) -> Sequence[Loop]:
    """Loops of a drive that has none."""
    return ()


def no_limits(_values: Numbers, _options: Words) -> Sequence[Limit]:
    """Limits of a drive that states none."""
    return ()


def no_remarks(_values: Numbers, _options: Words) -> Sequence[str]:
    """Remarks on a drive whose settings are all what they seem to be."""
    return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveKind:
    """Declares one kind of drive; `DriveModel` is made of it.

    Attributes
    ----------
    name
        Word in the model file: ``pneumatic-motor``.
    title
        For people.
    parameters
        All of them, SI, with usual ranges.
    inputs, outputs
        All that any option gives, by signal. Which of them a drive has depends on its options.
    options
        Choices between words, such as ``end_stops``: off or on.
    build
        ``build(values, options) -> CompiledModel``: the equations before its loops are closed, with all of its
        inputs, outputs, ports and own laws. Signals that a loop goes through get their ports when it's closed.
    loops
        ``loops(values, options) -> [Loop, ...]``, the innermost first.
    limits
        ``limits(values, options) -> [Limit, ...]``: what the model is valid for.
    remarks
        ``remarks(values, options) -> sentences`` on a setting that can be simulated, but isn't what it seems to be.
    law_words
        What acts at a port of the kind's own laws, by the port's name: ``the voltage limit``. Said when it acts.
    acts_with
        Parameters that act with some options only: name to ``(option, words)``. A parameter that isn't named
        always acts.
    """

    name: str
    title: str
    parameters: Parameters
    inputs: tuple[Terminal, ...]
    outputs: tuple[Terminal, ...]
    build: Callable[[Numbers, Words], CompiledModel]
    options: tuple[Option, ...] = ()
    loops: Callable[[Numbers, Words], Sequence[Loop]] = no_loops
    limits: Callable[[Numbers, Words], Sequence[Limit]] = no_limits
    remarks: Callable[[Numbers, Words], Sequence[str]] = no_remarks
    law_words: Mapping[str, str] = field(default_factory=dict)
    acts_with: Mapping[str, tuple[str, tuple[str, ...]]] = field(default_factory=dict)

    def choices(self, options: Words) -> dict[str, str]:
        """Word of each option; what isn't given has its default.

        Raises
        ------
        ModelError
            When an option or its word is unknown; names those there are.
        """
        chosen = {option.name: option.default for option in self.options}
        for name, word in options.items():
            known = next((option for option in self.options if option.name == name), None)
            if known is None:
                raise ModelError(f"{self.name}: no option {name!r}; options: {', '.join(chosen) or 'none'}")
            if word not in known.choices:
                raise ModelError(f"{self.name}: option {name} = {word!r}; choose one of {', '.join(known.choices)}")
            chosen[name] = word
        return chosen

    def acting(self, options: Words) -> Parameters:
        """Parameters that act with these options."""
        chosen = self.choices(options)
        return Parameters(tuple(p for p in self.parameters.items_in_order if self._acts(p.name, chosen)))

    def with_values(self, values: Numbers, options: Words) -> Parameters:
        """Parameters that act with these options, some values replaced.

        Raises
        ------
        ModelError
            When a name is unknown, a value impossible, or a parameter doesn't act with these options.
        """
        # An option that is off would swallow the value in silence.
        acting = self.acting(options)
        for name in values:
            self.parameters.require(name)
            if name not in acting:
                option, words = self.acts_with[name]
                raise ModelError(f"{self.name}: {name} acts only with option {option} = {' or '.join(words)}")
        return acting.with_values(values)

    def _acts(self, name: str, chosen: Words) -> bool:
        # Most parameters act whatever is switched.
        if name not in self.acts_with:
            return True
        option, words = self.acts_with[name]
        return chosen[option] in words
