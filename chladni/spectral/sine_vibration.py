"""Tools of sine sweep tests: profiles by breakpoints or by limits of motion, and a sweep's amplitude against them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from chladni.io.source import SeriesLike, series_of
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError, SetupError
from chladni.signals.profile import rising
from chladni.signals.sine_vibration import SineCheck, SineProfile
from chladni.signals.time_series import TimeSeries
from chladni.signals.units import si_factor
from chladni.spectral.filters import measured_samples
from chladni.spectral.orders import order_cuts
from chladni.spectral.rotation import rotation

ACCELERATION = "m/s^2"
# The level of the drive is that of so many cycles of the lowest frequency; below this share of its greatest there is
# no sweep yet, or any more.
CYCLES_LEVELLED = 4.0
LEAST_SHARE = 1e-3


def sine_profile(
    breakpoints: Sequence[tuple[float, float]],
    *,
    unit: str = "g",
    upper_db: float = 1.0,
    lower_db: float = 1.0,
) -> SineProfile:
    """Give the profile of a sine sweep by its breakpoints, as test standards print it.

    Parameters
    ----------
    breakpoints
        Frequency in Hz and peak acceleration of each.
    unit
        Unit of the accelerations; ``g`` is 9.80665 m/s^2.
    upper_db, lower_db
        Tolerance above and below, in dB of amplitude: 1 dB is 12 %.

    Returns
    -------
    SineProfile
        In SI.

    Raises
    ------
    EstimateError
        When breakpoints don't rise, or aren't above 0.
    SetupError
        When the unit is no acceleration.

    Examples
    --------
    >>> profile = sine_profile([(5, 0.5), (10, 2.0), (100, 2.0)])
    >>> (profile.at(np.array([7.5, 50.0])) / 9.80665).round(3)
    array([1.125, 2.   ])
    """
    factor, si_unit = si_factor(unit)
    if si_unit != ACCELERATION:
        raise SetupError(f"amplitudes in {unit} are no accelerations; give them in g or m/s^2, or use sine_limits")
    frequency_hz, amplitude = rising(breakpoints)
    return SineProfile(frequency_hz=frequency_hz, amplitude=amplitude * factor, upper_db=upper_db, lower_db=lower_db)


def sine_limits(
    band_hz: tuple[float, float],
    *,
    displacement_m: float | None = None,
    velocity_m_s: float | None = None,
    acceleration_m_s2: float | None = None,
    upper_db: float = 1.0,
    lower_db: float = 1.0,
) -> SineProfile:
    """Give the profile that keeps displacement, velocity and acceleration within their limits, with its crossovers.

    Parameters
    ----------
    band_hz
        Where the sweep begins and ends.
    displacement_m, velocity_m_s, acceleration_m_s2
        Peak of each motion, above 0; at least one. Half of what a standard states as peak to peak.
    upper_db, lower_db
        Tolerance, see `sine_profile`.

    Returns
    -------
    SineProfile
        With a breakpoint at each crossover inside the band.

    Raises
    ------
    EstimateError
        When the band doesn't rise from above 0, no limit is given, or one isn't above 0.

    Notes
    -----
    A sine of displacement d has velocity omega d and acceleration omega^2 d. So displacement hands over to velocity
    at v/(2 pi d), velocity to acceleration at a/(2 pi v), and displacement to acceleration at sqrt(a/d)/(2 pi), where
    that comes first (IEC 60068-2-6:2007 calls it the crossover frequency).

    Examples
    --------
    >>> profile = sine_limits((10, 500), displacement_m=0.75e-3, acceleration_m_s2=98.1)  # 0.75 mm, 10 g
    >>> profile.frequency_hz.round(1)
    array([ 10. ,  57.6, 500. ])
    """
    low_hz, high_hz = band_hz
    if not 0 < low_hz < high_hz < np.inf:
        raise EstimateError(f"a sweep from {low_hz:g} to {high_hz:g} Hz; give a band that rises, above 0 Hz")
    # Of each limit: peak acceleration is limit omega^power.
    limits = [
        (power, limit)
        for power, limit in ((2, displacement_m), (1, velocity_m_s), (0, acceleration_m_s2))
        if limit is not None
    ]
    if not limits or not all(0 < limit < np.inf for _, limit in limits):
        raise EstimateError("give a peak displacement, velocity or acceleration above 0, or several of them")
    crossings = [
        (lower / higher) ** (1 / (steep - flat)) / (2 * np.pi)
        for steep, higher in limits
        for flat, lower in limits
        if steep > flat
    ]
    grid = np.unique([low_hz, *(one for one in crossings if low_hz < one < high_hz), high_hz])
    omega = 2 * np.pi * grid
    lowest = np.min([limit * omega**power for power, limit in limits], axis=0)
    # Where two limits cross above the third there is no corner.
    kept = _corners(np.log(grid), np.log(lowest))
    return SineProfile(frequency_hz=grid[kept], amplitude=lowest[kept], upper_db=upper_db, lower_db=lower_db)


def check_sine(
    source: SeriesLike,
    profile: SineProfile,
    *,
    drive: str,
    channels: Names | None = None,
    revolutions: float = 8.0,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> SineCheck:
    """Follow a sine sweep and hold its amplitude against a profile.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]`` of accelerations.
    profile
        From `sine_profile` or `sine_limits`.
    drive
        Channel in which the sweep stands out, such as the control accelerometer. Its frequency is followed from zero
        crossing to zero crossing, so that harmonics and noise must lie well below the sine.
    channels
        Those that are judged; None takes `drive` alone.
    revolutions
        Cycles of the sweep that one amplitude is taken over: more of them reject more noise and follow less quickly.
    sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    SineCheck
        Tracked amplitudes without harmonics and noise, deviations in dB, the share of points outside the tolerance.

    Raises
    ------
    EstimateError
        When a channel is no acceleration, the sweep can't be followed, or no point of it lies inside the profile.

    Examples
    --------
    >>> t = np.arange(20_000) / 1000
    >>> sweep = TimeSeries.from_arrays(
    ...     20 * np.sin(2 * np.pi * (10 * t + t**2)), sample_rate_hz=1000.0, names="x", units="m/s^2"
    ... )
    >>> check_sine(sweep, sine_profile([(12, 2), (48, 2)]), drive="x").outside
    array([0.])
    """
    chosen = drive if channels is None else channels
    series = series_of(source, channels=chosen, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    odd = [channel for channel in series.channels if channel.unit != ACCELERATION]
    if odd:
        raise EstimateError(
            f"{odd[0].name} is in {odd[0].unit}, the profile in {ACCELERATION}; select accelerations, or give the "
            "channel's unit in a setup file"
        )
    control = series_of(source, channels=drive, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    # The sweep is its own tacho: a rising zero crossing each cycle.
    turned = rotation(
        _levelled(control, float(profile.frequency_hz[0])), tacho=control.channels[0].name, threshold=0.0
    )
    cuts = order_cuts(series, turned, orders=(1.0,), revolutions=revolutions)
    amplitude, asked = np.abs(cuts.values[:, 0]), profile.at(cuts.speed_hz)
    deviation_db = 20 * np.log10(np.maximum(amplitude, np.finfo(float).tiny) / asked)
    judged = np.isfinite(deviation_db)
    if not judged.any():
        raise EstimateError(
            f"no point of the sweep lies between {profile.frequency_hz[0]:g} and {profile.frequency_hz[-1]:g} Hz; "
            "name the channel in which it stands out, or read more"
        )
    wrong = judged & ((deviation_db > profile.upper_db) | (deviation_db < -profile.lower_db))
    return SineCheck(
        time_s=cuts.time_s,
        frequency_hz=cuts.speed_hz,
        amplitude=amplitude,
        deviation_db=deviation_db,
        outside=wrong.sum(axis=1) / np.maximum(judged.sum(axis=1), 1),
        channels=cuts.channels,
        profile=profile,
        notes=cuts.notes,
    )


def _levelled(control: TimeSeries, lowest_hz: float) -> TimeSeries:
    """Give the channel with a running RMS of 1, invalid where there is nearly nothing: before and after the sweep."""
    values = control.values.astype(np.float64)
    length = max(1, round(CYCLES_LEVELLED * control.sample_rate_hz / lowest_hz))
    known = measured_samples(control)
    squares = uniform_filter1d(np.where(known, values, 0.0) ** 2, length, axis=1, mode="constant")
    rms = np.sqrt(np.maximum(squares, 0.0))
    there = known & (rms > LEAST_SHARE * rms.max(initial=0.0))
    return replace(control, values=np.divide(values, rms, out=np.zeros_like(values), where=there), valid=there)


def _corners(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Tell which points of a line are its ends, or lie off the straight line between their neighbours."""
    kept = np.ones(x.size, dtype=np.bool_)
    slope = np.diff(y) / np.diff(x)
    kept[1:-1] = np.abs(np.diff(slope)) > 1e-9
    return kept
