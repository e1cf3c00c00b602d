"""Random-phase multisines, with lines left out on which nonlinearity shows."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from chladni.models.excitations.excitation import band_lines, require_number
from chladni.signals.arrays import Index, Real
from chladni.signals.errors import ModelError

Lines = Literal["full", "odd", "odd-detection"]

# One of so many neighbouring odd lines is left out, drawn at random (Pintelon and Schoukens 2012, section 4.3.1).
DETECTION_GROUP = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Multisine:
    """A sum of cosines of equal amplitude and random phases that repeats every `period_s`.

    On lines that aren't excited, a linear system answers with noise only. An even nonlinearity shows on the even
    lines, an odd one on the odd lines that were left out (R. Pintelon and J. Schoukens, System Identification: A
    Frequency Domain Approach, 2012, sections 2.3 and 4.3).

    Attributes
    ----------
    rms
        Root mean square over a period, in the input's unit.
    period_s
        Seconds of a period; a whole number of samples.
    band_hz
        Lowest and highest excited frequency; None for all up to half the sample rate.
    lines
        ``full``: every line of the band. ``odd``: odd multiples of 1/`period_s`. ``odd-detection``: those, with one
        of each group of four left out at random.
    """

    rms: float = 1.0
    period_s: float
    band_hz: tuple[float, float] | None = None
    lines: Lines = "odd-detection"

    def __post_init__(self) -> None:
        require_number(self, "rms", self.rms, positive=True)
        require_number(self, "period_s", self.period_s, positive=True)
        if self.lines not in ("full", "odd", "odd-detection"):
            raise ModelError(f"Multisine: lines = {self.lines!r} is none of full, odd, odd-detection")

    def samples(self, count: int, sample_rate_hz: float, rng: np.random.Generator) -> Real:
        """Give ``[sample]``, as many periods as fit and the beginning of one more."""
        size = self._period_samples(sample_rate_hz)
        excited = self.excited_lines(sample_rate_hz, rng)
        spectrum = np.zeros(size // 2 + 1, dtype=complex)
        spectrum[excited] = np.exp(2j * np.pi * rng.random(excited.size))
        period = np.fft.irfft(spectrum, n=size)
        period *= self.rms / np.sqrt(np.mean(period**2))
        return np.asarray(np.resize(period, count), dtype=np.float64)

    def excited_lines(self, sample_rate_hz: float, rng: np.random.Generator) -> Index:
        """Give the rising multiples of 1/`period_s` that are excited.

        The choice of lines is the first thing drawn from `rng`: a generator of the same seed gives the lines of
        `samples`.
        """
        size = self._period_samples(sample_rate_hz)
        frequency_hz = np.asarray(np.fft.rfftfreq(size, 1 / sample_rate_hz), dtype=np.float64)
        lines: Index = np.flatnonzero(band_lines(self, self.band_hz, frequency_hz))
        if self.lines == "full":
            return lines
        odd: Index = lines[lines % 2 == 1]
        if odd.size == 0:
            raise ModelError("Multisine: no odd line in the band; widen it or take a longer period")
        if self.lines == "odd":
            return odd
        groups = odd.size // DETECTION_GROUP
        left_out = np.arange(groups) * DETECTION_GROUP + rng.integers(DETECTION_GROUP, size=groups)
        kept: Index = np.delete(odd, left_out)
        return kept

    def _period_samples(self, sample_rate_hz: float) -> int:
        exact = self.period_s * sample_rate_hz
        size = round(exact)
        # Otherwise a period would end between two samples, and no line would stay on its place.
        if size < 4 or abs(exact - size) > 1e-6 * size:
            raise ModelError(
                f"Multisine: a period of {self.period_s:g} s at {sample_rate_hz:g} Hz is {exact:.6g} samples; "
                f"it must be a whole number of at least 4, such as {max(size, 4) / sample_rate_hz:.9g} s"
            )
        return size
