"""Coarse steps of a sensor, seen in its samples themselves: they stand on a lattice."""

from dataclasses import dataclass

import numpy as np

from chladni.signals.arrays import Real

#: ``abs(mean exp(2 pi i y/step))`` of a signal without steps stays far below; of a quantised one it's near 1.
_CLEAR = 0.9
_BINS = 1 << 16
#: Samples away from the level where most stand that are needed to see a lattice, and where all values repeat; levels
#: that they stand on.
_MOVING, _LEAVING, _LEVELS = 200, 20, 2
#: Different values over samples, below which values repeat.
_REPEATED = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Lattice:
    """Steps found in a signal: their size, and how sharply the samples stand on them, 0 to 1."""

    step: float
    strength: float

    @property
    def rounding_rms(self) -> float:
        """RMS of the rounding, ``step/sqrt(12)`` (Widrow and Kollar, equation 1.6)."""
        return self.step / float(np.sqrt(12.0))


def lattice_of(signal: Real) -> Lattice | None:
    """Find the step of a quantised signal, None when its samples stand on no lattice.

    The transform of the histogram has a peak at the inverse of the step (Widrow and Kollar, *Quantization Noise*,
    section 4.2: the characteristic function repeats).
    """
    low, high = float(np.min(signal)), float(np.max(signal))
    if high <= low:
        return None
    counts = np.histogram(signal, bins=_BINS, range=(low, high))[0]
    strength = np.abs(np.fft.rfft(counts)) / signal.size
    span = high - low
    # A step shows only when it's small against the signal: below some ten steps the shape of the signal is seen.
    first = 6
    usable = strength[first : _BINS // 16]
    if not usable.size:
        return None
    # Multiples of the inverse step are peaks too: the first that is nearly as high as the highest is the step's.
    high_enough = np.flatnonzero(usable > max(_CLEAR * float(usable.max()), 0.5))
    if not high_enough.size:
        return None
    place = first + int(high_enough[0])
    step, sharp = _sharpened(signal, span / place, span)
    step = _coarsest(signal, step)
    if sharp < _CLEAR or _mostly_still(signal, step):
        return None
    return Lattice(step=step, strength=sharp)


def _coarsest(signal: Real, step: float) -> float:
    """Largest multiple of a step on which the samples stand too: steps that the signal spans a few times only."""
    longest, middle = float(np.ptp(signal)), float(np.median(signal))
    # Those that stand where most do stand on every multiple.
    moving = signal[np.abs(signal - middle) > 0.5 * step]
    for factor in (2, 3, 5):
        while (
            factor * step < longest and min(_stands(one, factor * step, middle) for one in (signal, moving)) > _CLEAR
        ):
            step *= factor
    return step


def _stands(signal: Real, step: float, level: float) -> float:
    """How sharply samples stand on the lattice of a level, 1 when all do; of no samples 0."""
    return float(np.mean(np.cos(2.0 * np.pi * (signal - level) / step))) if signal.size else 0.0


def _mostly_still(signal: Real, step: float) -> bool:
    """Whether the samples seem to stand on a lattice because most of them stand at one level."""
    middle = float(np.median(signal))
    # A signal that repeats its values exactly has steps, however few; one that doesn't may rest beside a jump.
    repeats = np.unique(signal).size < _REPEATED * signal.size
    moving = signal[np.abs(signal - middle) > (0.5 if repeats else 1.5) * step]
    if moving.size < (_LEAVING if repeats else _MOVING) or np.unique(moving).size < _LEVELS:
        return True
    return _stands(moving, step, middle) < _CLEAR


def _sharpened(signal: Real, step: float, span: float) -> tuple[float, float]:
    """Search the step around a peak of the histogram's transform, whose lines are 1/span apart."""
    best_step, best = step, 0.0
    width = 1.0 / span
    centre = 1.0 / step
    for _ in range(4):
        inverses = np.linspace(centre - width, centre + width, 41)
        found = np.abs([np.mean(np.exp(2j * np.pi * one * signal)) for one in inverses])
        place = int(np.argmax(found))
        centre, best = float(inverses[place]), float(found[place])
        best_step = 1.0 / centre
        width /= 10.0
    return best_step, best
