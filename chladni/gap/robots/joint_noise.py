"""Noise of joint readings, and what it makes of torques."""

from collections.abc import Sequence
from functools import cache

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
    steps = np.array([_step(row) for row in values])
    upper = upper_density(values, sample_rate_hz, stretches, sample_rate_hz)
    return steps, np.maximum(upper, steps**2 / 12.0 / (sample_rate_hz / 2.0))


def upper_density(
    values: Real, sample_rate_hz: float, stretches: Sequence[tuple[int, int]], own_rate_hz: float
) -> Real:
    """Give the density of ``[row, sample]`` in the upper part of the band, unit^2/Hz.

    Parameters
    ----------
    own_rate_hz
        At which they were sampled before they came to this grid: beyond its band there is nothing.
    """
    a, b = max(stretches, key=lambda one: one[1] - one[0])
    lines, density = welch(values[:, a:b], sample_rate_hz, nperseg=min(_LINES, b - a), axis=-1)
    band_hz = min(sample_rate_hz, own_rate_hz) / 2.0
    # The line at the band's end may hold but half of what the others do.
    return np.asarray(np.median(density[:, (lines > _ABOVE * band_hz) & (lines <= band_hz)], axis=-1))


def _step(row: Real) -> float:
    """Least distance of two values, when all distances are about whole multiples of it."""
    values = np.unique(row)
    apart = np.diff(values)
    if not apart.size or values.size > row.size / 4:
        return 0.0
    return float(np.median(apart[apart <= 1.5 * np.min(apart[apart > 1e-3 * np.median(apart)])]))


def torque_noise(density: Real, cutoff_hz: float, *, stiffness: Real, damping: Real, inertia: Real) -> Real:
    """Give ``[joint]``: variance of the torque that noise of the positions seems to need below a cutoff.

    Of stiffness (the servos') and damping at the joints, and of the inertia ``[joint, joint, pose]`` by which each
    feels all of them: |k + i w d - w^2 m|^2 times the densities.
    """
    squared, fourth = _mean_powers(cutoff_hz)
    own = np.mean(np.diagonal(inertia), axis=0)
    gain = stiffness**2 + (damping**2 - 2.0 * stiffness * own) * squared
    return np.asarray((density * gain + fourth * np.mean(inertia**2, axis=2) @ density) * cutoff_hz)


@cache
def _mean_powers(cutoff_hz: float) -> tuple[float, float]:
    """Mean w^2 and w^4 below a cutoff, rad/s."""
    omega = 2.0 * np.pi * np.linspace(0.0, cutoff_hz, _LINES)
    return float(np.mean(omega**2)), float(np.mean(omega**4))


def imu_noise(force: float, turning: float, cutoff_hz: float, *, carried: Real, place: Real) -> Real:
    """Give ``[joint]``: variance of the torque that an IMU's noise seems to need below a cutoff.

    Parameters
    ----------
    force, turning
        Densities of the accelerometer, (m/s^2)^2/Hz, and the gyroscope, (rad/s)^2/Hz, of each axis.
    carried
        ``[6, joint, sample]`` torque a unit of the base's acceleration, linear, then angular.
    place
        ``[3]`` of the IMU on the base, m.
    """
    linear = carried[:3]
    # What turns the sensor moves the base's origin against it.
    angular = carried[3:] - np.einsum("ka,ajs->kjs", np.cross(np.eye(3), place), linear)
    of_rate = (2.0 * np.pi) ** 2 * cutoff_hz**3 / 3.0
    by_force, by_turning = (np.mean(np.sum(one**2, axis=0), axis=-1) for one in (linear, angular))
    return np.asarray(force * cutoff_hz * by_force + turning * of_rate * by_turning)
