"""Wishes about behaviour: something as small or large as can be, or on one side of a limit."""

from dataclasses import dataclass
from math import pi
from typing import Literal

import numpy as np

from chladni.models.analysis.frequency_behaviour import first_pair, frequency_behaviour, frequency_quantities
from chladni.models.analysis.frequency_curve import frequency_grid
from chladni.models.analysis.linear_path import LinearPath
from chladni.models.analysis.resolvent import Resolvent
from chladni.models.analysis.step_behaviour import step_marks, step_quantities
from chladni.models.core.reading import Quantity
from chladni.signals.errors import ModelError

Sense = Literal["least", "greatest", "at_most", "at_least"]
BAND_MAGNITUDE = "band_magnitude"
_OF_THE_PAIR = ("damping_ratio", "resonance_frequency")


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """What one behaviour quantity should be.

    Attributes
    ----------
    quantity
        Name of a quantity of `chladni.models.analysis.behaviour.behaviour`, or ``band_magnitude``: the largest
        magnitude in a band.
    sense
        ``least`` and ``greatest`` are aims, ``at_most`` and ``at_least`` limits.
    limit
        For limits, in the quantity's unit.
    band_hz
        For ``band_magnitude``.
    """

    quantity: str
    sense: Sense
    limit: float | None = None
    band_hz: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if (self.limit is None) != (self.sense in ("least", "greatest")):
            raise ModelError(f"{self.quantity}: {self.sense} {'needs a' if self.limit is None else 'takes no'} limit")
        if (self.band_hz is None) == (self.quantity == BAND_MAGNITUDE):
            raise ModelError(f"{self.quantity}: a band belongs to {BAND_MAGNITUDE} and to nothing else")
        if self.band_hz is not None and not 0 < self.band_hz[0] < self.band_hz[1] < np.inf:
            raise ModelError(f"the band {self.band_hz} Hz must rise, above 0 Hz")

    def __str__(self) -> str:
        band = "" if self.band_hz is None else f" from {self.band_hz[0]:g} to {self.band_hz[1]:g} Hz"
        words = self.quantity.replace("_", " ") + band
        return (
            f"{self.sense} {words}"
            if self.limit is None
            else f"{words} {self.sense.replace('_', ' ')} {self.limit:g}"
        )

    def excess(self, value: float) -> float:
        """How far a value misses the limit, over the limit (or absolutely, for a limit of 0); 0 when it's met."""
        if self.limit is None:
            return 0.0
        away = value - self.limit if self.sense == "at_most" else self.limit - value
        return max(away, 0.0) / (abs(self.limit) or 1.0)


def least_answer_time() -> Wish:
    """Wish the first peak to come as early as can be."""
    return Wish(quantity="answer_time", sense="least")


def overshoot_at_most(percent: float) -> Wish:
    """Wish the response to go beyond its final value by no more than this."""
    return Wish(quantity="overshoot", sense="at_most", limit=percent)


def damping_ratio_at_least(ratio: float) -> Wish:
    """Wish the first oscillating pair to be damped."""
    return Wish(quantity="damping_ratio", sense="at_least", limit=ratio)


def first_resonance_up() -> Wish:
    """Wish the first oscillating pair to have as high a frequency as can be."""
    return Wish(quantity="resonance_frequency", sense="greatest")


def band_magnitude_down(low_hz: float, high_hz: float) -> Wish:
    """Wish the frequency response to be as small as can be in a band."""
    return Wish(quantity=BAND_MAGNITUDE, sense="least", band_hz=(low_hz, high_hz))


def measured(path: LinearPath, wish: Wish, *, size: float = 1.0) -> Quantity:
    """Give the quantity that a wish is about, for a path to one output; computes only what it needs."""
    if wish.band_hz is not None:
        return _band_magnitude(path, wish.band_hz)
    if wish.quantity in _OF_THE_PAIR and not path.looped:
        return _of_the_pair(path, wish.quantity)
    # A search asks thousands of times: what isn't wished about isn't computed.
    known = [BAND_MAGNITUDE]
    for compute in (_in_time, _in_frequency):
        for one in compute(path, size):
            if one.name == wish.quantity:
                return one
            known.append(one.name)
    raise ModelError(f"no behaviour quantity {wish.quantity!r}; there are: {', '.join(known)}")


def _of_the_pair(path: LinearPath, name: str) -> Quantity:
    pair = first_pair(path.poles)
    if pair is None:
        # What doesn't oscillate is damped more than any pair, and resonates nowhere.
        return Quantity(
            name=name, value=1.0 if name == "damping_ratio" else None, unit="1", definition="no pole swings"
        )
    value = -pair.real / abs(pair) if name == "damping_ratio" else pair.imag / (2 * pi)
    return Quantity(name=name, value=value, unit="1" if name == "damping_ratio" else "Hz")


def _band_magnitude(path: LinearPath, band_hz: tuple[float, float]) -> Quantity:
    omega = frequency_grid(path.poles, float(path.dead_time_s[0]), 0.0, band_hz)
    largest = float(np.abs(Resolvent(path)(omega)).max())
    unit = f"({path.outputs[0].unit})/({path.source.unit})"
    return Quantity(
        name=BAND_MAGNITUDE,
        value=largest,
        unit=unit,
        definition=f"largest magnitude from {band_hz[0]:g} to {band_hz[1]:g} Hz",
    )


def _in_time(path: LinearPath, size: float) -> list[Quantity]:
    return step_quantities(path, step_marks(path), size=size)


def _in_frequency(path: LinearPath, _size: float) -> list[Quantity]:
    return frequency_quantities(path, frequency_behaviour(path))
