"""Harmonics of rotating machines among responses, told from modes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chladni.modal.narrow_band_kurtosis import NarrowBands, chance_of_kurtosis, independent_samples, narrow_bands
from chladni.signals.errors import EstimateError
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.time_series import TimeSeries
from chladni.spectral.leakage import leakage, named_window

Floats = NDArray[np.float64]

# Bands from a 16th of the record, which tells close lines apart, to 16 times as wide, where the speed may wander.
LONGEST_SEGMENT_SHARE = 16
WIDENINGS = (1, 4, 16)
SHORTEST_SEGMENT = 32
# A line closer to 0 Hz holds the record's trend.
FIRST_LINE = 5
# The sine has half the power of its band or more; with less, whatever else rings there would be named by it.
MOST_KURTOSIS = 2.625
# Leakage of a strong sine is a sine too; a second one must stand this far above it.
OVER_LEAKAGE = 4.0
MAIN_LOBE_LINES = 2.5
MOST_MULTIPLE = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class _Tone:
    """A sine found, with the half width of the band in which another would be the same one."""

    frequency_hz: float
    width_hz: float
    reason: str


def machine_harmonics(
    series: TimeSeries,
    *,
    candidates_hz: Sequence[float] | NDArray[np.float64] | None = None,
    band_hz: tuple[float, float] | None = None,
    false_alarm: float = 0.01,
    least_damping: float = 0.001,
) -> tuple[MachineHarmonic, ...]:
    """Find the sines among responses that are no modes.

    Parameters
    ----------
    series
        Responses; stretches with invalid samples are left out.
    candidates_hz
        Look only here (within the width of a band), such as at frequencies taken for modes; None looks everywhere.
    band_hz
        Look only between these two.
    false_alarm
        Chance that a record of Gaussian noise through any structure gives one harmonic or more, 0 to 1; it's shared
        among all the bands that are looked at.
    least_damping
        Damping ratio below which no mode of the structure lies, above 0. A mode rings so evenly that few samples of
        its amplitude are independent: about 4 pi least_damping f T in a record of T seconds. Below 8 of them nothing
        is called a harmonic.

    Returns
    -------
    tuple of MachineHarmonic
        By rising frequency; each tells the channel and the numbers that gave it away, and of which other harmonic it
        is a multiple.

    Raises
    ------
    EstimateError
        When an argument is out of its range, the record is too short, or a sample isn't finite.

    Notes
    -----
    The amplitude of a sine stays, that of a random response comes and goes: in a narrow band a sine has the kurtosis
    1.5, Gaussian noise 3 whatever the damping of the mode that shapes it (Jacobsen, Andersen & Brincker 2007).
    Responses to periodic excitation (multisine, sweep that repeats) are harmonics throughout.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> time_s = np.arange(60_000) / 100
    >>> noise = np.random.default_rng(0).standard_normal(time_s.size)
    >>> series = TimeSeries(
    ...     values=(noise + np.sin(2 * np.pi * 12.5 * time_s))[np.newaxis],
    ...     sample_rate_hz=100.0,
    ...     channels=(Channel(name="a", unit="m/s^2"),),
    ... )
    >>> [round(harmonic.frequency_hz, 3) for harmonic in machine_harmonics(series)]
    [12.5]
    """
    _require_arguments(series, band_hz, false_alarm, least_damping)
    longest = series.samples // LONGEST_SEGMENT_SHARE
    lengths = [2 * (longest // widening // 2) for widening in WIDENINGS]
    scales = [narrow_bands(series, length) for length in lengths if length >= SHORTEST_SEGMENT]
    looked_at = [_lines(bands, candidates_hz, band_hz) for bands in scales]
    tests = len(series.channels) * sum(np.count_nonzero(lines) for lines in looked_at)
    found: list[_Tone] = []
    for bands, lines in zip(scales, looked_at, strict=True):
        for tone in _tones(series, bands, lines, false_alarm / max(tests, 1), least_damping):
            if not any(_same(tone, other) for other in found):
                found.append(tone)
    return _named(found)


def _require_arguments(
    series: TimeSeries, band_hz: tuple[float, float] | None, false_alarm: float, least_damping: float
) -> None:
    if not 0 < false_alarm < 1:
        raise EstimateError(f"false_alarm is {false_alarm}; it must lie between 0 and 1")
    if not 0 < least_damping < 1:
        raise EstimateError(f"least_damping is {least_damping}; it must lie between 0 and 1, such as 0.001")
    if band_hz is not None and not 0 <= band_hz[0] < band_hz[1]:
        raise EstimateError(f"band_hz is {band_hz}; give its low and its high end, low below high")
    if series.samples < LONGEST_SEGMENT_SHARE * SHORTEST_SEGMENT:
        raise EstimateError(
            f"{series.samples} samples are too few to tell sines from modes; at least "
            f"{LONGEST_SEGMENT_SHARE * SHORTEST_SEGMENT} are needed"
        )


def _lines(
    bands: NarrowBands, candidates_hz: Sequence[float] | Floats | None, band_hz: tuple[float, float] | None
) -> NDArray[np.bool_]:
    """Lines that are looked at."""
    frequency_hz, spacing_hz = bands.frequency_hz, 1 / bands.segment_s
    chosen = np.arange(frequency_hz.size) >= FIRST_LINE
    # The last line is real: its amplitude is no complex Gaussian number.
    chosen[-1] = False
    if band_hz is not None:
        chosen &= (frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])
    if candidates_hz is not None:
        near = np.abs(frequency_hz[:, None] - np.asarray(candidates_hz, dtype=np.float64)[None, :])
        chosen &= np.any(near <= spacing_hz, axis=1)
    return chosen


def _tones(
    series: TimeSeries, bands: NarrowBands, lines: NDArray[np.bool_], chance: float, least_damping: float
) -> list[_Tone]:
    """Sines in the lines of one width of band, the surest channel of each."""
    independent = independent_samples(bands, least_damping)
    chances = chance_of_kurtosis(bands.kurtosis, independent[np.newaxis])
    sure = (chances <= chance) & (bands.kurtosis <= MOST_KURTOSIS) & lines
    tones: list[_Tone] = []
    for channel in np.argsort(chances.min(axis=1), kind="stable"):
        for line in _separate(bands.power[channel], sure[channel]):
            reason = (
                f"kurtosis {bands.kurtosis[channel, line]:.2f} of {series.channels[channel].name} in a band of "
                f"{1.5 / bands.segment_s:.3g} Hz (a sine has 1.5, noise 3; {independent[line]:.0f} independent samples)"
            )
            frequency_hz = _between_lines(bands.power[channel], line) / bands.segment_s
            tone = _Tone(frequency_hz=frequency_hz, width_hz=MAIN_LOBE_LINES / bands.segment_s, reason=reason)
            if not any(_same(tone, other) for other in tones):
                tones.append(tone)
    return tones


def _separate(power: Floats, sure: NDArray[np.bool_]) -> list[int]:
    """Lines of separate sines: the strongest first, without those that its leakage explains."""
    left, found, window = np.flatnonzero(sure), [], named_window("hann")
    while left.size:
        line = int(left[np.argmax(power[left])])
        found.append(line)
        away = np.abs(left - line)
        leaked = OVER_LEAKAGE * power[line] * leakage(window, np.maximum(away - 0.5, 0.0))
        left = left[(away > MAIN_LOBE_LINES) & (power[left] > leaked)]
    return found


def _between_lines(power: Floats, line: int) -> float:
    """Where a sine lies, in lines, from the two largest amplitudes of its Hann main lobe."""
    before, top, after = np.sqrt(power[line - 1 : line + 2])
    side, sign = (after, 1) if after >= before else (before, -1)
    ratio = side / top if top > 0 else 0.5
    # |W(1 - d)| / |W(d)| = (1 + d) / (2 - d); noise may push it beyond the next line, where it can't be.
    return line + sign * float(np.clip((2 * ratio - 1) / (ratio + 1), 0.0, 0.5))


def _same(one: _Tone, other: _Tone) -> bool:
    return abs(one.frequency_hz - other.frequency_hz) <= max(one.width_hz, other.width_hz)


def _named(tones: list[_Tone]) -> tuple[MachineHarmonic, ...]:
    """Add to each reason of which other tone it is a multiple."""
    tones = sorted(tones, key=lambda tone: tone.frequency_hz)
    named = []
    for row, tone in enumerate(tones):
        bases = [base for base in tones[:row] if _multiple_of(tone, base)]
        if bases:
            order = round(tone.frequency_hz / bases[0].frequency_hz)
            tone = replace(tone, reason=f"{tone.reason}; {order} times {bases[0].frequency_hz:.5g} Hz")
        named.append(MachineHarmonic(frequency_hz=tone.frequency_hz, reason=tone.reason))
    return tuple(named)


def _multiple_of(tone: _Tone, base: _Tone) -> bool:
    order = round(tone.frequency_hz / base.frequency_hz)
    # A sine's frequency is known to a fraction of its band, and the base's error grows with the order.
    tolerance_hz = 0.1 * (tone.width_hz + order * base.width_hz)
    unlikely = tolerance_hz < 0.1 * base.frequency_hz
    return (
        2 <= order <= MOST_MULTIPLE
        and unlikely
        and abs(tone.frequency_hz - order * base.frequency_hz) <= tolerance_hz
    )
