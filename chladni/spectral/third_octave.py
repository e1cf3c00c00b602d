"""Third-octave bands after IEC 61260-1:2014: from spectral densities, and by filters in time."""

from dataclasses import dataclass, replace
from math import ceil, floor, log10

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import TimeSeries
from chladni.spectral.bands import BandLevels, band_rms
from chladni.spectral.leakage import leakage, named_window

# IEC 61260-1:2014: octave frequency ratio and reference frequency.
OCTAVE = 10**0.3
REFERENCE_HZ = 1000.0
# Preferred numbers R10 (ISO 3), by which bands are called; the exact mid-band frequencies differ from them.
NOMINAL = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
# Order of the Butterworth prototype; the band-pass has twice as many poles. Three meets class 1 to a quarter of the
# sample rate, above which the bilinear transform makes the lower flank too shallow; four meets it up to 0.45.
FILTER_ORDER = 4

# IEC 61260-1:2014, table 1: powers of the octave ratio, and least and greatest relative attenuation in dB there.
# At 1/2, the edge of a band, the least attenuation steps up and the greatest ends.
_POWERS = np.array([0.0, 1 / 8, 1 / 4, 3 / 8, 1 / 2])
_STOP_POWERS = np.array([1 / 2, 1.0, 2.0, 3.0, 4.0])
_MASKS = {
    1: ([-0.4] * 5, [0.4, 0.5, 0.7, 1.4, 5.3], [1.2, 16.6, 40.5, 60.0, 70.0]),
    2: ([-0.6] * 5, [0.6, 0.7, 0.9, 1.7, 5.8], [0.8, 15.6, 39.5, 54.0, 60.0]),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ThirdOctaveBand:
    """One band: number (0 at 1 kHz), exact mid-band frequency, edges, and the nominal frequency it's called by."""

    number: int
    mid_hz: float
    low_hz: float
    high_hz: float
    nominal_hz: float


def third_octave_band(number: int) -> ThirdOctaveBand:
    """Give the band with this number; 0 is the one at 1 kHz.

    f_m = 1000 Hz G^(x/3) and edges f_m G^(-1/6), f_m G^(1/6) with G = 10^0.3 (IEC 61260-1:2014, base ten).

    Examples
    --------
    >>> band = third_octave_band(-13)
    >>> band.nominal_hz, round(band.mid_hz, 3), round(band.low_hz, 3), round(band.high_hz, 3)
    (50.0, 50.119, 44.668, 56.234)
    """
    mid_hz = REFERENCE_HZ * OCTAVE ** (number / 3)
    return ThirdOctaveBand(
        number=number,
        mid_hz=mid_hz,
        low_hz=mid_hz * OCTAVE ** (-1 / 6),
        high_hz=mid_hz * OCTAVE ** (1 / 6),
        nominal_hz=round(NOMINAL[number % 10] * 10.0 ** (3 + number // 10), 9),
    )


def third_octave_bands(low_hz: float, high_hz: float) -> tuple[ThirdOctaveBand, ...]:
    """Give the bands whose edges lie between two frequencies; `EstimateError` unless 0 < low_hz < high_hz.

    Examples
    --------
    >>> [band.nominal_hz for band in third_octave_bands(20, 90)]
    [25.0, 31.5, 40.0, 50.0, 63.0, 80.0]
    """
    if not 0 < low_hz < high_hz < np.inf:
        raise EstimateError(f"third-octave bands need 0 < low < high, got {low_hz} and {high_hz} Hz")
    first = ceil(10 * log10(low_hz / REFERENCE_HZ) + 0.5 - 1e-9)
    last = floor(10 * log10(high_hz / REFERENCE_HZ) - 0.5 + 1e-9)
    return tuple(third_octave_band(number) for number in range(first, last + 1))


def attenuation_limits(ratio: Real, *, performance_class: int) -> Real:
    """Give the mask of a third-octave filter of class 1 or 2.

    Parameters
    ----------
    ratio
        ``[frequency]``, frequency over mid-band frequency, positive.
    performance_class
        1 or 2.

    Returns
    -------
    ndarray
        ``[2, frequency]``, least and greatest relative attenuation in dB (infinite outside the band).

    Notes
    -----
    IEC 61260-1:2014, table 1. A breakpoint W of an octave filter becomes 1 + (W - 1) (G^(1/6) - 1)/(G^(1/2) - 1) for
    a third octave, below the mid-band frequency its reciprocal; attenuations are linear in log frequency between.
    """
    within, at_most, beyond = _MASKS[performance_class]
    above = np.log(np.maximum(ratio, 1 / ratio))
    pass_at, stop_at = (np.log(_breakpoints(powers)) for powers in (_POWERS, _STOP_POWERS))
    # The edge itself belongs to the outside, where the greatest attenuation has no limit.
    inside = above < pass_at[-1]
    least = np.where(inside, np.interp(above, pass_at, within), np.interp(above, stop_at, beyond))
    most = np.where(inside, np.interp(above, pass_at, at_most), np.inf)
    return np.stack([least, most])


def third_octave_levels(
    density: PowerSpectralDensity, *, low_hz: float | None = None, high_hz: float | None = None
) -> BandLevels:
    """Sum power spectral densities to third-octave bands.

    Parameters
    ----------
    density
        Of one or more channels.
    low_hz, high_hz
        Range whose whole bands are wanted; default what the spectrum covers, bands at least one line wide.

    Returns
    -------
    BandLevels
        The note says what such bands are: synthesised from lines, so no class of IEC 61260-1 is claimed for them;
        and from which band on a steady tone is attenuated as the mask of class 1 asks.

    Raises
    ------
    EstimateError
        When no band fits.
    """
    frequency_hz = density.frequency_hz
    spacing_hz = float(np.median(np.diff(frequency_hz)))
    # A third octave is 0.23 of its mid-band frequency wide; narrower than a line it would only repeat that line.
    narrowest_hz = spacing_hz / (1 - OCTAVE ** (-1 / 3))
    low_hz = max(float(frequency_hz[0]), narrowest_hz * OCTAVE ** (-1 / 3)) if low_hz is None else low_hz
    bands = third_octave_bands(low_hz, float(frequency_hz[-1]) if high_hz is None else high_hz)
    if not bands:
        raise EstimateError(f"no third-octave band lies between {low_hz:g} and {frequency_hz[-1]:g} Hz")
    levels = band_rms(density, bands_hz=[(band.low_hz, band.high_hz) for band in bands])
    window = named_window(density.provenance.window)
    # Only a window's main lobe and side lobes matter here, so the answer is the same for every record.
    fitting = [b for b in bands if synthesised_class(b, spacing_hz=spacing_hz, window=window) == 1]
    met = f"from the {fitting[0].nominal_hz:g} Hz band on" if fitting else "in none of these bands"
    note = (
        "third octaves summed from spectral lines: no filter, so no class of IEC 61260-1 applies; steady tones are "
        f"weighted as the class 1 mask asks {met}"
    )
    return replace(levels, provenance=levels.provenance.with_estimator("third octaves").with_notes(note))


def synthesised_class(band: ThirdOctaveBand, *, spacing_hz: float, window: Real) -> int | None:
    """Tell which class's mask the attenuation of steady tones meets when a band is summed from lines: 1, 2 or None.

    Parameters
    ----------
    band
        The band.
    spacing_hz
        Spacing of the lines.
    window
        ``[sample]``, the window of the spectra.
    """
    # Breakpoints of the mask just inside and outside the edge, and tones between lines.
    powers = np.array([0.0, 1 / 8, 1 / 4, 3 / 8, 0.499, 0.501, 1.0, 2.0, 3.0, 4.0])
    ratio = np.concatenate([_breakpoints(powers), 1 / _breakpoints(powers)[1:]])
    lines = np.arange(max(0, floor(band.low_hz / spacing_hz)), ceil(band.high_hz / spacing_hz) + 1)
    inside = np.minimum(band.high_hz / spacing_hz, lines + 0.5) - np.maximum(band.low_hz / spacing_hz, lines - 0.5)
    share = np.clip(inside, 0.0, 1.0)
    tones = band.mid_hz / spacing_hz * ratio
    shown = leakage(window, np.subtract.outer(lines, tones))
    bandwidth = window.size * np.sum(window**2) / np.sum(window) ** 2
    attenuation_db = -10 * np.log10(share @ shown / bandwidth + 1e-30)
    for performance_class in (1, 2):
        least, most = attenuation_limits(ratio, performance_class=performance_class)
        if np.all((attenuation_db >= least) & (attenuation_db <= most)):
            return performance_class
    return None


def third_octave_filter(series: TimeSeries, band: ThirdOctaveBand) -> TimeSeries:
    """Filter a series with the Butterworth band-pass of a third octave.

    Parameters
    ----------
    series
        Without invalid samples: a filter can't leave them out.
    band
        Its upper edge at most 0.45 of the sample rate.

    Returns
    -------
    TimeSeries
        Same channels and time. The filter (8 poles, edges at -3 dB) meets the class 1 mask of relative attenuation
        of IEC 61260-1:2014; a class in the standard's full sense also needs tests of a whole instrument. Its answer
        settles within about five over the band's width.

    Raises
    ------
    EstimateError
        When samples are missing, or the band is too near to half the sample rate.
    """
    from scipy.signal import sosfilt

    if not series.all_valid():
        raise EstimateError("a filter can't leave out missing samples; take a part of the series without gaps")
    return replace(series, values=sosfilt(filter_sections(band, series.sample_rate_hz), series.values, axis=1))


def filter_sections(band: ThirdOctaveBand, sample_rate_hz: float) -> Real:
    """Give the second-order sections of a band's filter, ``[section, 6]``."""
    from scipy.signal import butter

    if band.high_hz > 0.45 * sample_rate_hz:
        raise EstimateError(
            f"the {band.nominal_hz:g} Hz band ends at {band.high_hz:g} Hz, above 0.45 of the sample rate "
            f"{sample_rate_hz:g} Hz; resample to a higher rate"
        )
    edges_hz = (band.low_hz, band.high_hz)
    return np.asarray(butter(FILTER_ORDER, edges_hz, "bandpass", fs=sample_rate_hz, output="sos"), dtype=np.float64)


def _breakpoints(powers: Real) -> Real:
    """Frequency ratios of a third octave that stand for these powers of the octave ratio."""
    scale = (OCTAVE ** (1 / 6) - 1) / (OCTAVE ** (1 / 2) - 1)
    return np.asarray(1 + scale * (OCTAVE**powers - 1), dtype=np.float64)
