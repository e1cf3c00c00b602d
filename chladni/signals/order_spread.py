"""How the poles of each mode scatter over the model orders they were found at."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from chladni.signals.value import Value, require_shape


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OrderSpread(Value):
    """Mean and standard deviation of each cluster of poles.

    Attributes
    ----------
    orders
        ``[mode]`` number of model orders that gave the mode.
    frequency_hz, frequency_std_hz
        ``[mode]`` mean and standard deviation of the natural frequency over those orders.
    damping_ratio, damping_std
        ``[mode]`` the same of the damping ratio.
    """

    orders: NDArray[np.int64]
    frequency_hz: NDArray[np.float64]
    frequency_std_hz: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    damping_std: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name in ("frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std"):
            require_shape(name, getattr(self, name), self.orders.shape, "modes")
        self._freeze()

    def select(self, rows: NDArray[np.intp]) -> Self:
        """Give the spread of some modes, in the order asked for."""
        return type(self)(
            orders=self.orders[rows],
            frequency_hz=self.frequency_hz[rows],
            frequency_std_hz=self.frequency_std_hz[rows],
            damping_ratio=self.damping_ratio[rows],
            damping_std=self.damping_std[rows],
        )
