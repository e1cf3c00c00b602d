"""Noise of joint readings, and what it makes of torques."""

from collections.abc import Sequence

import numpy as np
from scipy.signal import welch

from chladni.signals.arrays import Real

#: Of the band: from here on a joint doesn't move, and what is there is noise.
_ABOVE = 0.6
_LINES = 64


def steps_and_noise(values: Real, sample_rate_hz: float, stretches: Sequence[tuple[int, int]]) -> tuple[Real, Real]:
    """Give the step of each row of ``[row, sample]`` (0 where none shows), and its noise's density, unit^2/Hz.

    The density is that of the upper part of the band, and at least that of rounding to the step.
    """
    a, b = max(stretches, key=lambda one: one[1] - one[0])
    steps = np.array([_step(row) for row in values])
    lines, density = welch(values[:, a:b], sample_rate_hz, nperseg=min(_LINES, b - a), axis=-1)
    upper = np.median(density[:, lines > _ABOVE * sample_rate_hz / 2.0], axis=-1)
    return steps, np.maximum(upper, steps**2 / 12.0 / (sample_rate_hz / 2.0))


def _step(row: Real) -> float:
    """Least distance of two values, when all distances are about whole multiples of it."""
    values = np.unique(row)
    apart = np.diff(values)
    if not apart.size or values.size > row.size / 4:
        return 0.0
    return float(np.median(apart[apart <= 1.5 * np.min(apart[apart > 1e-3 * np.median(apart)])]))


def torque_noise(density: Real, cutoff_hz: float, *, stiffness: Real, damping: Real, inertia: Real) -> Real:
    """Give ``[joint]``: variance of the torque that noise of the positions seems to need below a cutoff.

    Of stiffness (the servos') and damping at the joints, and of the inertia ``[joint, joint]`` by which each feels
    the others: |k + i w d - w^2 m|^2 times the densities.
    """
    omega = 2.0 * np.pi * np.linspace(0.0, cutoff_hz, _LINES)
    own = np.abs(stiffness[:, None] + 1j * omega * damping[:, None] - omega**2 * np.diag(inertia)[:, None]) ** 2
    others = (inertia - np.diag(np.diag(inertia))) ** 2 @ density * float(np.mean(omega**4))
    return np.asarray((density * np.mean(own, axis=1) + others) * cutoff_hz)
