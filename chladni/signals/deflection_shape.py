"""Operating deflection shape: how the measured points move at one frequency."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.provenance import Provenance
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DeflectionShape(Value):
    """Motion of all channels at one line: of modes together, as they are excited, with its size.

    Attributes
    ----------
    frequency_hz
        The line that it is of.
    amplitude
        ``[channel]`` complex, each along its channel's direction, in the channel's `units`; the phase is that
        relative to `reference`.
    std
        ``[channel]`` one sigma of the real and of the imaginary part; infinite where the data give no bound.
    channels
        One for each amplitude.
    units
        Unit of each amplitude: motion per force from frequency responses, RMS of the motion from cross-spectra.
    reference
        Channel that the phase is relative to.
    provenance
        How it was made; notes are advice.
    """

    frequency_hz: float
    amplitude: NDArray[np.complexfloating]
    std: Real
    channels: tuple[Channel, ...]
    units: tuple[str, ...]
    reference: Channel
    provenance: Provenance

    def __post_init__(self) -> None:
        count = (len(self.channels),)
        require_shape("amplitude", self.amplitude, count, "channels")
        require_shape("std", self.std, count, "channels")
        require_shape("units", np.array(self.units), count, "channels")
        self._freeze()
