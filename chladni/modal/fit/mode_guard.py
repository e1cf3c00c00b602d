"""Modes that a refinement has lost: outside the lines, far from where they began, or run into another mode."""

import numpy as np

from chladni.modal.fit.model_lines import ModelLines
from chladni.signals.arrays import Complex, Real

# Distances of poles in units of decay rates, or of half a line where that is more. A mode further from its start
# answers another question than was asked; two modes nearer to each other are one that the data don't split.
LONGEST_WAY = 10.0
NEAREST = 0.02
# A decay rate below this share of the distance of lines hides between them: who began wider has met a line of noise.
NARROWEST = 0.02


def lost_mode(lines: ModelLines, began: Complex, poles: Complex, strength: Real) -> tuple[int, str] | None:
    """Find the mode that has most certainly been lost, and say why; None when all are where they should be.

    Parameters
    ----------
    lines
        That were fitted.
    began, poles
        ``[mode]`` poles before and after.
    strength
        ``[mode]`` what each mode adds to the functions; of two that have met, the weaker is lost.
    """
    low, high = lines.frequency_hz[[0, -1]]
    frequency_hz = np.abs(poles) / (2 * np.pi)
    for mode in np.flatnonzero((frequency_hz < low) | (frequency_hz > high)):
        return int(mode), f"{_named(began[mode])} left the band from {low:.6g} to {high:.6g} Hz"
    half_line = np.pi * float(np.median(np.diff(lines.frequency_hz))) if lines.frequency_hz.size > 1 else 0.0
    hidden = (-poles.real < NARROWEST * 2 * half_line) & (-began.real > half_line)
    for mode in np.flatnonzero(hidden):
        return int(mode), f"{_named(began[mode])} ran into a peak that is narrower than the lines can tell"
    seen = np.maximum(-poles.real, half_line)
    way = np.abs(poles - began) / np.maximum(seen, -began.real)
    for mode in np.flatnonzero(way > LONGEST_WAY):
        return int(mode), f"{_named(began[mode])} ran away to {frequency_hz[mode]:.6g} Hz"
    apart = np.abs(poles - poles[:, np.newaxis]) / np.minimum(seen, seen[:, np.newaxis])
    met = np.argwhere(np.triu(apart < NEAREST, k=1))
    for pair in met:
        weaker = int(pair[np.argmin(strength[pair])])
        other = int(pair[np.argmax(strength[pair])])
        return weaker, f"{_named(began[weaker])} ran into the one at {frequency_hz[other]:.6g} Hz"
    return None


def _named(pole: complex) -> str:
    return f"the mode at {abs(pole) / (2 * np.pi):.6g} Hz"
