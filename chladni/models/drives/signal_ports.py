"""Ports at the signals of a loop, where effects and limits act on what goes round."""

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


def limit_port(name: str) -> str:
    """Name of the port at which an input's own limit acts, in front of all effects at the input."""
    return f"{name}_limit"


def with_limit(compiled: CompiledModel, name: str, law: PortLaw) -> CompiledModel:
    """Give the model with a limit of the named input, and behind it a port for effects.

    The limit has a port of its own, so that an integral which tracks it doesn't track the effects.
    """
    site = Site(effect="limit", name=name, kind="input")
    compiled, port = free_port(compiled, site)
    compiled = replace(compiled, laws=(*compiled.laws, replace(law, port=port)))
    # A second port in a row, for what acts on the limited command.
    compiled, _ = free_port(compiled, site)
    ports = list(compiled.ports)
    ports[port] = replace(ports[port], name=limit_port(name))
    return replace(compiled, ports=tuple(ports))
