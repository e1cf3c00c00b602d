"""What a picking page shows, and what it asks for."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from chladni.signals.arrays import Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.modal_fit import ModalFit
from chladni.signals.mode_set import ModeSet


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Picked:
    """Modes that are picked.

    Attributes
    ----------
    frequencies_hz
        List that gives just these modes, rising.
    response
        Functions that they were identified from; None when they are from responses alone.
    modes
        One for each frequency, with all poles in its stabilisation diagram.
    mac
        ``[mode, mode]`` AutoMAC.
    synthesis
        Functions as these modes alone make them; None where there is no function, or no mode.
    """

    frequencies_hz: tuple[float, ...]
    response: FrequencyResponse | None
    modes: ModeSet
    mac: Real
    synthesis: ModalFit | None


class Picking(Protocol):
    """State of a picking: what is picked, and what is asked for."""

    title: str
    shown: Picked
    asked: tuple[float, ...]

    def toggle(self, row: int) -> tuple[float, ...]:
        """Ask for the mode of that pole, or for all but it."""

    def fit(self, frequencies_hz: Sequence[float]) -> Picked:
        """Identify the modes of these frequencies; runs on a thread."""

    def accept(self, picked: Picked) -> None:
        """Take what `fit` gave as what is picked."""

    def give_up(self) -> None:
        """Ask for what is picked, and no more."""
