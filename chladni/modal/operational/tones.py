"""Sines found in lines: by an amplitude that stays even, or by a line narrower than any mode."""

from dataclasses import dataclass

import numpy as np

from chladni.modal.operational.narrow_band_kurtosis import NarrowBands, chance_of_kurtosis, independent_samples
from chladni.modal.operational.steady_line import SteadyLines
from chladni.signals.arrays import Mask, Real
from chladni.signals.time_series import TimeSeries
from chladni.spectral.leakage import leakage, named_window

# The sine has half the power of its band or more; with less, whatever else rings there would be named by it.
MOST_KURTOSIS = 2.625
# Leakage of a strong sine is a sine too; a second one must stand this far above it.
OVER_LEAKAGE = 4.0
MAIN_LOBE_LINES = 2.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Tone:
    """A sine, what gave it away, and the half width of the band in which another would be the same one."""

    frequency_hz: float
    width_hz: float
    reason: str


def same_tone(one: Tone, other: Tone) -> bool:
    """Whether two sines lie within the wider one's band."""
    return abs(one.frequency_hz - other.frequency_hz) <= max(one.width_hz, other.width_hz)


def even_tones(
    series: TimeSeries, bands: NarrowBands, lines: Mask, *, chance: float, least_damping: float
) -> list[Tone]:
    """Sines in the lines of one width of band, by their kurtosis; the surest channel of each names it.

    Parameters
    ----------
    series
        Whose channels the bands are of.
    bands
        Kurtosis of each line.
    lines
        ``[line]`` those to look at.
    chance
        That noise is taken for a sine, in one line of one channel.
    least_damping
        Damping ratio below which no mode lies.
    """
    independent = independent_samples(bands, least_damping)
    chances = chance_of_kurtosis(bands.kurtosis, independent[np.newaxis])
    # Sure that it's no noise, and so much of it that the band is the sine's.
    sure = (chances <= chance) & (bands.kurtosis <= MOST_KURTOSIS) & lines
    tones: list[Tone] = []
    for channel in np.argsort(chances.min(axis=1), kind="stable"):
        for line in _separate(bands.power[channel], sure[channel]):
            reason = (
                f"kurtosis {bands.kurtosis[channel, line]:.2f} of {series.channels[channel].name} in a band of "
                f"{1.5 / bands.segment_s:.3g} Hz (a sine has 1.5, noise 3; {independent[line]:.0f} independent "
                "samples)"
            )
            _add(tones, bands.power[channel], line, bands.segment_s, reason)
    return tones


def steady_tones(
    series: TimeSeries, record: SteadyLines, lines: Mask, *, chance: float, least_damping: float
) -> list[Tone]:
    """Sines in the lines of the whole record, by how far they stand over the lines beside them; the strongest first.

    Parameters as those of `even_tones`.
    """
    # One line a sine, the surest channel first: it names the sine, and gives the frequency.
    sure = (record.chance <= chance) & lines
    tones: list[Tone] = []
    for channel in np.argsort(-np.where(sure, record.over_neighbours, 0.0).max(axis=1), kind="stable"):
        for line in _separate(record.power[channel], sure[channel]):
            reason = (
                f"damping near zero: a line of {series.channels[channel].name} stands "
                f"{10 * np.log10(record.over_neighbours[channel, line]):.0f} dB over those beside it in "
                f"{record.segment_s:.4g} s, more than that of a mode with {100 * least_damping:.3g} % damping does"
            )
            _add(tones, record.power[channel], line, record.segment_s, reason)
    return tones


def _add(tones: list[Tone], power: Real, line: int, segment_s: float, reason: str) -> None:
    tone = Tone(
        frequency_hz=_between_lines(power, line) / segment_s, width_hz=MAIN_LOBE_LINES / segment_s, reason=reason
    )
    if not any(same_tone(tone, other) for other in tones):
        tones.append(tone)


def _separate(power: Real, sure: Mask) -> list[int]:
    """Lines of separate sines: the strongest first, without those that its leakage explains."""
    left, found, window = np.flatnonzero(sure), [], named_window("hann")
    while left.size:
        line = int(left[np.argmax(power[left])])
        found.append(line)
        away = np.abs(left - line)
        leaked = OVER_LEAKAGE * power[line] * leakage(window, np.maximum(away - 0.5, 0.0))
        left = left[(away > MAIN_LOBE_LINES) & (power[left] > leaked)]
    return found


def _between_lines(power: Real, line: int) -> float:
    """Where a sine lies, in lines, from the two largest amplitudes of its Hann main lobe."""
    before, top, after = np.sqrt(power[line - 1 : line + 2])
    side, sign = (after, 1) if after >= before else (before, -1)
    # |W(1 - d)| / |W(d)| = (1 + d) / (2 - d); noise may push it beyond the next line, where it can't be.
    ratio = side / top
    return float(line + sign * np.clip((2 * ratio - 1) / (ratio + 1), 0.0, 0.5))
