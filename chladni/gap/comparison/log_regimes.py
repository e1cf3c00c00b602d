"""The regimes of a gap between two logs: over motions that were measured, and over the amplitude of each output.

No joint's motion is known without a model; what the log itself holds of displacement, velocity and amplitude is.
"""

import numpy as np
from scipy import fft

from chladni.gap.calibration import CYCLES
from chladni.gap.comparison.shares import Variable
from chladni.gap.records.measurement import Measurement
from chladni.signals.arrays import Real

MOTION_UNITS = frozenset({"m", "rad", "m/s", "rad/s"})


def measured_variables(measured: Measurement) -> dict[str, Variable]:
    """Give its outputs in m, rad, m/s and rad/s by their names, and the amplitude of every output.

    That is ``amplitude of wrist``, see `amplitude`, over four cycles of its mean frequency.
    """
    rows = list(zip(measured.output_names, measured.output_units, measured.outputs, strict=True))
    motions = {name: Variable(row, unit) for name, unit, row in rows if unit in MOTION_UNITS}
    return motions | {
        f"amplitude of {name}": Variable(
            amplitude(row, cycles_of(row, measured.sample_rate_hz)), "" if unit == "1" else unit
        )
        for name, unit, row in rows
    }


def cycles_of(signal: Real, sample_rate_hz: float) -> int:
    """Give the samples of four cycles of a signal's mean frequency; all of one that stands still."""
    power = np.abs(fft.rfft(signal - signal.mean())) ** 2
    if not power.sum() > 0:
        return signal.size
    mean_hz = float(np.sum(power * fft.rfftfreq(signal.size, 1 / sample_rate_hz)) / power.sum())
    return round(CYCLES / mean_hz * sample_rate_hz)


def amplitude(signal: Real, length: int) -> Real:
    """``[sample]`` amplitude of an oscillation ``[sample]``: of a sine that is as large over `length` samples.

    The mean over the same samples is left out, since a load or a travel is no oscillation. At the ends of the record
    the first and the last whole stretch stand in.
    """
    length = min(max(length, 2), signal.size)
    # Squares of a small oscillation about a large mean would lose it to rounding.
    centred = signal - signal.mean()
    mean, square = (_running_mean(one, length) for one in (centred, centred**2))
    found = np.sqrt(2 * np.maximum(square - mean**2, 0.0))
    before = length // 2
    return np.pad(found, (before, signal.size - found.size - before), mode="edge")


def _running_mean(signal: Real, length: int) -> Real:
    """``[sample]`` means over each whole stretch of a length."""
    sums = np.concatenate([[0.0], np.cumsum(signal)])
    return np.asarray((sums[length:] - sums[:-length]) / length, dtype=np.float64)
