"""Shock response spectra by ramp-invariant filters."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from math import ceil, floor, log2
from typing import TYPE_CHECKING, Any, Literal, cast, get_args

import numpy as np

from chladni.io.missing_samples import MissingSamples
from chladni.io.source import Blocks, SeriesLike, blocks_of, extent_of, is_blocks, log_or_series
from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel, Names
from chladni.signals.errors import EstimateError
from chladni.signals.number_range import require_in_range
from chladni.signals.shock_response import ShockQuantity, ShockResponse
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.units import integrated
from chladni.signals.wording import counted
from chladni.spectral.blocks import leading_part
from chladni.spectral.filters import channel_runs, measured_samples, require_measured

if TYPE_CHECKING:
    from chladni.spectral.oscillator_bank import OscillatorBank

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
# What oscillators are fed at once: the samples between those are many times as many.
SAMPLES_AT_ONCE, VALUES_AT_ONCE = 1 << 16, 1 << 18


def srs(
    source: SeriesLike | Blocks,
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
        A log (read block by block when it's large), the path to one, a series, an array ``[channel, sample]``, or
        consecutive blocks of a series, which need `band_hz` or `frequencies_hz`: accelerations, of all channels.
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
    _require_options(q, offset)
    blocks, longest = _opened(
        source, quantity, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s
    )
    missing = MissingSamples()
    lead, parts = leading_part(missing.watch(blocks), 1)
    first = lead[0]
    lines_hz = _lines(first.sample_rate_hz, longest, band_hz, lines_an_octave, frequencies_hz)
    offsets = _medians(blocks) if offset == "median" else np.zeros(len(first.channels)) if offset == "keep" else None
    accumulator = ShockAccumulator(
        first.channels, first.sample_rate_hz, lines_hz=lines_hz, q=q, quantity=quantity, offsets=offsets
    )
    for one in parts:
        accumulator.update(one)
    found = accumulator.result()
    return replace(found, notes=(*missing.sentences(from_ns=first.start_time_ns), *found.notes))


class ShockAccumulator:
    """Running shock response spectra, see `srs`; mutable, the result is a frozen value.

    Parameters
    ----------
    channels, sample_rate_hz
        Of all blocks.
    lines_hz
        Natural frequencies, rising.
    q, quantity
        As for `srs`.
    offsets
        ``[channel]``, taken off first; None for the first sample of each.
    """

    def __init__(
        self,
        channels: Sequence[Channel],
        sample_rate_hz: float,
        *,
        lines_hz: Real,
        q: float,
        quantity: ShockQuantity,
        offsets: Real | None = None,
    ) -> None:
        _require_accelerations(channels, quantity)
        self.channels, self.sample_rate_hz = tuple(channels), sample_rate_hz
        self._lines_hz, self._q, self._quantity = lines_hz, q, quantity
        count = len(self.channels)
        self._offsets = np.full(count, np.nan) if offsets is None else offsets.copy()
        self._largest = np.zeros(count)
        self._known, self._runs, self._running = (np.zeros(count, dtype=kind) for kind in (bool, np.intp, bool))
        self._end_ns: int | None = None
        factors = np.exp2(np.ceil(np.log2(np.maximum(POINTS_A_CYCLE * lines_hz / sample_rate_hz, 1)))).astype(int)
        self._banks = [
            (np.flatnonzero(factors == one), self._bank(lines_hz[factors == one], one))
            for one in np.unique(factors).tolist()
        ]

    def update(self, block: TimeSeries) -> None:
        """Take in the next block; `EstimateError` when it has other channels or another rate."""
        if block.channels != self.channels or block.sample_rate_hz != self.sample_rate_hz:
            raise EstimateError("blocks of a shock response need the same channels and rate; resample them first")
        if self._end_ns is not None and abs(block.start_time_ns - self._end_ns) > NS_PER_S / self.sample_rate_hz / 2:
            self._end(self._running.copy())
        self._end_ns = block.start_time_ns + round(block.duration_s * NS_PER_S)
        measured = measured_samples(block)
        largest = np.max(np.abs(block.values), axis=1, initial=0.0, where=measured)
        self._largest = np.maximum(self._largest, largest)
        for first, last in _steady_parts(measured):
            present = measured[:, first]
            self._end(self._running & ~present)
            self._begin(present & ~self._running, block.values[:, first].astype(np.float64))
            rows = np.flatnonzero(present)
            for some in np.array_split(rows, max(1, rows.size * (last - first) // VALUES_AT_ONCE)):
                if some.size:
                    values = block.values[some, first:last].astype(np.float64) - self._offsets[some, None]
                    for _, bank in self._banks:
                        bank.feed(some, values)

    def result(self) -> ShockResponse:
        """Give the spectra; no more blocks may follow."""
        self._end(self._running.copy())
        if not self._known.all():
            empty = [c.name for c, known in zip(self.channels, self._known, strict=True) if not known]
            raise EstimateError(f"{', '.join(empty)}: nothing was measured; leave it out")
        require_in_range(self.channels, self._largest)
        positive, negative = (np.zeros((len(self.channels), self._lines_hz.size)) for _ in range(2))
        for lines, bank in self._banks:
            positive[:, lines], negative[:, lines] = bank.highest, -bank.lowest
        units = [_unit(channel.unit, self._quantity) for channel in self.channels]
        return ShockResponse(
            frequency_hz=self._lines_hz,
            positive=positive,
            negative=negative,
            quantity=self._quantity,
            q=self._q,
            channels=tuple(
                replace(c, unit=unit, overload=None) for c, unit in zip(self.channels, units, strict=True)
            ),
            offset=self._offsets,
            notes=self._notes(),
        )

    def _bank(self, lines_hz: Real, factor: int) -> "OscillatorBank":
        # Imported here, since numba takes half a second.
        from chladni.spectral.oscillator_bank import OscillatorBank

        rate_hz = factor * self.sample_rate_hz
        filters = [_coefficients(one, rate_hz, self._q, self._quantity) for one in lines_hz.tolist()]
        numerators, denominators = (np.stack(part) for part in zip(*filters, strict=True))
        return OscillatorBank(
            len(self.channels),
            lines_hz,
            self.sample_rate_hz,
            factor,
            numerators=numerators,
            denominators=denominators,
        )

    def _begin(self, rows: Mask, values: Real) -> None:
        fresh = rows & ~self._known & np.isnan(self._offsets)
        self._offsets[fresh] = values[fresh]
        self._known |= rows
        self._running |= rows
        self._runs[rows] += 1

    def _end(self, rows: Mask) -> None:
        if rows.any():
            for _, bank in self._banks:
                bank.end(np.flatnonzero(rows))
            self._running &= ~rows

    def _notes(self) -> tuple[str, ...]:
        notes = []
        broken = [c.name for c, runs in zip(self.channels, self._runs, strict=True) if runs > 1]
        if broken:
            notes.append(
                f"{', '.join(broken)}: samples are missing; oscillators begin anew after each gap, so that a shock "
                "that spans one is read too low"
            )
        if self._lines_hz[-1] > self.sample_rate_hz / RATE_OVER_HIGHEST * (1 + 1e-9):
            tenth_hz = self.sample_rate_hz / RATE_OVER_HIGHEST
            notes.append(
                f"above {tenth_hz:g} Hz, a tenth of the sample rate, what the sampling has cut off may be missing"
            )
        return tuple(notes)


def _coefficients(natural_hz: float, rate_hz: float, q: float, quantity: ShockQuantity) -> tuple[Real, Real]:
    from scipy.signal import cont2discrete

    omega, damping = 2 * np.pi * natural_hz, 1 / (2 * q)
    numerator, scale = {
        "absolute-acceleration": (np.array([2 * damping, 1.0]), 1.0),
        "relative-displacement": (np.array([-1.0]), omega**-2),
        "pseudo-velocity": (np.array([-1.0]), 1 / omega),
    }[quantity]
    # In units of the natural frequency, so that coefficients are of one size at every frequency.
    b, a, _ = cont2discrete((numerator, np.array([1.0, 2 * damping, 1.0])), omega / rate_hz, method="foh")
    return scale * np.ravel(b), np.asarray(a, dtype=np.float64)


def _steady_parts(measured: Mask) -> Iterator[tuple[int, int]]:
    """Give first and last + 1 of the stretches in which no channel begins or ends to be measured, none too long."""
    changes = np.flatnonzero((measured[:, 1:] != measured[:, :-1]).any(axis=0)) + 1
    edges = [0, *changes.tolist(), measured.shape[1]]
    for first, last in pairwise(edges):
        for begin in range(first, last, SAMPLES_AT_ONCE):
            yield begin, min(begin + SAMPLES_AT_ONCE, last)


def _require_options(q: float, offset: str) -> None:
    if not 0.5 < q < np.inf:
        raise EstimateError(f"q is {q:g}; it must be finite and above 0.5, such as 10 for 5 % damping")
    if offset not in get_args(Offset):
        raise EstimateError(f"offset {offset!r} is none of {', '.join(get_args(Offset))}")


def _opened(
    source: SeriesLike | Blocks, quantity: ShockQuantity, *, sample_rate_hz: float | None, **part: Any
) -> tuple[TimeSeries | Blocks, int | None]:
    """Give the samples, and the length of the longest run; None of a stream, which doesn't say it before its end."""
    if is_blocks(source):
        return blocks_of(source, sample_rate_hz=sample_rate_hz, **part), None
    opened = log_or_series(cast("SeriesLike", source), sample_rate_hz=sample_rate_hz)
    blocks = blocks_of(opened, **part)
    if isinstance(blocks, TimeSeries):
        return blocks, _longest_run(blocks, quantity)
    rate_hz, duration_s = extent_of(opened, **part)
    return blocks, round(rate_hz * duration_s)


def _longest_run(series: TimeSeries, quantity: ShockQuantity) -> int:
    _require_accelerations(series.channels, quantity)
    measured = require_measured(series)
    return max(last - first for row in measured for first, last in channel_runs(row))


def _medians(source: TimeSeries | Blocks) -> Real:
    if not isinstance(source, TimeSeries):
        raise EstimateError(
            "the median of a record that is read block by block isn't known; take offset first or keep, or a part of "
            "the record that fits in memory"
        )
    rows = zip(source.values, measured_samples(source), strict=True)
    return np.array([float(np.median(values[mask].astype(np.float64))) for values, mask in rows])


def _lines(
    sample_rate_hz: float,
    longest: int | None,
    band_hz: tuple[float, float] | None,
    lines_an_octave: int,
    frequencies_hz: Real | Sequence[float] | None,
) -> Real:
    nyquist_hz = sample_rate_hz / 2
    if frequencies_hz is None:
        lines_hz = _ladder(sample_rate_hz, longest, band_hz, lines_an_octave)
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


def _ladder(
    sample_rate_hz: float, longest: int | None, band_hz: tuple[float, float] | None, lines_an_octave: int
) -> Real:
    if band_hz is None:
        if longest is None:
            raise EstimateError("blocks don't say how long the record is; give band_hz or frequencies_hz")
        # Slower oscillators see no more of the shock than its change of velocity.
        band_hz = (sample_rate_hz / longest, sample_rate_hz / RATE_OVER_HIGHEST)
        if longest <= RATE_OVER_HIGHEST:
            raise EstimateError(f"{counted(longest, 'sample')} without a gap: too few for a spectrum; read more")
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


def _require_accelerations(channels: Sequence[Channel], quantity: ShockQuantity) -> None:
    # Who says no unit gives an array: its acceleration has the unit of its samples, the rest has none.
    known = (*ACCELERATIONS, "1") if quantity == "absolute-acceleration" else ACCELERATIONS
    odd = [channel for channel in channels if channel.unit not in known]
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
