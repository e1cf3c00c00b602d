"""From blocks and sums to ordinary equations of the whole scheme."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chladni.models.elements.element import Element
from chladni.models.elements.realization import Realization, realize
from chladni.models.schemes.block import Block
from chladni.models.schemes.descriptor import Descriptor, Reduced, reduced
from chladni.models.schemes.loops import loops_of, require_well_posed
from chladni.models.schemes.structural_inverse import total
from chladni.signals.arrays import Real
from chladni.signals.errors import ModelError


def realization_of(block: Block) -> Realization:
    """State space of what the block does now, with its polynomial part; the dead time is left out."""
    acting = block.acting
    if isinstance(acting, Element):
        return realize(acting.transfer)
    return Realization(a=acting.a, b=acting.b[:, 0], c=acting.c[0], q=acting.d[0])


def delay_of(block: Block) -> float:
    """Dead time of what the block does now, in seconds."""
    return block.acting.transfer.delay_s if isinstance(block.acting, Element) else 0.0


def solved_equations(blocks: Sequence[Block], between: Real, columns: Real) -> tuple[Reduced, tuple[str, ...]]:
    """Close all loops; rows of the rest are what leaves each block before its dead time.

    Parameters
    ----------
    blocks
        With their dead times left out.
    between
        K, see `Wiring`.
    columns
        ``[block, column]``: what each column of w adds to what goes into each block.

    Returns
    -------
    equations
        One power of D when every signal is proper.
    states
        Name of each state: ``plant.x1``, and ``regulator.derivative1`` where a block differentiates.

    Raises
    ------
    ModelError
        When a loop's signals are not determined; names its blocks.
    """
    forms = [realization_of(block) for block in blocks]
    names = [block.name for block in blocks]
    improper = [form.q.size > 1 for form in forms]
    # Where a block of the loop differentiates, what it gives on at once doesn't decide alone.
    differentiated = {place for group in loops_of(between) if any(improper[one] for one in group) for place in group}
    direct = np.array([0.0 if place in differentiated else form.q[0] for place, form in enumerate(forms)])
    require_well_posed(direct, between, names)
    try:
        solution = reduced(_descriptor(forms, between, columns))
    except ModelError as error:
        # The plain reason, where there is one: a loop inside the others that has gain one at once.
        require_well_posed(np.array([form.q[0] * (form.q.size == 1) for form in forms]), between, names)
        raise ModelError(f"{_loops_with(improper, between, names)}: {error}; change a gain, or add a lag") from None
    states = [
        f"{name}.x{number + 1}" for name, form in zip(names, forms, strict=True) for number in range(form.b.size)
    ]
    rest = _rest_names(names, forms)
    left = replace(solution, c=solution.c[-len(blocks) :], d=_without_empty_powers(solution.d[:, -len(blocks) :]))
    return left, (*states, *(rest[place] for place in solution.kept))


def _descriptor(forms: Sequence[Realization], between: Real, columns: Real) -> Descriptor:
    """Rest r: derivatives p of what goes into improper blocks, then y.

    ::

        x' = A x + B (K y + N w)
        (K y + N w)' = p_1,  p_k' = p_(k+1)      for each improper block
        0  = C x + Q p + (D K - 1) y + D N w
    """
    count, orders = len(forms), [form.q.size - 1 for form in forms]
    extra = sum(orders)
    # Block that each derivative belongs to.
    owner = np.repeat(np.arange(count), orders)
    first = np.array([place == 0 or owner[place] != owner[place - 1] for place in range(extra)], dtype=bool)
    b = _stacked([form.b for form in forms])
    c = _stacked([form.c for form in forms]).T
    direct = np.array([form.q[0] for form in forms])
    e = np.zeros((extra + count,) * 2)
    r_r, r_w = np.zeros_like(e), np.zeros((2, extra + count, columns.shape[1]))
    # Rows of derivatives: the first of a block's says what it differentiates, the others follow each other.
    for place in range(extra):
        if first[place]:
            e[place, extra:] = between[owner[place]]
            r_w[1, place] = -columns[owner[place]]
        else:
            e[place, place - 1] = 1.0
        r_r[place, place] = 1.0
    r_r[extra + owner, np.arange(extra)] = [q for form in forms for q in form.q[1:]]
    r_r[extra:, extra:] = total(direct[:, None] * between, -np.eye(count))
    r_w[0, extra:] = direct[:, None] * columns
    a = _block_diagonal([form.a for form in forms])
    x_w = np.zeros((2, b.shape[0], columns.shape[1]))
    x_w[0] = b @ columns
    return Descriptor(
        x_x=a,
        x_r=np.hstack([np.zeros((b.shape[0], extra)), b @ between]),
        x_w=x_w,
        e=e,
        r_x=np.vstack([np.zeros((extra, b.shape[0])), c]),
        r_r=r_r,
        r_w=r_w,
        preferred=np.arange(extra + count) >= extra,
    )


def _stacked(vectors: Sequence[Real]) -> Real:
    """``[state, block]``: each block's vector in its own column."""
    matrix = np.zeros((sum(vector.size for vector in vectors), len(vectors)))
    row = 0
    for column, vector in enumerate(vectors):
        matrix[row : row + vector.size, column] = vector
        row += vector.size
    return matrix


def _block_diagonal(parts: Sequence[Real]) -> Real:
    # As SciPy's `block_diag`, which looks at every array for so long that a scheme of many blocks waits for it.
    matrix = np.zeros((sum(len(part) for part in parts),) * 2)
    first = 0
    for part in parts:
        matrix[first : first + len(part), first : first + len(part)] = part
        first += len(part)
    return matrix


def _rest_names(names: Sequence[str], forms: Sequence[Realization]) -> list[str]:
    derivatives = [
        f"{name}.derivative{power}"
        for name, form in zip(names, forms, strict=True)
        for power in range(1, form.q.size)
    ]
    return [*derivatives, *(f"{name}.output" for name in names)]


def _without_empty_powers(d: Real) -> Real:
    # An empty power costs lags and ports further on.
    used = np.flatnonzero(d.reshape(d.shape[0], -1).any(axis=1))
    return d[: max(1, int(used[-1]) + 1 if used.size else 1)]


def _loops_with(improper: Sequence[bool], between: Real, names: Sequence[str]) -> str:
    groups = [group for group in loops_of(between) if any(improper[place] for place in group)]
    told = ["loop of " + ", ".join(names[place] for place in group[:20]) for group in groups]
    return "; ".join(told[:5]) or "scheme"
