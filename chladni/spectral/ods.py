"""Operating deflection shapes from averaged cross-spectra."""

from collections.abc import Sequence

import numpy as np

from chladni.io.source import SeriesLike
from chladni.signals.arrays import Complex, Index, Real
from chladni.signals.channel import Names, as_names
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.deflection_shapes import DeflectionShapes
from chladni.signals.errors import EstimateError
from chladni.spectral.cross_spectra import cross_spectra
from chladni.spectral.leakage import named_window
from chladni.spectral.peaks import find_peaks
from chladni.spectral.psd import power_spectral_density


def deflection_shapes(
    source: CrossSpectra | SeriesLike,
    *,
    references: str,
    frequencies_hz: Sequence[float] | None = None,
    resolution_hz: float | None = None,
    channels: Names | None = None,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> DeflectionShapes:
    """Tell how all points move together at chosen frequencies while the machine runs.

    Parameters
    ----------
    source
        Averaged cross-spectra of all points measured at once; or a log, the path to one, a series or an array
        ``[channel, sample]``, whose cross-spectra are averaged after Welch first.
    references
        Name of the channel whose phase is 0; one that moves at every frequency asked for.
    frequencies_hz
        Where; the nearest line is taken, and what its window takes from a tone between two lines is made up for,
        with half of that in the error bar. None takes the named peaks of all channels.
    resolution_hz, channels, sample_rate_hz, start_s, end_s
        Of samples: how they are averaged, see `cross_spectra`.

    Returns
    -------
    DeflectionShapes
        At each channel the part of its motion that is coherent with the reference.

    Raises
    ------
    EstimateError
        When there is no such channel, a frequency lies outside the spectrum, or no peak stands out.

    Notes
    -----
    Z_i = G_ref,i sqrt(B / G_ref,ref) with the noise bandwidth B of a line (Schwarz & Richardson 1999, Proc. IMAC
    XVII, 1255): abs(Z_i) = sqrt(coherence G_ii B). One sigma of it is abs(Z_i) sqrt((2/coherence - 1)/(4 n)) with n
    effective averages, by the covariances of averaged spectra (Bendat & Piersol 2010, section 9.1.2); of whole
    periods it is sqrt(N_ii B / (2 n)) with the noise N_ii between them.

    Examples
    --------
    >>> turn = 2 * np.pi * 20 * np.arange(8000) / 1000
    >>> x = {"base": np.cos(turn), "tip": 3 * np.cos(turn - np.pi / 2)}
    >>> shape = deflection_shapes(x, references="base", frequencies_hz=[20], resolution_hz=1, sample_rate_hz=1000)
    >>> [round(float(part), 3) for part in (abs(shape.values[0, 1]) * 2**0.5, np.angle(shape.values[0, 1], deg=True))]
    [3.0, -90.0]
    """
    if isinstance(source, CrossSpectra):
        spectra = source
    else:
        spectra = cross_spectra(
            source,
            channels=None if channels is None else dict.fromkeys((references, *as_names(channels))),
            resolution_hz=resolution_hz,
            sample_rate_hz=sample_rate_hz,
            start_s=start_s,
            end_s=end_s,
        )
    row = spectra.index(references)
    lines, wanted_hz = _lines(spectra, frequencies_hz)
    own = spectra.density[row, row, lines].real
    if np.any(own <= 0):
        still = float(spectra.frequency_hz[lines[int(np.argmin(own))]])
        raise EstimateError(f"{spectra.channels[row].name} doesn't move at {still:g} Hz; take another reference")
    cross = spectra.density[row][:, lines].T
    auto = np.einsum("iif->fi", spectra.density[:, :, lines]).real
    coherence = np.divide(np.abs(cross) ** 2, own[:, None] * auto, out=np.zeros(auto.shape), where=auto > 0)
    coherence = np.minimum(coherence, 1.0)
    values = cross * np.sqrt(spectra.bandwidth_hz / own)[:, None]
    gain = _tone_gain(spectra, row, lines, wanted_hz)[:, None]
    values = values * gain
    # Half of what was corrected is the frequency's to be wrong.
    std = np.hypot(_std(spectra, lines, values, coherence), np.abs(values) * (1 - 1 / gain) / 2)
    return DeflectionShapes(
        frequency_hz=spectra.frequency_hz[lines],
        values=values,
        std=std,
        coherence=coherence,
        channels=spectra.channels,
        reference=spectra.channels[row].name,
        bandwidth_hz=spectra.bandwidth_hz,
        provenance=spectra.provenance.with_estimator("ODS"),
    )


def _std(spectra: CrossSpectra, lines: Index, values: Complex, coherence: Real) -> Real:
    averages = max(spectra.provenance.effective_averages, 1.0)
    if spectra.noise_density is not None:
        # Of whole periods the scatter between them is known, half of it along the amplitude.
        noise = np.einsum("iif->fi", spectra.noise_density[:, :, lines]).real
        return np.asarray(np.sqrt(np.maximum(noise, 0.0) * spectra.bandwidth_hz / (2 * averages)))
    spread = np.sqrt((2 / np.maximum(coherence, np.finfo(float).eps) - 1) / (4 * averages))
    return np.asarray(np.abs(values) * spread)


def _lines(spectra: CrossSpectra, frequencies_hz: Sequence[float] | None) -> tuple[Index, Real]:
    """Give the lines nearest to what is asked for, and for each the frequency that was meant."""
    axis = spectra.frequency_hz
    if frequencies_hz is None:
        wanted = np.array(sorted(peak.frequency_hz for peak in find_peaks(power_spectral_density(spectra))))
        if not wanted.size:
            raise EstimateError("no peak stands out of the scatter; name the frequencies")
    else:
        wanted = np.atleast_1d(np.asarray(frequencies_hz, dtype=np.float64))
    outside = wanted[~((wanted >= axis[0]) & (wanted <= axis[-1]))]
    if outside.size or not wanted.size:
        told = f"{outside[0]:g} Hz lies outside" if outside.size else "no frequency is named; name some of"
        raise EstimateError(f"{told} the spectrum, {axis[0]:g} to {axis[-1]:g} Hz")
    lines, first = np.unique([int(np.argmin(np.abs(axis - one))) for one in wanted], return_index=True)
    if axis[lines[0]] == 0:
        # The mean is taken off: the line at 0 Hz holds no motion.
        raise EstimateError(
            f"{wanted.min():g} Hz lies nearer to 0 than to the first line, {axis[1]:.4g} Hz; ask for finer lines"
        )
    return lines, wanted[first]


def _tone_gain(spectra: CrossSpectra, row: int, lines: Index, wanted_hz: Real) -> Real:
    """Give what the window takes from a tone between two lines, as a factor 1 or above for each line.

    The auto-spectrum of the reference on a line and its neighbours is a tone at the frequency that was meant, as the
    window spreads it, on a floor. A floor alone, as a broad resonance is, loses nothing.
    """
    account, gain = spectra.provenance, np.ones(lines.size)
    # Whole periods have their tones on lines, and hits have none.
    if account.averaging in ("periodic", "impact") or not account.segment_s:
        return gain
    shape = named_window(account.window)
    own = spectra.density[row, row].real
    for place, (line, hz) in enumerate(zip(lines.tolist(), wanted_hz.tolist(), strict=True)):
        if 0 < line < own.size - 1:
            offset = (hz - float(spectra.frequency_hz[line])) * account.segment_s
            here, beside = _leaked(shape, offset), (_leaked(shape, offset - 1) + _leaked(shape, offset + 1)) / 2
            around = (own[line - 1] + own[line + 1]) / 2
            tone = min(max(0.0, (own[line] - around) / (here - beside)), own[line] / here)
            gain[place] = np.sqrt((tone + own[line] - tone * here) / own[line])
    return gain


def _leaked(shape: Real, bins: float) -> float:
    """Power that a tone so many lines away leaves on a line, over that of a tone on it."""
    turns = np.exp(-2j * np.pi * bins * np.arange(shape.size) / shape.size)
    return float(np.abs(shape @ turns / shape.sum()) ** 2)
