"""Gaussian noise in a band."""

from dataclasses import dataclass

import numpy as np

from chladni.models.excitations.excitation import band_lines, require_number
from chladni.signals.arrays import Real


@dataclass(frozen=True, slots=True, kw_only=True)
class RandomNoise:
    """Gaussian noise, flat in its band and nothing outside.

    Attributes
    ----------
    rms
        Root mean square, in the input's unit: of each record, not only in expectation.
    band_hz
        Lowest and highest frequency; None for all up to half the sample rate.

    Examples
    --------
    >>> x = RandomNoise(rms=2.0, band_hz=(5.0, 40.0)).samples(1000, 100.0, np.random.default_rng(0))
    >>> round(float(np.sqrt(np.mean(x**2))), 12)
    2.0
    """

    rms: float = 1.0
    band_hz: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        require_number(self, "rms", self.rms, positive=True)

    def samples(self, count: int, sample_rate_hz: float, rng: np.random.Generator) -> Real:
        """Give ``[sample]``; the record joins its own beginning, as a sum of lines does."""
        frequency_hz = np.asarray(np.fft.rfftfreq(count, 1 / sample_rate_hz), dtype=np.float64)
        inside = band_lines(self, self.band_hz, frequency_hz)
        lines = rng.standard_normal(inside.size) + 1j * rng.standard_normal(inside.size)
        noise = np.fft.irfft(np.where(inside, lines, 0.0), n=count)
        return np.asarray(noise * (self.rms / np.sqrt(np.mean(noise**2))), dtype=np.float64)
