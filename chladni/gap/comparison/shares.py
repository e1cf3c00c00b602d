"""Where the gap lies: by channel, by band of frequency, by regime of motion, and over time and frequency.

Outputs differ in unit and size: each is scaled by the RMS of what was measured, and powers of scaled outputs add up.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft
from scipy.special import ndtr, ndtri

from chladni.gap.calibration import (
    BANDS,
    BLOCK,
    CLEARLY,
    LINES_APART,
    LISTED,
    LITTLE,
    OUTSIDE,
    PIECES,
    QUARTER,
    ROUNDING,
    SAME,
    SLIGHT,
    SOME,
)
from chladni.gap.records.diagnosis import BandShare, ChannelGap, RegimeShare, TimeShare, Where
from chladni.gap.records.measurement import Measurement
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.spectral.windows import window_samples


@dataclass(frozen=True, slots=True)
class Variable:
    """A motion that regimes are cut by: ``values [sample]``, SI, and their unit; empty where that isn't known."""

    values: Real
    unit: str = ""


def relative_residual(residual: Real, measured: Real) -> Real:
    """Give ``[output, sample]`` residuals over the RMS of what was measured; an output of zero stays as it is."""
    if residual.shape != measured.shape:
        raise EstimateError(
            f"residual has shape {residual.shape}, measured {measured.shape}; both are [output, sample]"
        )
    return np.asarray(residual / _scale(measured))


def _scale(measured: Real) -> Real:
    """``[output, 1]`` RMS of what was measured; 1 for an output of zero."""
    rms = np.sqrt(np.mean(measured**2, axis=1, keepdims=True))
    return np.asarray(np.where(rms > 0, rms, 1.0))


def pooled_gap(residual: Real, measured: Real) -> float:
    """RMS of the residual over the RMS of what was measured, all outputs pooled after scaling each by its own."""
    return float(np.sqrt(np.mean(relative_residual(residual, measured) ** 2)))


def where_of(residual: Real, measurement: Measurement, noise: NoiseFloor, variables: Mapping[str, Variable]) -> Where:
    """Say where and when a gap ``[output, sample]`` lies, but for sites, which are a model's.

    A regime of the variables is told when it holds 1.25 times as large a share of the gap's power as of time, and 1.5
    times what it would hold of a gap that is the same share of each output at any time, see `regime_shares`.
    """
    measured, rate_hz = measurement.outputs, measurement.sample_rate_hz
    return Where(
        channels=channel_gaps(residual, measured, noise, output_names=measurement.output_names),
        bands=band_shares(residual, measured, sample_rate_hz=rate_hz, noise=noise),
        sites=(),
        regimes=regime_shares(residual, measured, variables, beyond_motion=True),
        times=time_shares(residual, measured, sample_rate_hz=rate_hz),
    )


def channel_gaps(
    residual: Real, measured: Real, noise: NoiseFloor, *, output_names: Sequence[str]
) -> tuple[ChannelGap, ...]:
    """Give gap and noise of each output, over the RMS of what was measured; arrays are ``[output, sample]``."""
    gaps = np.sqrt(np.mean(relative_residual(residual, measured) ** 2, axis=1))
    # The same scale for both, so that gap and noise can be held against each other.
    floors = relative_residual(np.broadcast_to(noise.rms[:, None], measured.shape), measured)[:, 0]
    return tuple(
        ChannelGap(name=name, gap=float(gap), noise=float(floor), noise_from=method, noise_at_most=bool(at_most))
        for name, gap, floor, method, at_most in zip(
            output_names, gaps, floors, noise.method, noise.upper_bound, strict=True
        )
    )


def band_shares(
    residual: Real,
    measured: Real,
    *,
    sample_rate_hz: float,
    noise: NoiseFloor | None = None,
) -> tuple[BandShare, ...]:
    """Split the gap's power over frequency.

    In ten bands of equal ratio between the frequencies that hold all but 0.1 % of what was measured and of the gap.

    Parameters
    ----------
    residual, measured
        ``[output, sample]``.
    noise
        Floor of the outputs: how much of the gap in each band it can be is told too.

    Returns
    -------
    tuple of BandShare
        From 0 Hz to half the rate without gaps; shares add up to 1, or are all 0 when there is no gap.
    """
    samples = residual.shape[1]
    frequency_hz = fft.rfftfreq(samples, 1 / sample_rate_hz)
    # One transform of the whole record: no window shifts power between bands, and shares add up.
    gap, whole = (_line_power(relative_residual(one, measured)) for one in (residual, measured))
    edges_hz = _edges_hz(gap, whole, frequency_hz)
    band = np.clip(np.searchsorted(edges_hz, frequency_hz, side="right") - 1, 0, edges_hz.size - 2)
    power = np.bincount(band, weights=gap, minlength=edges_hz.size - 1).astype(np.float64)
    shares = power / power.sum() if power.sum() > 0 else power
    of_noise: list[float | None] = [None] * power.size
    if noise is not None:
        of_noise = _noise_shares(power, noise, measured, edges_hz, sample_rate_hz)
    return tuple(
        BandShare(low_hz=float(low), high_hz=float(high), share=float(share), noise=one)
        for low, high, share, one in zip(edges_hz[:-1], edges_hz[1:], shares, of_noise, strict=True)
    )


def regime_shares(
    residual: Real, measured: Real, variables: Mapping[str, Variable], *, beyond_motion: bool = False
) -> tuple[RegimeShare, ...]:
    """Find the regimes of motion in which the gap is larger than elsewhere.

    Each variable is cut at its quantiles (0, 10, 25, 50, 75, 90, 100 %), and around zero at the 20 % of smallest
    magnitude. A regime counts when it holds at least 1.25 times as large a share of the gap's power as of time, by
    three standard errors, from the differences between neighbours of 64 stretches of the record.

    Parameters
    ----------
    residual, measured
        ``[output, sample]``.
    variables
        By name, such as ``elbow.velocity``.
    beyond_motion
        Whether a regime must hold 1.5 times as much, too, as it would of a gap that is the same share of each output
        at any time. Such a gap grows with the motion, so that large amplitudes would always be told.

    Returns
    -------
    tuple of RegimeShare
        At most six, by falling excess over their share of time; one of two that overlap. Empty when the gap doesn't
        depend on the variables.
    """
    power = np.mean(relative_residual(residual, measured) ** 2, axis=0)
    if not power.sum() > 0:
        return ()
    expected = _power_of_motion(residual, measured) if beyond_motion else np.zeros_like(power)
    found = []
    for name, one in variables.items():
        if one.values.shape != power.shape:
            raise EstimateError(f"variable {name!r} has {one.values.size} samples, the residual {power.size}")
        tried = [_regime(name, one, power, expected, edges) for edges in _regimes(one.values)]
        found += _apart([regime for regime in tried if regime is not None])
    # Each variable has its say first; the strongest of all are told.
    return tuple(sorted(found, key=_excess, reverse=True)[:LISTED])


def gap_map(residual: Real, measured: Real, sample_rate_hz: float) -> tuple[Real, Real, Real]:
    """Give the gap's density over time and frequency, by Hann segments with half overlap, about as many as lines.

    There's the middle of each slice in seconds, ``[time]``, the frequency in Hz, ``[frequency]``, and the density in
    1/Hz, ``[time, frequency]``: the mean over outputs of the one-sided density of the scaled residual. Over frequency
    it integrates to the square of the pooled gap of that slice.
    """
    samples = residual.shape[1]
    # Twice the square root of the samples balances slices with lines.
    length = min(2 ** round(np.log2(2 * np.sqrt(samples))), samples)
    window, hop = window_samples("hann", length), max(1, length // 2)
    segments = sliding_window_view(relative_residual(residual, measured), length, axis=1)[:, ::hop]
    density = np.mean(np.abs(fft.rfft(segments * window, axis=2)) ** 2, axis=0)
    density *= 2 / (sample_rate_hz * np.sum(window**2))
    # 0 Hz and half the rate stand for themselves only.
    density[:, 0] /= 2
    if length % 2 == 0:
        density[:, -1] /= 2
    time_s = (np.arange(len(density)) * hop + length / 2) / sample_rate_hz
    return time_s, fft.rfftfreq(length, 1 / sample_rate_hz), density


def _line_power(scaled: Real) -> Real:
    """``[line]`` power of all outputs together, each line's twin at negative frequency included."""
    power = np.sum(np.abs(fft.rfft(scaled, axis=1)) ** 2, axis=0)
    power[1:] *= 2
    if scaled.shape[1] % 2 == 0:
        power[-1] /= 2
    return np.asarray(power)


def _noise_shares(
    power: Real, noise: NoiseFloor, measured: Real, edges_hz: Real, sample_rate_hz: float
) -> list[float | None]:
    """How much of a gap's ``power [band]``, of `_line_power`, noise can be; None where there is no gap."""
    samples = measured.shape[1]
    scaled = np.sum(noise.one_sided(sample_rate_hz) / _scale(measured) ** 2, axis=0)
    # Bands may be narrower than the lines of the density.
    line_hz = np.linspace(0.0, sample_rate_hz / 2, scaled.size)
    below = np.concatenate([[0.0], np.cumsum((scaled[1:] + scaled[:-1]) / 2) * line_hz[1]])
    inside = samples**2 * np.diff(np.interp(edges_hz, line_hz, below))
    # An estimate that lies above what is there says that all of it can be noise.
    return [min(float(ours / whole), 1.0) if whole > 0 else None for ours, whole in zip(inside, power, strict=True)]


def _edges_hz(gap: Real, whole: Real, frequency_hz: Real) -> Real:
    power = sum((one[1:] / one[1:].sum() for one in (gap, whole) if one[1:].sum() > 0), np.zeros(gap.size - 1))
    if not power.any():
        return np.array([0.0, frequency_hz[-1]])
    rising = np.cumsum(power) / power.sum()
    # Rounding may leave the last sum below 1.
    first, last = (min(int(np.searchsorted(rising, at)), power.size - 1) for at in (SLIGHT, 1 - SLIGHT))
    low_hz, high_hz = float(frequency_hz[1 + first]), float(frequency_hz[1 + last])
    top_hz, apart_hz = float(frequency_hz[-1]), LINES_APART * float(frequency_hz[1])
    # Bands of less than some lines are one with their neighbour.
    edges = [0.0]
    for edge in np.geomspace(max(low_hz, apart_hz), max(high_hz, 2 * apart_hz), BANDS + 1):
        if edges[-1] + apart_hz <= edge <= top_hz - apart_hz:
            edges.append(float(edge))
    return np.array([*edges, top_hz])


def _regimes(values: Real) -> list[tuple[float, float]]:
    # Beside these stands the regime around zero.
    lower = (0.0, LITTLE, QUARTER, 0.5)
    edges = np.unique(np.quantile(values, [*lower, *(1.0 - one for one in lower)]))
    near = float(np.quantile(np.abs(values), SOME))
    bins = [(float(low), float(high)) for low, high in pairwise(edges)]
    # A variable that never changes sign has no motion around zero.
    return [*bins, (-near, near)] if near > 0 and values.min() < 0 < values.max() else bins


def _power_of_motion(residual: Real, measured: Real) -> Real:
    """``[sample]`` power of a gap that is the same share of each output at any time, over its sum."""
    gaps = np.mean(relative_residual(residual, measured) ** 2, axis=1)
    power = gaps @ relative_residual(measured, measured) ** 2
    return np.asarray(power / power.sum() if power.sum() > 0 else power)


def _regime(
    name: str, variable: Variable, power: Real, expected: Real, edges: tuple[float, float]
) -> RegimeShare | None:
    """Weigh one regime; `power` of the gap, and the one that it must exceed too; None where it doesn't count."""
    low, high = edges
    inside = (variable.values >= low) & (variable.values <= high)
    share, time = float(power[inside].sum() / power.sum()), float(inside.mean())
    # Over stretches of the record, since neighbouring samples tell the same; from one stretch to the next, since an
    # amplitude that rises and falls over the record isn't what scatters.
    parts = np.array_split(power * (inside - time), PIECES)
    sums = np.array([part.sum() for part in parts]) / power.sum()
    error = float(np.sqrt(PIECES * np.mean(np.diff(sums) ** 2) / 2))
    least = max(SAME * time, CLEARLY * float(expected[inside].sum()))
    if not (share >= least and share - time > OUTSIDE * error):
        return None
    return RegimeShare(variable=name, low=low, high=high, share=share, time=time, unit=variable.unit)


def _excess(regime: RegimeShare) -> float:
    """By how much its share of the gap exceeds its share of time."""
    return regime.share - (regime.time or 0.0)


def _apart(regimes: list[RegimeShare]) -> list[RegimeShare]:
    """Give the strongest of any that overlap."""
    kept: list[RegimeShare] = []
    for regime in sorted(regimes, key=_excess, reverse=True):
        if not any(regime.low < other.high and other.low < regime.high for other in kept):
            kept.append(regime)
    return kept


def time_shares(residual: Real, measured: Real, *, sample_rate_hz: float) -> tuple[TimeShare, ...]:
    """Find the stretches of the record in which the gap is larger than in the rest.

    The record is cut into 64 pieces of equal length, fewer when it's short. The stretch of neighbouring pieces told
    first is the one with the largest sum of (share of the gap's power - 1.25 share of time); the next ones are found
    in the same way before and behind it. A stretch counts when its power exceeds the
    record's mean by more than chance gives the best of all stretches, as three standard errors do for one, on a
    logarithmic scale and with the scatter between neighbouring pieces.

    Parameters
    ----------
    residual, measured
        ``[output, sample]``.

    Returns
    -------
    tuple of TimeShare
        At most six, by falling share, seconds from the first sample. Empty when the gap is there all the time, and
        when there is none.

    Examples
    --------
    >>> measured = np.ones((1, 640))
    >>> residual = np.zeros((1, 640))
    >>> residual[0, 320:480] = 0.1
    >>> time_shares(residual, measured, sample_rate_hz=10.0)
    (TimeShare(start_s=32.0, end_s=48.0, share=1.0),)
    """
    power = np.mean(relative_residual(residual, measured) ** 2, axis=0)
    pieces = min(PIECES, power.size // BLOCK)
    if pieces < 2 or not power.sum() > 0:
        return ()
    edges = np.linspace(0, power.size, pieces + 1).round().astype(np.intp)
    shares, times = np.add.reduceat(power, edges[:-1]) / power.sum(), np.diff(edges) / power.size
    # Beyond three sigma; the stretch was chosen among many, some of which stand out by chance.
    sigmas = -float(ndtri(ndtr(-OUTSIDE) / (pieces * (pieces + 1) / 2)))
    scatter = _scatter(np.log(np.maximum(shares / times, ROUNDING)))
    found = [
        TimeShare(
            start_s=float(edges[first] / sample_rate_hz),
            end_s=float(edges[stop] / sample_rate_hz),
            share=float(shares[first:stop].sum()),
        )
        for first, stop in _stretches(shares - SAME * times, 0, pieces)
        if _stands_out(shares[first:stop], times[first:stop], sigmas * scatter)
    ]
    return tuple(sorted(found, key=lambda one: -one.share)[:LISTED])


def _scatter(level: Real) -> float:
    """Standard deviation of a piece's level, from neighbours: a gap that comes and goes changes few of them."""
    # Of a normal variable: median size of the difference of two, in standard deviations.
    return float(np.median(np.abs(np.diff(level))) / (np.sqrt(2) * ndtri(0.75)))


def _stretches(gain: Real, first: int, stop: int) -> Iterator[tuple[int, int]]:
    """Stretches of largest sum: of the whole, then of what lies before and behind it, and so on."""
    if first >= stop:
        return
    sums = np.concatenate([[0.0], np.cumsum(gain[first:stop])])
    # The sum of every stretch at once, as differences of the running sum.
    every = np.where(np.tri(sums.size, k=-1, dtype=bool), sums[:, None] - sums[None, :], -np.inf)
    end, begin = (int(place) + first for place in np.unravel_index(np.argmax(every), every.shape))
    if gain[begin:end].sum() > 0:
        yield begin, end
        yield from _stretches(gain, first, begin)
        yield from _stretches(gain, end, stop)


def _stands_out(shares: Real, times: Real, scatter: float) -> bool:
    return bool(np.log(shares.sum() / times.sum()) > scatter / np.sqrt(shares.size))
