"""Lines of a record's discrete Fourier transform: which are looked at, and what signals are on them."""

from dataclasses import dataclass

import numpy as np

from chladni.gap.calibration import LINES
from chladni.signals.arrays import Complex, Real, Whole
from chladni.signals.value import Value


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecordLines(Value):
    """Some lines of the transforms of one or more segments of a record, all of `samples` samples.

    Attributes
    ----------
    index
        ``[line]`` numbers of the lines, from 1 (the mean is left out: no accelerometer tells it) to samples/2.
    samples
        Length of a segment, of which ``exp(-2j pi index n/samples)`` are the kernels.
    sample_rate_hz
        Samples a second.
    starts
        First sample of each segment.
    """

    index: Whole
    samples: int
    sample_rate_hz: float
    starts: tuple[int, ...] = (0,)

    def __post_init__(self) -> None:
        self._freeze()

    @property
    def cycles(self) -> Real:
        """``[line]`` cycles a sample."""
        return np.asarray(self.index / self.samples, dtype=np.float64)

    @property
    def frequency_hz(self) -> Real:
        """``[line]``."""
        return np.asarray(self.cycles * self.sample_rate_hz, dtype=np.float64)

    @property
    def z(self) -> Complex:
        """``[line]`` points of the unit circle."""
        return np.asarray(np.exp(2j * np.pi * self.cycles), dtype=np.complex128)

    def spectrum(self, signals: Real) -> Complex:
        """Give ``[..., segment, line]`` of signals ``[..., sample]``; white noise keeps its variance."""
        parts = np.stack([signals[..., start : start + self.samples] for start in self.starts], axis=-2)
        found = np.fft.rfft(parts, axis=-1)[..., self.index]
        return np.asarray(found / np.sqrt(self.samples), dtype=np.complex128)

    def signal(self, spectrum: Complex) -> Real:
        """Give ``[..., segment, sample]`` of spectra ``[..., segment, line]``; lines left out are zero."""
        whole = np.zeros((*spectrum.shape[:-1], self.samples // 2 + 1), dtype=np.complex128)
        whole[..., self.index] = spectrum * np.sqrt(self.samples)
        return np.asarray(np.fft.irfft(whole, self.samples, axis=-1), dtype=np.float64)


def all_lines(samples: int, sample_rate_hz: float) -> RecordLines:
    """Every line but the mean and, of an even record, the last, which is real."""
    return RecordLines(index=np.arange(1, (samples + 1) // 2), samples=samples, sample_rate_hz=sample_rate_hz)


def segment_lines(segment: int, *, samples: int, sample_rate_hz: float, count: int = LINES) -> RecordLines:
    """Give all lines of segments of `segment` samples, spread evenly over a record, about `count` lines in all."""
    index = np.arange(1, (segment + 1) // 2)
    possible = samples // segment
    wanted = int(np.clip(count // max(index.size, 1), 1, possible))
    places = np.unique(np.linspace(0, possible - 1, wanted).round().astype(np.int64))
    starts = tuple(int(place) * segment for place in places)
    return RecordLines(index=index, samples=segment, sample_rate_hz=sample_rate_hz, starts=starts)


def telling_lines(power: Real, *, samples: int, sample_rate_hz: float, count: int = LINES) -> RecordLines:
    """Choose about `count` lines: half where the power is highest, half spread evenly over the rest.

    The power ``[line]`` is of `all_lines`, such as the residual's over the noise's.
    """
    every = all_lines(samples, sample_rate_hz)
    if every.index.size <= count:
        return every
    order = np.argsort(power)[::-1]
    high, rest = order[: count // 2], np.sort(order[count // 2 :])
    spread = rest[np.linspace(0, rest.size - 1, count - count // 2).astype(np.int64)]
    chosen = np.sort(np.concatenate([high, spread]))
    return RecordLines(index=every.index[chosen], samples=samples, sample_rate_hz=sample_rate_hz)
