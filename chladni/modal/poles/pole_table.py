"""Poles of models of rising order, before any is taken for a mode."""

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

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

    orders: NDArray[np.int64]
    order: NDArray[np.int64]
    pole: NDArray[np.complex128]
    vector: NDArray[np.complex128]
    frequency_std_hz: NDArray[np.float64] | None = None
    damping_std: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_shape("pole", self.pole, self.order.shape, "poles")
        require_shape("vector", self.vector, (self.order.size, self.vector.shape[1]), "poles x components")
        self._freeze()

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """``[pole]`` undamped natural frequency."""
        return np.abs(self.pole) / (2 * pi)

    @property
    def damping_ratio(self) -> NDArray[np.float64]:
        """``[pole]`` -Re/abs."""
        return -self.pole.real / np.abs(self.pole)
