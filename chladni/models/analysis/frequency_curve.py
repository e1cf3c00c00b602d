"""Frequency response of a path on a grid that no resonance slips through, with its phase unwrapped."""

from dataclasses import dataclass
from math import log10, pi

import numpy as np

from chladni.models.analysis.linear_path import LinearPath
from chladni.models.analysis.resolvent import Resolvent
from chladni.models.analysis.zeros import zeros
from chladni.signals.arrays import Complex, Real
from chladni.signals.value import Value

# So dense that a Nyquist plot is round, where a turn of phase takes a good part of a decade.
POINTS_A_DECADE = 60
MOST_DECADES = 10.0
# The grid goes this far beyond the corners, where magnitude and phase are straight lines.
BEYOND = 30.0
# A root damped less than this gets points of its own: the phase turns by half a turn within its bandwidth.
LIGHT = 0.9
_TURN = np.tan(np.linspace(-1.5, 1.5, 80))
# Radians of dead time between two points, and turns of its phase that are followed.
DEAD_TIME_STEP = 0.5
DEAD_TIME_TURNS = 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrequencyCurve(Value):
    """Response of one output to one input against frequency.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, rising, denser about light resonances.
    response
        ``[frequency]``, output unit per input unit; dead time included, e^{+j omega t}.
    phase_deg
        ``[frequency]``, unwrapped: begins between -90 and +90 degrees from where the integrators put it, 180 more for
        a path of negative sign.
    zeros
        In rad/s.
    sign
        -1 when a slow positive input lowers the output, else 1.
    """

    frequency_hz: Real
    response: Complex
    phase_deg: Real
    zeros: Complex
    sign: float

    def __post_init__(self) -> None:
        self._freeze()

    def magnitude_db(self) -> Real:
        """20 log10 of the magnitude; -inf where there is no response."""
        with np.errstate(divide="ignore"):
            return np.asarray(20 * np.log10(np.abs(self.response)))


def frequency_curve(
    path: LinearPath, *, resolvent: Resolvent | None = None, band_hz: tuple[float, float] | None = None
) -> FrequencyCurve:
    """Compute the frequency response of a path to one output.

    Parameters
    ----------
    path
        To one output.
    resolvent
        Of the path, when there is one already.
    band_hz
        From, to; by the poles and zeros when None.
    """
    resolvent = resolvent or Resolvent(path)
    found = zeros(path)
    omega = frequency_grid(
        np.concatenate([path.poles, found]), float(path.dead_time_s[0]), _loop_delay_s(path), band_hz
    )
    # Dead time is added to the unwrapped phase: far out it turns too fast for any grid.
    without = resolvent(omega)
    order = path.integrators() - int(np.count_nonzero(found == 0))
    phase, sign = _unwrapped(without, order)
    turning = omega * path.dead_time_s[0]
    return FrequencyCurve(
        frequency_hz=omega / (2 * pi),
        response=without * np.exp(-1j * turning),
        phase_deg=np.degrees(phase - turning),
        zeros=found,
        sign=sign,
    )


def frequency_grid(
    roots: Complex, dead_time_s: float, loop_delay_s: float, band_hz: tuple[float, float] | None = None
) -> Real:
    """Choose angular frequencies in rad/s by the poles and zeros, ``[frequency]``."""
    corners = np.abs(roots[roots != 0])
    delay = max(dead_time_s, loop_delay_s)
    if not corners.size:
        corners = np.array([1 / delay if delay > 0 else 1.0])
    low, high = float(corners.min()) / BEYOND, float(corners.max()) * BEYOND
    if delay > 0:
        # A loop's dead time makes a comb of peaks without end; a few teeth of it are shown.
        high = max(high if loop_delay_s == 0 else 0.0, 2 * pi / delay)
    if log10(high / low) > MOST_DECADES:
        low = high / 10**MOST_DECADES
    if band_hz is not None:
        low, high = 2 * pi * band_hz[0], 2 * pi * band_hz[1]
    points = max(int(POINTS_A_DECADE * log10(high / low)), 2)
    parts = [np.geomspace(low, high, points), *(_about(root) for root in roots if _light(root))]
    if delay > 0:
        last = min(high, DEAD_TIME_TURNS * 2 * pi / delay)
        parts.append(np.arange(low, last, DEAD_TIME_STEP / delay))
    grid = np.unique(np.concatenate(parts))
    return np.asarray(grid[(grid >= low) & (grid <= high)])


def _light(root: complex) -> bool:
    return root.imag > 0 and abs(root.real) < LIGHT * abs(root)


def _about(root: complex) -> Real:
    """Frequencies about a light root at which its phase turns in equal steps; never at an undamped one itself."""
    return np.abs(root.imag + max(abs(root.real), 1e-7 * abs(root)) * _TURN)


def _unwrapped(response: Complex, order: int) -> tuple[Real, float]:
    phase = np.unwrap(np.angle(response))
    # A slow input of a path with `order` integrators turns by 90 degrees for each; what's left tells the sign.
    left = phase[0] + order * pi / 2
    half_turns = round(left / pi)
    sign = -1.0 if half_turns % 2 else 1.0
    target = -order * pi / 2 + (pi if sign < 0 else 0.0)
    return phase + 2 * pi * round((target - phase[0]) / (2 * pi)), sign


def _loop_delay_s(path: LinearPath) -> float:
    return max((line.delay_s for line in path.exact.delays), default=0.0) if path.exact is not None else 0.0
