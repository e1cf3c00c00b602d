"""Parts of spectra: RMS levels in frequency bands, and what lies below a frequency."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.levels import BandLevels
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.waterfall import Waterfall
from chladni.spectral.leakage import line_correlation, named_window

EstimateT = TypeVar("EstimateT", PowerSpectralDensity, FrequencyResponse, Waterfall)


def band_rms(density: PowerSpectralDensity, *, bands_hz: Sequence[tuple[float, float]]) -> BandLevels:
    """Integrate power spectral densities over bands.

    Parameters
    ----------
    density
        Of one or more channels.
    bands_hz
        Low and high edge of each band; bands may overlap or leave gaps.

    Returns
    -------
    BandLevels
        NaN, with infinite std and a note, for a band that the spectrum doesn't cover.

    Raises
    ------
    EstimateError
        When an edge is negative or a band is empty, or the spectrum has less than two lines.

    Notes
    -----
    A line stands for the power between the middles to its neighbours; the first and last one reach to 0 Hz and to
    the end of the spectrum. A band that cuts a line gets the share of it that lies inside, so adjoining bands add up
    to the whole: over all lines the RMS is the root of sum(G) df, which is Parseval's.

    The variance of a band's power is sum of std^2 over its lines times the sum of squared correlations between
    neighbouring lines, sum(w^4) N / sum(w^2)^2: for white noise about 1/(B T) of the power squared (Bendat & Piersol
    2010, eq. 8.51). The RMS has half the relative error of the power.

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> from chladni.signals.provenance import Provenance
    >>> flat = PowerSpectralDensity(
    ...     frequency_hz=np.arange(101.0), values=np.full((1, 101), 0.04), std=np.full((1, 101), 0.004),
    ...     channels=(Channel(name="a", unit="m/s^2"),), bandwidth_hz=1.0, provenance=Provenance(),
    ... )
    >>> band_rms(flat, bands_hz=[(10, 35), (10.25, 11.25)]).rms.round(6)
    array([[1. , 0.2]])
    """
    edges = np.asarray(bands_hz, dtype=np.float64).reshape(-1, 2)
    if not np.all(np.isfinite(edges)) or np.any(edges < 0) or np.any(edges[:, 1] <= edges[:, 0]):
        raise EstimateError(f"bands {list(bands_hz)} must be pairs of rising frequencies, 0 or above")
    # Shares of cells, not of lines: otherwise a band would gain or lose a whole line as its edge passes the middle.
    cells = _cell_edges(density.frequency_hz)
    share = _shares(cells, edges)
    spacing_hz = _spacings(density.frequency_hz)
    power = (density.values * spacing_hz) @ share.T
    variance = (
        (density.std * spacing_hz) ** 2 @ (share.T**2) * line_correlation(named_window(density.provenance.window))
    )
    uncovered = (edges[:, 0] < cells[0] - 1e-9) | (edges[:, 1] > cells[-1] + _tail(density.frequency_hz))
    rms = np.where(uncovered, np.nan, np.sqrt(power))
    # d(sqrt P) = dP / (2 sqrt P); an empty band has no error either.
    half = 2 * np.sqrt(np.maximum(power, np.finfo(float).tiny))
    return BandLevels(
        low_hz=edges[:, 0],
        high_hz=edges[:, 1],
        rms=rms,
        std=np.where(uncovered, np.inf, np.sqrt(variance) / half),
        channels=density.channels,
        provenance=density.provenance.with_estimator("band RMS").with_notes(
            *_uncovered_note(edges[uncovered], cells)
        ),
    )


def total_rms(density: PowerSpectralDensity) -> BandLevels:
    """Give the RMS over the whole spectrum as one band."""
    cells = _cell_edges(density.frequency_hz)
    return band_rms(density, bands_hz=[(float(cells[0]), float(cells[-1]))])


def _spacings(frequency_hz: Real) -> Real:
    """Width in Hz by which each line's density counts: the spacing of the lines, at both ends too."""
    if frequency_hz.size < 2:
        raise EstimateError("one line is no spectrum; a band needs two lines or more")
    steps = np.diff(frequency_hz)
    return np.asarray((np.append(steps, steps[-1]) + np.append(steps[0], steps)) / 2, dtype=np.float64)


def _cell_edges(frequency_hz: Real) -> Real:
    """Edges of the cells over which the power of each line is spread."""
    spacing_hz = _spacings(frequency_hz)
    middles = (frequency_hz[1:] + frequency_hz[:-1]) / 2
    # The line at 0 Hz holds no mirror image, so that its power lies in half a spacing.
    low = 0.0 if frequency_hz[0] < spacing_hz[0] / 2 else frequency_hz[0] - spacing_hz[0] / 2
    # The last line may be the Nyquist frequency, beyond which there is nothing: its power lies below it.
    return np.concatenate([[low], middles, [frequency_hz[-1]]])


def _tail(frequency_hz: Real) -> float:
    """How far above its last line a spectrum of odd length still reaches."""
    return float(0.5 * (frequency_hz[-1] - frequency_hz[-2]) * (1 + 1e-9))


def _shares(cells: Real, edges: Real) -> Real:
    """``[band, line]``: share of each line's cell that lies in each band."""
    inside = np.minimum(edges[:, 1:], cells[1:]) - np.maximum(edges[:, :1], cells[:-1])
    return np.asarray(np.clip(inside, 0.0, None) / np.diff(cells), dtype=np.float64)


def _uncovered_note(bands: Real, cells: Real) -> tuple[str, ...]:
    if not bands.size:
        return ()
    named = ", ".join(f"{low:g}-{high:g} Hz" for low, high in bands[:3])
    more = f" and {len(bands) - 3} more" if len(bands) > 3 else ""
    return (f"no level for {named}{more}: the spectrum covers {cells[0]:g} to {cells[-1]:g} Hz",)


def within(
    estimate: EstimateT, *, band_hz: tuple[float, float] | None = None, highest_hz: float | None = None
) -> EstimateT:
    """Give the lines of an estimate in a band, and a note that the others are left out.

    Parameters
    ----------
    estimate
        Over frequency.
    band_hz
        Lowest and highest line that stays; None for all.
    highest_hz
        Highest line that stays, too; None for all.

    Raises
    ------
    EstimateError
        When that leaves fewer than two lines.
    """
    line_hz = estimate.frequency_hz
    low_hz, high_hz = band_hz or (0.0, np.inf)
    kept = (line_hz >= low_hz) & (line_hz <= high_hz) & (line_hz <= (np.inf if highest_hz is None else highest_hz))
    if np.count_nonzero(kept) < 2:
        asked = f"--fmax {highest_hz:g} Hz" if band_hz is None else f"--band {low_hz:g}-{high_hz:g} Hz"
        raise EstimateError(
            f"{asked} leaves fewer than two lines: they go from {line_hz[0]:.6g} to {line_hz[-1]:.6g} Hz, "
            f"{np.diff(line_hz).min(initial=np.inf):.6g} Hz apart; ask for more"
        )
    if kept.all():
        return estimate
    cut: dict[str, Any] = {
        name: np.compress(kept, getattr(estimate, name), axis=axes.index("frequency_hz"))
        for name, axes in estimate.AXES.items()
    }
    if band_hz is None:
        where = f"above {highest_hz:g} Hz"
    else:
        where = f"outside {line_hz[kept][0]:.6g} to {line_hz[kept][-1]:.6g} Hz"
    note = f"lines {where} are left out, of levels and peaks as well"
    account = estimate.provenance.with_notes(note)
    return replace(estimate, frequency_hz=line_hz[kept], provenance=account, **cut)
