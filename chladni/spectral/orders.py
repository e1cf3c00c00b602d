"""Order tracking: maps by resampling over the shaft's angle, cuts of single orders with their phase."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np
import scipy.fft

from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError
from chladni.signals.order_spectra import OrderCuts, OrderMap, OrderMethod
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.provenance import Provenance
from chladni.signals.rotation import Rotation
from chladni.signals.time_series import TimeSeries
from chladni.spectral.filters import measured_samples, require_measured
from chladni.spectral.peaks import find_peaks
from chladni.spectral.vold_kalman import smooth_amplitudes

# A shaft that turns back farther than that has reversed; less is noise of what tells its angle.
MOST_BACK_REVOLUTIONS = 0.5
# Samples are doubled before splines of this degree are laid through them: up to 80 % of half the sample rate they are
# then true to (0.2/0.8)^6 = 2.4e-4 (Thevenaz, Blu 2000, IEEE Trans. Medical Imaging 19(7)).
OVERSAMPLING: Final = 2
SPLINE_DEGREE: Final = 5
USABLE_SHARE = 0.8
# A spline of this degree forgets a sample by 0.43 for each of the doubled ones between (Thevenaz, Blu 2000, table 1),
# and the doubling reaches over ten: so many samples off, what isn't there is less than rounding.
SPLINE_MARGIN: Final = 64
BATCH_SAMPLES = 1 << 18
MOST_VALUES = 1 << 27
# Straight lines between so many knots miss a ripple at the band's edge by 1 - sinc^2(1/40) = 0.2 %.
KNOTS_A_BANDWIDTH = 20
# Width of a Hann window's main lobe, 3 dB down, in lines (Harris 1978, table 1).
HANN_WIDTH = 1.44


@dataclass(frozen=True, slots=True, kw_only=True)
class _Turned:
    """Samples with the angle at which each was taken."""

    series: TimeSeries
    revolutions: Real
    """``[sample]``, never falling where known; NaN elsewhere."""

    def runs(self) -> Iterator[tuple[int, int]]:
        edges = np.flatnonzero(np.diff(np.isfinite(self.revolutions), prepend=False, append=False))
        yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)

    def windows(self, length: float, overlap: float) -> "list[_Window]":
        """Stretches of so many revolutions, one after another in each run."""
        found = []
        for first, last in self.runs():
            turned = self.revolutions[first:last]
            count = int((turned[-1] - turned[0] - length) / (length * (1 - overlap)) + 1e-9) + 1
            if turned[-1] - turned[0] < length:
                continue
            middles = turned[0] + length / 2 + np.arange(count) * length * (1 - overlap)
            edges = first + np.searchsorted(turned, np.stack([middles - length / 2, middles + length / 2]))
            quarter = np.interp(
                np.stack([middles - length / 4, middles, middles + length / 4]),
                turned,
                np.arange(first, last) / self.series.sample_rate_hz,
            )
            for number, middle in enumerate(middles.tolist()):
                found.append(
                    _Window(
                        middle=middle,
                        length=length,
                        samples=slice(int(edges[0, number]), int(edges[1, number])),
                        time_s=float(quarter[1, number]),
                        speed_hz=float(length / 2 / (quarter[2, number] - quarter[0, number])),
                    )
                )
        if not found:
            most = max((self.revolutions[b - 1] - self.revolutions[a] for a, b in self.runs()), default=0.0)
            raise EstimateError(
                f"the shaft turns {most:.3g} times without a break, and a window takes {length:g} revolutions; give "
                "fewer, or a longer record"
            )
        return found


@dataclass(frozen=True, slots=True, kw_only=True)
class _Window:
    """So many revolutions about a middle, in revolutions; its samples, and time and speed in its middle."""

    middle: float
    length: float
    samples: slice
    time_s: float
    speed_hz: float


def order_map(
    source: SeriesLike,
    rotation: Rotation,
    *,
    highest_order: float | None = None,
    revolutions: float = 10.0,
    overlap: float = 0.5,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> OrderMap:
    """Give amplitudes over order and time.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        vibration; the rotation may have another clock rate.
    rotation
        From `chladni.rotation`.
    highest_order
        By default the highest that stays below 80 % of half the sample rate at the highest speed.
    revolutions
        Length of a slice; orders closer than 2/revolutions run together.
    overlap
        Share of a slice that the next one repeats, 0 <= overlap < 1.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    OrderMap
        Orders 1/revolutions apart.

    Raises
    ------
    EstimateError
        When the rotation and the series don't overlap for a slice, the shaft turns back, or an argument is out of its
        range.

    Notes
    -----
    Computed order tracking (Fyfe & Munck 1997, Mechanical Systems and Signal Processing 11(2)): each slice is
    resampled at equal steps of angle, fine enough that nothing aliases, weighted by a Hann window and transformed.
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    turned = _turned(series, rotation, revolutions, overlap)
    windows = turned.windows(revolutions, overlap)
    fastest_hz = max(window.speed_hz for window in windows)
    usable_hz = USABLE_SHARE * series.sample_rate_hz / 2
    highest = usable_hz / fastest_hz if highest_order is None else highest_order
    if not 0 < highest < np.inf:
        raise EstimateError(f"highest_order is {highest:g}; it must be above 0")
    lines = np.arange(int(highest * revolutions + 1e-9) + 1)
    if len(series.channels) * len(windows) * lines.size > MOST_VALUES:
        raise EstimateError(
            f"{len(windows)} slices of {lines.size} orders are more than fit in memory; give a lower highest_order, "
            "less overlap, or more revolutions a slice"
        )
    measured = measured_samples(series)
    values = np.empty((len(series.channels), len(windows), lines.size))
    for row, samples, mask in zip(values, series.values, measured, strict=True):
        row[:] = _map_of(turned, windows, samples, mask, lines / revolutions)
    speeds_hz = np.array([window.speed_hz for window in windows])
    values[:, np.outer(speeds_hz, lines / revolutions) > usable_hz] = np.nan
    return OrderMap(
        order=lines / revolutions,
        time_s=np.array([window.time_s for window in windows]),
        speed_hz=speeds_hz,
        values=values,
        channels=series.channels,
        start_time_ns=series.start_time_ns,
        revolutions=revolutions,
        notes=rotation.notes,
    )


def order_cuts(
    source: SeriesLike,
    rotation: Rotation,
    *,
    orders: Sequence[float] = (1.0,),
    method: OrderMethod = "angle",
    revolutions: float = 8.0,
    overlap: float = 0.75,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> OrderCuts:
    """Give amplitude and phase of single orders over time and speed.

    Parameters
    ----------
    series, rotation
        As for `order_map`.
    orders
        Any multiples above 0, such as 5.7, different from each other.
    method
        ``angle``: transform over windows of so many revolutions. ``vold-kalman``: all orders at once, each an
        oscillation along the shaft's angle whose amplitude changes slowly; it parts orders that are close or cross.
    revolutions
        Length of a window; orders closer than 2/revolutions run together, and an amplitude that changes within it is
        averaged. The band of ``vold-kalman`` is as wide as that of such a window, 1.44/revolutions orders 3 dB down.
    overlap
        Share of a window that the next one repeats.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    OrderCuts
        One point for each window.

    Raises
    ------
    EstimateError
        As `order_map` does, or when orders aren't different.

    Notes
    -----
    ``angle``: 2 sum(w x exp(-j 2 pi o theta) dtheta) / sum(w dtheta) with a Hann window w over the angle theta, which
    no sampling over the angle comes into (time-variant discrete Fourier transform; Blough 2003, Journal of Sound and
    Vibration 265(1)). ``vold-kalman``: second generation, two poles (Vold & Leuridan 1993, SAE 931288; Tuma 2005,
    Int. Congress on Sound and Vibration), over the angle: the least squares of x - mean - sum Re(a exp(j 2 pi o
    theta)), and of r times the second differences of the mean and of each a, r^2 = (sqrt(2) - 1)/(2 - 2 cos(pi band
    step))^2.

    Examples
    --------
    >>> t = np.arange(20_000) / 1000
    >>> angle = 10 * t + t**2
    >>> turned = Rotation(time_s=t, revolutions=angle, start_time_ns=0, source="phase")
    >>> cuts = order_cuts(3 * np.cos(2 * np.pi * 2 * angle + 0.5), turned, orders=[2.0], sample_rate_hz=1000.0)
    >>> second = cuts.values[0, 0]
    >>> [round(float(part), 2) for part in (abs(second[7]), np.angle(second[7]))]
    [3.0, 0.5]
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    wanted = np.atleast_1d(np.asarray(orders, dtype=np.float64))
    if not (
        wanted.size and np.all(wanted > 0) and np.all(np.isfinite(wanted)) and np.unique(wanted).size == wanted.size
    ):
        raise EstimateError(f"orders {', '.join(f'{one:g}' for one in wanted)}: give different ones above 0")
    turned = _turned(series, rotation, revolutions, overlap)
    windows = turned.windows(revolutions, overlap)
    speeds_hz = np.array([window.speed_hz for window in windows])
    measured = measured_samples(series)
    if method == "angle":
        cut = _cut_by_angle
    elif method == "vold-kalman":
        cut = _cut_by_vold_kalman
    else:
        raise EstimateError(f"method {method!r} is none of angle, vold-kalman")
    values = np.stack(
        [cut(turned, windows, row, mask, wanted) for row, mask in zip(series.values, measured, strict=True)]
    )
    # What lies above half the sample rate isn't in the samples.
    values[:, np.outer(wanted, speeds_hz) > series.sample_rate_hz / 2] = np.nan
    return OrderCuts(
        orders=wanted,
        time_s=np.array([window.time_s for window in windows]),
        speed_hz=speeds_hz,
        values=values,
        channels=series.channels,
        start_time_ns=series.start_time_ns,
        method=method,
        notes=rotation.notes,
    )


def strongest_orders(maps: Sequence[OrderMap], *, count: int) -> tuple[float, ...]:
    """Name the orders that stand out of a map, averaged over its slices; the lowest first.

    Parameters
    ----------
    maps
        One a sampling grid.
    count
        Most to name; the strongest of all channels are.

    Returns
    -------
    tuple of float
        Each the roundest number within twice its uncertainty, or a tenth of a line.

    Raises
    ------
    EstimateError
        When none stands out of the scatter, see `find_peaks`.
    """
    peaks = [peak for one in maps for peak in find_peaks(_mean_spectrum(one), count=count)]
    # A tenth of a line off, a cut is a third of a percent too low.
    tenth = max((0.1 / one.revolutions for one in maps), default=0.0)
    ranked = dict.fromkeys(_roundest(peak.frequency_hz, max(tenth, 2 * peak.frequency_std_hz)) for peak in peaks)
    if not ranked:
        raise EstimateError("no order stands out of the map; name the orders")
    return tuple(sorted(list(ranked)[:count]))


def _mean_spectrum(one: OrderMap) -> PowerSpectralDensity:
    """Power density over order, which the search for peaks takes as it takes one over frequency."""
    bandwidth = 1.5 / one.revolutions
    averages = np.stack([np.maximum(np.isfinite(row).sum(axis=0), 1) for row in one.values])
    power = np.stack([np.nansum(np.square(row), axis=0) for row in one.values])
    density = power / (2 * averages * bandwidth)
    return PowerSpectralDensity(
        frequency_hz=one.order,
        values=density,
        # Slices that overlap by half count for 36/38 of their number (Welch 1967).
        std=density / np.sqrt(averages),
        channels=one.channels,
        bandwidth_hz=bandwidth,
        provenance=Provenance(
            estimator="PSD",
            window="hann",
            segment_s=one.revolutions,
            averages=one.time_s.size,
            effective_averages=float(one.time_s.size),
        ),
    )


def _roundest(value: float, within: float) -> float:
    return next((near for digits in range(6) if abs((near := round(value, digits)) - value) <= within), value)


def _turned(series: TimeSeries, rotation: Rotation, revolutions: float, overlap: float) -> _Turned:
    if not 0 < revolutions < np.inf:
        raise EstimateError(f"a window of {revolutions:g} revolutions; give a number above 0, such as 10")
    if not 0 <= overlap < 1:
        raise EstimateError(f"overlap is {overlap:g}; it must be at least 0 and below 1")
    require_measured(series)
    angle = rotation.at(series)
    # Of a shaft at rest the angle is noise, which no window may run backwards over.
    highest = np.fmax.accumulate(angle)
    back = np.subtract(highest, angle, out=angle)
    unknown = np.isnan(back)
    highest[unknown] = np.nan
    if not unknown.all() and np.nanmax(back) > MOST_BACK_REVOLUTIONS:
        where_s = float(np.nanargmax(back)) / series.sample_rate_hz
        raise EstimateError(
            f"the shaft turns back by {np.nanmax(back):.3g} revolutions at {where_s:.3f} s; choose a part in which "
            "it turns one way"
        )
    return _Turned(series=series, revolutions=highest)


def _map_of(turned: _Turned, windows: "list[_Window]", values: Real, measured: Mask, orders: Real) -> Real:
    found = np.full((len(windows), orders.size), np.nan)
    hann: dict[int, Real] = {}
    for first, last in _batches(windows):
        samples = _Splined.of(values, measured, windows[first].samples.start, windows[last - 1].samples.stop)
        for number, window in enumerate(windows[first:last], first):
            if not measured[window.samples].all():
                continue
            angle = turned.revolutions[window.samples]
            # As dense as the samples are where they're densest.
            step = max(float(np.diff(angle).min(initial=np.inf)), window.length / (4 * angle.size))
            points = scipy.fft.next_fast_len(max(int(window.length / step) + 1, 2 * orders.size), real=True)
            at = window.middle + window.length * (np.arange(points) / points - 0.5)
            place = np.interp(at, angle, np.arange(window.samples.start, window.samples.stop))
            weight = hann.setdefault(points, 1 - np.cos(2 * np.pi * np.arange(points) / points))
            found[number] = 2 / points * np.abs(scipy.fft.rfft(samples.at(place) * weight)[: orders.size])
    # The line at order 0 has no mirror image.
    found[:, 0] /= 2
    return found


def _batches(windows: "list[_Window]") -> Iterator[tuple[int, int]]:
    """Give first and last + 1 of windows that lie within so many samples, or of one that is longer."""
    first = 0
    for last in range(1, len(windows) + 1):
        reach = windows[last].samples.stop - windows[first].samples.start if last < len(windows) else np.inf
        if reach > BATCH_SAMPLES:
            yield first, last
            first = last


@dataclass(frozen=True, slots=True, kw_only=True)
class _Splined:
    """Samples with the coefficients of a spline through twice as many."""

    weights: Real
    start: int

    @classmethod
    def of(cls, values: Real, measured: Mask, first: int, last: int) -> Self:
        """Lay it through the samples from a first to before a last, and some beside them that it hangs on."""
        from scipy.ndimage import spline_filter1d
        from scipy.signal import resample_poly

        part = slice(max(first - SPLINE_MARGIN, 0), last + SPLINE_MARGIN)
        filled = np.where(measured[part], values[part], 0.0).astype(np.float64)
        fine = np.asarray(resample_poly(filled, OVERSAMPLING, 1))
        return cls(weights=spline_filter1d(fine, SPLINE_DEGREE, mode="mirror"), start=part.start)

    def at(self, place: Real) -> Real:
        """Give values at places counted in samples of the record."""
        from scipy.ndimage import map_coordinates

        fine = OVERSAMPLING * (place[None] - self.start)
        return np.asarray(map_coordinates(self.weights, fine, order=SPLINE_DEGREE, mode="mirror", prefilter=False))


def _cut_by_angle(turned: _Turned, windows: "list[_Window]", values: Real, measured: Mask, orders: Real) -> Complex:
    found = np.full((orders.size, len(windows)), np.nan, dtype=np.complex128)
    for number, window in enumerate(windows):
        if not measured[window.samples].all():
            continue
        angle = turned.revolutions[window.samples]
        weight = (1 + np.cos(2 * np.pi * (angle - window.middle) / window.length)) * np.gradient(angle)
        turning = np.exp(-2j * np.pi * np.outer(orders, angle))
        found[:, number] = 2 * (turning @ (weight * values[window.samples])) / weight.sum()
    return found


def _cut_by_vold_kalman(
    turned: _Turned, windows: "list[_Window]", values: Real, measured: Mask, orders: Real
) -> Complex:
    found = np.full((orders.size, len(windows)), np.nan, dtype=np.complex128)
    whole = np.array([bool(measured[window.samples].all()) for window in windows])
    middles = np.array([window.middle for window in windows])
    run_of = np.array([window.samples.start for window in windows])
    band = HANN_WIDTH / windows[0].length
    for first, last in turned.runs():
        chosen = np.flatnonzero(whole & (run_of >= first) & (run_of < last))
        if not chosen.size:
            continue
        angle = turned.revolutions[first:last]
        used = measured[first:last]
        step = 1 / (KNOTS_A_BANDWIDTH * band)
        amplitudes = smooth_amplitudes(angle, np.where(used, values[first:last], 0.0), used, orders, band, step)
        knots = angle[0] + step * np.arange(amplitudes.shape[1])
        for row, one in enumerate(amplitudes):
            found[row, chosen] = np.interp(middles[chosen], knots, one)
    return found
