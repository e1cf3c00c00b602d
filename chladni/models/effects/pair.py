"""Pairs: two bodies, or a body and the ground, that no joint need connect; two outputs."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, PortKind
from chladni.signals.errors import ModelError

#: Between the names of a pair: ``arm~hand``.
TILDE = "~"
_GROUND = "ground"


def members_of(compiled: CompiledModel, kind: PortKind) -> list[str]:
    """Give the names of which two are a pair of a kind, in the model's order, the ground first."""
    if kind == "output_pair":
        return [one.name for one in compiled.outputs]
    bodies = [port.name for port in compiled.ports if port.kind == "body"]
    return [_GROUND, *bodies] if bodies else []


def pairs_of(compiled: CompiledModel, kind: PortKind) -> list[str]:
    """Give the names of all pairs of a kind, each once."""
    return [TILDE.join(pair) for pair in combinations(members_of(compiled, kind), 2)]


def pair_of(compiled: CompiledModel, name: str, kind: PortKind) -> tuple[str, str] | None:
    """Give both names of a pair, in the order in which they are given; None where it's none of the model's."""
    if kind not in ("pair", "output_pair"):
        return None
    members, parts = members_of(compiled, kind), name.split(TILDE)
    if len(parts) != 2 or parts[0] == parts[1] or not set(parts) <= set(members):
        return None
    return parts[0], parts[1]


def with_pair_port(compiled: CompiledModel, name: str) -> tuple[CompiledModel, int]:
    """Give a port of kind ``pair``, the one that is there or a new one, and its place.

    Its displacement is the second body's less the first's, and its force resists: -f acts on the second body, +f on
    the first.

    Raises
    ------
    ModelError
        When a name is no body, or one of both moves along a line and the other one turns.
    """
    for place, port in enumerate(compiled.ports):
        if (port.name, port.kind) == (name, "pair"):
            return compiled, place
    pair = pair_of(compiled, name, "pair")
    if pair is None:
        members = ", ".join(members_of(compiled, "pair")) or "none"
        raise ModelError(f"{name!r} is no pair of bodies; join two of: {members}")
    weights = np.zeros(len(compiled.ports))
    bodies = [(sign, compiled.port_index(one, "body")) for sign, one in zip((-1.0, 1.0), pair, strict=True)
              if one != _GROUND]  # fmt: skip
    for sign, place in bodies:
        weights[place] = sign
    shown = [compiled.ports[place] for _, place in bodies]
    _require_alike(name, shown)
    last = shown[-1]
    port = Port(name=name, kind="pair", unit=last.unit, displacement_unit=last.displacement_unit)
    # What acts at the pair acts at its bodies, against their displacements' signs.
    to_displacement, to_velocity = -compiled.displacement_port @ weights, -compiled.velocity_port @ weights
    displacement_port = np.column_stack([compiled.displacement_port, to_displacement])
    velocity_port = np.column_stack([compiled.velocity_port, to_velocity])
    return replace(
        compiled,
        g=np.column_stack([compiled.g, -compiled.g @ weights]),
        h=np.column_stack([compiled.h, -compiled.h @ weights]),
        displacement_state=np.vstack([compiled.displacement_state, weights @ compiled.displacement_state]),
        displacement_column=np.vstack([compiled.displacement_column, weights @ compiled.displacement_column]),
        displacement_port=np.vstack([displacement_port, weights @ displacement_port]),
        velocity_state=np.vstack([compiled.velocity_state, weights @ compiled.velocity_state]),
        velocity_column=np.vstack([compiled.velocity_column, weights @ compiled.velocity_column]),
        velocity_port=np.vstack([velocity_port, weights @ velocity_port]),
        ports=(*compiled.ports, port),
    ), len(compiled.ports)


def _require_alike(name: str, bodies: Sequence[Port]) -> None:
    units = list(dict.fromkeys(port.displacement_unit for port in bodies))
    if len(units) > 1:
        told = " and ".join(f"{port.name} in {port.displacement_unit}" for port in bodies)
        raise ModelError(f"{name!r}: {told} move in unlike ways; only two that both turn, or both don't, are a pair")


def with_pairs(compiled: CompiledModel) -> CompiledModel:
    """Give the model with a port for every two bodies, or ground and body, that could be linked and aren't."""
    joints = [place for place, port in enumerate(compiled.ports) if port.kind == "joint"]
    units = {port.name: port.displacement_unit for port in compiled.ports if port.kind == "body"}
    for name in pairs_of(compiled, "pair"):
        if len({units[one] for one in name.split(TILDE) if one in units}) > 1:
            continue
        linked, place = with_pair_port(compiled, name)
        if not any(_moves_alike(linked, place, joint) for joint in joints):
            compiled = linked
    return compiled


def _moves_alike(compiled: CompiledModel, place: int, other: int) -> bool:
    """Whether the displacement at a port is that at another one, or its opposite."""
    ways = (compiled.displacement_state, compiled.displacement_column)
    return any(all(np.array_equal(way[place], sign * way[other]) for way in ways) for sign in (1.0, -1.0))
