"""Amplitude spectra from averaged cross-spectra."""

from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

import numpy as np

from chladni.io.source import Blocks, SeriesLike
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel, Names, find_channels
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import SetupError
from chladni.signals.provenance import Provenance
from chladni.signals.renamed import renamed
from chladni.signals.value import Value, of_channel, require_frequency_axis, require_shape
from chladni.spectral.cross_spectra import spectra_of
from chladni.spectral.psd import power_spectral_density
from chladni.spectral.windows import Window

Quantity = Literal["rms", "peak"]
QUANTITIES = ("rms", "peak")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AmplitudeSpectrum(Value):
    """Amplitudes line by line, corrected for the window's gain.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, strictly rising.
    values
        ``[channel, frequency]``, at least 0, in each channel's unit.
    std
        ``[channel, frequency]``, one sigma of `values`.
    quantity
        ``rms`` or ``peak``: what of a sine the values tell; peak is sqrt(2) RMS, on the line at 0 Hz both are the
        magnitude.
    channels
        One for each row.
    provenance
        How it was made.
    """

    AXES: ClassVar = {"values": ("channels", "frequency_hz"), "std": ("channels", "frequency_hz")}
    ROWS: ClassVar = "frequency_hz"
    UNITS: ClassVar = dict.fromkeys(AXES, of_channel)

    frequency_hz: Real
    values: Real
    std: Real
    quantity: Literal["rms", "peak"]
    channels: tuple[Channel, ...]
    provenance: Provenance

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        expected = (len(self.channels), self.frequency_hz.size)
        require_shape("values", self.values, expected, "channels x frequencies")
        require_shape("std", self.std, expected, "channels x frequencies")
        self._freeze()

    def select(self, names: Names) -> Self:
        """Give the amplitudes of the named channels; `EstimateError` naming those there are when one is missing."""
        rows = find_channels(self.channels, names)
        channels = tuple(self.channels[row] for row in rows)
        return replace(self, values=self.values[rows], std=self.std[rows], channels=channels)


@renamed(spectra="source")
def amplitude_spectrum(
    source: CrossSpectra | SeriesLike | Blocks,
    *,
    quantity: Quantity = "rms",
    channels: Names | None = None,
    resolution_hz: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> AmplitudeSpectrum:
    """Give the amplitude that a sine on each line would have.

    Right for tones; what noise reads depends on the noise bandwidth, so compare noise by its density.

    Parameters
    ----------
    source
        Averaged cross-spectra; or a log, the path to one, a series or an array ``[channel, sample]``, which is
        averaged after Welch first. A flat-top window keeps a tone between two lines within 0.2 %; Hann reads it up to
        15 % low.
    quantity
        ``rms``, sqrt(G B) with the noise bandwidth B of a line; ``peak``, sqrt(2) of it except at 0 Hz.
    channels, resolution_hz, window, overlap, sample_rate_hz, start_s, end_s
        Of samples: how they are averaged, see `cross_spectra`.

    Returns
    -------
    AmplitudeSpectrum
        ``[channel, frequency]`` in each channel's unit. One sigma is that of the power over twice the amplitude (and
        where the power is 0, the root of it).

    Raises
    ------
    SetupError
        When `quantity` is neither.

    Examples
    --------
    >>> sine = 3.0 * np.sin(2 * np.pi * 25 * np.arange(4000) / 1000)
    >>> spectrum = amplitude_spectrum(sine, sample_rate_hz=1000.0, resolution_hz=1.0, quantity="peak")
    >>> float(spectrum.values[0, 25].round(9))
    3.0
    """
    if quantity not in QUANTITIES:
        raise SetupError(f"quantity {quantity!r} is none of {', '.join(QUANTITIES)}")
    spectra = spectra_of(
        source,
        channels=channels,
        resolution_hz=resolution_hz,
        window=window,
        overlap=overlap,
        sample_rate_hz=sample_rate_hz,
        start_s=start_s,
        end_s=end_s,
    )
    density = power_spectral_density(spectra)
    power = density.values * spectra.bandwidth_hz
    power_std = density.std * spectra.bandwidth_hz
    rms = np.sqrt(power)
    # d sqrt(P) = dP / (2 sqrt(P)).
    std = np.divide(power_std, 2 * rms, out=np.sqrt(power_std), where=rms > 0)
    # At 0 Hz a one-sided density has no negative twin: the line is the square of the offset itself.
    gain = np.where(spectra.frequency_hz > 0, np.sqrt(2), 1.0) if quantity == "peak" else np.ones(power.shape[1])
    return AmplitudeSpectrum(
        frequency_hz=spectra.frequency_hz,
        values=rms * gain,
        std=std * gain,
        quantity=quantity,
        channels=spectra.channels,
        provenance=spectra.provenance.with_estimator(f"amplitude spectrum, {quantity}"),
    )
