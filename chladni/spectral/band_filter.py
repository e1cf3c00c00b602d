"""Blocks of a stream band-passed, and integrated, so that they don't depend on where the blocks were cut."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from math import ceil, inf

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.units import integrated, power
from chladni.spectral.accumulator import require_finite
from chladni.spectral.held_samples import HeldSamples
from chladni.spectral.stretches import Runs

#: Order of the Butterworth prototype, 18 dB an octave: that of the flanks in ISO 2954:2012.
ORDER = 3
# The impulse response has then decayed to exp(-14), 8e-7 of what it began with: below what a record resolves.
DECAY_NEPERS = 14.0
# Of an impulse response; its spectrum and that of the samples take some hundreds of megabytes.
MOST_SAMPLES = 1 << 23
# Where an ideal interpolation is needed it decays as one over the distance; half of this many samples hold it.
LEAST_REACH = 64


class SharedTransforms:
    """Transform of the samples that were filtered last, for filters that are fed the same blocks in turn.

    Which samples they are is told by the run and the place in it; a filter that is elsewhere makes its own.
    """

    def __init__(self) -> None:
        self._key: tuple[int, int, int] | None = None
        self._spectrum = np.empty(0, np.complex128)

    def of(self, values: Real, length: int, *, run_ns: int, place: int) -> NDArray[np.complexfloating]:
        """Give ``[channel, line]`` of `values` that begin at a place of the run which starts at `run_ns`."""
        key = (run_ns, place, values.shape[1])
        if self._key != key:
            self._key, self._spectrum = key, np.asarray(scipy.fft.rfft(values, length), np.complex128)
        return self._spectrum


class BandFilter:
    """A filter without phase shift that has the magnitude of a Butterworth band-pass of third order.

    It is 3 dB down at the edges of the band. In the same step it integrates motions, exactly as 1/(j omega)^n, or
    gives the squared envelope. It is a finite impulse response, cut where the analogue filter's slowest pole has
    decayed by 14 nepers: each sample leans on those within `reach_s` of it, and on no others. What the cut costs is
    at most 5e-4 of the gain inside the band.

    Parameters
    ----------
    sample_rate_hz
        Rate of the blocks.
    band_hz
        Edges, 0 <= low < high <= half the rate. At 0 nothing is cut below, at half the rate nothing above.
    integrations
        How often motions are integrated over time; the band must then begin above 0.
    envelope
        Whether to give the squared envelope of what passes, abs(x + j Hilbert(x))^2, in place of it.
    transforms
        Shared with filters of the same band that are fed the same blocks, and integrate more or less often.

    Raises
    ------
    EstimateError
        When the band isn't inside the spectrum, or so narrow beside the rate that memory doesn't hold the filter.

    Examples
    --------
    >>> BandFilter(1000.0, (10.0, 100.0)).reach_s
    0.51
    """

    def __init__(
        self,
        sample_rate_hz: float,
        band_hz: tuple[float, float],
        *,
        integrations: int = 0,
        envelope: bool = False,
        transforms: SharedTransforms | None = None,
    ) -> None:
        low_hz, high_hz = band_hz
        if not 0 <= low_hz < high_hz <= sample_rate_hz / 2 * (1 + 1e-9):
            raise EstimateError(
                f"the band {low_hz:g} to {high_hz:g} Hz must rise and end at half the sample rate, "
                f"{sample_rate_hz / 2:g} Hz, or below"
            )
        if integrations and not low_hz:
            raise EstimateError("integration needs a band that begins above 0 Hz; below it a drift has no end")
        self.sample_rate_hz = sample_rate_hz
        self.band_hz = (low_hz, min(high_hz, sample_rate_hz / 2))
        self.integrations = integrations
        self.envelope = envelope
        self._transforms = transforms
        self._reach = self._samples_of_decay()
        self._response = self._impulse_response()
        self._runs = Runs()
        # Of each channel, for who has to square what comes out.
        self.largest = np.zeros(1)
        # Samples of the run that later ones need, and how many of it were before them.
        self._first: TimeSeries | None = None
        self._held, self._taken = HeldSamples(), 0

    @property
    def reach_s(self) -> float:
        """How far to either side a sample of the result leans on others, in seconds."""
        return self._reach / self.sample_rate_hz

    @property
    def reach(self) -> int:
        """`reach_s` in samples."""
        return self._reach

    def passed(self, channels: Sequence[Channel]) -> tuple[Channel, ...]:
        """Give channels as they come out."""
        # A limit of the sensor is none of what was computed.
        return tuple(replace(one, unit=self._unit(one.unit), overload=None) for one in channels)

    def blocks(self, source: Iterable[TimeSeries]) -> Iterator[TimeSeries]:
        """Filter a whole stream, see `feed`; `EstimateError` when no run is longer than twice `reach_s`."""
        for block in source:
            yield from self.feed(block)
        yield from self.rest()

    def feed(self, block: TimeSeries) -> Iterator[TimeSeries]:
        """Take the next block, and give what can be filtered by now.

        What comes out lacks `reach_s` at both ends of each run of samples that are valid in all channels.

        Raises
        ------
        EstimateError
            When a sample that isn't marked invalid isn't finite, or the block starts before the last one ended.
        """
        for begins, piece in self._runs.pieces(block):
            self.largest = np.maximum(self.largest, require_finite(piece, [(0, piece.samples)]))
            if begins:
                yield from self._filtered()
                self._first, self._taken, self._held = piece, 0, HeldSamples()
            self._held.append(piece.values)
            # Much longer than the impulse response, so that most of each transform is new.
            if self._held.samples > 8 * self._reach:
                yield from self._filtered()

    def rest(self) -> Iterator[TimeSeries]:
        """Give what is left at the end of the stream; `EstimateError` when no run was longer than twice `reach_s`."""
        yield from self.rest_of_part()
        self.require_long(self._runs.longest)

    def rest_of_part(self) -> Iterator[TimeSeries]:
        """Give what is left at the end of a part of a stream, which may be nothing."""
        yield from self._filtered()

    def require_long(self, longest: int) -> None:
        """Raise `EstimateError` when the longest run has no more samples than twice the filter's reach."""
        if longest <= 2 * self._reach:
            # The filter is as long as its narrower slope asks for.
            narrow = self.band_hz[1] - self.band_hz[0] < self.band_hz[0]
            remedy = "take a wider band" if narrow else "begin the band at a higher frequency"
            raise EstimateError(
                f"a band from {self.band_hz[0]:g} to {self.band_hz[1]:g} Hz needs an unbroken run of "
                f"{2 * self.reach_s:.3g} s, and the longest has {longest / self.sample_rate_hz:.3g} s. "
                f"Measure longer, or {remedy}"
            )

    def _filtered(self) -> Iterator[TimeSeries]:
        """Filter what is held, but for the samples that those to come lean on as well."""
        new = self._held.samples - 2 * self._reach
        if self._first is None or new <= 0:
            return
        joined = self._held.joined().astype(np.float64, copy=False)
        start_s = (self._taken + self._reach) / self.sample_rate_hz
        yield TimeSeries(
            values=self._convolved(joined, self._first.start_time_ns),
            sample_rate_hz=self.sample_rate_hz,
            channels=self.passed(self._first.channels),
            start_time_ns=self._first.start_time_ns + round(start_s * NS_PER_S),
        )
        self._taken += new
        self._held.replace(joined[:, new:])

    def _convolved(self, values: Real, run_ns: int) -> Real:
        """``[channel, sample]`` where the impulse response lies on samples from end to end."""
        length = scipy.fft.next_fast_len(values.shape[1], real=not self.envelope)
        kept = slice(2 * self._reach, values.shape[1])
        if not self.envelope:
            shared = self._transforms or SharedTransforms()
            transformed = shared.of(values, length, run_ns=run_ns, place=self._taken)
            spectrum = scipy.fft.rfft(self._response.real, length)
            return np.asarray(scipy.fft.irfft(transformed * spectrum, length)[:, kept])
        spectrum = scipy.fft.fft(self._response, length)
        passed = scipy.fft.ifft(scipy.fft.fft(values, length) * spectrum, length)[:, kept]
        return np.asarray(passed.real**2 + passed.imag**2)

    def _unit(self, unit: str) -> str:
        for _ in range(self.integrations):
            unit = integrated(unit)
        return power(unit, 2) if self.envelope else unit

    def _samples_of_decay(self) -> int:
        slowest = min((-pole.real for pole in _poles(self.band_hz, self.sample_rate_hz / 2)), default=inf)
        # Without a flank there is nothing to wait for, but for what keeps a delta between samples together.
        samples = max(LEAST_REACH, DECAY_NEPERS / slowest * self.sample_rate_hz)
        if 2 * samples > MOST_SAMPLES:
            raise EstimateError(
                f"a band from {self.band_hz[0]:g} to {self.band_hz[1]:g} Hz is too narrow beside a rate of "
                f"{self.sample_rate_hz:g} Hz; resample to a lower rate, or widen the band"
            )
        return ceil(samples)

    def _impulse_response(self) -> NDArray[np.complexfloating]:
        """``[2 reach + 1]``, its middle at no delay; real unless it makes an analytic signal."""
        # Four times as long, so that little of what lies beyond comes round.
        length = scipy.fft.next_fast_len(8 * self._reach)
        frequency_hz = scipy.fft.fftfreq(length, 1 / self.sample_rate_hz)
        gain = _magnitude(np.abs(frequency_hz), self.band_hz, self.sample_rate_hz / 2).astype(np.complex128)
        if self.integrations:
            gain /= (2j * np.pi * np.where(frequency_hz == 0, 1.0, frequency_hz)) ** self.integrations
        if self.envelope:
            gain *= 2 * (frequency_hz > 0)
        response = scipy.fft.ifft(gain)
        return np.roll(response, self._reach)[: 2 * self._reach + 1] * _fade(self._reach)


def _magnitude(frequency_hz: Real, band_hz: tuple[float, float], nyquist_hz: float) -> Real:
    """Magnitude of the analogue Butterworth filter: (1 + u^(2 n))^(-1/2).

    u = f / high for a low-pass, low / f for a high-pass, (f^2 - low high) / (f (high - low)) for a band-pass
    (Oppenheim & Schafer 2010, appendix B.1).
    """
    low_hz, high_hz = band_hz
    safe_hz = np.maximum(frequency_hz, np.finfo(np.float64).tiny)
    with np.errstate(over="ignore"):
        if not low_hz:
            u = np.zeros(frequency_hz.size) if high_hz >= nyquist_hz else frequency_hz / high_hz
        elif high_hz >= nyquist_hz:
            u = low_hz / safe_hz
        else:
            u = (frequency_hz**2 - low_hz * high_hz) / (safe_hz * (high_hz - low_hz))
        return np.asarray(1 / np.sqrt(1 + u ** (2 * ORDER)), dtype=np.float64)


def _poles(band_hz: tuple[float, float], nyquist_hz: float) -> list[complex]:
    """Poles of the same filter, in rad/s; none when nothing is cut."""
    low, high = (2 * np.pi * edge for edge in band_hz)
    prototype = np.exp(0.5j * np.pi * (1 + (2 * np.arange(ORDER) + 1) / ORDER))
    if band_hz[1] >= nyquist_hz:
        return list(low / prototype) if low else []
    if not low:
        return list(high * prototype)
    # s^2 - p (high - low) s + low high = 0 for each pole p of the low-pass.
    return [root for p in prototype for root in np.roots([1.0, -p * (high - low), low * high])]


def _fade(reach: int) -> Real:
    """1, falling to 0 along a half cosine over the last eighth at either end."""
    distance = np.abs(np.arange(-reach, reach + 1)) / reach
    return np.asarray((1 + np.cos(np.pi * np.clip(8 * distance - 7, 0.0, 1.0))) / 2, dtype=np.float64)
