"""The resonator that answers one signal with another, from their spectra."""

from collections.abc import Iterator

import numpy as np

from chladni.models.effects.trial import Shape
from chladni.signals.arrays import Complex, Real

#: Damping ratios that are believed, lines that are enough, and steps.
_DAMPING, _LINES, _STEPS = (1e-3, 0.2), 20, 8


def resonances(
    answer: Complex, drive: Complex, weight: Real, frequency_hz: Real, band_hz: tuple[float, float]
) -> Iterator[Shape]:
    """Give logarithms of frequency in Hz and damping ratio, step by step nearer.

    Of ``answer (s^2 + c1 s + c0) = drive (b1 s + b0) + t1 s + t0`` by least squares, each time divided by the
    denominator found before (Sanathanan and Koerner, IEEE Transactions on Automatic Control 8, 1963); t is what
    swings at the start of the record and still at its end. A grid would step over a resonance that is lightly damped.

    Parameters
    ----------
    answer, drive
        ``[line]`` spectra of the same record.
    weight
        ``[line]`` 0 to 1, how far the answer is to be believed.
    frequency_hz
        ``[line]``.
    band_hz
        In which both are compared; a resonance may lie outside.
    """
    inside = (frequency_hz > band_hz[0]) & (frequency_hz < band_hz[1])
    if np.count_nonzero(inside) < _LINES:
        return
    # Numbers near one: the square of a frequency beside a constant loses digits.
    s = 1j * frequency_hz[inside] / band_hz[1]
    y, u, believed = answer[inside], drive[inside], weight[inside]
    columns = np.stack([-y * s, -y, u * s, u, s, np.ones_like(s)])
    denominator = np.ones(s.size, dtype=np.complex128)
    for _ in range(_STEPS):
        c1, c0 = _least_squares(columns * (believed / denominator), y * s**2 * (believed / denominator))[:2]
        denominator = np.asarray(s**2 + c1 * s + c0, dtype=np.complex128)
        if c0 > 0:
            frequency = float(np.sqrt(c0))
            damping = float(np.clip(c1 / (2 * frequency), *_DAMPING))
            yield (float(np.log(frequency * band_hz[1])), float(np.log(damping)))


def _least_squares(columns: Complex, target: Complex) -> Real:
    """Real factors of complex columns ``[number, line]``."""
    real = np.hstack([columns.real, columns.imag])
    size = np.maximum(np.linalg.norm(real, axis=1), 1e-300)
    found = np.linalg.lstsq((real / size[:, None]).T, np.hstack([target.real, target.imag]), rcond=1e-10)[0]
    return np.asarray(found / size, dtype=np.float64)
