"""Vibration by order: in multiples of a shaft's speed of rotation."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.value import Value, of_channel, require_shape

OrderMethod = Literal["angle", "vold-kalman"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OrderMap(Value):
    """Amplitudes over order and time.

    Attributes
    ----------
    order
        ``[order]``, multiples of the speed of rotation, rising from 0.
    time_s
        ``[slice]``, middle of each slice in seconds since `start_time_ns`.
    speed_hz
        ``[slice]``, revolutions a second there.
    values
        ``[channel, slice, order]``, peak amplitude in each channel's unit; NaN where samples are missing, and above
        80 % of half the sample rate.
    channels
        One for each first index.
    start_time_ns
        Nanoseconds since the Unix epoch.
    revolutions
        Length of a slice; amplitudes of orders closer than 2/revolutions run together.
    notes
        What to know of how it was made.
    """

    AXES: ClassVar = {"values": ("channels", "time_s", "order"), "speed_hz": ("time_s",)}
    ROWS: ClassVar = "time_s"
    UNITS: ClassVar = {"values": of_channel, "speed_hz": "Hz"}

    order: Real
    time_s: Real
    speed_hz: Real
    values: Real
    channels: tuple[Channel, ...]
    start_time_ns: int
    revolutions: float
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.order.ndim != 1 or np.any(np.diff(self.order) <= 0):
            raise EstimateError("order must be one-dimensional and strictly rising")
        require_shape("speed_hz", self.speed_hz, self.time_s.shape, "time_s")
        expected = (len(self.channels), self.time_s.size, self.order.size)
        require_shape("values", self.values, expected, "channels x slices x orders")
        self._freeze()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OrderCuts(Value):
    """Amplitude and phase of single orders over time and speed.

    Attributes
    ----------
    orders
        ``[order]``, multiples of the speed of rotation, as asked for.
    time_s
        ``[point]``, seconds since `start_time_ns`.
    speed_hz
        ``[point]``, revolutions a second.
    values
        ``[channel, order, point]``, complex: ``abs`` is the peak amplitude in each channel's unit, ``angle`` the lead
        of its cosine over the shaft's own angle. NaN where samples are missing, and above half the sample rate.
    channels
        One for each first index.
    start_time_ns
        Nanoseconds since the Unix epoch.
    method
        ``angle`` or ``vold-kalman``.
    notes
        What to know of how they were made.
    """

    AXES: ClassVar = {"values": ("channels", "orders", "time_s"), "speed_hz": ("time_s",)}
    ROWS: ClassVar = "time_s"
    UNITS: ClassVar = {"values": of_channel, "speed_hz": "Hz"}

    orders: Real
    time_s: Real
    speed_hz: Real
    values: Complex
    channels: tuple[Channel, ...]
    start_time_ns: int
    method: OrderMethod
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_shape("speed_hz", self.speed_hz, self.time_s.shape, "time_s")
        expected = (len(self.channels), self.orders.size, self.time_s.size)
        require_shape("values", self.values, expected, "channels x orders x points")
        self._freeze()
