"""The complex mode indicator function (CMIF): singular values of the frequency responses."""

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.frequency_response import FrequencyResponse


def complex_mode_indicator(response: FrequencyResponse) -> Real:
    """Give the singular values of H on each line; a peak of the greatest is a mode, of the second a close mode.

    Parameters
    ----------
    response
        Lines whose values are not finite give NaN.

    Returns
    -------
    ndarray
        ``[curve, frequency]`` in the functions' unit, the greatest first; as many curves as there are references or
        responses, whichever is less.

    Notes
    -----
    Shih, Tsuei, Allemang & Brown (1988), Mech. Syst. Signal Process. 2, 367.
    """
    lines = np.moveaxis(response.values, -1, 0)
    finite = np.isfinite(lines).all(axis=(1, 2))
    indicator = np.full((min(lines.shape[1:]), lines.shape[0]), np.nan)
    usable = lines[finite]
    if usable.shape[1] < usable.shape[2]:
        usable = usable.transpose(0, 2, 1)
    # H^H H is references x references: for hundreds of responses a hundredth of the work of a decomposition of H.
    gram = usable.conj().transpose(0, 2, 1) @ usable
    squares = np.linalg.eigvalsh(gram)[:, ::-1].T
    indicator[:, finite] = np.sqrt(np.maximum(squares, 0.0))
    return indicator
