"""What clocks that are late or early read of outputs."""

import numpy as np

from chladni.signals.arrays import Real


def read_late(outputs: Real, offsets_s: Real, sample_rate_hz: float) -> Real:
    """Give ``[..., output, sample]`` as read by clocks that are late by ``offsets_s [output]``.

    By cubic splines between samples; before the start as at the start, after the end as at the end. What isn't finite
    somewhere is nowhere: a spline through it would have no numbers.
    """
    late = np.flatnonzero(offsets_s)
    if not late.size:
        return outputs
    from scipy.interpolate import CubicSpline

    times_s = np.arange(outputs.shape[-1]) / sample_rate_hz
    read = outputs.copy()
    for row in late:
        asked = np.clip(times_s - offsets_s[row], 0.0, times_s[-1])
        seen = outputs[..., row, :]
        finite = np.isfinite(seen).all(axis=-1)
        read[..., row, :] = np.nan
        read[finite, row, :] = CubicSpline(times_s, seen[finite], axis=-1)(asked)
    return read
