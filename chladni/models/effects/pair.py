"""Pairs: two bodies, or a body and the ground, that no joint need connect; two outputs."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import Port, PortKind
from chladni.signals.arrays import Real
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
    return with_pair_ports(compiled, [name]), len(compiled.ports)


def with_pair_ports(compiled: CompiledModel, names: Sequence[str]) -> CompiledModel:
    """Give the model with a new port for each of some pairs of bodies; errors are those of `with_pair_port`."""
    return PairPorts(compiled, names).of(compiled)


class PairPorts:
    """Ports of some pairs of bodies, laid out once for a model of any numbers; errors are those of `with_pair_port`.

    Parameters
    ----------
    compiled
        The model at some of its numbers.
    names
        Of the pairs.
    """

    def __init__(self, compiled: CompiledModel, names: Sequence[str]) -> None:
        weights, ports = np.zeros((len(names), len(compiled.ports))), []
        for row, name in enumerate(names):
            ends = _ends(compiled, name)
            for sign, place in ends:
                weights[row, place] = sign
            shown = [compiled.ports[place] for _, place in ends]
            _require_alike(name, shown)
            last = shown[-1]
            ports.append(Port(name=name, kind="pair", unit=last.unit, displacement_unit=last.displacement_unit))
        self._weights, self._ports = weights, tuple(ports)

    def of(self, compiled: CompiledModel) -> CompiledModel:
        """Give the model at other numbers with these ports, behind its own."""
        if not self._ports:
            return compiled
        weights = self._weights
        # What acts at the pair acts at its bodies, against their displacements' signs.
        displacement_port = np.hstack([compiled.displacement_port, -compiled.displacement_port @ weights.T])
        velocity_port = np.hstack([compiled.velocity_port, -compiled.velocity_port @ weights.T])
        return replace(
            compiled,
            g=np.hstack([compiled.g, -compiled.g @ weights.T]),
            h=np.hstack([compiled.h, -compiled.h @ weights.T]),
            displacement_state=np.vstack([compiled.displacement_state, weights @ compiled.displacement_state]),
            displacement_column=np.vstack([compiled.displacement_column, weights @ compiled.displacement_column]),
            displacement_port=np.vstack([displacement_port, weights @ displacement_port]),
            velocity_state=np.vstack([compiled.velocity_state, weights @ compiled.velocity_state]),
            velocity_column=np.vstack([compiled.velocity_column, weights @ compiled.velocity_column]),
            velocity_port=np.vstack([velocity_port, weights @ velocity_port]),
            ports=(*compiled.ports, *self._ports),
        )


def unlinked_pairs(compiled: CompiledModel) -> tuple[str, ...]:
    """Give the names of all pairs of bodies, and of a body and the ground, that move alike and share no joint."""
    joints = [
        (compiled.displacement_state[place], compiled.displacement_column[place])
        for place, port in enumerate(compiled.ports)
        if port.kind == "joint"
    ]
    found = []
    for name in pairs_of(compiled, "pair"):
        ends = _ends(compiled, name)
        if len({compiled.ports[place].displacement_unit for _, place in ends}) > 1:
            continue
        state = sum(sign * compiled.displacement_state[place] for sign, place in ends)
        column = sum(sign * compiled.displacement_column[place] for sign, place in ends)
        if not any(_same(state, own) and _same(column, moved) for own, moved in joints):
            found.append(name)
    return tuple(found)


def _same(one: Real, other: Real) -> bool:
    return np.array_equal(one, other) or np.array_equal(one, -other)


def _ends(compiled: CompiledModel, name: str) -> list[tuple[float, int]]:
    """Sign and port of each body of a pair."""
    pair = pair_of(compiled, name, "pair")
    if pair is None:
        members = ", ".join(members_of(compiled, "pair")) or "none"
        raise ModelError(f"{name!r} is no pair of bodies; join two of: {members}")
    return [
        (sign, compiled.port_index(one, "body"))
        for sign, one in zip((-1.0, 1.0), pair, strict=True)
        if one != _GROUND
    ]


def _require_alike(name: str, bodies: Sequence[Port]) -> None:
    units = list(dict.fromkeys(port.displacement_unit for port in bodies))
    if len(units) > 1:
        told = " and ".join(f"{port.name} in {port.displacement_unit}" for port in bodies)
        raise ModelError(f"{name!r}: {told} move in unlike ways; only two that both turn, or both don't, are a pair")
