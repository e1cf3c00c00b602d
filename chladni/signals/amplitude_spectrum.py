"""Amplitude spectra of channels: what a sine on each line would measure."""

from dataclasses import dataclass
from typing import Literal

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.provenance import Provenance
from chladni.signals.value import Value, require_frequency_axis, require_shape


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
