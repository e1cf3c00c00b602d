"""Where the elements of an array of fixed-size messages lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from chladni.io.decoding.layout import FixedLayout
    from chladni.signals.arrays import Whole


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElementPlaces:
    """Offsets of one leaf from the start of the array: ``first``, then ``later + k * step`` for element k.

    Each is one number, or one a message.
    """

    first: int | Whole
    later: int | Whole
    step: int | Whole

    @property
    def evenly_spaced(self) -> bool:
        """Whether one step leads from each element to the next, element 0 included."""
        return isinstance(self.later, int) and isinstance(self.first, int) and self.first == self.later


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElementSpan:
    """Sizes of the elements of an array of fixed-size values.

    Element 0 starts wherever the fields before it ended; the end of one element sets the phase of the next, and
    from element 1 on that phase, and with it the size, stays the same (see `chladni.io.decoding.layout`).

    Parameters
    ----------
    phase, later_phase : int or int64 array [row]
        Alignment phase at which element 0, and each further one, starts.
    size, step : int or int64 array [row]
        Bytes of element 0, and of each further one, padding included.
    total : int or int64 array [row]
        Bytes of the whole array.
    """

    phase: int | Whole
    later_phase: int | Whole
    size: int | Whole
    step: int | Whole
    total: int | Whole

    @classmethod
    def of(cls, position: int | Whole, layout: FixedLayout, counts: int | Whole) -> ElementSpan:
        """Measure arrays of `counts` elements that start at `position`."""
        size = layout.at(position)
        later_phase = position + size
        step = layout.at(later_phase)
        total = (counts > 0) * (size + (counts - 1) * step)
        return cls(phase=position, later_phase=later_phase, size=size, step=step, total=total)

    def leaf(self, offset: FixedLayout) -> ElementPlaces:
        """Places of the leaf that lies at `offset` in an element."""
        later = self.size + offset.at(self.later_phase) - self.step
        return ElementPlaces(first=offset.at(self.phase), later=later, step=self.step)
