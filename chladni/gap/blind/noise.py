"""Noise of sensors, different on each channel, white or coloured."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.floating[Any]]
Colour = Literal["white", "pink", "low_pass", "resonant"]
COLOURS: tuple[Colour, ...] = ("pink", "low_pass", "resonant")
#: Share of a channel's RMS.
LEAST_SHARE, MOST_SHARE = 0.003, 0.03


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorNoise:
    """Noise of one channel.

    Attributes
    ----------
    share
        Its RMS over that of what the sensor measures.
    colour
        ``pink`` falls with a power of frequency, ``low_pass`` above a corner, ``resonant`` has a hump.
    corner
        Of the colour, as a share of the sample rate.
    """

    share: float
    colour: Colour = "white"
    corner: float = 0.1

    def samples(self, count: int, rng: np.random.Generator) -> Matrix:
        """Give ``[sample]`` of unit RMS."""
        lines = np.fft.rfft(rng.standard_normal(count))
        noise = np.fft.irfft(lines * self._weight(np.fft.rfftfreq(count)), n=count)
        noise -= noise.mean()
        return np.asarray(noise / np.sqrt(np.mean(noise**2)))

    def told(self) -> Mapping[str, Any]:
        """Give what the truth says of it."""
        return asdict(self)

    def _weight(self, share: Matrix) -> Matrix:
        if self.colour == "pink":
            # Flat below the lowest frequencies, as amplifiers are: the log would show a drift otherwise.
            return np.asarray((np.maximum(share, 1e-3) / 1e-3) ** -0.5)
        if self.colour == "low_pass":
            return np.asarray(1.0 / np.sqrt(1.0 + (share / self.corner) ** 2))
        if self.colour == "resonant":
            return np.asarray(0.3 + 1.0 / np.abs(1.0 - (share / self.corner) ** 2 + 0.2j * share / self.corner))
        return np.ones_like(share)


def draw_noise(rng: np.random.Generator, *, coloured: bool) -> SensorNoise:
    """Draw level and colour of a channel."""
    share = float(np.exp(rng.uniform(np.log(LEAST_SHARE), np.log(MOST_SHARE))))
    colour: Colour = COLOURS[int(rng.integers(len(COLOURS)))] if coloured else "white"
    return SensorNoise(share=share, colour=colour, corner=float(np.exp(rng.uniform(np.log(0.01), np.log(0.2)))))
