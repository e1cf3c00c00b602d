"""Where a frequency response passes levels of phase and magnitude: margins, critical frequency, bandwidth, peak."""

import cmath
from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from chladni.models.analysis.bracketed_root import bracketed_root
from chladni.models.analysis.frequency_curve import FrequencyCurve
from chladni.models.analysis.resolvent import Resolvent
from chladni.signals.arrays import Real

# Phases that touch a level by rounding only (two integrators lie at -180 degrees for ever) don't cross it.
ROUNDING_DEG = 1e-7
# The same of magnitudes, over the level: that of a dead time is 1 everywhere.
ROUNDING_SHARE = 1e-12
# Of a frequency, when a crossing is found.
ROUNDING = 1e-15


@dataclass(frozen=True, slots=True, kw_only=True)
class Margin:
    """One crossing that decides on stability when the loop is closed with unit negative feedback.

    Attributes
    ----------
    frequency_hz
        Where it is.
    gain
        Factor by which the loop gain may rise (or, under 1, must fall) to the limit of stability; at a crossing of
        -180 degrees. 1 at a crossing of magnitude 1.
    phase_deg
        Phase above -180 degrees, at a crossing of magnitude 1. 0 at a crossing of -180 degrees.
    """

    frequency_hz: float
    gain: float
    phase_deg: float


class FrequencyMarks:
    """Finds crossings on the grid of a curve, and each to rounding by the exact response.

    Parameters
    ----------
    curve
        Of the path.
    resolvent
        Of the same path.
    dead_time_s
        Of the same path, outside of loops.
    """

    def __init__(self, curve: FrequencyCurve, resolvent: Resolvent, dead_time_s: float) -> None:
        self._curve = curve
        self._resolvent = resolvent
        self._dead_time_s = dead_time_s
        self._omega = 2 * pi * curve.frequency_hz

    def response(self, omega: float) -> complex:
        """Give the response at one angular frequency in rad/s, dead time included."""
        return self._resolvent.value(omega) * complex(np.exp(-1j * omega * self._dead_time_s))

    def phase_crossings(self, level_deg: float, *, falling_only: bool = False) -> list[float]:
        """Give angular frequencies at which the unwrapped phase passes a level."""
        away = self._curve.phase_deg - level_deg
        away = np.where(np.abs(away) < ROUNDING_DEG, 0.0, away)
        turn = complex(np.exp(-1j * np.radians(level_deg)))

        def measure(omega: float) -> tuple[float, float]:
            value, slope = self._value_and_slope(omega)
            return cmath.phase(value * turn), (slope / value).imag if value else 0.0

        return self._crossings(measure, away, falling_only=falling_only)

    def magnitude_crossings(self, level: float, *, falling_only: bool = False) -> list[float]:
        """Give angular frequencies at which the magnitude passes a level."""

        def measure(omega: float) -> tuple[float, float]:
            value, slope = self._value_and_slope(omega)
            size = abs(value)
            return size - level, (value.conjugate() * slope).real / size if size else 0.0

        away = np.abs(self._curve.response) - level
        away = np.where(np.abs(away) <= ROUNDING_SHARE * level, 0.0, away)
        return self._crossings(measure, away, falling_only=falling_only)

    def gain_margins(self) -> list[Margin]:
        """Give every crossing of -180 degrees, whole turns more or less included, by rising frequency."""
        lowest, highest = float(self._curve.phase_deg.min()), float(self._curve.phase_deg.max())
        turns = range(int(np.ceil((lowest + 180) / 360)), int(np.floor((highest + 180) / 360)) + 1)
        found = sorted(omega for turn in turns for omega in self.phase_crossings(360.0 * turn - 180))
        return [Margin(frequency_hz=w / (2 * pi), gain=1 / abs(self.response(w)), phase_deg=0.0) for w in found]

    def phase_margins(self) -> list[Margin]:
        """Give every crossing of magnitude 1, by rising frequency; margins from -180 to 180 degrees."""
        return [
            Margin(frequency_hz=w / (2 * pi), gain=1.0, phase_deg=float(np.degrees(np.angle(-self.response(w)))))
            for w in self.magnitude_crossings(1.0)
        ]

    def peak(self) -> tuple[float, float] | None:
        """Angular frequency and magnitude of the highest peak inside the curve; None without one."""
        size = np.abs(self._curve.response)
        inner = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
        if not inner.size:
            return None
        top = int(inner[np.argmax(size[inner])])
        # Rounding on a flat part makes peaks too; a real one rises above both ends of the curve's dip.
        if size[top] <= size[:top].min() * (1 + 1e-9):
            return None
        omega = self._turning(float(self._omega[top - 1]), float(self._omega[top + 1]))
        return omega, abs(self.response(omega))

    def _value_and_slope(self, omega: float) -> tuple[complex, complex]:
        """Give the response and its derivative to omega, dead time included."""
        value, slope, _ = self._resolvent.derivatives(omega)
        turn = cmath.exp(-1j * omega * self._dead_time_s)
        return value * turn, (slope - 1j * self._dead_time_s * value) * turn

    def _crossings(
        self, measure: Callable[[float], tuple[float, float]], away: Real, *, falling_only: bool
    ) -> list[float]:
        """Refine each change of sign of `away` on the grid by what `measure` gives exactly."""
        found = []
        for point in _sign_changes(away):
            low, high = float(self._omega[point]), float(self._omega[point + 1])
            before, after = float(away[point]), float(away[point + 1])
            if falling_only and after >= 0:
                continue
            guess = low + (high - low) * before / (before - after) if before != after else low
            found.append(
                bracketed_root(measure, low, high, begins_below=after > 0, guess=guess, rounding=ROUNDING * high)
            )
        return found

    def _turning(self, low: float, high: float) -> float:
        """Angular frequency between two at which the magnitude stops rising."""

        def measure(omega: float) -> tuple[float, float]:
            value, slope, curvature = self._resolvent.derivatives(omega)
            rise = (value.conjugate() * slope).real
            return rise, abs(slope) ** 2 + (value.conjugate() * curvature).real

        if measure(low)[0] * measure(high)[0] > 0:
            return 0.5 * (low + high)
        middle = 0.5 * (low + high)
        return bracketed_root(measure, low, high, begins_below=False, guess=middle, rounding=ROUNDING * high)


def _sign_changes(signal: Real) -> list[int]:
    """Points after which the sign is the other one; where the signal is zero, it still has the sign it had."""
    sign = np.sign(signal)
    # A crossing may lie exactly on a point of the grid, and a response may end on the level without passing it.
    last = np.maximum.accumulate(np.where(sign != 0, np.arange(sign.size), 0))
    held = sign[last]
    return [int(point) for point in np.flatnonzero(held[:-1] * held[1:] < 0)]
