"""Loops of a scheme, and whether those without any lag determine their signals."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import ModelError

# Smallest singular value of I - D K, balanced, over the largest or over 1: below, rounding decides.
_SINGULAR = 1e-12


def loops_of(blocks: Real, *, through: Mask | None = None) -> list[list[int]]:
    """Give groups of blocks that lie on common loops, each group once.

    Parameters
    ----------
    blocks
        ``[block, block]``: entry [i, j] isn't zero when block j feeds block i.
    through
        ``[block]``: only loops through these blocks alone are wanted; all blocks by default.
    """
    links = blocks != 0
    if through is not None:
        links = links & through[:, None] & through[None, :]
    return [list(group) for group in _groups(links.tobytes(), len(links))]


# Which block feeds which stays as it is while numbers change, and is asked several times for each setting.
@lru_cache(maxsize=64)
def _groups(pattern: bytes, count: int) -> tuple[tuple[int, ...], ...]:
    from scipy.sparse.csgraph import connected_components

    links = np.frombuffer(pattern, dtype=bool).reshape(count, count)
    # Strongly connected blocks: each reaches every other one, which is what a common loop means.
    _, label = connected_components(links, directed=True, connection="strong")
    groups = [tuple(int(place) for place in np.flatnonzero(label == group)) for group in np.unique(label)]
    return tuple(group for group in groups if len(group) > 1 or links[group[0], group[0]])


def require_well_posed(direct: Real, blocks: Real, names: Sequence[str]) -> None:
    """Raise `ModelError` when a loop without lag has the gain one, so that its signals aren't determined.

    Parameters
    ----------
    direct
        ``[block]``: D, what each block gives on at once.
    blocks
        K, see `Wiring`.
    names
        Of the blocks.

    Notes
    -----
    The loop is well-posed when I - D K is regular (Zhou, Doyle & Glover 1996, lemma 5.1). Signals of very different
    size would hide that; a diagonal change of units, which doesn't change the loops, takes the difference out.
    """
    from scipy.linalg import matrix_balance

    for group in loops_of(blocks, through=direct != 0):
        gains = direct[group][:, None] * blocks[np.ix_(group, group)]
        balanced, _ = matrix_balance(gains, permute=False)
        sizes = np.linalg.svd(np.eye(len(group)) - balanced, compute_uv=False)
        if sizes[-1] <= _SINGULAR * max(1.0, float(sizes[0])):
            told = " -> ".join(names[place] for place in group[:20])
            raise ModelError(
                f"the loop of {told} has gain one and no lag, so that its signals are not determined: "
                "change a gain or sign, or put a lag such as pt1 into the loop (a dead time alone is not enough)"
            )
