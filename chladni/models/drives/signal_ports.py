"""Ports at the signals of a loop, where effects and limits act on what goes round."""

from collections.abc import Sequence
from dataclasses import replace

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import PortKind
from chladni.models.core.port_law import PortLaw
from chladni.models.effects.effect_kind import Site
from chladni.models.effects.signal_path import free_port, last_port


def with_port(compiled: CompiledModel, name: str, kind: PortKind) -> CompiledModel:
    """Give the model with a port at the named input or output; one that it has is kept.

    What acts at an output that is fed back acts on the loop too. Effects tell by this port that it is.
    """
    if last_port(compiled, name, kind) is not None:
        return compiled
    return free_port(compiled, Site(effect="loop", name=name, kind=kind))[0]


def with_command_laws(compiled: CompiledModel, name: str, laws: Sequence[PortLaw]) -> CompiledModel:
    """Give the model with laws at the named input, one behind the other, behind all that acts there."""
    for law in laws:
        compiled, port = free_port(compiled, Site(effect="limit", name=name, kind="input"))
        compiled = replace(compiled, laws=(*compiled.laws, replace(law, port=port)))
    return compiled
