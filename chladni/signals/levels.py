"""Levels of vibration: how strong, how peaked, how lopsided, over all and running; and their severity."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel, find_channels
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RunningLevels(Value):
    """Levels of consecutive windows.

    Attributes
    ----------
    window_s
        Length of a window in seconds.
    time_s
        ``[window]``, centre of each, seconds since `start_time_ns`.
    rms, peak, kurtosis
        ``[channel, band, window]``, as in `Levels` but about the window's own mean; NaN in windows without a sample.
    start_time_ns
        Time of the first sample, nanoseconds since the Unix epoch.
    """

    window_s: float
    time_s: Real
    rms: Real
    peak: Real
    kurtosis: Real
    start_time_ns: int

    def __post_init__(self) -> None:
        for name in ("peak", "kurtosis"):
            require_shape(name, getattr(self, name), self.rms.shape, "the shape of rms")
        require_shape("time_s", self.time_s, self.rms.shape[2:], "one entry a window")
        self._freeze()

    def rows(self, rows: Sequence[int]) -> Self:
        """Give the levels of some channels, in the order asked for."""
        chosen = list(rows)
        return replace(self, rms=self.rms[chosen], peak=self.peak[chosen], kurtosis=self.kurtosis[chosen])


_BY_CHANNEL = (
    "samples",
    "mean",
    "rms",
    "rms_std",
    "peak",
    "peak_to_peak",
    "crest_factor",
    "skewness",
    "kurtosis",
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Levels(Value):
    """Levels of channels in bands, each about its mean.

    Attributes
    ----------
    channels
        One for each first index.
    bands_hz
        Low and high edge, one pair for each second index; ``(0, half the rate)`` is all that was sampled.
    samples
        ``[channel, band]``, how many were judged.
    mean
        ``[channel, band]``, in each channel's unit, as are `rms`, `peak` and `peak_to_peak`.
    rms, rms_std
        ``[channel, band]``, root mean square about the mean (ISO 2041:2018), and one sigma of it; infinite where the
        record is too short to tell.
    peak, peak_to_peak
        ``[channel, band]``, largest magnitude about the mean; largest less smallest value.
    crest_factor
        ``[channel, band]``, peak over RMS: sqrt(2) for a sine. NaN, as the next two, where nothing moves.
    skewness, kurtosis
        ``[channel, band]``, third and fourth moment about the mean over the third and fourth power of the RMS
        (Bendat & Piersol 2010, section 3.1.1): 0 and 3 for Gaussian noise, 0 and 1.5 for a sine.
    running
        The same over time.
    notes
        What was left out, in sentences.
    """

    channels: tuple[Channel, ...]
    bands_hz: tuple[tuple[float, float], ...]
    samples: Whole
    mean: Real
    rms: Real
    rms_std: Real
    peak: Real
    peak_to_peak: Real
    crest_factor: Real
    skewness: Real
    kurtosis: Real
    running: RunningLevels
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        expected = (len(self.channels), len(self.bands_hz))
        for name in _BY_CHANNEL:
            require_shape(name, getattr(self, name), expected, "channels x bands")
        require_shape("running.rms", self.running.rms[..., 0], expected, "channels x bands")
        self._freeze()

    def select(self, names: Sequence[str]) -> Self:
        """Give the levels of the named channels; `EstimateError` naming those there are when one is missing."""
        rows = find_channels(self.channels, names)
        chosen = {name: getattr(self, name)[rows] for name in _BY_CHANNEL}
        channels = tuple(self.channels[row] for row in rows)
        return replace(self, channels=channels, running=self.running.rows(rows), **chosen)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Severity(Value):
    """Vibration severity: RMS of velocity in the band of ISO 20816-3.

    Attributes
    ----------
    channels
        The motions judged, one for each row.
    band_hz
        Band of the standard, and what of it the sample rate shows.
    velocity_mm_s, velocity_std_mm_s
        ``[channel]``, RMS of velocity in mm/s, and one sigma of it.
    machine
        Class of the machine, such as ``medium-rigid``; None when it wasn't named.
    boundaries_mm_s
        Boundaries A/B, B/C and C/D of the class's zones in mm/s; empty without a class.
    zones
        ``A`` to ``D`` for each channel; empty without a class.
    running
        The same over time: levels of velocity in m/s, of one band.
    notes
        What isn't as the standard wants it, in sentences.
    """

    channels: tuple[Channel, ...]
    band_hz: tuple[float, float]
    velocity_mm_s: Real
    velocity_std_mm_s: Real
    machine: str | None
    boundaries_mm_s: tuple[float, ...]
    zones: tuple[str, ...]
    running: RunningLevels
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("velocity_mm_s", "velocity_std_mm_s"):
            require_shape(name, getattr(self, name), (len(self.channels),), "one entry a channel")
        self._freeze()

    def select(self, names: Sequence[str]) -> Self:
        """Give the severity of the named channels; `EstimateError` naming those there are when one is missing."""
        rows = find_channels(self.channels, names)
        return replace(
            self,
            channels=tuple(self.channels[row] for row in rows),
            velocity_mm_s=self.velocity_mm_s[rows],
            velocity_std_mm_s=self.velocity_std_mm_s[rows],
            zones=tuple(self.zones[row] for row in rows) if self.zones else (),
            running=self.running.rows(rows),
        )
