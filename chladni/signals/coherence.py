"""Coherence between channels."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.provenance import Provenance
from chladni.signals.value import Value, require_frequency_axis, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coherence(Value):
    """Share of each response's power that is linearly due to the references, line by line.

    Attributes
    ----------
    frequency_hz
        ``[frequency]``, strictly rising.
    values
        ``[response, frequency]``, 0 to 1.
    std
        ``[response, frequency]``, one sigma (Bendat & Piersol 2010, table 9.6: sqrt(2) (1 - c) sqrt(c) / sqrt(n)).
    kind
        ``ordinary`` (one reference), ``multiple`` (several), or ``partial`` (one, the others removed).
    responses, references
        Channels; a partial coherence names the one reference kept.
    conditioned_on
        Channels whose linear contribution was removed first; empty unless partial.
    provenance
        How it was made.
    """

    AXES: ClassVar = {"values": ("responses", "frequency_hz"), "std": ("responses", "frequency_hz")}
    ROWS: ClassVar = "frequency_hz"

    frequency_hz: Real
    values: Real
    std: Real
    kind: Literal["ordinary", "multiple", "partial"]
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    conditioned_on: tuple[Channel, ...] = ()
    provenance: Provenance

    def __post_init__(self) -> None:
        require_frequency_axis(self.frequency_hz)
        expected = (len(self.responses), self.frequency_hz.size)
        require_shape("values", self.values, expected, "responses x frequencies")
        require_shape("std", self.std, expected, "responses x frequencies")
        self._freeze()
