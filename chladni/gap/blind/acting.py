"""Whether a hidden law does in a machine what its word means: a loop that never opens is a spring."""

from collections.abc import Mapping, Sequence

import numpy as np

from chladni.gap.blind.excitation_draw import Drive
from chladni.gap.blind.performance import perform
from chladni.gap.blind.plan import Bench, Hidden

#: Of the way from end to end: a yield, half of it to either side, from which on part of a loop opens, since the first
#: of sliders in parallel gives way at a quarter of their mean; two periods of a ripple, from which on it's seen to
#: repeat, and before which it's a spring that bends.
_WAY: Mapping[str, tuple[str, float]] = {"hysteresis": ("yield", 1.0), "ripple": ("period", 2.0)}


def all_act(bench: Bench, numbers: Mapping[str, float], drive: Drive, effects: Sequence[Hidden], *,
            steps: int | None = None) -> bool:  # fmt: skip
    """Whether each hysteresis moves far enough to yield, and each ripple over two of its periods, with all effects.

    How far they would move without them says little: a loop itself holds a free axis, and teeth catch what is slow.
    """
    acting = [one for one in effects if one.effect in _WAY]
    if not acting:
        return True
    moved = perform(bench, numbers, drive, effects, steps=steps, watched=True)
    return all(_acts(one, float(np.ptp(moved[_displacement(bench, one.site)]))) for one in acting)


def _acts(one: Hidden, way: float) -> bool:
    """Whether an effect does what it's called over a way from end to end, m or rad."""
    number, times = _WAY[one.effect]
    return way > times * one.numbers[number]


def _displacement(bench: Bench, site: str) -> str:
    """Name of what `perform` watches there."""
    return f"{site}.x" if site in {one.name for one in bench.plan.inputs} else f"{site}.d"
