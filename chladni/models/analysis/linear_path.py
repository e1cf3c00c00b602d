"""The linear way from one input of a system to its outputs, in states whose numbers are of like size."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import log2
from typing import Self

import numpy as np

from chladni.models.core.balance import balance
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.core.port import Terminal
from chladni.models.core.state_space import StateSpace
from chladni.signals.arrays import Complex, Index, Mask, Real
from chladni.signals.errors import ModelError
from chladni.signals.value import Value

System = StateSpace | CompiledModel | Model

# An eigenvalue this much smaller than the largest is the rounding error of an integrator.
INTEGRATOR = 1e-9
ROUNDING = 1e-14
# A response is back at zero when this little is left of the parts that cancel.
RESTS = 1e-9
_RATES = {"m": "m/s", "m/s": "m/s^2", "rad": "rad/s", "rad/s": "rad/s^2"}
_MOTIONS = {rate: motion for motion, rate in _RATES.items()}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearPath(Value):
    """``x' = A x + b u(t - dead time)``, ``y = C x + d u(t - dead time)`` from one input.

    States that the input doesn't reach or the outputs don't see are left out: they have no part in any response. The
    others are scaled, since pressures in Pa beside strokes in m would cost the digits of a matrix exponential.

    Attributes
    ----------
    a, b, c, d
        ``[state, state]``, ``[state]``, ``[output, state]``, ``[output]``.
    poles
        ``[state]`` in rad/s, those of slowest decay first; of an integrator exactly 0.
    dead_time_s
        ``[output]``: of the input and the clock of the output together.
    source, outputs
        Terminals.
    kept, scale
        Which of the system's states `a` has, and the factor from scaled states to theirs, ``[state]``.
    looped
        Whether a dead time acts inside one of the system's loops: A, b, C, d and poles are then those without it.
    exact
        The system, when only its own frequency response is exact: dead time inside a loop, ideal derivatives.
    """

    a: Real
    b: Real
    c: Real
    d: Real
    poles: Complex
    dead_time_s: Real
    source: Terminal
    outputs: tuple[Terminal, ...]
    kept: Index
    scale: Real
    looped: bool = False
    exact: CompiledModel | None = None

    def __post_init__(self) -> None:
        self._freeze()

    def to(self, output: str) -> Self:
        """Give the way to one output; `ModelError` naming those there are when it's missing."""
        row = index_of(self.outputs, output, "output")
        seen = _reached(self.a.T != 0, self.c[row] != 0)
        return type(self)(
            a=self.a[np.ix_(seen, seen)],
            b=self.b[seen],
            c=self.c[row : row + 1, seen],
            d=self.d[row : row + 1],
            poles=self.poles if seen.size == self.b.size else poles_of(self.a[np.ix_(seen, seen)]),
            dead_time_s=self.dead_time_s[row : row + 1],
            source=self.source,
            outputs=(self.outputs[row],),
            kept=self.kept[seen],
            scale=self.scale[seen],
            looped=self.looped,
            exact=self.exact,
        )

    def seen_by(self, outputs: Collection[str]) -> Self:
        """Give the way to some of the outputs, with all states; unlike those of `to` they are the same for any."""
        rows = [row for row, output in enumerate(self.outputs) if output.name in outputs]
        return replace(
            self,
            c=self.c[rows],
            d=self.d[rows],
            dead_time_s=self.dead_time_s[rows],
            outputs=tuple(self.outputs[row] for row in rows),
        )

    def rate(self) -> Self | None:
        """Give the way to the rate of the one output; None when the input passes directly, so that the rate jumps."""
        if self.d[0]:
            return None
        # Sums of which only rounding is left are zero: an integrator's state must not stay visible by 1e-17 of it.
        row, size = self.c[0] @ self.a, np.abs(self.c[0]) @ np.abs(self.a)
        row = np.where(np.abs(row) <= ROUNDING * size, 0.0, row)
        terminal = Terminal(name=self.outputs[0].name, unit=rate_unit(self.outputs[0].unit))
        path = replace(self, c=row[None], d=np.array([self.c[0] @ self.b]), outputs=(terminal,), exact=None)
        return path.to(terminal.name)

    def dies_out(self) -> bool:
        """Whether the one output is a rate of a motion that is back at zero long after a step."""
        if self.outputs[0].unit not in _MOTIONS or self.looped or self.integrators() or not self.b.size:
            return False
        row = np.linalg.solve(self.a.T, self.c[0])
        # By norms, since the states are of like size: what is left of a sum of one term has none to be small beside.
        size = abs(self.d[0]) + np.linalg.norm(row) * np.linalg.norm(self.b)
        return bool(abs(self.d[0] - row @ self.b) <= RESTS * size)

    def integral(self) -> Self:
        """Give the way to the motion whose rate the one output is, for an output that dies out.

        ::

            H(s) = c (s I - A)^-1 b + d = s c A^-1 (s I - A)^-1 b + H(0)

        so that for H(0) = 0 the integral is seen by c A^-1, without a further state.
        """
        terminal = Terminal(name=self.outputs[0].name, unit=_MOTIONS[self.outputs[0].unit])
        row = np.linalg.solve(self.a.T, self.c[0])
        return replace(self, c=row[None], d=np.zeros(1), outputs=(terminal,), exact=None)

    def final_value(self) -> float:
        """Value of the one output long after a unit step, without poles at the origin: ``d - c A^-1 b``."""
        return float(self.d[0] - (self.c[0] @ np.linalg.solve(self.a, self.b) if self.b.size else 0.0))

    def integrators(self) -> int:
        """Poles at the origin."""
        return int(np.count_nonzero(self.poles == 0))

    def stable(self) -> bool:
        """Whether every pole but those at the origin decays."""
        return bool(np.all(self.poles[self.poles != 0].real < 0))


def linear_path(system: System, *, from_input: str = "", to_outputs: Sequence[str] = ()) -> LinearPath:
    """Take the linear way from one input to outputs out of a system; laws and sample maps are left out.

    Parameters
    ----------
    system
        State space, compiled model or model.
    from_input
        Name; the first input when empty.
    to_outputs
        Names; all outputs when empty.

    Raises
    ------
    ModelError
        For an unknown name, a system without inputs or outputs, and an input whose derivatives act too.
    """
    compiled = compiled_model(system)
    state_space = compiled.state_space() if isinstance(compiled, CompiledModel) else compiled
    if not state_space.inputs or not state_space.outputs:
        raise ModelError("a system without inputs or without outputs has no response; declare one of each")
    column = state_space.input_index(from_input) if from_input else 0
    rows = [state_space.output_index(name) for name in to_outputs] or list(range(len(state_space.outputs)))
    kept = _reached(state_space.a != 0, state_space.b[:, column] != 0)
    scaled, scale = _balanced(state_space.a[np.ix_(kept, kept)], state_space.b[kept, column])
    return LinearPath(
        a=scaled,
        b=state_space.b[kept, column] / scale,
        c=state_space.c[rows][:, kept] * scale,
        d=state_space.d[rows, column],
        poles=poles_of(scaled),
        dead_time_s=_dead_time_s(compiled, column)[rows],
        source=state_space.inputs[column],
        outputs=tuple(state_space.outputs[row] for row in rows),
        kept=kept,
        scale=scale,
        looped=isinstance(compiled, CompiledModel) and bool(compiled.delays),
        exact=compiled if isinstance(compiled, CompiledModel) and (compiled.delays or compiled.derivatives) else None,
    )


def compiled_model(system: System) -> CompiledModel | StateSpace:
    """Give the equations of a system: a model is compiled, the others are equations already."""
    return system if isinstance(system, (StateSpace, CompiledModel)) else system.compile()


def poles_of(a: Real) -> Complex:
    """Eigenvalues in rad/s, those of slowest decay first; rounding errors about the origin are made exactly 0."""
    if not a.size:
        return np.empty(0, np.complex128)
    found = np.linalg.eigvals(a).astype(np.complex128)
    found[np.abs(found) <= INTEGRATOR * np.abs(found).max()] = 0
    return np.asarray(found[np.lexsort((found.imag, -found.real))], dtype=np.complex128)


def rate_unit(unit: str) -> str:
    """Give the unit of a signal's rate.

    Examples
    --------
    >>> rate_unit("m/s"), rate_unit("Pa")
    ('m/s^2', '(Pa)/s')
    """
    return _RATES.get(unit, f"({unit})/s")


def index_of(terminals: Sequence[Terminal], name: str, what: str) -> int:
    """Place of the named terminal, 0 for an empty name; `ModelError` naming those there are when it's missing."""
    names = [terminal.name for terminal in terminals]
    if name and name not in names:
        raise ModelError(f"no {what} {name!r}; {what}s: {', '.join(names)}")
    return names.index(name) if name else 0


def _reached(links: Mask, start: Mask) -> Index:
    """States that are reached from `start` along ``links[to, from]``."""
    reached = start
    for _ in range(len(start)):
        further = reached | (links @ reached)
        if np.array_equal(further, reached):
            break
        reached = further
    return np.flatnonzero(reached)


def _balanced(a: Real, b: Real) -> tuple[Real, Real]:
    if not a.size:
        return a, np.ones(0)
    scaled, scale = balance(a)
    # The exponential of [A b; 0 0] is exact beside its largest entry, which must not be that of b alone.
    entry, size = float(np.abs(b / scale).max()), float(np.abs(scaled).max())
    # Apart, since the quotient of a tiny and a huge number is nothing.
    common = 2.0 ** round(log2(entry) - log2(size)) if entry > 0 and size > 0 else 1.0
    return scaled, np.asarray(scale * common)


def _dead_time_s(compiled: CompiledModel | StateSpace, column: int) -> Real:
    if isinstance(compiled, StateSpace):
        return np.zeros(len(compiled.outputs))
    return compiled.input_delays_s[column] + np.asarray(compiled.output_offsets_s)
