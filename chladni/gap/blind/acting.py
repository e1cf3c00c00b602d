"""Whether a hidden law does in a machine what its word means: a loop that never opens is a spring."""

from collections.abc import Mapping, Sequence

import numpy as np

from chladni.gap.blind.excitation_draw import Drive
from chladni.gap.blind.performance import perform
from chladni.gap.blind.plan import Bench, Hidden

#: Half of the way over the yield displacement, from which on part of a loop opens: the first of sliders in parallel
#: gives way at a quarter of their mean.
_OPENS = 0.5


def loops_open(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden], *,
               steps: int | None = None) -> bool:  # fmt: skip
    """Whether the joint of each hysteresis moves far enough to yield, with all effects there.

    How far it would move without them says little: on a free axis the loop itself holds it.
    """
    loops = [one for one in effects if one.effect == "hysteresis"]
    if not loops:
        return True
    moved = perform(bench, numbers, drive, effects, steps=steps, watched=True)
    return all(0.5 * np.ptp(moved[f"{one.site}.d"]) > _OPENS * one.numbers["yield"] for one in loops)
