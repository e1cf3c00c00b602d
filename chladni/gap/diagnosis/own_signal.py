"""Whether what is left at a sensor follows the sensor's own signal: then it's no noise, however much it looks so."""

import numpy as np

from chladni.gap.calibration import LAW_POINTS, SOME
from chladni.gap.explanation.hats import hats
from chladni.signals.arrays import Real


def share_of_own_signal(simulated: Real, residual: Real) -> Real:
    """Share of each residual's power that a curve over what the sensor should show explains, but for straight lines.

    A noise floor that comes from what no linear model explains holds a sensor's distortion and its steps too, and
    nothing would ever stand out of it. What the signal itself explains is a gain's or a parameter's.

    Parameters
    ----------
    simulated, residual
        ``[output, sample]``.

    Returns
    -------
    ``[output]`` 0 to 1.
    """
    found = np.zeros(len(simulated))
    for row, (signal, left) in enumerate(zip(simulated, residual, strict=True)):
        plain = _power(_rest([np.ones_like(signal), signal], left))
        found[row] = 1.0 - _power(_rest(hats(signal, LAW_POINTS), left)) / plain if plain > 0 else 0.0
    return found


def without_own_signal(simulated: Real, residual: Real) -> Real:
    """Give ``[output, sample]`` residuals without the curve over their own signal, where they follow one.

    What is left of the others is as it was: a curve through noise would take some of that.
    """
    shares = share_of_own_signal(simulated, residual)
    rows = zip(simulated, residual, shares, strict=True)
    return np.stack([_rest(hats(signal, LAW_POINTS), left) if share > SOME else left for signal, left, share in rows])


def _rest(functions: list[Real], target: Real) -> Real:
    columns = np.stack(functions, axis=1)
    return np.asarray(target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0])


def _power(row: Real) -> float:
    return float(row @ row)
