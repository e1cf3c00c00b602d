"""Envelope spectra: what modulates a band, and the band's kurtogram."""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Kurtogram(Value):
    """Spectral kurtosis over bands of the spectrum halved and cut in thirds again and again.

    Attributes
    ----------
    low_hz, high_hz
        ``[band]``, edges; from the whole spectrum to the narrowest bands.
    kurtosis
        ``[channel, band]``, mean(abs(c)^4)/mean(abs(c)^2)^2 - 2 of the complex envelope c: 0 for Gaussian noise, -1
        for a tone, high for blows.
    std
        ``[channel, band]``, one sigma of it for Gaussian noise.
    channels
        One for each row.
    """

    low_hz: Real
    high_hz: Real
    kurtosis: Real
    std: Real
    channels: tuple[Channel, ...]

    def __post_init__(self) -> None:
        require_shape("high_hz", self.high_hz, self.low_hz.shape, "one entry a band")
        for name in ("kurtosis", "std"):
            require_shape(name, getattr(self, name), (len(self.channels), self.low_hz.size), "channels x bands")
        self._freeze()

    def select(self, row: int) -> Self:
        """Give the kurtogram of one channel."""
        rows = slice(row, row + 1)
        return replace(self, kurtosis=self.kurtosis[rows], std=self.std[rows], channels=self.channels[rows])

    def best(self, row: int = 0, *, least_width_hz: float = 0.0) -> int:
        """Give the band of greatest kurtosis less three sigma, at least so wide, and without 0 Hz."""
        wide = (self.high_hz - self.low_hz >= least_width_hz * (1 - 1e-9)) & (self.low_hz > 0)
        if not wide.any():
            raise EstimateError(
                f"no band is {least_width_hz:g} Hz wide, which the bearing's frequencies need; sample faster"
            )
        return int(np.argmax(np.where(wide, self.kurtosis[row] - 3 * self.std[row], -np.inf)))


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultLine:
    """A bearing's frequency in an envelope spectrum.

    Attributes
    ----------
    name
        ``BPFO``, ``BPFI``, ``BSF`` or ``FTF``, a multiple in front: ``2 BPFO``.
    expected_hz, found_hz
        By geometry, and of the highest line within the bearing's slip.
    amplitude
        Of that line, in the square of the channel's unit.
    over_background
        Over the median of the lines around.
    """

    name: str
    expected_hz: float
    found_hz: float
    amplitude: float
    over_background: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EnvelopeSpectrum(Value):
    """Spectrum of one channel's squared envelope in a band.

    Attributes
    ----------
    channel
        The channel that was measured.
    band_hz
        The band whose envelope it is.
    band_kurtosis
        Spectral kurtosis there; NaN where the band was named.
    density
        Density of the squared envelope, of one channel in the square of the unit, up to the width of the band.
    mean
        Mean of the squared envelope: twice the power in the band.
    kurtogram
        By which the band was chosen; None where it was named.
    faults
        The bearing's frequencies and their multiples; empty without a bearing.
    peaks
        Lines that stand out, the highest first; their heights are amplitudes. Empty where nothing repeats.
    notes
        What to distrust, in sentences.
    """

    AXES: ClassVar = {"amplitude": ("frequency_hz",)}
    ROWS: ClassVar = "frequency_hz"

    channel: Channel
    band_hz: tuple[float, float]
    band_kurtosis: float
    density: PowerSpectralDensity
    mean: float
    kurtogram: Kurtogram | None = None
    faults: tuple[FaultLine, ...] = ()
    peaks: tuple[Peak, ...] = ()
    notes: tuple[str, ...] = ()

    def unit_at(self, field: str, place: tuple[int, ...]) -> str:  # noqa: ARG002
        """Give the unit of the squared envelope."""
        return self.density.channels[0].unit

    @property
    def frequency_hz(self) -> Real:
        """``[frequency]``, of the modulation."""
        return self.density.frequency_hz

    @property
    def amplitude(self) -> Real:
        """``[frequency]``, amplitude that a sine on each line has in the squared envelope, sqrt(2 G B)."""
        return np.asarray(np.sqrt(2 * self.density.values[0] * self.density.bandwidth_hz), dtype=np.float64)
