"""Tones in a signal: sharp lines that stand out of what is around them."""

import numpy as np

from chladni.signals.arrays import Real

#: Power over that of the lines around it, itself among them, of a line that stands out.
_SHARP = 4.0


def strongest_tones(signal: Real, sample_rate_hz: float, count: int = 3) -> list[float]:
    """Give frequencies in Hz of the sharpest lines and of the highest sharp ones, to a fraction of a line.

    By the Hann-windowed transform and a parabola through the logarithm of its peak (Gasior and Gonzalez 2004).

    Parameters
    ----------
    count
        At most so many of either kind.
    """
    # Slow to import, and few diagnoses look for tones.
    from scipy.signal import find_peaks

    size = signal.size
    power = np.abs(np.fft.rfft(signal * np.hanning(size))) ** 2
    # Against its surroundings: a resonance that an unknown force excites is broad.
    width = max(5, size // 400)
    around = np.convolve(np.pad(power, width, mode="reflect"), np.full(2 * width + 1, 1 / (2 * width + 1)), "valid")
    sharp = power / np.maximum(around, 1e-300)
    sharp[: max(3, size // 5000)] = 0.0
    peaks = find_peaks(power)[0]
    peaks = peaks[(power[peaks] > 1e-6 * power.max()) & (sharp[peaks] > 0)]
    # A motor's speed wanders a little, so its line is less sharp than a spike of noise; but it's higher.
    high = peaks[sharp[peaks] > _SHARP]
    chosen = [*peaks[np.argsort(-sharp[peaks])][:count], *high[np.argsort(-power[high])][:count]]
    return [
        float((place + _offset(power[place - 1 : place + 2])) * sample_rate_hz / size)
        for place in dict.fromkeys(chosen)
    ]


def _offset(three: Real) -> float:
    low, mid, high = np.log(np.maximum(three, 1e-300))
    bend = low - 2 * mid + high
    return float(0.5 * (low - high) / bend) if bend < 0 else 0.0
