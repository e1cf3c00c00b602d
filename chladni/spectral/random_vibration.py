"""Tools of random vibration tests: spectra against a profile, spread of amplitudes, shock response of a density."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from chladni.io.missing_samples import missing_notes
from chladni.io.source import SeriesLike, density_of, series_of
from chladni.signals.arrays import Real
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.profile import rising
from chladni.signals.random_vibration import ProbabilityDensity, ProfileCheck, RandomProfile, VibrationResponse
from chladni.signals.units import si_factor
from chladni.spectral.filters import require_measured

# Points of the integral over a resonance: steps of so many a half-power bandwidth, within so many of them.
STEPS_A_BANDWIDTH, BANDWIDTHS = 20, 20


def random_profile(
    breakpoints: Sequence[tuple[float, float]],
    *,
    unit: str = "g",
    upper_db: float = 3.0,
    lower_db: float = 3.0,
) -> RandomProfile:
    """Give a profile by its breakpoints, as test standards print it.

    Parameters
    ----------
    breakpoints
        Frequency in Hz and density in ``unit^2/Hz`` of each.
    unit
        Unit that the densities are in; ``g`` is 9.80665 m/s^2.
    upper_db, lower_db
        Tolerance above and below, in dB of power.

    Returns
    -------
    RandomProfile
        In SI.

    Raises
    ------
    EstimateError
        When breakpoints don't rise, or aren't above 0.
    SetupError
        When the unit is none.

    Examples
    --------
    >>> navmat = random_profile([(20, 0.01), (80, 0.04), (350, 0.04), (2000, 0.007)])  # NAVMAT P-9492: 6.06 g RMS
    >>> round(navmat.rms() / 9.80665, 2)
    6.06
    """
    factor, si_unit = si_factor(unit)
    frequency_hz, density = rising(breakpoints)
    return RandomProfile(
        frequency_hz=frequency_hz,
        density=density * factor**2,
        unit=si_unit,
        upper_db=upper_db,
        lower_db=lower_db,
    )


def check_profile(density: PowerSpectralDensity, profile: RandomProfile) -> ProfileCheck:
    """Hold spectra against a profile, line by line.

    Parameters
    ----------
    density
        Of channels in the profile's unit, such as `PowerSpectralDensity.from_arrays` makes of an array; lines outside
        the profile are left out.
    profile
        From `random_profile`.

    Returns
    -------
    ProfileCheck
        Deviations in dB, the share of lines outside the tolerance, and both RMS.

    Raises
    ------
    EstimateError
        When a unit differs, or fewer than two lines lie inside the profile.
    """
    odd = [channel for channel in density.channels if channel.unit != profile.unit]
    if odd:
        raise EstimateError(
            f"{odd[0].name} is in {odd[0].unit}, the profile in {profile.unit}; select channels in one unit, or give "
            "the channel's"
        )
    inside = np.isfinite(profile.at(density.frequency_hz))
    if np.count_nonzero(inside) < 2:
        raise EstimateError(
            f"fewer than two lines lie between {profile.frequency_hz[0]:g} and {profile.frequency_hz[-1]:g} Hz; ask "
            "for a finer resolution"
        )
    axis, values = density.frequency_hz[inside], density.values[:, inside]
    ratio = values / profile.at(axis)
    deviation_db = 10 * np.log10(np.maximum(ratio, np.finfo(float).tiny))
    outside = (deviation_db > profile.upper_db) | (deviation_db < -profile.lower_db)
    relative = density.std[:, inside] / np.maximum(values, np.finfo(float).tiny)
    return ProfileCheck(
        frequency_hz=axis,
        deviation_db=deviation_db,
        outside=outside.mean(axis=1),
        rms=np.sqrt(np.trapezoid(values, axis, axis=1)),
        profile_rms=profile.rms(),
        std_db=10 / np.log(10) * np.median(relative, axis=1),
        channels=density.channels,
        profile=profile,
    )


def probability_density(
    source: SeriesLike,
    *,
    bins: int = 60,
    widest: float = 5.0,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> ProbabilityDensity:
    """Tell how often amplitudes occur, beside what Gaussian noise has.

    Parameters
    ----------
    source
        A log, the path to one, a series, or an array ``[channel, sample]``:
        of all channels.
    bins
        How many, at least 2.
    widest
        From minus to plus so many standard deviations; what lies beyond isn't counted.
    channels, sample_rate_hz, start_s, end_s
        Which samples, see `cross_spectra`.

    Returns
    -------
    ProbabilityDensity
        In standard deviations from the mean.

    Raises
    ------
    EstimateError
        When an argument is out of its range, or a channel never changes.

    Notes
    -----
    Share of samples in a bin over its width W (Bendat & Piersol 2010, eq. 8.69). Its variance is p (1 - p W)/(N W)
    for N independent samples. At least as many are as there are samples over the sum of their squared
    autocorrelation: whether a sample lies in a bin is forgotten sooner than its value.

    Examples
    --------
    >>> found = probability_density(np.random.default_rng(1).standard_normal(100_000), sample_rate_hz=1000.0)
    >>> bool(np.abs(found.density[0] - found.gaussian).max() < 0.02)
    True
    """
    series = series_of(source, channels=channels, sample_rate_hz=sample_rate_hz, start_s=start_s, end_s=end_s)
    if not (bins >= 2 and 0 < widest < np.inf):
        raise EstimateError(f"{bins} bins to {widest:g} standard deviations; give 2 or more, above 0")
    edges = np.linspace(-widest, widest, bins + 1)
    rows = []
    for channel, values, known in zip(series.channels, series.values, require_measured(series), strict=True):
        x = values[known].astype(np.float64)
        size = float(x.std()) if x.size else 0.0
        if not size > 0:
            raise EstimateError(f"{channel.name} never changes; leave it out")
        deviation = (x - x.mean()) / size
        share = np.histogram(deviation, edges)[0] / x.size
        independent = x.size / _held_together(deviation)
        rows.append((share, np.sqrt(share * (1 - share) / independent), float(x.mean()), size))
    width = float(edges[1] - edges[0])
    return ProbabilityDensity(
        deviation=(edges[1:] + edges[:-1]) / 2,
        density=np.stack([share for share, _, _, _ in rows]) / width,
        std=np.stack([std for _, std, _, _ in rows]) / width,
        mean=np.array([mean for _, _, mean, _ in rows]),
        standard_deviation=np.array([size for _, _, _, size in rows]),
        channels=series.channels,
        notes=missing_notes(series),
    )


def _held_together(deviation: Real) -> float:
    """How many samples count as one: the sum of the squared autocorrelation, that is of the squared spectrum."""
    power = np.abs(np.fft.rfft(deviation)) ** 2
    # Half of the lines are there, and those of a periodogram scatter by as much as they are: twice the square.
    return max(1.0, float(deviation.size * np.sum(power**2) / (4 * power.sum() ** 2)))


def vibration_response(
    source: PowerSpectralDensity | ArrayLike,
    *,
    frequencies_hz: Real | Sequence[float],
    q: float = 10.0,
    duration_s: float = 60.0,
    probability: float = 0.5,
    frequency_hz: ArrayLike | None = None,
) -> VibrationResponse:
    """Give the shock response spectrum of a random vibration: RMS and peak of oscillators on that base.

    Parameters
    ----------
    source
        Densities of base accelerations, or an array ``[channel, frequency]`` of them; straight between its lines on
        logarithmic axes, nothing outside them.
    frequencies_hz
        Natural frequencies, rising, above 0.
    q
        Amplification at resonance, above 0.5.
    duration_s
        How long the vibration lasts.
    probability
        With which the peak isn't exceeded, between 0 and 1; 0.5 is the median of the highest peak.
    frequency_hz
        Of an array: its lines.

    Returns
    -------
    VibrationResponse
        Of absolute acceleration, in each channel's unit.

    Raises
    ------
    EstimateError
        When an argument is out of its range.

    Notes
    -----
    RMS: the integral of abs(H)^2 G, H = (1 + 2j zeta r)/(1 - r^2 + 2j zeta r). Miles: sqrt(pi/2 f q G(f)) (Miles
    1954, J. Aeronautical Sciences 21(11)); three times that is the usual "3 sigma". Peak: Vanmarcke's law of first
    passages (Vanmarcke 1975, J. Applied Mechanics 42(1)), P(s) = (1 - exp(-s^2/2)) exp(-nu T (1 - exp(-sqrt(pi/2)
    delta^1.2 s))/(exp(s^2/2) - 1)), s in RMS, with nu = sqrt(m2/m0)/pi crossings of either sign and
    delta^2 = 1 - m1^2/(m0 m2) by the spectral moments m.

    Examples
    --------
    >>> lines = np.linspace(1, 5000, 5000)
    >>> found = vibration_response(np.ones(5000), frequency_hz=lines, frequencies_hz=[100.0])
    >>> round(float(found.rms[0, 0]), 1), round(float(found.miles[0, 0]), 1)
    (39.8, 39.6)
    """
    density = density_of(source, frequency_hz=frequency_hz)
    natural_hz = np.atleast_1d(np.asarray(frequencies_hz, dtype=np.float64))
    if not (natural_hz.size and np.all(np.diff(natural_hz, prepend=0.0) > 0) and np.all(np.isfinite(natural_hz))):
        raise EstimateError("natural frequencies must rise, above 0 Hz")
    if not 0.5 < q < np.inf:
        raise EstimateError(f"q is {q:g}; it must be finite and above 0.5, such as 10 for 5 % damping")
    if not (0 < duration_s < np.inf and 0 < probability < 1):
        raise EstimateError(
            f"a peak within {duration_s:g} s with probability {probability:g}; give a time above 0 and a probability "
            "between 0 and 1"
        )
    shape = (len(density.channels), natural_hz.size)
    rms, miles, peak = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for row, values in enumerate(density.values):
        for place, one_hz in enumerate(natural_hz.tolist()):
            moments = _moments(density.frequency_hz, values, one_hz, q)
            rms[row, place] = np.sqrt(moments[0])
            peak[row, place] = rms[row, place] * _peak_factor(moments, duration_s, probability)
            miles[row, place] = np.sqrt(np.pi / 2 * one_hz * q * _between(density.frequency_hz, values, one_hz))
    return VibrationResponse(
        frequency_hz=natural_hz,
        rms=rms,
        miles=miles,
        peak=peak,
        q=q,
        duration_s=duration_s,
        probability=probability,
        channels=density.channels,
    )


def _between(axis: Real, values: Real, frequency_hz: Real | float) -> Real:
    """Density between its lines, straight on logarithmic axes; 0 outside."""
    known = (axis > 0) & (values > 0)
    if not known.any():
        return np.zeros(np.shape(frequency_hz))
    inside = (frequency_hz >= axis[known][0]) & (frequency_hz <= axis[known][-1])
    log_f = np.log(np.where(inside, frequency_hz, axis[known][0]))
    found = np.exp(np.interp(log_f, np.log(axis[known]), np.log(values[known])))
    return np.where(inside, found, 0.0)


def _moments(axis: Real, values: Real, natural_hz: float, q: float) -> Real:
    """Spectral moments m0, m1, m2 of the response, in powers of rad/s."""
    width = natural_hz / q
    near = natural_hz + width * np.arange(-BANDWIDTHS, BANDWIDTHS, 1 / STEPS_A_BANDWIDTH)
    grid = np.unique(np.concatenate([axis, near[(near > axis[0]) & (near < axis[-1])]]))
    grid = grid[grid > 0]
    ratio = grid / natural_hz
    gain = (1 + (ratio / q) ** 2) / ((1 - ratio**2) ** 2 + (ratio / q) ** 2)
    response = gain * _between(axis, values, grid)
    return np.array([np.trapezoid(response * (2 * np.pi * grid) ** power, grid) for power in range(3)])


def _peak_factor(moments: Real, duration_s: float, probability: float) -> float:
    from scipy.optimize import brentq

    if not moments[0] > 0:
        return 0.0
    crossings = np.sqrt(moments[2] / moments[0]) / np.pi * duration_s
    delta = np.sqrt(max(1 - moments[1] ** 2 / (moments[0] * moments[2]), 0.0))

    def log_chance(s: float) -> float:
        clumped = -np.expm1(-np.sqrt(np.pi / 2) * delta**1.2 * s)
        return float(np.log(-np.expm1(-(s**2) / 2)) - crossings * clumped / np.expm1(s**2 / 2))

    return float(brentq(lambda s: log_chance(s) - np.log(probability), 1e-3, 30.0))
