"""Values of sine sweep tests: a profile of amplitudes, and how the tracked amplitude of a sweep keeps it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.profile import between, require_profile
from chladni.signals.value import Value, of_channel, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SineProfile(Value):
    """Peak acceleration of a sine sweep by breakpoints, straight between them on logarithmic axes.

    A constant displacement rises with the square of the frequency and a constant velocity with the frequency. Both
    are straight lines between two breakpoints.

    Attributes
    ----------
    frequency_hz
        ``[breakpoint]``, above 0, strictly rising, at least two.
    amplitude
        ``[breakpoint]``, peak acceleration in m/s^2, above 0.
    upper_db, lower_db
        How far a test may lie above and below, in dB of amplitude, both at least 0.

    Examples
    --------
    >>> steady = SineProfile(frequency_hz=np.array([10.0, 20.0]), amplitude=np.array([1.0, 4.0]))
    >>> steady.displacement_m(np.array([10.0, 15.0, 20.0])).round(6)  # 0.253 mm all along
    array([0.000253, 0.000253, 0.000253])
    """

    AXES: ClassVar = {"amplitude": ("frequency_hz",)}
    ROWS: ClassVar = "frequency_hz"
    UNITS: ClassVar = {"amplitude": "m/s^2"}

    frequency_hz: Real
    amplitude: Real
    upper_db: float = 1.0
    lower_db: float = 1.0

    def __post_init__(self) -> None:
        require_profile(
            self.frequency_hz, self.amplitude, name="amplitude", upper_db=self.upper_db, lower_db=self.lower_db
        )
        self._freeze()

    def at(self, frequency_hz: Real) -> Real:
        """Peak acceleration in m/s^2 at each frequency; NaN outside the breakpoints."""
        return between(self.frequency_hz, self.amplitude, frequency_hz)

    def velocity_m_s(self, frequency_hz: Real) -> Real:
        """Peak velocity at each frequency, a / omega."""
        return self.at(frequency_hz) / (2 * np.pi * frequency_hz)

    def displacement_m(self, frequency_hz: Real) -> Real:
        """Peak displacement at each frequency, a / omega^2; twice it is peak to peak."""
        return self.at(frequency_hz) / (2 * np.pi * frequency_hz) ** 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SineCheck(Value):
    """How the tracked amplitude of a sweep keeps a profile.

    Attributes
    ----------
    time_s
        ``[point]``, seconds since the start of the samples: a sweep may go up and down.
    frequency_hz
        ``[point]``, of the sweep.
    amplitude
        ``[channel, point]``, peak amplitude of the sine alone, in m/s^2; NaN where it isn't known.
    deviation_db
        ``[channel, point]``, measured over asked for, in dB of amplitude; NaN outside the profile.
    outside
        ``[channel]``, share of the points inside the profile that lie outside the tolerance.
    channels
        One for each row.
    profile
        What was asked for.
    notes
        What to know of how the sweep was followed.
    """

    AXES: ClassVar = {
        "amplitude": ("channels", "time_s"),
        "deviation_db": ("channels", "time_s"),
        "frequency_hz": ("time_s",),
    }
    ROWS: ClassVar = "time_s"
    UNITS: ClassVar = {"amplitude": of_channel, "deviation_db": "dB", "frequency_hz": "Hz"}

    time_s: Real
    frequency_hz: Real
    amplitude: Real
    deviation_db: Real
    outside: Real
    channels: tuple[Channel, ...]
    profile: SineProfile
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_shape("frequency_hz", self.frequency_hz, self.time_s.shape, "time_s")
        expected = (len(self.channels), self.time_s.size)
        for name in ("amplitude", "deviation_db"):
            require_shape(name, getattr(self, name), expected, "channels x points")
        require_shape("outside", self.outside, expected[:1], "channels")
        self._freeze()
