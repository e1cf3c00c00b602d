"""A named peak of a spectrum or a frequency response."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Peak:
    """Where a function peaks, how high, and how sure that is.

    Attributes
    ----------
    frequency_hz, frequency_std_hz
        Frequency of the maximum and one sigma of it.
    height, height_std
        Value there and one sigma of it, in `unit`.
    unit
        Unit of the height.
    channels
        Names of the channels that show it, the strongest first; for a frequency response, response and reference.
    """

    frequency_hz: float
    frequency_std_hz: float
    height: float
    height_std: float
    unit: str
    channels: tuple[str, ...]
