"""Named peaks of spectra and frequency responses: where, how high, how sure, on which channels."""

from dataclasses import dataclass
from math import ceil

import numpy as np
import scipy.ndimage
import scipy.special
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from chladni.io.source import density_of, response_of
from chladni.signals.arrays import Mask, Real, Whole
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.renamed import renamed
from chladni.spectral.leakage import leakage, line_correlation, named_window
from chladni.spectral.line_scatter import std_or_scatter
from chladni.spectral.windows import noise_bandwidth_bins

# The floor around a line is the median of a tenth of the spectrum, of this many lines at least.
FLOOR_SHARE = 0.1
FLOOR_LINES = 51
FEWEST_LINES = 5
# Interpolation between lines is never better than this share of a line: windows and resonances are not parabolas.
INTERPOLATION_LINES = 0.02
# Estimates said to be exact still scatter by rounding and by the slow change of any machine; one that is as uncertain
# as it is high is no peak, and how much worse it is matters no more.
SMALLEST_RELATIVE_STD = 1e-3
LARGEST_RELATIVE_STD = 2.0
# Chance of a coherence between unrelated channels, and of a line above its upper bound, that we live with.
COHERENT_BY_CHANCE = 1e-3
UPPER_BOUND_CHANCE = 1e-3

# A person reads so many; more are given when asked for.
MOST_PEAKS = 10


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Curve:
    """Power over frequency, of one function, with what is needed to judge a maximum of it.

    `sampled`: whether the lines are points of the function itself, as of those that a file holds ready-made; nothing
    is known of a window that would have smeared them.
    """

    frequency_hz: Real
    power: Real
    relative_std: Real
    trusted: Mask
    spacing_hz: float
    first_hz: float
    line_sampled: bool
    window: Real
    tonal: bool
    sampled: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class _Found:
    """A significant maximum of a curve; `over_floor` is its power over the local floor."""

    frequency_hz: float
    frequency_std_hz: float
    power: float
    relative_std: float
    over_floor: float


@renamed(density="source")
def find_peaks(
    source: PowerSpectralDensity | ArrayLike,
    *,
    frequency_hz: ArrayLike | None = None,
    averages: float | None = None,
    count: int = MOST_PEAKS,
    min_prominence_db: float = 3.0,
    false_alarm: float = 0.01,
) -> tuple[Peak, ...]:
    """Name the peaks of power spectral densities.

    Parameters
    ----------
    source
        Densities of one or more channels, or an array ``[channel, frequency]`` of them; peaks that several channels
        show within the resolution get one name.
    frequency_hz, averages
        Of an array: its frequencies, and the independent segments that were averaged, which its scatter follows from.
    count
        Most peaks to give, at least 1.
    min_prominence_db
        How far a peak must stand above the higher of the valleys beside it.
    false_alarm
        Chance that the scatter of a peakless spectrum gives a channel any peak, 0 to 1.

    Returns
    -------
    tuple of Peak
        The highest first (channels of different units are ranked by height over the local floor). Heights are
        densities; of a tone, what its line would show were the tone on it. For periodic excitation the spectrum
        exists at its lines only: frequency and height are those of the line.

    Raises
    ------
    EstimateError
        When an argument is out of its range, or the densities don't tell their random error.

    Notes
    -----
    A line is a peak when all of these hold, with nu = 2 (G/std)^2 degrees of freedom:

    1. its power over the local floor (running median) exceeds chi^2(nu)/nu at `false_alarm` over the number of lines;
    2. its ratio to the deepest line on either side, up to a higher peak, exceeds F(nu, nu) at `false_alarm` over the
       number of pairs of lines that were compared to find it;
    3. that ratio is `min_prominence_db` or more;
    4. it lies above `judged_above_hz`; the line at 0 Hz is nobody's valley, since the mean is taken off.

    The frequency comes from the three highest lines by the window's own main lobe, when the peak is as narrow as
    that; otherwise from a fit of 1/G = a + b f + c f^2 (a resonance near its top) to the lines above half the peak.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> frequency_hz = np.arange(200.0)
    >>> resonance = 1e-3 + 1 / ((1 - (frequency_hz / 80.3) ** 2) ** 2 + (0.05 * frequency_hz / 80.3) ** 2)
    >>> psd = PowerSpectralDensity(
    ...     frequency_hz=frequency_hz, values=resonance[None], std=0.1 * resonance[None], bandwidth_hz=1.5,
    ...     channels=(Channel(name="a", unit="m/s^2"),), provenance=Provenance(window="hann"),
    ... )
    >>> [round(peak.frequency_hz, 1) for peak in find_peaks(psd)]
    [80.2]
    """
    density = density_of(source, frequency_hz=frequency_hz, averages=averages)
    _require(count, false_alarm)
    # Without it a peak can't be told from scatter, and none would be found, in silence.
    if not np.isfinite(density.std).any():
        raise EstimateError("the densities don't tell their random error; give averages=, the segments averaged")
    curves = [_density_curve(density, row) for row in range(len(density.channels))]
    # Channel by channel, so that a strong channel's floor doesn't hide a weak one's peak.
    found = [_significant(curve, min_prominence_db, false_alarm) for curve in curves]
    named = [
        (peak, channel.name, unit)
        for peaks, channel, unit in zip(found, density.channels, density.units, strict=True)
        for peak in peaks
    ]
    resolution_hz = max((curve.spacing_hz for curve in curves), default=0.0)
    return _merged(named, max(density.bandwidth_hz, resolution_hz), count)


@renamed(response="source")
def find_response_peaks(
    source: FrequencyResponse | ArrayLike,
    *,
    frequency_hz: ArrayLike | None = None,
    count: int = MOST_PEAKS,
    min_prominence_db: float = 3.0,
    false_alarm: float = 0.01,
) -> tuple[Peak, ...]:
    """Name the peaks of the magnitude of frequency responses, on lines that the references excite.

    Parameters
    ----------
    source
        Functions in any form, or an array ``[response, reference, frequency]`` of them.
    frequency_hz
        Frequencies of an array.
    count
        Most peaks to give for each function, at least 1.
    min_prominence_db, false_alarm
        See `find_peaks`.

    Returns
    -------
    tuple of Peak
        The highest first; ``channels`` are the response and its reference. Heights are magnitudes. Lines whose
        coherence unrelated channels would show with a chance of 0.1 % or more hold no peak. Of functions without
        error bars, as files of other programs hold them, the scatter is what lines differ from their neighbours by.

    Raises
    ------
    EstimateError
        When an argument is out of its range.
    """
    response = response_of(source, frequency_hz=frequency_hz)
    _require(count, false_alarm)
    peaks = []
    for row, answer in enumerate(response.responses):
        for column, reference in enumerate(response.references):
            found = _significant(_response_curve(response, row, column), min_prominence_db, false_alarm)
            found.sort(key=lambda peak: -peak.power)
            unit, names = response.unit(row, column), (answer.name, reference.name)
            peaks += [_peak(peak, unit, names, magnitude=True) for peak in found[:count]]
    return tuple(sorted(peaks, key=lambda peak: -peak.height))


def _density_curve(density: PowerSpectralDensity, row: int) -> _Curve:
    power, std = density.values[row], density.std[row]
    line_sampled = density.provenance.averaging == "periodic"
    usable = np.isfinite(power) & (power > 0)
    if line_sampled:
        # A comb has lines only where the excitation has them; between them is scatter as large as its own std.
        usable &= power > 4 * std
    return _curve(
        density.frequency_hz[usable],
        power[usable],
        std[usable] / power[usable],
        trusted=np.ones(np.count_nonzero(usable), dtype=bool),
        provenance=density.provenance,
        bandwidth_hz=density.bandwidth_hz,
        tonal=True,
    )


def _response_curve(response: FrequencyResponse, row: int, column: int) -> _Curve:
    values = response.values[row, column]
    usable = response.excited & np.isfinite(values) & (values != 0)
    magnitude, std = np.abs(values[usable]), response.std[row, column, usable]
    if _without_averages(response):
        std = std_or_scatter(values[usable], std)
    # A magnitude wrong by 1 % is a power wrong by 2 %.
    return _curve(
        response.frequency_hz[usable],
        magnitude**2,
        2 * std / magnitude,
        trusted=_coherent(response, row)[usable],
        provenance=response.provenance,
        bandwidth_hz=_bandwidth_hz(response),
        tonal=False,
        # Whoever averaged elsewhere doesn't say how: the lines are points of the function itself.
        sampled=not response.provenance.effective_averages,
    )


def _curve(
    frequency_hz: Real,
    power: Real,
    relative_std: Real,
    *,
    trusted: Mask,
    provenance: Provenance,
    bandwidth_hz: float,
    tonal: bool,
    sampled: bool = False,
) -> _Curve:
    return _Curve(
        frequency_hz=frequency_hz,
        power=power,
        relative_std=np.clip(relative_std, SMALLEST_RELATIVE_STD, LARGEST_RELATIVE_STD),
        trusted=trusted,
        spacing_hz=_spacing(frequency_hz),
        first_hz=0.0 if sampled else _leaks_below_hz(provenance, bandwidth_hz),
        line_sampled=provenance.averaging == "periodic",
        window=named_window(provenance.window),
        tonal=tonal,
        sampled=sampled,
    )


def judged_above_hz(estimate: PowerSpectralDensity | FrequencyResponse) -> float:
    """Frequency above which peaks are looked for: the noise bandwidth of the window, below which a trend leaks.

    0 for whole periods, which don't leak, and for hits, whose transient has died away: only the offset is left out.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> line_hz = np.arange(5.0)
    >>> density = PowerSpectralDensity(
    ...     frequency_hz=line_hz, values=line_hz[None], std=line_hz[None], channels=(Channel(name="a", unit="m"),),
    ...     bandwidth_hz=1.5, provenance=Provenance(window="hann"),
    ... )
    >>> judged_above_hz(density)
    1.5
    """
    return _leaks_below_hz(estimate.provenance, _bandwidth_hz(estimate))


def _bandwidth_hz(estimate: PowerSpectralDensity | FrequencyResponse) -> float:
    if isinstance(estimate, PowerSpectralDensity):
        return estimate.bandwidth_hz
    return _spacing(estimate.frequency_hz) * noise_bandwidth_bins(named_window(estimate.provenance.window))


def _leaks_below_hz(provenance: Provenance, bandwidth_hz: float) -> float:
    return 0.0 if provenance.averaging in ("periodic", "impact") else bandwidth_hz


def _coherent(response: FrequencyResponse, row: int) -> Mask:
    """Lines whose coherence unrelated channels would hardly show: P = (1 - coherence)^(n - q) (Carter 1987).

    With few averages the std is itself an accident, small on some of many lines; the coherence tells which.
    """
    if _without_averages(response):
        return np.ones(response.frequency_hz.shape, bool)
    freedom = max(response.provenance.effective_averages - len(response.references), 0.0)
    return np.asarray((1 - response.coherence[row]) ** freedom <= COHERENT_BY_CHANCE)


def _without_averages(response: FrequencyResponse) -> bool:
    """Whether nothing was averaged: a file that tells of no averages, or a hit a reference.

    The force of a single hit has no line of chance, as a single segment of a random one has.
    """
    account = response.provenance
    single = account.averaging == "impact" and account.effective_averages <= len(response.references)
    return single or not account.effective_averages


def _significant(curve: _Curve, min_prominence_db: float, false_alarm: float) -> list[_Found]:
    """Every maximum of a curve that the scatter of its lines doesn't explain."""
    power = curve.power
    if power.size < FEWEST_LINES:
        return []
    over_floor = power / _floor(curve)
    freedom = 2 / curve.relative_std**2
    # A sum of squares of nu Gaussian numbers: what an averaged line is when nothing but scatter is there.
    # Half of the false alarms for each of the two tests.
    chance = false_alarm / (2 * power.size)
    loud = (scipy.special.chdtrc(freedom, freedom * over_floor) <= chance) & curve.trusted & (curve.relative_std <= 1)
    # Once for all peaks: inverting the chi-squared distribution is most of the work here.
    sure = _upper_bound(power, freedom)
    # Of the line at 0 Hz, whose mean is taken off, any slow motion would stand out.
    lowest = int(curve.first_hz > 0 and curve.frequency_hz[0] < 0.5 * curve.spacing_hz)
    found = []
    for line in np.flatnonzero(loud & _maxima(curve)):
        valley = _valley(power[lowest:], sure[lowest:], int(line) - lowest) + lowest
        ratio, pairs = power[line] / power[valley], abs(int(line) - valley)
        surprise = scipy.special.fdtrc(freedom[line], freedom[valley], ratio)
        if surprise * pairs <= chance and 10 * np.log10(ratio) >= min_prominence_db:
            found.append(_located(curve, int(line), float(over_floor[line])))
    return found


def _upper_bound(power: Real, freedom: Real) -> Real:
    return np.asarray(power * freedom / scipy.special.chdtri(freedom, 1 - UPPER_BOUND_CHANCE), dtype=np.float64)


def _maxima(curve: _Curve) -> Mask:
    power, frequency_hz = curve.power, curve.frequency_hz
    inner = (power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])
    # Lines on the other side of a gap in the excitation are no neighbours.
    near = np.diff(frequency_hz) < 4 * curve.spacing_hz
    inner &= near[1:] & near[:-1] & (frequency_hz[1:-1] > curve.first_hz)
    return np.concatenate([[False], inner, [False]])


def _floor(curve: _Curve) -> Real:
    """Level that the lines around would have without peaks: their running median, freed of its bias."""
    lines = min(max(FLOOR_LINES, int(FLOOR_SHARE * curve.power.size)), curve.power.size) | 1
    median = scipy.ndimage.median_filter(curve.power, size=lines, mode="reflect")
    freedom = 2 / curve.relative_std**2
    return np.asarray(median * freedom / scipy.special.chdtri(freedom, 0.5), dtype=np.float64)


def _valley(power: Real, sure: Real, line: int) -> int:
    """Deepest line between a peak and the next higher one, on the side where that is less deep.

    Lines are as deep as they surely are (`sure`, an upper bound of each): the deepest of all, an antiresonance, may
    be one of which nothing is known.
    """
    first, last = _realm(power, line)
    before = first + int(np.argmin(sure[first : line + 1]))
    after = line + int(np.argmin(sure[line : last + 1]))
    return before if sure[before] > sure[after] else after


def _realm(power: Real, line: int) -> tuple[int, int]:
    """Next higher line on either side of a peak; the ends where none is higher."""
    higher = np.flatnonzero(power > power[line])
    left, right = higher[higher < line], higher[higher > line]
    return int(left[-1]) if left.size else 0, int(right[0]) if right.size else power.size - 1


def _located(curve: _Curve, line: int, over_floor: float) -> _Found:
    """Frequency and height between the lines, as the kind of curve allows."""
    frequency_hz, power = float(curve.frequency_hz[line]), float(curve.power[line])
    relative_std = float(curve.relative_std[line])
    if curve.line_sampled:
        # Somewhere within the line: a uniform distribution over the spacing.
        std_hz = curve.spacing_hz / np.sqrt(12)
    else:
        run = _above_half(curve, line)
        narrow = run.size <= 2 * noise_bandwidth_bins(curve.window) + 1 or _falls_with_the_window(curve, line)
        if narrow and curve.sampled:
            # Three points of a lone resonance tell all of it, however narrow it is.
            run, narrow = np.arange(line - 1, line + 2), False
        frequency_hz, std_hz, power = _from_three(curve, line) if narrow else _from_resonance(curve, line, run)
    return _Found(
        frequency_hz=frequency_hz,
        frequency_std_hz=float(np.hypot(std_hz, INTERPOLATION_LINES * curve.spacing_hz)),
        power=power,
        relative_std=relative_std,
        over_floor=over_floor,
    )


def _falls_with_the_window(curve: _Curve, line: int) -> bool:
    """Whether the lines a noise bandwidth away surely lie below half of a peak, however few the averages."""
    reach = ceil(noise_bandwidth_bins(curve.window))
    if not reach <= line < curve.power.size - reach:
        return False
    flanks = [line - reach, line + reach]
    bounds = _upper_bound(curve.power[flanks], 2 / curve.relative_std[flanks] ** 2)
    return bool(np.all(bounds < curve.power[line] / 2))


def _above_half(curve: _Curve, line: int) -> Whole:
    """Lines around a peak that stay above half of it, seen through their scatter."""
    # So many neighbours averaged scatter by a seventh, and a dip to half of the peak is no accident any more.
    lines = min(int((7 * curve.relative_std[line]) ** 2), 8) // 2
    start, stop = max(line - 64 * (lines + 1), 0), line + 64 * (lines + 1) + 1
    smooth = scipy.ndimage.uniform_filter1d(curve.power[start:stop], 2 * lines + 1, mode="nearest")
    at = line - start
    low = np.flatnonzero(smooth < smooth[at] / 2)
    left, right = low[low < at], low[low > at]
    # Smoothed, the slope of a higher peak nearby looks like this one's: the run ends in the valley between them.
    first, last = _realm(curve.power, line)
    before = first + int(np.argmin(curve.power[first : line + 1])) if first else 0
    after = line + int(np.argmin(curve.power[line : last + 1])) if last < curve.power.size - 1 else last
    begin = start + (int(left[-1]) + 1 if left.size else 0)
    end = start + (int(right[0]) if right.size else smooth.size)
    return np.arange(max(begin, before), min(end, after + 1))


def _from_three(curve: _Curve, line: int) -> tuple[float, float, float]:
    """Vertex of the parabola through the logarithms of three lines, mended by what the window makes of a tone."""
    before, top, after = np.log(curve.power[line - 1 : line + 2])
    bend = before - 2 * top + after
    vertex = 0.5 * (before - after) / bend
    # Each logarithm has the line's relative error.
    spread = np.hypot(np.hypot(0.5 - vertex, 0.5 + vertex), 2 * vertex) / abs(bend)
    std_hz = float(spread * curve.relative_std[line] * curve.spacing_hz)
    if not curve.tonal:
        height = np.exp(top - (before - after) ** 2 / (8 * bend))
        return float(curve.frequency_hz[line] + vertex * curve.spacing_hz), std_hz, float(height)
    offset, slope, shown = _tone(curve.window, float(vertex))
    return curve.frequency_hz[line] + offset * curve.spacing_hz, slope * std_hz, float(curve.power[line] / shown)


def _tone(window: Real, vertex: float) -> tuple[float, float, float]:
    """Where between lines a tone lies whose lines give this vertex, the slope of that, and what its line shows."""
    offsets = np.arange(-32, 33) / 64
    shown = leakage(window, np.stack([offsets + 1, offsets, offsets - 1]))
    before, top, after = np.log(shown + np.finfo(float).tiny)
    vertices = 0.5 * (before - after) / (before - 2 * top + after)
    offset = np.interp(vertex, vertices, offsets)
    slope = np.interp(vertex, vertices, np.gradient(offsets, vertices))
    return float(offset), float(slope), float(np.interp(offset, offsets, shown[1]))


def _from_resonance(curve: _Curve, line: int, run: Whole) -> tuple[float, float, float]:
    """Fit of 1/G to the lines above half the peak: a parabola in frequency, a cubic where there are lines for it.

    A lone resonance is a parabola near its top; its neighbours skew it, which the cubic term takes up. Averaged
    spectra follow a gamma distribution, whose canonical link is 1/G: one step of scoring from a polynomial in log G
    (McCullagh & Nelder 1989, chapter 8) is the fit of 1/G without the bias that inverting noisy lines has.
    """
    x = (curve.frequency_hz[run] - curve.frequency_hz[line]) / curve.spacing_hz
    for terms in (4, 3):
        fitted = _vertex(x, curve.power[run], terms) if run.size >= 2 * terms or terms == 3 else None
        if fitted is not None:
            top, height, gradient = fitted
            relative_std = float(np.median(curve.relative_std[run])) * np.sqrt(line_correlation(curve.window))
            frequency_hz = float(curve.frequency_hz[line] + top * curve.spacing_hz)
            return frequency_hz, float(relative_std * gradient * curve.spacing_hz), height
    # No maximum inside: so flat and noisy a top lies anywhere above half of it.
    flat_std_hz = float(np.ptp(x) * curve.spacing_hz / np.sqrt(12))
    return float(curve.frequency_hz[line]), flat_std_hz, float(curve.power[line])


def _vertex(x: Real, power: Real, terms: int) -> tuple[float, float, float] | None:
    """Where a fitted 1/G has its minimum, G there, and the vertex's std for lines of relative std 1."""
    basis = np.vander(x, terms, increasing=True)
    expected = np.exp(basis @ np.linalg.lstsq(basis, np.log(power), rcond=None)[0])
    weighted = basis * expected[:, np.newaxis]
    target = expected * (1 / expected - (power - expected) / expected**2)
    inverse = Polynomial(np.linalg.lstsq(weighted, target, rcond=None)[0])
    bend = inverse.deriv(2)
    vertices = [float(root.real) for root in inverse.deriv().roots() if abs(root.imag) < 1e-9]
    inside = [root for root in vertices if x[0] <= root <= x[-1] and bend(root) > 0 and inverse(root) > 0]
    if not inside:
        return None
    top = min(inside, key=abs)
    # The vertex moves by -(d/dx of what a coefficient multiplies) / (second derivative).
    slopes = np.arange(terms) * top ** np.maximum(np.arange(terms) - 1, 0) / -bend(top)
    covariance = np.linalg.inv(weighted.T @ weighted)
    return top, float(1 / inverse(top)), float(np.sqrt(slopes @ covariance @ slopes))


def _merged(named: list[tuple[_Found, str, str]], resolution_hz: float, count: int) -> tuple[Peak, ...]:
    """Gather peaks of several channels under one name, the strongest channel first."""
    one_unit = len({unit for _, _, unit in named}) == 1

    def strength(entry: tuple[_Found, str, str]) -> float:
        return entry[0].power if one_unit else entry[0].over_floor

    groups: list[list[tuple[_Found, str, str]]] = []
    # The strongest first, so that each name carries the frequency of the channel that knows it best.
    for entry in sorted(named, key=strength, reverse=True):
        peak, channel, _ = entry
        for group in groups:
            first = group[0][0]
            apart = abs(peak.frequency_hz - first.frequency_hz)
            within = max(resolution_hz, 3 * float(np.hypot(peak.frequency_std_hz, first.frequency_std_hz)))
            if apart <= within and channel not in {name for _, name, _ in group}:
                group.append(entry)
                break
        else:
            groups.append([entry])
    peaks = [_peak(group[0][0], group[0][2], tuple(name for _, name, _ in group)) for group in groups]
    return tuple(peaks[:count])


def _peak(found: _Found, unit: str, channels: tuple[str, ...], *, magnitude: bool = False) -> Peak:
    height, relative_std = found.power, found.relative_std
    if magnitude:
        height, relative_std = float(np.sqrt(height)), relative_std / 2
    return Peak(
        frequency_hz=float(found.frequency_hz),
        frequency_std_hz=found.frequency_std_hz,
        height=height,
        height_std=height * relative_std,
        unit=unit,
        channels=channels,
    )


def _spacing(frequency_hz: Real) -> float:
    return float(np.median(np.diff(frequency_hz))) if frequency_hz.size > 1 else 0.0


def _require(count: int, false_alarm: float) -> None:
    if count < 1:
        raise EstimateError(f"count is {count}; ask for at least one peak")
    if not 0 < false_alarm < 1:
        raise EstimateError(f"false_alarm is {false_alarm}; it must lie between 0 and 1")
