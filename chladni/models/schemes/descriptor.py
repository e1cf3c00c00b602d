"""Equations with derivatives of unknowns and inputs, reduced to ordinary ones."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.models.schemes.structural_inverse import structural_inverse, total
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.errors import ModelError
from chladni.signals.value import Value

# Of a row or column of unit size: below, an equation doesn't determine the unknown.
_RANK = 1e-11
# How much better an unknown that isn't preferred must be determined to be chosen.
_NOT_PREFERRED = 1e-4
# Each halves the logarithm of what sizes differ by.
_UNIT_ROUNDS = 8
#: Most derivatives of an input that are carried; nothing in use has more than a few.
MAX_POWER = 10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Descriptor(Value):
    """States x with equations of their own, and the rest r, some of it only determined by its sum with others.

    ::

        x'   = Xx x + Xr r + sum_k Xw[k] w^(k)
        E r' = Rx x + Rr r + sum_k Rw[k] w^(k)          E square, most often singular

    w are the inputs and w^(k) their derivatives; Xw and Rw are ``[power, row, input]`` with equally many powers.
    `preferred` says which of the rest should be eliminated before the others.
    """

    x_x: Real
    x_r: Real
    x_w: Real
    e: Real
    r_x: Real
    r_r: Real
    r_w: Real
    preferred: Mask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reduced(Value):
    """Ordinary equations: ``z' = A z + B w`` and ``r = C z + sum_k D[k] w^(k)``.

    Attributes
    ----------
    a, b, c
        ``[state, state]``, ``[state, input]``, ``[rest, state]``.
    d
        ``[power, rest, input]``; powers above 0 are what is improper.
    kept
        Which of the rest became states, behind those of x.
    """

    a: Real
    b: Real
    c: Real
    d: Real
    kept: tuple[int, ...]


def reduced(given: Descriptor) -> Reduced:
    """Eliminate every unknown of the rest that no equation gives a derivative of.

    Equations without derivatives are solved for as many unknowns; put into the others they leave a smaller system of
    the same form, until E is regular (the shuffle algorithm, Luenberger 1978, with elimination in place of
    differentiation wherever no derivative is needed).

    Raises
    ------
    ModelError
        When equations contradict each other or leave an unknown open.
    """
    size = given.e.shape[0]
    powers, _, inputs = given.x_w.shape
    recovery = _Recovery(
        from_x=np.zeros((size, given.x_x.shape[0])), from_r=np.eye(size), from_w=np.zeros((powers, size, inputs))
    )
    current, left = given, list(range(size))
    while current.e.shape[0]:
        current, recovery = _with_room(current, recovery)
        turned, rank = _rows_with_derivatives_first(current)
        if rank == current.e.shape[0]:
            # What's left has derivatives of its own: states, like those of a PD around an integrator.
            return _ordinary(turned, recovery, tuple(left))
        solution = _solved(turned, rank)
        recovery = _recovered(recovery, solution)
        current = _inserted(turned, rank, solution)
        left = [left[place] for place in solution.free]
    return _ordinary(current, recovery, ())


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Recovery(Value):
    """All of the original rest from x, from what is left of it, and from w."""

    from_x: Real
    from_r: Real
    from_w: Real


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Solution(Value):
    """``r[solved] = from_x x + from_r r[free] + sum_k from_w[k] w^(k)``."""

    solved: Whole
    free: Whole
    from_x: Real
    from_r: Real
    from_w: Real


def _rows_with_derivatives_first(given: Descriptor) -> tuple[Descriptor, int]:
    """Combine the rest's equations so that only the first `rank` have derivatives."""
    moving = np.flatnonzero(given.e.any(axis=1))
    still = np.setdiff1d(np.arange(given.e.shape[0]), moving)
    steps, rank = _elimination(given.e[moving])
    combine = np.zeros((given.e.shape[0],) * 2)
    combine[: moving.size, moving] = steps
    combine[np.arange(moving.size, given.e.shape[0]), still] = 1.0
    e = total((combine, given.e))
    e[rank:] = 0.0
    turned = replace(
        given, e=e, r_x=total((combine, given.r_x)), r_r=total((combine, given.r_r)), r_w=total((combine, given.r_w))
    )
    return turned, rank


def _elimination(e: Real) -> tuple[Real, int]:
    """Give the combinations of rows that leave `rank` independent ones first and zeros below, and the rank.

    Gauss's elimination with complete pivoting: unlike rotations it leaves rows alone that need no combining, and with
    them the zeros that say what has nothing to do with what.
    """
    row, column = _units(e)
    work, steps = row[:, None] * e * column, np.diag(row)
    for rank in range(e.shape[0]):
        size = np.abs(work[rank:])
        best = int(size.argmax())
        if size.flat[best] <= _RANK:
            return steps, rank
        pivot, unknown = rank + best // e.shape[1], best % e.shape[1]
        work[[rank, pivot]], steps[[rank, pivot]] = work[[pivot, rank]], steps[[pivot, rank]]
        share = np.where(np.arange(e.shape[0]) > rank, work[:, unknown] / work[rank, unknown], 0.0)[:, None]
        work, steps = total(work, (-share, work[rank : rank + 1])), total(steps, (-share, steps[rank : rank + 1]))
        work[rank + 1 :, unknown] = 0.0
    return steps, e.shape[0]


def _solved(given: Descriptor, rank: int) -> _Solution:
    """Solve the equations without derivatives for as many unknowns, preferred ones wherever they are determined."""
    from scipy.linalg import qr

    rows = given.r_r[rank:]
    row, column = _units(rows)
    weight = np.where(given.preferred, 1.0, _NOT_PREFERRED)
    triangle, pivoted = qr(row[:, None] * rows * (column * weight), mode="r", pivoting=True)
    if np.any(np.abs(np.diagonal(triangle)) < _RANK * _NOT_PREFERRED):
        raise ModelError("the equations do not determine every signal")
    order = np.asarray(pivoted, dtype=np.int64)
    solved, free = order[: rows.shape[0]], np.sort(order[rows.shape[0] :])
    inverse = structural_inverse(-rows[:, solved])
    return _Solution(
        solved=solved,
        free=free,
        from_x=total((inverse, given.r_x[rank:])),
        from_r=total((inverse, rows[:, free])),
        from_w=total((inverse, given.r_w[:, rank:])),
    )


def _recovered(before: _Recovery, solution: _Solution) -> _Recovery:
    # Unknowns solved earlier may depend on those that are solved now.
    put_in = before.from_r[:, solution.solved]
    return _Recovery(
        from_x=total(before.from_x, (put_in, solution.from_x)),
        from_r=total(before.from_r[:, solution.free], (put_in, solution.from_r)),
        from_w=total(before.from_w, (put_in, solution.from_w)),
    )


def _inserted(given: Descriptor, rank: int, solution: _Solution) -> Descriptor:
    """Put the solution into the equations of x and into those of the rest that have derivatives."""
    solved, free = solution.solved, solution.free
    of_x, moved, still = given.x_r[:, solved], given.e[:rank, solved], given.r_r[:rank, solved]
    x_x = total(given.x_x, (of_x, solution.from_x))
    x_r = total(given.x_r[:, free], (of_x, solution.from_r))
    x_w = total(given.x_w, (of_x, solution.from_w))
    # The derivative of what was solved for: that of x is known, that of the inputs goes one power up.
    through_x = -total((moved, solution.from_x))
    higher = np.roll(solution.from_w, 1, axis=0)
    return Descriptor(
        x_x=x_x,
        x_r=x_r,
        x_w=x_w,
        e=total(given.e[:rank, free], (moved, solution.from_r)),
        r_x=total(given.r_x[:rank], (still, solution.from_x), (through_x, x_x)),
        r_r=total(given.r_r[:rank, free], (still, solution.from_r), (through_x, x_r)),
        r_w=total(given.r_w[:, :rank], (still, solution.from_w), (through_x, x_w), (-moved, higher)),
        preferred=given.preferred[free],
    )


def _ordinary(given: Descriptor, recovery: _Recovery, kept: tuple[int, ...]) -> Reduced:
    """Equations of x and the kept rest, without derivatives of the inputs among them.

    With ``z = raw - sum_k T[k] w^(k)``, ``T[k-1] = B[k] + A T[k]`` takes every derivative out (Kailath 1980, section
    2.2).
    """
    lower = [np.linalg.solve(given.e, part) if kept else part for part in (given.r_x, given.r_r)]
    lower_w = np.linalg.solve(given.e, given.r_w) if kept else given.r_w
    a = np.block([[given.x_x, given.x_r], lower])
    raw = np.concatenate([given.x_w, lower_w], axis=1)
    # From the highest power down: each one taken out leaves a term in the power below.
    shift = np.zeros_like(raw)
    for power in range(raw.shape[0] - 1, 0, -1):
        shift[power - 1] = total(raw[power], (a, shift[power]))
    c = np.hstack([recovery.from_x, recovery.from_r])
    return Reduced(
        a=a,
        b=total(raw[0], (a, shift[0])),
        c=c,
        d=total(recovery.from_w, (c, shift)),
        kept=kept,
    )


def _with_room(given: Descriptor, recovery: _Recovery) -> tuple[Descriptor, _Recovery]:
    """Keep one empty power of the inputs' derivatives at the end, for the next elimination to fill."""
    used = [np.flatnonzero(w.any(axis=(1, 2))) for w in (given.x_w, given.r_w, recovery.from_w)]
    highest = max((int(powers[-1]) for powers in used if powers.size), default=0)
    if highest > MAX_POWER:
        raise ModelError(f"an input is differentiated more than {MAX_POWER} times")
    x_w, r_w, from_w = (_resized(w, highest + 2) for w in (given.x_w, given.r_w, recovery.from_w))
    return replace(given, x_w=x_w, r_w=r_w), replace(recovery, from_w=from_w)


def _resized(w: Real, powers: int) -> Real:
    return np.concatenate([w[:powers], np.zeros((max(0, powers - w.shape[0]), *w.shape[1:]))])


def _units(matrix: Real) -> tuple[Real, Real]:
    """Units of rows and columns that give each the largest entry 1, so that size doesn't hide rank (Ruiz 2001)."""
    row, column = np.ones(matrix.shape[0]), np.ones(matrix.shape[1])
    for _ in range(_UNIT_ROUNDS):
        scaled = np.abs(row[:, None] * matrix * column)
        for units, largest in ((row, scaled.max(axis=1, initial=0.0)), (column, scaled.max(axis=0, initial=0.0))):
            units /= np.sqrt(np.where(largest > 0, largest, 1.0))
    if not np.all(np.isfinite(row[:, None] * matrix * column)):
        raise ModelError("gains and time constants lie too far apart for floating point numbers")
    return row, column
