"""Peaks of the first singular value that stand for modes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.modal.operational.spectral_decomposition import SpectralDecomposition, relative_std
from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError
from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.wording import counted
from chladni.spectral.peaks import find_peaks

# More than a person looks at, and than modes lie in a band that a method without an order can resolve.
MOST_PEAKS = 200
# Lines beside a peak whose first vectors must agree with its own.
NEIGHBOURS = 2
# A frequency given by hand means the highest line this near.
NEAR_LINES = 3
# A second singular value that rises so far under a peak is no scatter of a few lines.
SECOND_RISE = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponsePeak:
    """A peak of the first singular value: its line, and its frequency between the lines with one sigma."""

    line: int
    frequency_hz: float
    frequency_std_hz: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PickedPeaks:
    """Peaks by rising frequency, and sentences on those that were left out."""

    peaks: tuple[ResponsePeak, ...]
    notes: tuple[str, ...]


def pick_peaks(
    decomposition: SpectralDecomposition,
    *,
    band_hz: tuple[float, float] | None,
    count: int | None,
    frequencies_hz: Sequence[float] | Real | None,
    false_alarm: float,
    min_mac: float,
) -> PickedPeaks:
    """Choose the peaks of the first singular value that one mode each makes.

    A peak must stand over the local floor and over the valleys beside it by more than the scatter of the lines
    explains (`chladni.spectral.peaks.find_peaks`), and the first singular vectors of the lines beside it must agree
    with its own: over a mode all lines have one shape, over noise each has another.

    Parameters
    ----------
    decomposition
        Singular values and vectors.
    band_hz, count, frequencies_hz
        See `FrequencyDomainDecomposition.identify`.
    false_alarm
        Chance that a peakless spectrum gives any peak.
    min_mac
        Mean MAC with the lines beside the peak, at least.
    """
    _require_request(decomposition, band_hz, count, frequencies_hz)
    # A person sees what statistics don't: what is asked for is taken as it is.
    if frequencies_hz is not None:
        return PickedPeaks(peaks=_by_hand(decomposition, frequencies_hz), notes=())
    peaks: list[ResponsePeak] = []
    notes: list[str] = []
    wanted = MOST_PEAKS if count is None else count
    for peak in _significant(decomposition, band_hz, false_alarm):
        line = int(np.argmin(np.abs(decomposition.frequency_hz - peak.frequency_hz)))
        agreement = modal_coherence(decomposition, line)
        if agreement < min_mac:
            notes.append(
                f"the peak at {peak.frequency_hz:.4g} Hz is left out: the shapes of the lines beside it agree with "
                f"its own by a MAC of {agreement:.2f} only; close modes make such a "
                "peak, or a machine (see machine_harmonics)"
            )
        elif len(peaks) < wanted:
            peaks.append(
                ResponsePeak(line=line, frequency_hz=peak.frequency_hz, frequency_std_hz=peak.frequency_std_hz)
            )
    if count is not None and len(peaks) < count:
        notes.append(
            f"{counted(count, 'mode')} asked for, {len(peaks)} found: no other peak of the first singular value "
            "stands out of its scatter"
        )
    return PickedPeaks(peaks=tuple(sorted(peaks, key=lambda peak: peak.frequency_hz)), notes=tuple(notes))


def modal_coherence(decomposition: SpectralDecomposition, line: int) -> float:
    """Mean MAC of the first vector of a line with those of the lines beside it; 1 for a single channel."""
    first = decomposition.vectors[:, :, 0]
    # Through the window the nearest lines share part of the segment's noise; the next ones hardly any.
    beside = [row for step in range(1, NEIGHBOURS + 1) for row in (line - step, line + step)]
    inside = [row for row in beside if 0 <= row < len(first)]
    return float(np.mean(np.abs(first[inside].conj() @ first[line]) ** 2))


def close_mode_notes(
    decomposition: SpectralDecomposition, peaks: Sequence[ResponsePeak], half_widths_hz: Sequence[float]
) -> tuple[str, ...]:
    """Say under which peaks the second singular value rises too: more than one mode, or a machine, is in them."""
    notes = []
    for peak, half_width_hz in zip(peaks, half_widths_hz, strict=True):
        if _second_rise(decomposition, peak.line, half_width_hz / decomposition.spacing_hz) > SECOND_RISE:
            notes.append(
                f"the second singular value rises with the first at {peak.frequency_hz:.4g} Hz: two close modes or a "
                "machine may be in this peak, and its damping and shape theirs together; a finer resolution or "
                "CovarianceDrivenSubspace may part them"
            )
    return tuple(notes)


def _second_rise(decomposition: SpectralDecomposition, line: int, half_width: float) -> float:
    """Second singular value at a peak over that beside it; 1 where another mode's flank or noise makes it."""
    if decomposition.values.shape[1] < 2:
        return 1.0
    second = decomposition.values[:, 1]
    # The window spreads the peak over two lines in any case.
    core, near = int(half_width) + 1, int(4 * half_width) + 4
    inside = second[max(line - core, 0) : line + core + 1]
    beside = [second[max(line - 2 * near, 0) : max(line - near, 0)], second[line + near : line + 2 * near]]
    # The higher side: the flank of a strong neighbour falls across the peak without being its own.
    level = max((float(side.mean()) for side in beside if side.size), default=0.0)
    return float(inside.mean()) / max(level, np.finfo(float).eps * float(decomposition.values[line, 0]))


def _significant(
    decomposition: SpectralDecomposition, band_hz: tuple[float, float] | None, false_alarm: float
) -> list[Peak]:
    """Peaks in the band, the strongest first."""
    # The largest eigenvalue scatters a little less than a channel's density does: the test is on the safe side.
    first = decomposition.values[:, 0][np.newaxis]
    density = PowerSpectralDensity(
        frequency_hz=decomposition.frequency_hz,
        values=first,
        std=first * relative_std(decomposition),
        channels=(Channel(name="first singular value"),),
        bandwidth_hz=decomposition.bandwidth_hz,
        provenance=decomposition.provenance,
    )
    low_hz, high_hz = (0.0, np.inf) if band_hz is None else band_hz
    found = find_peaks(density, count=MOST_PEAKS, false_alarm=false_alarm)
    return [peak for peak in found if low_hz <= peak.frequency_hz <= high_hz]


def _by_hand(
    decomposition: SpectralDecomposition, frequencies_hz: Sequence[float] | Real
) -> tuple[ResponsePeak, ...]:
    """Highest lines nearest to the frequencies given, each once."""
    lines = set[int]()
    for frequency_hz in frequencies_hz:
        nearest = int(np.argmin(np.abs(decomposition.frequency_hz - frequency_hz)))
        # The first and the last line have no flanks.
        near = np.arange(max(nearest - NEAR_LINES, 1), min(nearest + NEAR_LINES + 1, len(decomposition.values) - 1))
        lines.add(int(near[np.argmax(decomposition.values[near, 0])]))
    # A person's choice of a line is known to the line: uniform over its width.
    std_hz = float(decomposition.spacing_hz / np.sqrt(12))
    return tuple(
        ResponsePeak(line=line, frequency_hz=float(decomposition.frequency_hz[line]), frequency_std_hz=std_hz)
        for line in sorted(lines)
    )


def _require_request(
    decomposition: SpectralDecomposition,
    band_hz: tuple[float, float] | None,
    count: int | None,
    frequencies_hz: Sequence[float] | Real | None,
) -> None:
    first_hz, last_hz = decomposition.frequency_hz[[0, -1]]
    if count is not None and count < 1:
        raise EstimateError(f"count is {count}; ask for at least one mode")
    if band_hz is not None and not (band_hz[0] < band_hz[1] and band_hz[0] < last_hz and band_hz[1] > first_hz):
        raise EstimateError(
            f"band_hz is {band_hz}; give its low and its high end within the spectra's {first_hz:g} to {last_hz:g} Hz"
        )
    wanted = np.asarray(() if frequencies_hz is None else frequencies_hz, dtype=np.float64)
    outside = wanted[~((wanted > first_hz) & (wanted < last_hz))]
    if outside.size:
        raise EstimateError(
            f"{outside[0]:g} Hz lies outside the spectra's {first_hz:g} to {last_hz:g} Hz; give frequencies within"
        )
