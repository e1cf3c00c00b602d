"""Cepstra: what repeats in a spectrum, as echoes and families of harmonics do."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.provenance import Provenance
from chladni.signals.value import Value, require_shape

CepstrumKind = Literal["real", "power"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cepstrum(Value):
    """Cepstra of channels.

    Attributes
    ----------
    quefrency_s
        ``[quefrency]``, from 0 to half a segment: the delay of an echo, or one over the distance of harmonics.
    values
        ``[channel, quefrency]``, in nepers, or their squares in a power cepstrum.
    std
        ``[quefrency]``, one sigma of the real cepstrum where nothing repeats, the same for all channels.
    kind
        ``real`` or ``power``.
    peaks_s
        For each channel the quefrencies that stand out of the scatter, the highest first.
    channels
        One for each row.
    provenance
        How the spectra were averaged.
    """

    AXES: ClassVar = {"values": ("channels", "quefrency_s")}
    ROWS: ClassVar = "quefrency_s"

    quefrency_s: Real
    values: Real
    std: Real
    kind: CepstrumKind
    peaks_s: tuple[tuple[float, ...], ...]
    channels: tuple[Channel, ...]
    provenance: Provenance

    def __post_init__(self) -> None:
        require_shape("values", self.values, (len(self.channels), self.quefrency_s.size), "channels x quefrencies")
        require_shape("std", self.std, self.quefrency_s.shape, "one entry a quefrency")
        self._freeze()

    def at(self, row: int, quefrency_s: float) -> float:
        """Give a channel's value at the nearest quefrency."""
        return float(self.values[row, np.argmin(np.abs(self.quefrency_s - quefrency_s))])
