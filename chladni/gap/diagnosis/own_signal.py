"""Whether what is left at a sensor follows the sensor's own signal: then it's no noise, however much it looks so."""

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


def share_of_own_signal(measured: Matrix, residual: Matrix) -> Matrix:
    """Share of each residual's power that the square and the cube of what the sensor showed explain.

    A noise floor that comes from what no linear model explains holds a sensor's distortion too, and nothing would
    ever stand out of it. The cube is taken without the share of it that is the signal itself, which a gain is.

    Parameters
    ----------
    measured, residual
        ``[output, sample]``.

    Returns
    -------
    ``[output]`` 0 to 1.
    """
    found = np.zeros(len(measured))
    for row, (signal, left) in enumerate(zip(measured, residual, strict=True)):
        scaled = (signal - signal.mean()) / max(float(np.std(signal)), 1e-300)
        columns = np.stack([np.ones_like(scaled), scaled, scaled**2, scaled**3], axis=1)
        # What the signal itself explains is a gain's or a parameter's and counts for nothing here.
        plain, full = (_left(columns[:, :count], left) for count in (2, 4))
        found[row] = 1.0 - full / plain if plain > 0 else 0.0
    return found


def _left(columns: Matrix, target: Matrix) -> float:
    rest = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(rest @ rest)
