"""Octave bands after IEC 61260-1:2014, whole and fractional: from spectral densities, and by filters in time."""

from dataclasses import dataclass, replace
from math import ceil, floor, log10

import numpy as np

from chladni.io.source import SeriesLike, blocks_of, extent_of, log_or_series
from chladni.signals.arrays import Real
from chladni.signals.channel import Names
from chladni.signals.errors import EstimateError
from chladni.signals.levels import OctaveLevels
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import TimeSeries
from chladni.spectral.accumulator import AutoSpectraAccumulator
from chladni.spectral.bands import band_rms, total_rms
from chladni.spectral.blocks import Source
from chladni.spectral.cross_spectra import segment_average
from chladni.spectral.leakage import leakage, named_window
from chladni.spectral.psd import power_spectral_density
from chladni.spectral.weighting import Weighting, weighted

# Octaves are divided in so many bands at most (IEC 61260-1:2014, table 1 of bandwidth designators ends with 1/24).
FINEST_FRACTION = 24
# A band of 4.6 lines or more, with a Hann window, weighs steady tones as the mask of class 1 asks.
LINES_OF_A_BAND = 5.0
# Segments end to end that a spectrum is averaged over, where nobody says how low bands are to go.
SEGMENTS = 16

# IEC 61260-1:2014: octave frequency ratio and reference frequency.
OCTAVE = 10**0.3
REFERENCE_HZ = 1000.0
# Preferred numbers R10 (ISO 3), by which octaves and their thirds are called; the exact middles differ from them.
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
class OctaveBand:
    """One band: number, bands in an octave, exact mid-band frequency, edges, and the frequency it's called by."""

    number: int
    fraction: int
    mid_hz: float
    low_hz: float
    high_hz: float
    nominal_hz: float


def octave_band(number: int, *, fraction: int = 3) -> OctaveBand:
    """Give the band with this number.

    With G = 10^0.3 and b bands in an octave, f_m = 1000 Hz G^(x/b) for odd b and 1000 Hz G^((2 x + 1)/(2 b)) for even
    b, edges f_m G^(-1/(2 b)) and f_m G^(1/(2 b)) (IEC 61260-1:2014, base ten; nominal frequencies: annex E).

    Examples
    --------
    >>> band = octave_band(-13)
    >>> band.nominal_hz, round(band.mid_hz, 3), round(band.low_hz, 3), round(band.high_hz, 3)
    (50.0, 50.119, 44.668, 56.234)
    >>> octave_band(-1, fraction=1).nominal_hz, octave_band(0, fraction=12).nominal_hz
    (500.0, 1030.0)
    """
    _require_fraction(fraction)
    mid_hz = REFERENCE_HZ * OCTAVE ** (number / fraction if fraction % 2 else (2 * number + 1) / (2 * fraction))
    half = OCTAVE ** (1 / (2 * fraction))
    return OctaveBand(
        number=number,
        fraction=fraction,
        mid_hz=mid_hz,
        low_hz=mid_hz / half,
        high_hz=mid_hz * half,
        nominal_hz=_nominal_hz(number, fraction, mid_hz),
    )


def _nominal_hz(number: int, fraction: int, mid_hz: float) -> float:
    if fraction in (1, 3):
        third = number * 3 // fraction
        return round(NOMINAL[third % 10] * 10.0 ** (3 + third // 10), 9)
    # Annex E: three digits; two where the first is 5 or more, for bands narrower than half an octave.
    digits = 2 if fraction > 2 and mid_hz >= 5 * 10.0 ** floor(log10(mid_hz)) else 3
    return float(f"{mid_hz:.{digits - 1}e}")


def octave_bands(low_hz: float, high_hz: float, *, fraction: int = 3) -> tuple[OctaveBand, ...]:
    """Give the bands whose edges lie between two frequencies; `EstimateError` unless 0 < low_hz < high_hz.

    Examples
    --------
    >>> [band.nominal_hz for band in octave_bands(20, 90)]
    [25.0, 31.5, 40.0, 50.0, 63.0, 80.0]
    """
    _require_fraction(fraction)
    if not 0 < low_hz < high_hz < np.inf:
        raise EstimateError(f"octave bands need 0 < low < high, got {low_hz} and {high_hz} Hz")
    # Of odd fractions a middle lies at the reference, of even ones an edge.
    shift = 0.5 if fraction % 2 else 0.0
    low, high = (fraction * log10(edge_hz / REFERENCE_HZ) / log10(OCTAVE) for edge_hz in (low_hz, high_hz))
    numbers = range(ceil(low + shift - 1e-9), floor(high - 1 + shift + 1e-9) + 1)
    return tuple(octave_band(number, fraction=fraction) for number in numbers)


def _require_fraction(fraction: int) -> None:
    if not 1 <= fraction <= FINEST_FRACTION:
        raise EstimateError(
            f"octaves are divided in 1 to {FINEST_FRACTION} bands, got {fraction}; 3 gives third octaves"
        )


def attenuation_limits(ratio: Real, *, performance_class: int, fraction: int = 3) -> Real:
    """Give the mask of an octave filter of class 1 or 2.

    Parameters
    ----------
    ratio
        ``[frequency]``, frequency over mid-band frequency, positive.
    performance_class
        1 or 2.
    fraction
        Bands in an octave.

    Returns
    -------
    ndarray
        ``[2, frequency]``, least and greatest relative attenuation in dB (infinite outside the band).

    Notes
    -----
    IEC 61260-1:2014, table 1. A breakpoint W of an octave filter becomes 1 + (W - 1) (G^(1/(2 b)) - 1)/(G^(1/2) - 1)
    for b bands in an octave, below the mid-band frequency its reciprocal; between, attenuations are linear in log
    frequency.
    """
    within, at_most, beyond = _MASKS[performance_class]
    above = np.log(np.maximum(ratio, 1 / ratio))
    pass_at, stop_at = (np.log(_breakpoints(powers, fraction)) for powers in (_POWERS, _STOP_POWERS))
    # The edge itself belongs to the outside, where the greatest attenuation has no limit.
    inside = above < pass_at[-1]
    least = np.where(inside, np.interp(above, pass_at, within), np.interp(above, stop_at, beyond))
    most = np.where(inside, np.interp(above, pass_at, at_most), np.inf)
    return np.stack([least, most])


def octaves(
    source: SeriesLike | PowerSpectralDensity,
    *,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
    fraction: int = 3,
    weighting: Weighting | None = None,
    low_hz: float | None = None,
    high_hz: float | None = None,
) -> OctaveLevels:
    """Sum power spectral densities to octave bands.

    Parameters
    ----------
    source
        A log (read block by block when it's large), the path to one, a series or an array ``[channel, sample]``,
        averaged with lines fine enough for the lowest band; or densities, taken as they are.
    channels
        Message paths or names; None for all, which must share a sampling grid.
    sample_rate_hz
        Samples a second of an array, or of a file that doesn't say it.
    start_s, end_s
        Only samples with ``start_s <= t < end_s``, seconds from the start.
    fraction
        Bands in an octave: 1, 3, 12 or any number up to 24.
    weighting
        ``A`` or ``C`` of sound level meters, for each line; None for none.
    low_hz, high_hz
        Range whose whole bands are wanted. By default what the spectrum covers, bands at least one line wide; of a
        series from where bands of 5 lines leave 31 half-overlapping segments.

    Returns
    -------
    OctaveLevels
        The note says what such bands are: synthesised from lines, so no class of IEC 61260-1 is claimed for them;
        and from which band on a steady tone is attenuated as the mask of class 1 asks.

    Raises
    ------
    EstimateError
        When no band fits.

    Examples
    --------
    >>> tone = np.sqrt(2) * np.sin(2 * np.pi * 1000 * np.arange(48_000) / 12_000)  # 1 Pa, 94 dB
    >>> x = TimeSeries.from_arrays(tone, sample_rate_hz=12e3, units="Pa")
    >>> found = octaves(x, fraction=1, weighting="A")
    >>> dict(zip(found.nominal_hz.tolist(), found.decibels()[0].round(1).tolist()))[1000.0]
    94.0
    """
    if not isinstance(source, PowerSpectralDensity):
        found = log_or_series(source, sample_rate_hz=sample_rate_hz)
        rate_hz, length_s = extent_of(found, channels=channels, start_s=start_s, end_s=end_s)
        resolution_hz = octave_resolution_hz(rate_hz, length_s, fraction=fraction, low_hz=low_hz)
        low_hz = lowest_band_hz(resolution_hz, fraction=fraction) if low_hz is None else low_hz
        source = octave_density(
            blocks_of(found, channels=channels, start_s=start_s, end_s=end_s), resolution_hz=resolution_hz
        )
    density = source if weighting is None else weighted(source, weighting)
    frequency_hz = density.frequency_hz
    spacing_hz = float(np.median(np.diff(frequency_hz)))
    # A band narrower than a line would only repeat that line; this is the low edge of the narrowest one.
    narrowest_hz = spacing_hz / _relative_width(fraction)
    low_hz = max(float(frequency_hz[0]), narrowest_hz) if low_hz is None else low_hz
    high_hz = float(frequency_hz[-1]) if high_hz is None else high_hz
    bands = octave_bands(low_hz, high_hz, fraction=fraction)
    if not bands:
        raise EstimateError(
            f"no {name_of(fraction)} band lies between {low_hz:g} and {high_hz:g} Hz; widen the range"
        )
    levels = band_rms(density, bands_hz=[(band.low_hz, band.high_hz) for band in bands])
    note = _class_note(bands, spacing_hz, named_window(density.provenance.window))
    provenance = levels.provenance.with_estimator(f"{name_of(fraction)} bands").with_notes(note)
    return OctaveLevels(
        fraction=fraction,
        weighting=weighting,
        nominal_hz=np.array([band.nominal_hz for band in bands]),
        mid_hz=np.array([band.mid_hz for band in bands]),
        bands=replace(levels, provenance=provenance),
        total=total_rms(density).rms[:, 0],
    )


def octave_density(source: Source, *, resolution_hz: float) -> PowerSpectralDensity:
    """Average densities of a series or a stream of blocks for octave bands: after Welch, whatever the excitation is.

    Whole periods would show peaks higher; bands hold the power of a peak however wide it is drawn.
    """
    make = AutoSpectraAccumulator
    return power_spectral_density(
        segment_average(make, source, resolution_hz=resolution_hz, window="hann", overlap=0.5, detrend="constant")
    )


def octave_resolution_hz(
    sample_rate_hz: float, duration_s: float, *, fraction: int, low_hz: float | None = None
) -> float:
    """Give the distance of lines for octave bands from `low_hz` on, or for bands as low as the record allows.

    Raises
    ------
    EstimateError
        When the record is too short for any band.
    """
    _require_fraction(fraction)
    if low_hz is not None:
        if not 0 < low_hz < sample_rate_hz / 2:
            raise EstimateError(
                f"bands can't begin at {low_hz:g} Hz: take more than 0 and less than half the sample rate, "
                f"{sample_rate_hz / 2:g} Hz"
            )
        return min(low_hz * _relative_width(fraction) / LINES_OF_A_BAND, sample_rate_hz / 4)
    resolution_hz = SEGMENTS / duration_s
    begins_hz = lowest_band_hz(resolution_hz, fraction=fraction)
    if begins_hz * OCTAVE ** (1 / fraction) > sample_rate_hz / 2:
        raise EstimateError(
            f"a record of {duration_s:.3g} s shows {name_of(fraction)} bands from {begins_hz:.3g} Hz on, and its "
            f"samples end at {sample_rate_hz / 2:g} Hz; measure longer, or ask for coarser bands"
        )
    return resolution_hz


def lowest_band_hz(resolution_hz: float, *, fraction: int) -> float:
    """Give the frequency from which on bands hold enough lines."""
    return LINES_OF_A_BAND * resolution_hz / _relative_width(fraction)


def name_of(fraction: int) -> str:
    """Name bands by their width: ``octave``, ``1/3 octave``."""
    return "octave" if fraction == 1 else f"1/{fraction} octave"


def _relative_width(fraction: int) -> float:
    """Width of a band over its low edge."""
    return float(OCTAVE ** (1 / fraction) - 1)


def _class_note(bands: tuple[OctaveBand, ...], spacing_hz: float, window: Real) -> str:
    # Only a window's main lobe and side lobes matter here, so the answer is the same for every record.
    fitting = next((b for b in bands if synthesised_class(b, spacing_hz=spacing_hz, window=window) == 1), None)
    met = f"from the {fitting.nominal_hz:g} Hz band on" if fitting else "in none of these bands"
    return (
        f"{name_of(bands[0].fraction)} bands summed from spectral lines: no filter, so no class of IEC 61260-1 "
        f"applies. Steady tones are weighted as the class 1 mask asks {met}"
    )


def synthesised_class(band: OctaveBand, *, spacing_hz: float, window: Real) -> int | None:
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
    ratio = np.concatenate([_breakpoints(powers, band.fraction), 1 / _breakpoints(powers, band.fraction)[1:]])
    lines = np.arange(max(0, floor(band.low_hz / spacing_hz)), ceil(band.high_hz / spacing_hz) + 1)
    inside = np.minimum(band.high_hz / spacing_hz, lines + 0.5) - np.maximum(band.low_hz / spacing_hz, lines - 0.5)
    share = np.clip(inside, 0.0, 1.0)
    tones = band.mid_hz / spacing_hz * ratio
    shown = leakage(window, np.subtract.outer(lines, tones))
    bandwidth = window.size * np.sum(window**2) / np.sum(window) ** 2
    attenuation_db = -10 * np.log10(share @ shown / bandwidth + 1e-30)
    for performance_class in (1, 2):
        least, most = attenuation_limits(ratio, performance_class=performance_class, fraction=band.fraction)
        if np.all((attenuation_db >= least) & (attenuation_db <= most)):
            return performance_class
    return None


def octave_filter(series: TimeSeries, band: OctaveBand) -> TimeSeries:
    """Filter a series with the Butterworth band-pass of an octave band.

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


def filter_sections(band: OctaveBand, sample_rate_hz: float) -> Real:
    """Give the second-order sections of a band's filter, ``[section, 6]``."""
    from scipy.signal import butter

    if band.high_hz > 0.45 * sample_rate_hz:
        raise EstimateError(
            f"the {band.nominal_hz:g} Hz band ends at {band.high_hz:g} Hz, above 0.45 of the sample rate "
            f"{sample_rate_hz:g} Hz; resample to a higher rate"
        )
    edges_hz = (band.low_hz, band.high_hz)
    return np.asarray(butter(FILTER_ORDER, edges_hz, "bandpass", fs=sample_rate_hz, output="sos"), dtype=np.float64)


def _breakpoints(powers: Real, fraction: int) -> Real:
    """Frequency ratios of a fraction of an octave that stand for these powers of the octave ratio."""
    scale = (OCTAVE ** (1 / (2 * fraction)) - 1) / (OCTAVE ** (1 / 2) - 1)
    return np.asarray(1 + scale * (OCTAVE**powers - 1), dtype=np.float64)
