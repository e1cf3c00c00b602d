"""How much neighbouring spectral lines repeat each other."""

from math import floor

import numpy as np

from chladni.signals.provenance import Provenance
from chladni.spectral.leakage import named_window


def line_correlation_factor(provenance: Provenance) -> float:
    """Factor on covariances that were computed as if spectral lines were independent.

    Parameters
    ----------
    provenance
        How the spectra were averaged; the variance of single lines is taken to rest on its effective averages.

    Returns
    -------
    float
        At least 1, and 1 for periods of a repeating excitation, for records of impacts and without a window: their
        lines are independent.

    Notes
    -----
    A quantity that takes in many lines with slowly varying weights scatters by the sum of the covariances of all
    pairs of segments at all distances of lines. By Parseval's theorem that of segments l hops apart is

        c_l = N sum_n w(n)^2 w(n + l D)^2 / (sum_n w(n)^2)^2,

    while a single line scatters by rho_l = (sum_n w(n) w(n + l D))^2/(sum_n w(n)^2)^2 (Welch 1967). With K segments

        factor = sum_l (1 - abs(l)/K) c_l / sum_l (1 - abs(l)/K) rho_l.

    For Hann: 35/18 for a single segment; 2 for many at an overlap of 1/2, where the information per hertz is then
    18/19 of the record's length, near the length itself which no window can exceed.

    Examples
    --------
    >>> round(line_correlation_factor(Provenance(window="hann", averages=1)) * 18, 9)
    35.0
    >>> line_correlation_factor(Provenance(window="hann", averages=8, averaging="periodic"))
    1.0
    """
    if provenance.averaging in ("periodic", "impact"):
        return 1.0
    window = named_window(provenance.window)
    hop = max(1, window.size - floor(window.size * provenance.overlap + 1e-9))
    power = window**2
    every, single = 0.0, 0.0
    for lag in range(0, window.size, hop):
        hops = lag // hop
        # Each distance but zero occurs before and after.
        share = max(0.0, 1 - hops / max(provenance.averages, 1)) * (1 if hops == 0 else 2)
        overlap = window.size - lag
        every += share * window.size * float(power[lag:] @ power[:overlap])
        single += share * float(window[lag:] @ window[:overlap]) ** 2
    return float(np.maximum(every / single, 1.0))
