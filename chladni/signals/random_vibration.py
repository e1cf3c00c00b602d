"""Values of random vibration tests: a profile, how a spectrum keeps it, how amplitudes are spread, what they do."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.profile import between, require_profile
from chladni.signals.units import power_density_unit
from chladni.signals.value import Value, of_channel, require_frequency_axis, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RandomProfile(Value):
    """A power spectral density by breakpoints, straight between them on logarithmic axes.

    Attributes
    ----------
    frequency_hz
        ``[breakpoint]``, above 0, strictly rising, at least two.
    density
        ``[breakpoint]``, above 0, in ``unit^2/Hz``.
    unit
        Unit of the motion, such as ``m/s^2``.
    upper_db, lower_db
        How far a test may lie above and below, in dB of power, both at least 0.

    Examples
    --------
    >>> flat = RandomProfile(frequency_hz=np.array([20.0, 120.0]), density=np.array([0.01, 0.01]), unit="m/s^2")
    >>> flat.rms()
    1.0
    """

    AXES: ClassVar = {"density": ("frequency_hz",)}
    ROWS: ClassVar = "frequency_hz"

    frequency_hz: Real
    density: Real
    unit: str
    upper_db: float = 3.0
    lower_db: float = 3.0

    def __post_init__(self) -> None:
        require_profile(
            self.frequency_hz, self.density, name="density", upper_db=self.upper_db, lower_db=self.lower_db
        )
        self._freeze()

    def unit_at(self, field: str, place: tuple[int, ...]) -> str:  # noqa: ARG002
        """Give the unit of the densities."""
        return power_density_unit(self.unit)

    def at(self, frequency_hz: Real) -> Real:
        """Density at each frequency; NaN outside the breakpoints."""
        return between(self.frequency_hz, self.density, frequency_hz)

    def rms(self) -> float:
        """Root mean square of the whole profile: the closed integral of each power law between breakpoints."""
        low, high = self.frequency_hz[:-1], self.frequency_hz[1:]
        slope = np.diff(np.log(self.density)) / np.diff(np.log(self.frequency_hz))
        rises = slope + 1
        # G f^n integrates to a logarithm where n is -1; (e^(u) - 1)/u holds near it, too.
        u = rises * np.log(high / low)
        growth = np.where(np.abs(u) < 1e-12, 1.0, np.expm1(u) / np.where(u == 0, 1.0, u))
        return float(np.sqrt(np.sum(self.density[:-1] * low * np.log(high / low) * growth)))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProfileCheck(Value):
    """How spectra keep a profile.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, the lines inside the profile.
    deviation_db
        ``[channel, frequency]``, measured over asked for, in dB of power.
    outside
        ``[channel]``, share of the lines that lie outside the tolerance.
    rms, profile_rms
        ``[channel]`` root mean square of the measured lines inside the profile, and that of the profile.
    std_db
        ``[channel]``, one sigma of a line by random error: what lies outside by less may be scatter.
    channels
        One for each row.
    profile
        What was asked for.
    """

    AXES: ClassVar = {"deviation_db": ("channels", "frequency_hz")}
    ROWS: ClassVar = "frequency_hz"
    UNITS: ClassVar = {"deviation_db": "dB"}

    frequency_hz: Real
    deviation_db: Real
    outside: Real
    rms: Real
    profile_rms: float
    std_db: Real
    channels: tuple[Channel, ...]
    profile: RandomProfile

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        expected = (len(self.channels), self.frequency_hz.size)
        require_shape("deviation_db", self.deviation_db, expected, "channels x frequencies")
        for name in ("outside", "rms", "std_db"):
            require_shape(name, getattr(self, name), expected[:1], "channels")
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProbabilityDensity(Value):
    """How often amplitudes occur, in standard deviations from the mean.

    Attributes
    ----------
    deviation
        ``[bin]``, middle of each bin, in standard deviations.
    density
        ``[channel, bin]``, probability a standard deviation.
    std
        ``[channel, bin]``, one sigma by chance, at most.
    mean, standard_deviation
        ``[channel]``, in each channel's unit.
    channels
        One for each row.
    notes
        What wasn't counted, in sentences.
    """

    AXES: ClassVar = {"density": ("channels", "deviation"), "std": ("channels", "deviation")}
    ROWS: ClassVar = "deviation"

    deviation: Real
    density: Real
    std: Real
    mean: Real
    standard_deviation: Real
    channels: tuple[Channel, ...]
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        expected = (len(self.channels), self.deviation.size)
        require_shape("density", self.density, expected, "channels x bins")
        require_shape("std", self.std, expected, "channels x bins")
        for name in ("mean", "standard_deviation"):
            require_shape(name, getattr(self, name), expected[:1], "channels")
        self._freeze()

    @property
    def gaussian(self) -> Real:
        """``[bin]``, what Gaussian noise has."""
        return np.asarray(np.exp(-np.square(self.deviation) / 2) / np.sqrt(2 * np.pi), dtype=np.float64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VibrationResponse(Value):
    """Responses of oscillators to random vibration of their base, over their natural frequency.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, natural frequencies, rising.
    rms
        ``[channel, frequency]``, of absolute acceleration: the integral over the whole spectrum.
    miles
        ``[channel, frequency]``, the same by Miles' equation, for a density that is flat about the resonance.
    peak
        ``[channel, frequency]``, what isn't exceeded within `duration_s` with `probability`.
    q
        Amplification at resonance.
    duration_s, probability
        For the peak.
    channels
        One for each row.
    """

    AXES: ClassVar = {
        "peak": ("channels", "frequency_hz"),
        "rms": ("channels", "frequency_hz"),
        "miles": ("channels", "frequency_hz"),
    }
    ROWS: ClassVar = "frequency_hz"
    UNITS: ClassVar = dict.fromkeys(AXES, of_channel)

    frequency_hz: Real
    rms: Real
    miles: Real
    peak: Real
    q: float
    duration_s: float
    probability: float
    channels: tuple[Channel, ...]

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        expected = (len(self.channels), self.frequency_hz.size)
        for name in ("rms", "miles", "peak"):
            require_shape(name, getattr(self, name), expected, "channels x frequencies")
        self._freeze()
