"""Shock response spectra by ramp-invariant filters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, log2
from typing import Literal

import numpy as np

from chladni.io.source import SeriesLike, series_of
from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError
from chladni.signals.shock_response import ShockQuantity, ShockResponse
from chladni.signals.time_series import TimeSeries
from chladni.signals.units import integrated
from chladni.spectral.filters import channel_runs, require_measured

Offset = Literal["first", "median", "keep"]

ACCELERATIONS = ("m/s^2", "rad/s^2")
# Samples joined by straight lines lose sinc^2(1/32) = 0.3 % of a sine of so many points, and their largest may lie
# 1 - cos(pi/32) = 0.5 % under its peak.
POINTS_A_CYCLE = 32
# ISO 18431-4:2007 wants the sample rate ten times the highest natural frequency.
RATE_OVER_HIGHEST = 10
# The octaves' own middle (IEC 61260-1), so that spectra of all records have the same lines.
MIDDLE_HZ = 1000.0
MOST_LINES = 10_000


def srs(
    source: SeriesLike,
    *,
    q: float = 10.0,
    quantity: ShockQuantity = "absolute-acceleration",
    band_hz: tuple[float, float] | None = None,
    lines_an_octave: int = 12,
    frequencies_hz: Real | Sequence[float] | None = None,
    offset: Offset = "first",
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> ShockResponse:
    """Compute shock response spectra of base accelerations.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        accelerations, of all channels.
    q
        Amplification of the oscillators at resonance, above 0.5; 10 is a damping ratio of 5 %.
    quantity
        ``absolute-acceleration`` of the oscillator, its ``relative-displacement`` to the base, or its
        ``pseudo-velocity``, which is that times its angular natural frequency.
    band_hz
        Lowest and highest natural frequency; by default from one over the record's length to a tenth of the sample
        rate.
    lines_an_octave
        Natural frequencies an octave, at 1 kHz 2^(k/n).
    frequencies_hz
        Natural frequencies themselves, rising, in place of `band_hz`.
    offset
        What is taken off first, so that the oscillators begin at rest, such as gravity: the ``first`` sample; the
        ``median``, which noise moves less, of a record that is quiet for most of its length; or nothing, ``keep``,
        which makes of an offset a step.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    ShockResponse
        Largest positive and negative response, during the record and in a period after it. Each unbroken run of
        samples begins at rest; the largest of all runs counts.

    Raises
    ------
    EstimateError
        When a channel is no acceleration, a natural frequency isn't between 0 and half the sample rate, or nothing
        was measured.

    Notes
    -----
    Oscillators that see straight lines between the samples (Smallwood 1981, Shock and Vibration Bulletin 51(1); ISO
    18431-4:2007), discretised by `scipy.signal.cont2discrete` with its triangle hold, which is the same. Absolute
    acceleration: (2 zeta s + 1)/(s^2 + 2 zeta s + 1), relative displacement: -1/omega^2/(s^2 + 2 zeta s + 1), with
    s in units of omega. Where a period of the oscillator has less than 32 samples, those between them are computed
    first, band-limited.

    Examples
    --------
    >>> t = np.arange(4000) / 20_000
    >>> pulse = np.where(t < 0.011, 500 * np.sin(np.pi * t / 0.011), 0.0)  # half a sine of 11 ms
    >>> spectrum = srs(pulse, q=1000.0, frequencies_hz=[0.8 / 0.011], sample_rate_hz=20e3)
    >>> float((spectrum.maximax[0, 0] / 500).round(2))  # nearly undamped: 1.77 times as much, at most
    1.77
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    _require_accelerations(series, quantity)
    if not 0.5 < q < np.inf:
        raise EstimateError(f"q is {q:g}; it must be finite and above 0.5, such as 10 for 5 % damping")
    measured = require_measured(series)
    lines_hz = _lines(series, measured, band_hz, lines_an_octave, frequencies_hz)
    bank = _Bank(lines_hz=lines_hz, rate_hz=series.sample_rate_hz, q=q, quantity=quantity)
    rows = [_of_channel(bank, values, mask, offset) for values, mask in zip(series.values, measured, strict=True)]
    units = [_unit(channel.unit, quantity) for channel in series.channels]
    return ShockResponse(
        frequency_hz=lines_hz,
        positive=np.stack([row.highest for row in rows]),
        negative=np.stack([-row.lowest for row in rows]),
        quantity=quantity,
        q=q,
        channels=tuple(replace(c, unit=unit, overload=None) for c, unit in zip(series.channels, units, strict=True)),
        offset=np.array([row.offset for row in rows]),
        notes=_notes(series, measured, lines_hz),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Extremes:
    highest: Real
    lowest: Real
    offset: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bank:
    """Oscillators of all natural frequencies."""

    lines_hz: Real
    rate_hz: float
    q: float
    quantity: ShockQuantity

    def extremes(self, run: Real) -> tuple[Real, Real]:
        """Give the highest and the lowest response of each oscillator, at least and at most 0, at rest before."""
        from scipy.signal import lfilter, resample_poly

        highest, lowest = np.zeros(self.lines_hz.size), np.zeros(self.lines_hz.size)
        factors = np.exp2(np.ceil(np.log2(np.maximum(POINTS_A_CYCLE * self.lines_hz / self.rate_hz, 1)))).astype(int)
        for factor in np.unique(factors).tolist():
            rate_hz = factor * self.rate_hz
            fine = run if factor == 1 else np.asarray(resample_poly(run, factor, 1))
            lines = np.flatnonzero(factors == factor)
            # What is left of the motion after the record has its peaks within a period.
            longest = ceil(rate_hz / self.lines_hz[lines[0]])
            padded = np.concatenate([fine, np.zeros(longest)])
            for line in lines.tolist():
                b, a = self._coefficients(float(self.lines_hz[line]), rate_hz)
                response = lfilter(b, a, padded[: fine.size + ceil(rate_hz / self.lines_hz[line])])
                highest[line], lowest[line] = max(response.max(), 0.0), min(response.min(), 0.0)
        return highest, lowest

    def _coefficients(self, natural_hz: float, rate_hz: float) -> tuple[Real, Real]:
        from scipy.signal import cont2discrete

        omega, damping = 2 * np.pi * natural_hz, 1 / (2 * self.q)
        numerator, scale = {
            "absolute-acceleration": (np.array([2 * damping, 1.0]), 1.0),
            "relative-displacement": (np.array([-1.0]), omega**-2),
            "pseudo-velocity": (np.array([-1.0]), 1 / omega),
        }[self.quantity]
        # In units of the natural frequency, so that coefficients are of one size at every frequency.
        b, a, _ = cont2discrete((numerator, np.array([1.0, 2 * damping, 1.0])), omega / rate_hz, method="foh")
        return scale * np.ravel(b), np.asarray(a, dtype=np.float64)


def _of_channel(bank: _Bank, values: Real, measured: Mask, offset: Offset) -> _Extremes:
    known = values[measured].astype(np.float64)
    taken = {"first": float(known[0]), "median": float(np.median(known)), "keep": 0.0}.get(offset)
    if taken is None:
        raise EstimateError(f"offset {offset!r} is none of first, median, keep")
    found = [bank.extremes(values[first:last].astype(np.float64) - taken) for first, last in channel_runs(measured)]
    return _Extremes(
        highest=np.max([highest for highest, _ in found], axis=0),
        lowest=np.min([lowest for _, lowest in found], axis=0),
        offset=taken,
    )


def _lines(
    series: TimeSeries,
    measured: Mask,
    band_hz: tuple[float, float] | None,
    lines_an_octave: int,
    frequencies_hz: Real | Sequence[float] | None,
) -> Real:
    nyquist_hz = series.sample_rate_hz / 2
    if frequencies_hz is None:
        lines_hz = _ladder(series, measured, band_hz, lines_an_octave)
    elif band_hz is not None:
        raise EstimateError("frequencies_hz and band_hz are both given; give one of them")
    else:
        lines_hz = np.atleast_1d(np.asarray(frequencies_hz, dtype=np.float64))
    if not (lines_hz.size and np.all(np.diff(lines_hz, prepend=0.0) > 0) and lines_hz[-1] <= nyquist_hz):
        asked = "" if band_hz is None else f", and {band_hz[0]:g} to {band_hz[1]:g} Hz were asked for"
        raise EstimateError(
            f"natural frequencies must rise, above 0 and up to half the sample rate, {nyquist_hz:g} Hz{asked}"
        )
    return lines_hz


def _ladder(series: TimeSeries, measured: Mask, band_hz: tuple[float, float] | None, lines_an_octave: int) -> Real:
    if band_hz is None:
        # Slower oscillators see no more of the shock than its change of velocity.
        longest = max(last - first for row in measured for first, last in channel_runs(row))
        band_hz = (series.sample_rate_hz / longest, series.sample_rate_hz / RATE_OVER_HIGHEST)
        if longest <= RATE_OVER_HIGHEST:
            raise EstimateError(f"{longest} samples without a gap are too few for a spectrum; read more")
    low_hz, high_hz = band_hz
    if not 0 < low_hz < high_hz < np.inf:
        raise EstimateError(f"a band from {low_hz:g} to {high_hz:g} Hz holds no natural frequency; give LOW < HIGH")
    if not 1 <= lines_an_octave <= MOST_LINES or lines_an_octave * log2(high_hz / low_hz) > MOST_LINES:
        raise EstimateError(
            f"{lines_an_octave} lines an octave from {low_hz:g} to {high_hz:g} Hz aren't between 1 and {MOST_LINES}; "
            "take 6 to 48 an octave"
        )
    # Ends that lie on a line up to rounding hold it.
    first = ceil(lines_an_octave * log2(low_hz / MIDDLE_HZ) - 1e-9)
    last = floor(lines_an_octave * log2(high_hz / MIDDLE_HZ) + 1e-9)
    return np.asarray(MIDDLE_HZ * np.exp2(np.arange(first, last + 1) / lines_an_octave), dtype=np.float64)


def _require_accelerations(series: TimeSeries, quantity: ShockQuantity) -> None:
    # Who says no unit gives an array: its acceleration has the unit of its samples, the rest has none.
    known = (*ACCELERATIONS, "1") if quantity == "absolute-acceleration" else ACCELERATIONS
    odd = [channel for channel in series.channels if channel.unit not in known]
    if odd:
        raise EstimateError(
            f"{odd[0].name} is in {odd[0].unit}; a shock response spectrum is of accelerations, in m/s^2: select "
            "those, or give the channel's unit"
        )


def _unit(unit: str, quantity: ShockQuantity) -> str:
    if quantity == "absolute-acceleration":
        return unit
    velocity = integrated(unit)
    return velocity if quantity == "pseudo-velocity" else integrated(velocity)


def _notes(series: TimeSeries, measured: Mask, lines_hz: Real) -> tuple[str, ...]:
    notes = []
    broken = [c.name for c, row in zip(series.channels, measured, strict=True) if len(list(channel_runs(row))) > 1]
    if broken:
        notes.append(
            f"{', '.join(broken)}: samples are missing; oscillators begin anew after each gap, so that a shock that "
            "spans one is read too low"
        )
    if lines_hz[-1] > series.sample_rate_hz / RATE_OVER_HIGHEST * (1 + 1e-9):
        notes.append(
            f"above {series.sample_rate_hz / RATE_OVER_HIGHEST:g} Hz, a tenth of the sample rate, what the sampling "
            "has cut off may be missing"
        )
    return tuple(notes)
