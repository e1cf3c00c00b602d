"""Harmonics of rotating machines among responses, told from modes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chladni.modal.operational.narrow_band_kurtosis import narrow_bands
from chladni.modal.operational.steady_line import steady_lines
from chladni.modal.operational.tones import Tone, even_tones, same_tone, steady_tones
from chladni.signals.arrays import Mask, Real
from chladni.signals.errors import EstimateError
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.mode_set import ModeSet
from chladni.signals.time_series import TimeSeries
from chladni.spectral.stretches import valid_runs

# Bands from a 16th of the record, which tells close lines apart, to 16 times as wide, where the speed may wander.
LONGEST_SEGMENT_SHARE = 16
WIDENINGS = (1, 4, 16)
SHORTEST_SEGMENT = 32
# A line closer to 0 Hz holds the record's trend.
FIRST_LINE = 5
# Multiples of a machine's speed that are named as such.
MOST_MULTIPLE = 40
# What a machine and a window make of a sine is this near to its frequency, and decays no faster.
NEAR, LEAST_DAMPING = 0.01, 0.005


def machine_harmonics(
    series: TimeSeries,
    *,
    candidates_hz: Sequence[float] | Real | None = None,
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
        its amplitude are independent, about 4 pi least_damping f T in a record of T seconds, and its line is narrow:
        the fewer, the less is called a harmonic.

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
    Two signs give a sine away, each with half of `false_alarm`. Its amplitude stays, where that of a random response
    comes and goes: in a narrow band a sine has the kurtosis 1.5, Gaussian noise 3 whatever the damping of the mode
    that shapes it (Jacobsen, Andersen & Brincker 2007); the speed may wander within the band. And if its frequency
    stays, its line in the spectrum of the whole record is narrower than that of any mode: damping near zero.

    With G the one-sided density of the random response around it and T the length of the record, a steady sine is
    found in half of all records when its mean square is 70 G/T, in nearly all from 150 G/T on; times what the ratio
    of the narrowest mode is allowed (3 when least_damping f T is 6, 1.4 at 16, 1.1 at 30). On top of a mode with 1 %
    damping that has all of the power, 6000 cycles long, that is a sine as strong as the response; -10 dB two of its
    half-power widths away, -20 dB six widths away. One that wanders needs more than half of the power in a band of
    24/T or wider. False alarms were 0 in 600 records of modes with 0.1 to 1 % damping.

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
    # Narrow bands need long segments: they follow from the longest run of valid samples, not from the record.
    longest = _longest_run(series) // LONGEST_SEGMENT_SHARE
    lengths = [2 * (longest // widening // 2) for widening in WIDENINGS]
    found: list[Tone] = []
    # From narrow to wide, so that a sine has the frequency that the narrowest band gives it.
    scales = [narrow_bands(series, length) for length in lengths if length >= SHORTEST_SEGMENT]
    looked_at = [_lines(bands.frequency_hz, candidates_hz, band_hz) for bands in scales]
    # The chance of any false alarm is at most the sum of the chances of all, however they hang together.
    tests = max(sum(int(lines.sum()) for lines in looked_at), 1) * len(series.channels)
    for bands, lines in zip(scales, looked_at, strict=True):
        even = even_tones(series, bands, lines, chance=false_alarm / 2 / tests, least_damping=least_damping)
        found += [tone for tone in even if not any(same_tone(tone, other) for other in found)]
    return _named(_with_steady(found, series, candidates_hz, band_hz, false_alarm / 2, least_damping))


def _with_steady(
    even: list[Tone],
    series: TimeSeries,
    candidates_hz: Sequence[float] | Real | None,
    band_hz: tuple[float, float] | None,
    false_alarm: float,
    least_damping: float,
) -> list[Tone]:
    """Add the sines that are narrow lines of the whole record, and what that tells of those found already."""
    record = steady_lines(series, least_damping)
    lines = _lines(record.frequency_hz, candidates_hz, band_hz)
    tests = max(int(lines.sum()), 1) * len(series.channels)
    found, refined = list(even), set[int]()
    for tone in steady_tones(series, record, lines, chance=false_alarm / tests, least_damping=least_damping):
        row = next((row for row, other in enumerate(found) if same_tone(tone, other)), None)
        if row is None:
            found.append(tone)
        elif row < len(even) and row not in refined:
            # The strongest line comes first and has the finer frequency; those beside it are its wandering.
            both = f"{found[row].reason}, and {tone.reason}"
            found[row] = replace(found[row], frequency_hz=tone.frequency_hz, reason=both)
            refined.add(row)
    return found


def _require_arguments(
    series: TimeSeries, band_hz: tuple[float, float] | None, false_alarm: float, least_damping: float
) -> None:
    if not 0 < false_alarm < 1:
        raise EstimateError(f"false_alarm is {false_alarm}; it must lie between 0 and 1")
    if not 0 < least_damping < 1:
        raise EstimateError(f"least_damping is {least_damping}; it must lie between 0 and 1, such as 0.001")
    if band_hz is not None and not 0 <= band_hz[0] < band_hz[1]:
        raise EstimateError(f"band_hz is {band_hz}; give its low and its high end, low below high")
    longest = _longest_run(series)
    if longest < LONGEST_SEGMENT_SHARE * SHORTEST_SEGMENT:
        raise EstimateError(
            f"{longest} valid samples in a row are too few to tell sines from modes; at least "
            f"{LONGEST_SEGMENT_SHARE * SHORTEST_SEGMENT} are needed"
        )


def _longest_run(series: TimeSeries) -> int:
    return max((last - first for first, last in valid_runs(series)), default=0)


def _lines(
    frequency_hz: Real, candidates_hz: Sequence[float] | Real | None, band_hz: tuple[float, float] | None
) -> Mask:
    """Lines that are looked at."""
    chosen = np.arange(frequency_hz.size) >= FIRST_LINE
    # The last line is real: its amplitude is no complex Gaussian number.
    chosen[-1] = False
    if band_hz is not None:
        chosen &= (frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])
    if candidates_hz is not None:
        near = np.zeros(frequency_hz.size, dtype=np.bool_)
        # One at a time: all differences at once would be as large as the spectra of many channels.
        for candidate_hz in candidates_hz:
            near |= np.abs(frequency_hz - candidate_hz) <= 1.5 * frequency_hz[1]
        chosen &= near
    return chosen


def _named(tones: list[Tone]) -> tuple[MachineHarmonic, ...]:
    """Add to each reason of which other tone it is a multiple."""
    # By rising frequency, so that the base of a family is named before its multiples.
    tones = sorted(tones, key=lambda tone: tone.frequency_hz)
    named = []
    for row, tone in enumerate(tones):
        bases = [base for base in tones[:row] if _multiple_of(tone, base)]
        if bases:
            order = round(tone.frequency_hz / bases[0].frequency_hz)
            tone = replace(tone, reason=f"{tone.reason}; {order} times {bases[0].frequency_hz:.5g} Hz")
        named.append(MachineHarmonic(frequency_hz=tone.frequency_hz, reason=tone.reason))
    return tuple(named)


def _multiple_of(tone: Tone, base: Tone) -> bool:
    order = round(tone.frequency_hz / base.frequency_hz)
    # A sine's frequency is known to a fraction of its band, and the base's error grows with the order.
    tolerance_hz = 0.1 * (tone.width_hz + order * base.width_hz)
    unlikely = tolerance_hz < 0.1 * base.frequency_hz
    return (
        2 <= order <= MOST_MULTIPLE
        and unlikely
        and abs(tone.frequency_hz - order * base.frequency_hz) <= tolerance_hz
    )


def without_machines(modes: ModeSet, harmonics: Sequence[MachineHarmonic], *, line_hz: float) -> ModeSet:
    """Leave out modes that are lines of machines, and list those lines with their reasons.

    Parameters
    ----------
    modes
        From spectra, which don't tell a sine from a mode that is narrower than their lines.
    harmonics
        Of the same record; see `chladni.modal.operational.harmonics.machine_harmonics`.
    line_hz
        Distance of the spectral lines, Hz.

    Returns
    -------
    ModeSet
        Without the modes next to a harmonic whose damping ratio is at most half a percent, or whose half-power width
        is at most two lines: a window makes that of a sine.
    """
    known = (*modes.harmonics, *harmonics)
    if not known:
        return modes
    machine_hz = np.array([one.frequency_hz for one in known])
    away_hz = np.abs(modes.frequency_hz[:, np.newaxis] - machine_hz).min(axis=1)
    narrow = (modes.damping_ratio <= LEAST_DAMPING) | (modes.damping_ratio * modes.frequency_hz <= line_hz)
    machine = narrow & (away_hz <= np.maximum(NEAR * modes.frequency_hz, line_hz))
    kept = modes.select(np.flatnonzero(~machine))
    unique = {round(one.frequency_hz / line_hz): one for one in reversed(known)}
    return replace(kept, harmonics=tuple(sorted(unique.values(), key=lambda one: one.frequency_hz)))
