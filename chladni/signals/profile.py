"""Profiles of vibration tests: breakpoints with a tolerance, straight between them on logarithmic axes."""

from collections.abc import Sequence

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.value import require_frequency_axis, require_shape


def rising(breakpoints: Sequence[tuple[float, float]]) -> tuple[Real, Real]:
    """Give the frequencies and the levels of breakpoints.

    Raises
    ------
    EstimateError
        When the frequencies don't rise.
    """
    points = np.asarray(list(breakpoints), dtype=np.float64).reshape(-1, 2)
    falls = np.flatnonzero(~(np.diff(points[:, 0]) > 0))
    if falls.size:
        before, after = points[falls[0] : falls[0] + 2, 0]
        raise EstimateError(f"breakpoint {after:g} Hz follows {before:g} Hz; give them in rising order, each once")
    return points[:, 0], points[:, 1]


def require_profile(frequency_hz: Real, levels: Real, *, name: str, upper_db: float, lower_db: float) -> None:
    """Refuse what is no profile.

    Raises
    ------
    EstimateError
        With fewer than two breakpoints, one that isn't above 0, or a tolerance below 0.
    """
    require_frequency_axis(frequency_hz)
    require_shape(name, levels, frequency_hz.shape, "frequency_hz")
    if frequency_hz.size < 2 or not frequency_hz[0] > 0:
        raise EstimateError("a profile needs two breakpoints or more, above 0 Hz")
    if not np.all((levels > 0) & np.isfinite(levels)):
        raise EstimateError(f"{name} of a profile must be finite and above 0 at every breakpoint")
    if not (0 <= upper_db < np.inf and 0 <= lower_db < np.inf):
        raise EstimateError(f"a tolerance of +{upper_db:g} and -{lower_db:g} dB; both must be 0 or more")


def between(breakpoints_hz: Real, levels: Real, frequency_hz: Real) -> Real:
    """Level at each frequency; NaN outside the breakpoints."""
    inside = (frequency_hz >= breakpoints_hz[0]) & (frequency_hz <= breakpoints_hz[-1])
    log_f = np.log(np.where(inside, frequency_hz, breakpoints_hz[0]))
    found = np.exp(np.interp(log_f, np.log(breakpoints_hz), np.log(levels)))
    return np.where(inside, found, np.nan)
