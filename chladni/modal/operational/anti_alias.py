"""The filter that lets correlation functions be taken at every n-th lag only."""

import numpy as np

from chladni.signals.arrays import Real

# Share of the new half rate that passes unchanged; above it the power falls like a raised cosine, to nothing at the
# half rate itself.
PASS_BAND = 0.8
# The filter's own correlation is some millionths of its maximum beyond so many new samples.
REACH = 64


def reach(decimation: int) -> int:
    """Samples on either side that a filtered lag depends on; none without decimation."""
    return REACH * decimation if decimation > 1 else 0


def power_transfer(lines: int, decimation: int) -> Real:
    """Squared magnitude of the filter on lines from 0 Hz to the new half rate, ``[line]``."""
    if decimation == 1:
        return np.ones(lines)
    position = np.linspace(0.0, 1.0, lines)
    fall = np.clip((position - PASS_BAND) / (1 - PASS_BAND), 0.0, 1.0)
    # Smooth in its first three derivatives, so that its correlation dies out fast.
    smooth = fall**4 * (35 - 84 * fall + 70 * fall**2 - 20 * fall**3)
    return np.asarray(1 - smooth, dtype=np.float64)
