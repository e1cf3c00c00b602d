"""Which band a picture of the gap over band and time shows."""

import numpy as np

from chladni.gap.records.diagnosis import GapSignals
from chladni.signals.arrays import Real
from chladni.signals.engineering import percent

# Of the gap so much may lie above the band that is shown; some room above it shows that nothing comes.
LEFT_OUT, ROOM = 0.01, 1.2


def shown_hz(signals: GapSignals) -> float:
    """Frequency above which neither map has more than a hundredth of the gap before, and some room above it."""
    lines, before, after = signals.map_frequency_hz, _power(signals.gap_map), _power(signals.gap_map_after)
    allowed = LEFT_OUT * before.sum()
    if lines.size < 2 or not allowed > 0:
        return float(lines[-1])
    last = max(_last_line(before, allowed), _last_line(after, allowed))
    return float(min(ROOM * lines[last] + lines[1], lines[-1]))


def band_told(signals: GapSignals) -> str:
    """Say which part of the band is shown and how much of the gap lies above; nothing where all of it is shown."""
    lines, high_hz = signals.map_frequency_hz, shown_hz(signals)
    above = lines > high_hz
    if not above.any():
        return ""
    maps = _power(signals.gap_map), _power(signals.gap_map_after)
    most = max(float(power[above].sum()) for power in maps) / float(maps[0].sum())
    return f"{lines[0]:.3g} to {high_hz:.3g} of {lines[-1]:.4g} Hz, {percent(most)} of the gap above"


def _power(density: Real) -> Real:
    """``[line]`` over all times that are known."""
    return np.asarray(np.nan_to_num(density, posinf=0.0).sum(axis=0))


def _last_line(power: Real, allowed: float) -> int:
    """Line above which at most the power allowed lies."""
    rising = np.cumsum(power)
    return min(int(np.searchsorted(rising, rising[-1] - allowed)), power.size - 1)
