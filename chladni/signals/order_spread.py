"""How the poles of each mode scatter over the model orders they were found at."""

from dataclasses import dataclass
from typing import Self

from chladni.signals.arrays import Index, Real, Whole
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

    orders: Whole
    frequency_hz: Real
    frequency_std_hz: Real
    damping_ratio: Real
    damping_std: Real

    def __post_init__(self) -> None:
        for name in ("frequency_hz", "frequency_std_hz", "damping_ratio", "damping_std"):
            require_shape(name, getattr(self, name), self.orders.shape, "modes")
        self._freeze()

    def select(self, rows: Index) -> Self:
        """Give the spread of some modes, in the order asked for."""
        return type(self)(
            orders=self.orders[rows],
            frequency_hz=self.frequency_hz[rows],
            frequency_std_hz=self.frequency_std_hz[rows],
            damping_ratio=self.damping_ratio[rows],
            damping_std=self.damping_std[rows],
        )
