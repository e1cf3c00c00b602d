"""Levels of vibration: how strong, how peaked, how lopsided, over all and running; and their severity."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real, Whole
from chladni.signals.channel import Channel, find_channels
from chladni.signals.provenance import Provenance
from chladni.signals.value import Coordinate, Value, of_channel, require_shape


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
    channels, bands_hz
        As in `Levels`.
    start_time_ns
        Time of the first sample, nanoseconds since the Unix epoch.
    """

    AXES: ClassVar = dict.fromkeys(("rms", "peak", "kurtosis"), ("channels", "bands_hz", "time_s"))
    ROWS: ClassVar = "time_s"
    UNITS: ClassVar = {"rms": of_channel, "peak": of_channel}

    window_s: float
    time_s: Real
    rms: Real
    peak: Real
    kurtosis: Real
    channels: tuple[Channel, ...]
    bands_hz: tuple[tuple[float, float], ...]
    start_time_ns: int

    def __post_init__(self) -> None:
        for name in ("peak", "kurtosis"):
            require_shape(name, getattr(self, name), self.rms.shape, "the shape of rms")
        require_shape("time_s", self.time_s, self.rms.shape[2:], "one entry a window")
        self._freeze()

    def rows(self, rows: Sequence[int]) -> Self:
        """Give the levels of some channels, in the order asked for."""
        chosen = list(rows)
        return replace(
            self,
            rms=self.rms[chosen],
            peak=self.peak[chosen],
            kurtosis=self.kurtosis[chosen],
            channels=tuple(self.channels[row] for row in chosen),
        )

    def coordinate(self, axis: str) -> Coordinate:
        """Give what stands along an axis, bands as ``10 to 1000 Hz``."""
        return _band_names(self.bands_hz) if axis == "bands_hz" else super(RunningLevels, self).coordinate(axis)


def _band_names(bands_hz: Sequence[tuple[float, float]]) -> list[str]:
    return [f"{low_hz:.6g} to {high_hz:.6g} Hz" for low_hz, high_hz in bands_hz]


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

    AXES: ClassVar = dict.fromkeys(("rms", *(one for one in _BY_CHANNEL if one != "rms")), ("channels", "bands_hz"))
    ROWS: ClassVar = "channels"
    OF_ROW: ClassVar = ("mean", "rms", "rms_std", "peak", "peak_to_peak")

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

    def coordinate(self, axis: str) -> Coordinate:
        """Give what stands along an axis, bands as ``10 to 1000 Hz``."""
        return _band_names(self.bands_hz) if axis == "bands_hz" else super(Levels, self).coordinate(axis)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Severity(Value):
    """Vibration severity: RMS of velocity and of displacement in the band of ISO 20816-3.

    Attributes
    ----------
    channels
        The motions judged, one for each row.
    band_hz
        Band of the standard, and what of it the sample rate shows.
    velocity_mm_s, velocity_std_mm_s
        ``[channel]``, RMS of velocity in mm/s, and one sigma of it.
    displacement_um, displacement_std_um
        ``[channel]``, RMS of displacement in um, and one sigma of it.
    machine
        Class of the machine, such as ``medium-rigid``; None when it wasn't named.
    boundaries_mm_s, boundaries_um
        Boundaries A/B, B/C and C/D of the class's zones, of velocity and of displacement; empty without a class.
    running, running_displacement
        The same over time: levels of velocity in m/s and of displacement in m, of one band.
    notes
        What isn't as the standard wants it, in sentences.
    """

    AXES: ClassVar = dict.fromkeys(
        ("velocity_mm_s", "velocity_std_mm_s", "displacement_um", "displacement_std_um", "zone"), ("channels",)
    )
    ROWS: ClassVar = "channels"

    channels: tuple[Channel, ...]
    band_hz: tuple[float, float]
    velocity_mm_s: Real
    velocity_std_mm_s: Real
    displacement_um: Real
    displacement_std_um: Real
    machine: str | None
    boundaries_mm_s: tuple[float, ...]
    boundaries_um: tuple[float, ...]
    running: RunningLevels
    running_displacement: RunningLevels
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("velocity_mm_s", "velocity_std_mm_s", "displacement_um", "displacement_std_um"):
            require_shape(name, getattr(self, name), (len(self.channels),), "one entry a channel")
        self._freeze()

    @property
    def velocity_zones(self) -> tuple[str, ...]:
        """Zone of each channel's velocity, ``A`` to ``D``; empty without a class."""
        return _zones(self.velocity_mm_s, self.boundaries_mm_s)

    @property
    def displacement_zones(self) -> tuple[str, ...]:
        """Zone of each channel's displacement; empty without a class."""
        return _zones(self.displacement_um, self.boundaries_um)

    @property
    def zones(self) -> tuple[str, ...]:
        """Zone of each channel, the severer of both; empty without a class."""
        return tuple(map(max, zip(self.velocity_zones, self.displacement_zones, strict=True)))

    @property
    def zone(self) -> NDArray[np.object_]:
        """``[channel]`` zones as they stand in a table; empty texts without a class."""
        return np.array(self.zones or [""] * len(self.channels), dtype=object)

    def select(self, names: Sequence[str]) -> Self:
        """Give the severity of the named channels; `EstimateError` naming those there are when one is missing."""
        rows = find_channels(self.channels, names)
        return replace(
            self,
            channels=tuple(self.channels[row] for row in rows),
            velocity_mm_s=self.velocity_mm_s[rows],
            velocity_std_mm_s=self.velocity_std_mm_s[rows],
            displacement_um=self.displacement_um[rows],
            displacement_std_um=self.displacement_std_um[rows],
            running=self.running.rows(rows),
            running_displacement=self.running_displacement.rows(rows),
        )


def _zones(levels: Real, boundaries: tuple[float, ...]) -> tuple[str, ...]:
    """Give the zone of each level; an empty text where there is none to judge."""
    if not boundaries:
        return ()
    zones = np.searchsorted(boundaries, levels)
    return tuple("ABCD"[zone] if np.isfinite(level) else "" for zone, level in zip(zones, levels, strict=True))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BandLevels(Value):
    """RMS of channels in frequency bands.

    Attributes
    ----------
    low_hz, high_hz
        ``[band]``, edges of each band.
    rms
        ``[channel, band]``, at least 0, in each channel's unit; NaN where a band isn't covered.
    std
        ``[channel, band]``, one sigma of `rms`.
    channels
        One for each row.
    provenance
        How it was made.
    """

    low_hz: Real
    high_hz: Real
    rms: Real
    std: Real
    channels: tuple[Channel, ...]
    provenance: Provenance

    def __post_init__(self) -> None:
        expected = (len(self.channels), self.low_hz.size)
        require_shape("high_hz", self.high_hz, self.low_hz.shape, "one entry a band")
        require_shape("rms", self.rms, expected, "channels x bands")
        require_shape("std", self.std, expected, "channels x bands")
        self._freeze()


# Of decibels, by ISO 1683:2015; of other units, 1.
DECIBEL_REFERENCES = {"Pa": 20e-6, "m/s^2": 1e-6, "m/s": 1e-9, "m": 1e-12, "N": 1e-6}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OctaveLevels(Value):
    """Levels in octave bands, whole or fractional.

    Attributes
    ----------
    fraction
        Bands in an octave.
    weighting
        ``A`` or ``C``, or None.
    nominal_hz, mid_hz
        ``[band]``, frequency by which a band is called, and its exact middle.
    bands
        Edges, RMS and one sigma of it, ``[channel, band]``.
    total
        ``[channel]``, RMS of the whole spectrum, weighted as the bands are.
    """

    AXES: ClassVar = {"rms": ("channels", "mid_hz"), "std": ("channels", "mid_hz")}
    ROWS: ClassVar = "mid_hz"
    UNITS: ClassVar = dict.fromkeys(AXES, of_channel)

    fraction: int
    weighting: str | None
    nominal_hz: Real
    mid_hz: Real
    bands: BandLevels
    total: Real

    def __post_init__(self) -> None:
        for name in ("nominal_hz", "mid_hz"):
            require_shape(name, getattr(self, name), self.bands.low_hz.shape, "one entry a band")
        require_shape("total", self.total, (len(self.bands.channels),), "one entry a channel")
        self._freeze()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """One for each row of the levels."""
        return self.bands.channels

    @property
    def rms(self) -> Real:
        """``[channel, band]``, RMS in each channel's unit."""
        return self.bands.rms

    @property
    def std(self) -> Real:
        """``[channel, band]``, one sigma of it."""
        return self.bands.std

    def decibels(self) -> Real:
        """Give ``[channel, band]`` in dB over the references of ISO 1683, such as 20 uPa and 1 um/s^2."""
        return decibels(self.bands.rms, self.channels)


def decibels(rms: Real, channels: Sequence[Channel]) -> Real:
    """Give ``rms[channel, ...]`` in dB over the reference of each channel's unit (ISO 1683); minus infinity for 0."""
    reference = np.array([DECIBEL_REFERENCES.get(channel.unit, 1.0) for channel in channels])
    with np.errstate(divide="ignore"):
        return np.asarray(20 * np.log10(rms / reference.reshape(-1, *[1] * (rms.ndim - 1))), dtype=np.float64)
