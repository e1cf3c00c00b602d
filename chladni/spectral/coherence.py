"""Ordinary, multiple and partial coherence."""

import numpy as np

from chladni.io.source import Blocks, SeriesLike
from chladni.signals.arrays import Real
from chladni.signals.channel import Names, as_names
from chladni.signals.coherence import Coherence
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.renamed import renamed
from chladni.spectral.channel_choice import choose_channels
from chladni.spectral.cross_spectra import spectra_of
from chladni.spectral.line_algebra import conditioned_density, solve_lines
from chladni.spectral.psd import auto_densities
from chladni.spectral.windows import Window

# What is left of a channel after its own double was taken out is rounding: not more than this share of its power.
ROUNDING = 1e-12


def coherence(
    source: CrossSpectra | SeriesLike | Blocks,
    *,
    references: Names,
    responses: Names | None = None,
    resolution_hz: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Coherence:
    """Give the share of each response's power that is linearly due to the references.

    Parameters
    ----------
    source
        Averaged cross-spectra; or a log, the path to one, a series or an array ``[channel, sample]``, whose
        cross-spectra are averaged after Welch first.
    references
        Names of the excitations: one gives the ordinary coherence |G_xy|^2/(G_xx G_yy) (Bendat & Piersol 2010,
        chapter 6), several the multiple coherence G_xy^H G_xx^-1 G_xy / G_yy (chapter 7).
    responses
        Names of the responses; None takes all other channels.
    resolution_hz, window, overlap, sample_rate_hz, start_s, end_s
        Of samples: how they are averaged, see `cross_spectra`.

    Returns
    -------
    Coherence
        ``[response, frequency]``, 0 to 1; 0 where the response has no power or the references can't be told apart.

    Raises
    ------
    EstimateError
        When a channel is missing or named twice, or the spectra are peak-held.

    Examples
    --------
    >>> x, noise = np.random.default_rng(1).standard_normal((2, 2**14))
    >>> found = coherence({"x": x, "y": x + noise}, references="x", sample_rate_hz=1000.0)  # as much noise as signal
    >>> float(found.values.mean().round(1))
    0.5
    """
    spectra = spectra_of(
        source,
        channels=None if responses is None else (*as_names(references), *as_names(responses)),
        resolution_hz=resolution_hz,
        window=window,
        overlap=overlap,
        sample_rate_hz=sample_rate_hz,
        start_s=start_s,
        end_s=end_s,
    )
    chosen = choose_channels(spectra, references, responses)
    density = np.asarray(spectra.density, dtype=np.complex128)
    # One formula for both kinds: with one reference the explained power is |G_xy|^2/G_xx.
    solution = solve_lines(density, chosen.references, chosen.responses)
    values = share(solution.explained, auto_densities(density)[chosen.responses])
    kind = "ordinary coherence" if len(chosen.references) == 1 else "multiple coherence"
    return Coherence(
        frequency_hz=spectra.frequency_hz,
        values=values,
        std=coherence_std(values, spectra.provenance.effective_averages),
        kind="ordinary" if len(chosen.references) == 1 else "multiple",
        responses=tuple(spectra.channels[row] for row in chosen.responses),
        references=tuple(spectra.channels[row] for row in chosen.references),
        provenance=spectra.provenance.with_estimator(kind),
    )


@renamed(reference="references")
def partial_coherence(
    source: CrossSpectra | SeriesLike | Blocks,
    *,
    references: str,
    conditioned_on: Names,
    responses: Names | None = None,
    resolution_hz: float | None = None,
    window: Window = "hann",
    overlap: float = 0.5,
    sample_rate_hz: float | None = None,
    start_s: float | None = None,
    end_s: float | None = None,
) -> Coherence:
    """Give the coherence of one reference with each response after others have been taken out of both.

    What is linearly due to the channels `conditioned_on` is removed, G_ij.r = G_ij - G_ir G_rr^-1 G_rj, then the
    ordinary coherence of what is left is taken (Bendat & Piersol 2010, section 7.3).

    Parameters
    ----------
    source
        As for `coherence`.
    references
        Name of the excitation that is judged.
    conditioned_on
        Names of the channels whose contribution is removed first.
    responses
        Names of the responses; None takes all other channels.
    resolution_hz, window, overlap, sample_rate_hz, start_s, end_s
        Of samples: how they are averaged, see `cross_spectra`.

    Returns
    -------
    Coherence
        ``[response, frequency]``, 0 to 1; 0 where nothing is left of the reference or the response. Each channel
        taken out costs one average, which its one sigma accounts for.

    Raises
    ------
    EstimateError
        When a channel is missing or named twice, or the spectra are peak-held.
    """
    names = (references, *as_names(conditioned_on))
    spectra = spectra_of(
        source,
        channels=None if responses is None else (*names, *as_names(responses)),
        resolution_hz=resolution_hz,
        window=window,
        overlap=overlap,
        sample_rate_hz=sample_rate_hz,
        start_s=start_s,
        end_s=end_s,
    )
    chosen = choose_channels(spectra, names, responses)
    kept, removed = [chosen.references[0], *chosen.responses], chosen.references[1:]
    density = np.asarray(spectra.density, dtype=np.complex128)
    rest = conditioned_density(density, removed, kept)
    power = auto_densities(rest)
    # A channel that the others explain wholly leaves noise of rounding, coherent with nothing or anything.
    left = power > ROUNDING * auto_densities(density)[kept]
    values = np.where(left[0] & left[1:], share(np.abs(rest[0, 1:]) ** 2, power[0] * power[1:]), 0.0)
    return Coherence(
        frequency_hz=spectra.frequency_hz,
        values=values,
        # Each channel taken out is a parameter fitted to the same averages.
        std=coherence_std(values, spectra.provenance.effective_averages - len(removed)),
        kind="partial",
        responses=tuple(spectra.channels[row] for row in chosen.responses),
        references=(spectra.channels[kept[0]],),
        conditioned_on=tuple(spectra.channels[row] for row in removed),
        provenance=spectra.provenance.with_estimator("partial coherence"),
    )


def share(part: Real, whole: Real) -> Real:
    """Give part/whole within 0 to 1; 0 where the whole is 0. Rounding may lift a part above its whole."""
    ratio = np.divide(part, whole, out=np.zeros_like(part), where=whole > 0)
    return np.asarray(np.clip(ratio, 0.0, 1.0), dtype=np.float64)


def coherence_std(coherence: Real, averages: float) -> Real:
    """One sigma of a coherence, sqrt(2) (1 - c) sqrt(c) / sqrt(n) (Bendat & Piersol 2010, table 9.6).

    Infinite when one average or less went in: such a coherence is 1 whatever the data.
    """
    if averages <= 1:
        return np.full(coherence.shape, np.inf)
    return np.asarray((1 - coherence) * np.sqrt(2 * coherence / averages), dtype=np.float64)
