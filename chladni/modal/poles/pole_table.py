"""Poles of models of rising order, before any is taken for a mode."""

from dataclasses import dataclass
from math import pi

import numpy as np

from chladni.signals.arrays import Complex, Real, Whole
from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoleTable(Value):
    """Oscillating poles on the stable side, one of each conjugate pair, by order.

    Attributes
    ----------
    orders
        ``[order]`` every model order that was tried, rising, also those without such a pole.
    order
        ``[pole]`` model order of each pole, rising.
    pole
        ``[pole]`` in rad/s, Re < 0 < Im.
    vector
        ``[pole, component]`` complex, length 1: participation factors of a fit of frequency responses, shapes of a
        fit of responses.
    frequency_std_hz, damping_std
        ``[pole]`` one sigma of natural frequency and damping ratio where the method knows it, else None.
    notes
        What was left out of the fit, such as orders that the lines don't determine, and why.
    """

    orders: Whole
    order: Whole
    pole: Complex
    vector: Complex
    frequency_std_hz: Real | None = None
    damping_std: Real | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_shape("pole", self.pole, self.order.shape, "poles")
        require_shape("vector", self.vector, (self.order.size, self.vector.shape[1]), "poles x components")
        self._freeze()

    @property
    def frequency_hz(self) -> Real:
        """``[pole]`` undamped natural frequency."""
        return np.abs(self.pole) / (2 * pi)

    @property
    def damping_ratio(self) -> Real:
        """``[pole]`` -Re/abs."""
        return -self.pole.real / np.abs(self.pole)
