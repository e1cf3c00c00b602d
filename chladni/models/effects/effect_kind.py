"""What an effect is: its word, where it may act, its parameters, and the variants of its law."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.port import Port, PortKind
from chladni.models.core.simulation import Simulation
from chladni.models.effects.clues import Clues
from chladni.models.effects.wording import nearest
from chladni.signals.errors import ModelError

Values = Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Where one effect is attached to one model.

    Attributes
    ----------
    effect
        The effect's word, for names and messages.
    name
        Name of the joint, body, input or output; ``ground``.
    kind
        Which of these it is.
    source
        Name of another output that the effect listens to, or None.
    in_loop
        Whether the signal is known to act inside a loop that the model doesn't show yet: an output that a controller
        will feed back.
    """

    effect: str
    name: str
    kind: PortKind
    source: str | None = None
    in_loop: bool = False


#: ``attach(compiled, site, values) -> compiled``, all values in SI and inside their bounds.
Attach = Callable[[CompiledModel, Site, Values], CompiledModel]
#: ``flags(port, values, simulation) -> sentences`` about where the law left its validity.
Flags = Callable[[Port, Values, Simulation], tuple[str, ...]]

_NONE = Parameters(())


@dataclass(frozen=True, slots=True, kw_only=True)
class Variant:
    """One form of an effect's law.

    Attributes
    ----------
    name
        Such as ``bristle``.
    attach
        How it changes a compiled model.
    formula
        The law in one line, for pages and tables.
    parameters
        Those that only this variant has, beyond the effect's own; all have defaults.
    odd
        Whether the law claims ``F(-d, -s) = -F(d, s)``; tested with ``offset`` and ``phase`` at zero.
    fitted
        Names, also among those that all variants share, that make this form what it is: a fit moves them beside
        those that the effect requires.
    """

    name: str
    attach: Attach
    formula: str
    parameters: Parameters = _NONE
    odd: bool = False
    fitted: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectKind:
    """One word of the vocabulary of unmodelled effects.

    To add one of your own, write such a record in a file of yours and hand it to `attached` in place of a word;
    nothing has to be registered. docs/effects.md shows an example.

    Attributes
    ----------
    name
        The word, such as ``coulomb_friction``.
    said
        As one says it, with an article where the field uses one; the word without underscores when empty.
    family
        ``friction``, ``stiffness``, ``damping``, ``attachment``, ``actuator``, ``sensor`` or ``disturbance``.
    meaning
        A few words for people.
    sites
        Kinds of port where it may act.
    parameters
        Those that all variants share.
    variants
        The first is the default.
    optional
        Names among `parameters` that keep their value when they aren't given; all others must be given.
    neutral
        Values with which the effect does nothing.
    linear
        Whether the model stays linear, so that the effect can be seen in the frequency response.
    needs_source
        Whether it listens to another output, which must be named.
    check
        ``check(values)`` says what is wrong between the values, or gives an empty text.
    flags
        Says where a simulation left the law's validity, or None when the law is valid everywhere.
    clues
        What a diagnosis must know of it.

    Raises
    ------
    ModelError
        When there's no site or no variant, or a name in `optional`, `neutral` or `clues` is no parameter.
    """

    name: str
    family: str
    meaning: str
    sites: tuple[PortKind, ...]
    parameters: Parameters
    variants: tuple[Variant, ...]
    optional: tuple[str, ...] = ()
    neutral: Mapping[str, float] = field(default_factory=dict)
    linear: bool = False
    needs_source: bool = False
    check: Callable[[Values], str] | None = None
    flags: Flags | None = None
    said: str = ""
    clues: Clues = field(default_factory=Clues)

    def __post_init__(self) -> None:
        if not self.sites or not self.variants:
            raise ModelError(f"effect {self.name!r}: it needs at least one kind of site and one variant")
        # A name used twice shows when the parameters are put together: now, not when someone picks the variant.
        for variant in self.variants:
            known = self.parameters_of(variant.name)
            for name in variant.fitted:
                known.require(name)
        for name in (*self.optional, *self.neutral):
            self.parameters.require(name)
        every = {name for variant in self.variants for name in self.parameters_of(variant.name)}
        for name in (*self.clues.details, *self.clues.sizes):
            if name not in every:
                raise ModelError(f"effect {self.name!r}: its clues name {name!r}, which no variant has")

    @property
    def required(self) -> tuple[str, ...]:
        """Names of the parameters that must be given."""
        return tuple(name for name in self.parameters if name not in self.optional)

    @property
    def spoken(self) -> str:
        """The word as one says it."""
        return self.said or self.name.replace("_", " ")

    def variant(self, name: str | None = None) -> Variant:
        """Give the named variant, or the default; `ModelError` that names the nearest when it's missing."""
        if name is None:
            return self.variants[0]
        for variant in self.variants:
            if variant.name == name:
                return variant
        known = [variant.name for variant in self.variants]
        raise ModelError(f"{self.name}: no variant {name!r}; {nearest(name, known, 'variants')}")

    def parameters_of(self, variant: str | None = None) -> Parameters:
        """Give the shared parameters and those of one variant (the default one when None)."""
        extra: tuple[Parameter, ...] = self.variant(variant).parameters.items_in_order
        return Parameters((*self.parameters.items_in_order, *extra))
