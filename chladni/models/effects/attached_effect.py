"""An effect at a site of a model, with its numbers."""

from collections.abc import Mapping
from dataclasses import dataclass

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameters
from chladni.models.core.port import Port, PortKind
from chladni.models.core.simulation import Simulation
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.effect_kind import EffectKind, Site
from chladni.models.effects.pair import pair_of, pairs_of
from chladni.models.effects.signal_path import last_port
from chladni.models.effects.wording import nearest, spoken
from chladni.signals.errors import ModelError


@dataclass(frozen=True, slots=True, kw_only=True)
class AttachedEffect:
    """What a model's `effects` hold; made by `attached`.

    Attributes
    ----------
    kind
        The word's record.
    site
        Name of the joint, body, input or output; ``ground``.
    values
        Every parameter of the variant, SI.
    variant
        Form of the law.
    source
        Name of another output that the effect listens to (``cross_axis``), else None.

    Raises
    ------
    ModelError
        When a parameter is missing, unknown or impossible, or a source is missing or of no use.
    """

    kind: EffectKind
    site: str
    values: Mapping[str, float]
    variant: str
    source: str | None = None

    def __post_init__(self) -> None:
        try:
            parameters = self.kind.parameters_of(self.variant).with_values(self.values)
        except ModelError as error:
            raise ModelError(f"{self.effect} at {self.site!r}: {error}") from error
        missing = [name for name in self.kind.required if name not in self.values]
        if missing:
            wish = ", ".join(f"{name} [{parameters[name].unit}]" for name in missing)
            raise ModelError(f"{self.effect} at {self.site!r}: give {wish}")
        # Complete from here on: what a law reads, what is written to a file, and what a fit starts from are the same.
        object.__setattr__(self, "values", parameters.numbers())
        mistake = self.kind.check(self.values) if self.kind.check else ""
        if mistake:
            raise ModelError(f"{self.effect} at {self.site!r}: {mistake}")
        self._require_source()

    @property
    def effect(self) -> str:
        """The word, such as ``coulomb_friction``."""
        return self.kind.name

    @property
    def parameters(self) -> Parameters:
        """The values with their units and ranges."""
        return self.kind.parameters_of(self.variant).with_values(self.values)

    @property
    def usually_fitted(self) -> tuple[str, ...]:
        """Parameters that it can't do without; a choice such as the side of a stop isn't one to fit."""
        names = (*self.kind.required, *self.kind.variant(self.variant).fitted)
        return tuple(name for name in names if self.parameters[name].role == "construction")

    def attach(self, compiled: CompiledModel, *, in_loop: bool = False) -> CompiledModel:
        """Give the model with the effect in it.

        Parameters
        ----------
        compiled
            The model's equations. Effects at joints, bodies and ground attach first, then those at outputs, then
            loops are closed, then effects at inputs attach; at one site in the order of the signal.
        in_loop
            Say so of an output that a controller will feed back, when the model has no port for it: what changes
            its signal must then act in the loop, where outside of loops it acts on recorded samples.

        Raises
        ------
        ModelError
            When there's no such site, or it's of a kind where the effect can't act.
        """
        kind = _kind_of_site(compiled, self.site, self.kind)
        if self.source is not None and self.source not in _sites(compiled, "output"):
            raise ModelError(
                f"{self.effect} at {self.site!r}: no output {self.source!r}; "
                f"{nearest(self.source, _sites(compiled, 'output'), 'outputs')}"
            )
        place = Site(effect=self.effect, name=self.site, kind=kind, source=self.source, in_loop=in_loop)
        return self.kind.variant(self.variant).attach(compiled, place, self.values)

    def flags(self, compiled: CompiledModel, simulation: Simulation) -> tuple[str, ...]:
        """Sentences about where a simulation of `compiled` left what the law is valid for."""
        if self.kind.flags is None:
            return ()
        kind = _kind_of_site(compiled, self.site, self.kind)
        place = last_port(compiled, self.site, kind)
        # Inputs and outputs outside of loops carry effects on their samples, and need no port for it.
        port = Port(name=self.site, kind=kind) if place is None else compiled.ports[place]
        return self.kind.flags(port, self.values, simulation)

    def _require_source(self) -> None:
        if self.kind.needs_source and not self.source:
            raise ModelError(f"{self.effect} at {self.site!r}: name the output that it listens to as source")
        if self.source and not self.kind.needs_source:
            raise ModelError(
                f"{self.effect} at {self.site!r}: it listens to no other output; leave {self.source!r} out"
            )
        if self.source and self.source == self.site:
            raise ModelError(f"{self.effect} at {self.site!r}: its source is another output, not itself")


def attached(
    effect: str | EffectKind,
    site: str,
    values: Mapping[str, float],
    *,
    variant: str | None = None,
    source: str | None = None,
) -> AttachedEffect:
    """Make an effect at a site, for a model's `with_effects`.

    Parameters
    ----------
    effect
        A word of `CATALOGUE`, or a record of your own.
    site
        Name of the joint, body, input or output; ``ground``.
    values
        Parameters in SI; those that the effect calls optional may be left out.
    variant
        Form of the law, the effect's first when None.
    source
        For ``cross_axis``: the output of the direction that is felt too.

    Raises
    ------
    ModelError
        For an unknown word, variant or parameter (the nearest is named), a missing or impossible value.

    Examples
    --------
    >>> friction = attached("coulomb_friction", "elbow", {"force": 8.1})
    >>> friction.values["offset"], friction.variant
    (0.0, 'regularised')
    """
    kind = kind_of(effect)
    name = kind.variant(variant).name
    return AttachedEffect(kind=kind, site=site, values=dict(values), variant=name, source=source)


def kind_of(effect: str | EffectKind) -> EffectKind:
    """Give the record of a word, or the one that was given; `ModelError` that names the nearest word."""
    if not isinstance(effect, str):
        return effect
    if effect not in CATALOGUE:
        raise ModelError(f"no effect {effect!r}; {nearest(effect, CATALOGUE, 'effects')}")
    return CATALOGUE[effect]


def attached_if_possible(
    effect: str | EffectKind,
    site: str,
    values: Mapping[str, float],
    *,
    variant: str | None = None,
    source: str | None = None,
) -> AttachedEffect | None:
    """Give what `attached` gives, None where the numbers make no such effect: of a guess that's an answer."""
    try:
        return attached(effect, site, values, variant=variant, source=source)
    except ModelError:
        return None


def _sites(compiled: CompiledModel, kind: PortKind) -> list[str]:
    """Names of all sites of one kind; inputs and outputs need no port to be one."""
    names = [port.name for port in compiled.ports if port.kind == kind]
    if kind in ("pair", "output_pair"):
        return pairs_of(compiled, kind)
    # Inputs and outputs outside of loops have no port until an effect needs one.
    terminals = {"input": compiled.inputs, "output": compiled.outputs}.get(kind, ())
    return list(dict.fromkeys([*(terminal.name for terminal in terminals), *names]))


def _kind_of_site(compiled: CompiledModel, name: str, effect: EffectKind) -> PortKind:
    # Names are unique over bodies, joints, inputs and outputs, so the first kind that has it is the one.
    for kind in effect.sites:
        if name in _sites(compiled, kind) or pair_of(compiled, name, kind) is not None:
            return kind
    possible = [site for kind in effect.sites for site in _sites(compiled, kind)]
    elsewhere: list[PortKind] = [
        kind for kind in ("joint", "body", "ground", "input", "output", "pair") if name in _sites(compiled, kind)
    ]
    where = f"{effect.name} acts at {spoken(effect.sites)}"
    if elsewhere:
        rest = f"possible sites: {', '.join(possible) or 'none'}"
        raise ModelError(f"{where}, but {name!r} is {spoken(elsewhere)}; {rest}")
    raise ModelError(f"{where}, and there is no {name!r}; {nearest(name, possible, 'possible sites')}")
