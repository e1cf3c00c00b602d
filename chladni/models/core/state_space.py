"""Linear time-invariant systems in state space, with named inputs and outputs."""

from dataclasses import dataclass
from math import pi

import numpy as np

from chladni.models.core.port import Terminal
from chladni.models.core.resolvent import resolvent
from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StateSpace(Value):
    """``x' = A x + B u``, ``y = C x + D u``.

    Attributes
    ----------
    a, b, c, d
        ``[state, state]``, ``[state, input]``, ``[output, state]``, ``[output, input]``.
    inputs, outputs
        One for each column of `b` and row of `c`.
    states
        Name of each state.

    Raises
    ------
    ModelError
        When shapes don't fit or an entry is not finite.
    """

    a: Real
    b: Real
    c: Real
    d: Real
    inputs: tuple[Terminal, ...]
    outputs: tuple[Terminal, ...]
    states: tuple[str, ...]

    def __post_init__(self) -> None:
        n, m, p = len(self.states), len(self.inputs), len(self.outputs)
        for name, matrix, shape in (
            ("a", self.a, (n, n)),
            ("b", self.b, (n, m)),
            ("c", self.c, (p, n)),
            ("d", self.d, (p, m)),
        ):
            if matrix.shape != shape:
                raise ModelError(f"state space: {name} has shape {matrix.shape}, {shape} was expected")
            if not np.all(np.isfinite(matrix)):
                raise ModelError(f"state space: {name} holds a number that is not finite")
        self._freeze()

    def poles(self) -> Complex:
        """Eigenvalues of A in rad/s, those of slowest decay first."""
        found = np.linalg.eigvals(self.a).astype(np.complex128) if len(self.states) else np.empty(0, np.complex128)
        return np.asarray(found[np.argsort(-found.real, kind="stable")], dtype=np.complex128)

    def frequency_response(self, frequency_hz: Real) -> Complex:
        """``H(j omega) = C (j omega I - A)^-1 B + D``, ``[output, input, frequency]``; e^{+j omega t}."""
        s = np.asarray(2j * pi * np.asarray(frequency_hz, dtype=np.float64), dtype=np.complex128)
        found = self.c @ resolvent(self.a, s) @ self.b + self.d
        return np.moveaxis(np.asarray(found, dtype=np.complex128), 0, -1)

    def input_index(self, name: str) -> int:
        """Column of the named input; `ModelError` naming those there are when it's missing."""
        return _find(self.inputs, name, "input")

    def output_index(self, name: str) -> int:
        """Row of the named output; `ModelError` naming those there are when it's missing."""
        return _find(self.outputs, name, "output")


def _find(terminals: tuple[Terminal, ...], name: str, what: str) -> int:
    for place, terminal in enumerate(terminals):
        if terminal.name == name:
            return place
    raise ModelError(f"no {what} {name!r}; {what}s: {', '.join(terminal.name for terminal in terminals)}")
