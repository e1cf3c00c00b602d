"""Lines of a whole record that are narrower than any mode."""

from dataclasses import dataclass

import numpy as np
import scipy.special

from chladni.modal.operational.narrow_band_kurtosis import window_autocorrelation
from chladni.signals.arrays import Real
from chladni.signals.time_series import TimeSeries
from chladni.spectral.leakage import line_correlation, named_window
from chladni.spectral.segment_spectra import segment_spectra
from chladni.spectral.segmentation import Segmentation
from chladni.spectral.stretches import valid_runs
from chladni.spectral.windows import window_samples

# The lines beside the main lobe of a Hann window that a line is held against, on either side.
NEAREST, FARTHEST = 3, 18
# A piece is transformed whole; a longer record is averaged over pieces.
LONGEST_PIECE = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SteadyLines:
    """Power of each line of the longest Hann segments over that of the lines beside it.

    Attributes
    ----------
    frequency_hz
        ``[line]``.
    power
        ``[channel, line]`` mean squared magnitude, unscaled.
    over_neighbours
        ``[channel, line]`` power over the mean of the neighbours' on either side; 0 where there are too few.
    chance
        ``[channel, line]`` that noise through a mode of the least damping stands so far out.
    segment_s
        Length of a segment in seconds.
    """

    frequency_hz: Real
    power: Real
    over_neighbours: Real
    chance: Real
    segment_s: float


def steady_lines(series: TimeSeries, least_damping: float) -> SteadyLines:
    """Hold each line of the whole record against the lines beside it.

    Of noise through a structure, lines beside each other have the same expected power, unless a mode is as narrow as
    they are: then the ratio that a mode with `least_damping` shows at its top is allowed for. Apart from it the ratio
    of two powers follows Fisher's F, with 2 M degrees of freedom over 2 M times the neighbours that count as
    independent, M the number of segments.
    """
    # Across a gap the phase of a sine is kept, but no line is: only one run can be taken whole.
    first, last = max(valid_runs(series), key=lambda run: run[1] - run[0])
    samples = min(last - first, LONGEST_PIECE) // 2 * 2
    plan = Segmentation(samples=samples, hop=samples, window="hann", detrend="linear")
    segments = plan.count(last - first)
    power = np.zeros((len(series.channels), samples // 2 + 1))
    window = window_samples("hann", samples)
    # A channel and a segment at a time: the spectrum of a whole record is as large as the record.
    for channel in range(len(series.channels)):
        for begin in range(first, first + segments * samples, samples):
            part = series.values[channel : channel + 1, begin : begin + samples]
            power[channel] += np.abs(segment_spectra(part, plan, window)[:, 0, 0]) ** 2 / segments
    frequency_hz = np.asarray(np.arange(samples // 2 + 1) * (series.sample_rate_hz / samples), dtype=np.float64)
    over = _over_neighbours(power)
    segment_s = samples / series.sample_rate_hz
    allowed = _narrowest_mode(least_damping * frequency_hz * segment_s)
    freedom = 2 * segments * 2 * (FARTHEST - NEAREST + 1) / line_correlation(named_window("hann"))
    return SteadyLines(
        frequency_hz=frequency_hz,
        power=power,
        over_neighbours=over,
        chance=np.asarray(scipy.special.fdtrc(2 * segments, freedom, over / allowed), dtype=np.float64),
        segment_s=segment_s,
    )


def _over_neighbours(power: Real) -> Real:
    """Each line over the mean of its neighbours, `NEAREST` to `FARTHEST` lines away on both sides."""
    over = np.zeros_like(power)
    total = np.cumsum(np.pad(power, ((0, 0), (1, 0))), axis=1)
    # Lines nearer to an end have no neighbours on one side: a slope would look like a peak there.
    lines = np.arange(FARTHEST, power.shape[1] - FARTHEST)
    below = total[:, lines - NEAREST + 1] - total[:, lines - FARTHEST]
    above = total[:, lines + FARTHEST + 1] - total[:, lines + NEAREST]
    mean = (below + above) / (2 * (FARTHEST - NEAREST + 1))
    # The cumulated sum keeps 16 digits of the strongest line: what lies below that is rounding, no neighbour.
    floor = np.finfo(float).eps * total[:, -1:]
    over[:, lines] = power[:, lines] / np.maximum(mean, np.maximum(floor, np.finfo(float).tiny))
    return over


def _narrowest_mode(half_width: Real) -> Real:
    """Ratio that a mode shows at its top, for half of its half-power bandwidth in lines, zeta f T."""
    lags, window = window_autocorrelation()
    grid = np.geomspace(1e-3, 1e4, 300)
    offsets = np.arange(NEAREST, FARTHEST + 1)
    decayed = np.exp(-2 * np.pi * grid[:, None] * np.abs(lags)) * window
    beside = decayed @ np.cos(2 * np.pi * lags[:, None] * offsets)
    ratio = decayed.sum(axis=1) / np.maximum(beside.mean(axis=1), 1e-9 * decayed.sum(axis=1))
    return np.asarray(np.exp(np.interp(np.log(np.maximum(half_width, grid[0])), np.log(grid), np.log(ratio))))
