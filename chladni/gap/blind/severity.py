"""Gives a hidden effect the size that moves the outputs by what was asked for."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray

from chladni.gap.blind.draft import Draft, Scene
from chladni.gap.blind.excitation_draw import Drive
from chladni.gap.blind.hidden_signals import ON_SAMPLES, on_samples
from chladni.gap.blind.performance import measured, perform, pooled_change
from chladni.gap.blind.plan import Hidden
from chladni.signals.errors import EstimateError

Matrix = NDArray[np.float64]
_TRIES, _CLOSE = 9, 1.12
#: Steps a sample while the size is searched for; what is kept is simulated finer.
SEARCH_STEPS = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Sized:
    """An effect of a size, and how far it moves the outputs (pooled RMS over each output's own)."""

    hidden: Hidden
    change: float


def converted(outputs: Mapping[str, Matrix], effects: tuple[Hidden, ...], names: list[str]) -> dict[str, Matrix]:
    """Give samples behind the converters of the sensors."""
    behind = {name: outputs[name] for name in names}
    for hidden in effects:
        if hidden.law in ON_SAMPLES:
            behind[hidden.site] = on_samples(hidden, behind[hidden.site])
    return behind


def sized(draft: Draft, scene: Scene, drive: Drive, clean: Mapping[str, Matrix], target: float) -> Sized | None:
    """Search the size at which the effect moves the outputs by `target`; None when no size does.

    Parameters
    ----------
    clean
        Outputs without the effect.
    target
        Pooled RMS change over each output's own RMS.
    """
    names = measured(scene.bench)
    size, nearest = min(max(1.0, draft.least), draft.most), None
    for _ in range(_TRIES):
        found = _tried(draft.hidden(size), scene, drive, clean, names)
        if found is None:
            size = max(draft.least, 0.3 * size)
            continue
        if nearest is None or abs(log(found.change / target)) < abs(log(nearest.change / target)):
            nearest = found
        if 1 / _CLOSE < found.change / target < _CLOSE:
            break
        # Most changes grow about in proportion; a step too far is taken back by the next.
        wanted = min(max(size * (target / found.change) ** 0.9, draft.least), draft.most)
        if wanted == size:
            break
        size = wanted
    return nearest


def _tried(hidden: Hidden, scene: Scene, drive: Drive, clean: Mapping[str, Matrix], names: list[str]) -> Sized | None:
    try:
        moved = clean if hidden.law in ON_SAMPLES else perform(
            scene.bench, scene.numbers, drive, (hidden,), steps=SEARCH_STEPS
        )  # fmt: skip
    except EstimateError:
        return None
    change = pooled_change(scene.bench, clean, converted(moved, (hidden,), names))
    return Sized(hidden=hidden, change=change) if np.isfinite(change) and change > 0 else None
