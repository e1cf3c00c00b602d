"""Resonances one at a time: the lines around each peak, as mobility."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from chladni.signals.arrays import Complex, Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.peak import Peak
from chladni.signals.provenance import Provenance
from chladni.signals.wording import counted
from chladni.spectral.forms import convert_form
from chladni.spectral.leakage import named_window
from chladni.spectral.peaks import find_response_peaks
from chladni.spectral.response_advice import half_power_lines

# Lines whose std is zero or unknown are weighted as if they had this share of the function's RMS; the misfit of what
# is fitted to them then says how sure it is.
SMALLEST_STD_SHARE = 1e-9
PEAKS_A_FUNCTION = 50
MOST_FUNCTIONS = 32
# A frequency given by hand is moved to the highest line this near.
REACH_SHARE = 0.01
REACH_LINES = 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MobilityLines:
    """Mobilities on the lines that can be fitted.

    Attributes
    ----------
    frequency_hz
        ``[line]``.
    values, std
        ``[response, reference, line]`` mobility and one sigma of its real and of its imaginary part.
    spacing_hz
        Between lines that have none left out between them.
    provenance
        Tells how the noise of neighbouring lines hangs together.
    std_known
        False when no line has a finite std above zero.
    """

    frequency_hz: Real
    values: Complex
    std: Real
    spacing_hz: float
    provenance: Provenance
    std_known: bool

    def correlation(self, span: slice) -> Complex:
        """``[line, line]`` of the noise, which a window smears over neighbouring lines."""
        return _line_correlation(self.frequency_hz[span], self.spacing_hz, self.provenance)

    def around(self, centre_hz: float, reach_hz: float, *, at_least: int) -> slice:
        """Lines within `reach_hz` of a frequency, and the nearest `at_least` in any case."""
        nearest = np.sort(np.argsort(np.abs(self.frequency_hz - centre_hz), kind="stable")[:at_least])
        inside = np.flatnonzero(np.abs(self.frequency_hz - centre_hz) <= reach_hz)
        both = np.concatenate([nearest, inside])
        return slice(int(both.min()), int(both.max()) + 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Resonance:
    """A peak to be looked at: its line, the function that shows it best, and where its realm ends."""

    line: int
    function: tuple[int, int]
    half_width_hz: float
    low_hz: float = 0.0
    high_hz: float = float("inf")

    def within(self, lines: MobilityLines, span: slice, *, at_least: int) -> slice:
        """The lines of a span that are nearer to this resonance than to its neighbours, if that leaves enough."""
        first = max(span.start, int(np.searchsorted(lines.frequency_hz, self.low_hz)))
        stop = min(span.stop, int(np.searchsorted(lines.frequency_hz, self.high_hz, side="right")))
        return slice(first, stop) if stop - first >= at_least else span


def mobility_lines(response: FrequencyResponse, band_hz: tuple[float, float] | None) -> MobilityLines:
    """Give the mobilities on excited lines within a band.

    Raises
    ------
    EstimateError
        When a response is no motion, the band is none, or fewer than five lines are left.
    """
    low_hz, high_hz = band_hz or (0.0, np.inf)
    if not 0 <= low_hz < high_hz:
        raise EstimateError(f"band_hz is ({low_hz:g}, {high_hz:g}); it must rise from 0 or more")
    mobility = convert_form(response, "mobility")
    frequency_hz = mobility.frequency_hz
    inside = (frequency_hz >= low_hz) & (frequency_hz <= high_hz) & (frequency_hz > 0)
    known = np.isfinite(mobility.std).all(axis=(0, 1))
    usable = inside & mobility.excited & np.isfinite(mobility.values).all(axis=(0, 1))
    std_known = bool(np.any(mobility.std[:, :, usable & known] > 0))
    if std_known:
        usable &= known
    if np.count_nonzero(usable) < 5:
        raise EstimateError(
            f"{counted(int(np.count_nonzero(usable)), 'excited line')} between {low_hz:g} and {high_hz:g} Hz; a peak "
            "needs five at least: widen the band or ask for a finer resolution"
        )
    values = np.asarray(mobility.values[:, :, usable], dtype=np.complex128)
    least = SMALLEST_STD_SHARE * np.sqrt(np.mean(np.abs(values) ** 2, axis=2, keepdims=True))
    std = np.maximum(mobility.std[:, :, usable], least) if std_known else least * np.ones(values.shape)
    return MobilityLines(
        frequency_hz=frequency_hz[usable],
        values=values,
        std=np.where(std > 0, std, 1.0),
        spacing_hz=float(np.median(np.diff(frequency_hz))),
        provenance=response.provenance,
        std_known=std_known,
    )


def _line_correlation(frequency_hz: Real, spacing_hz: float, provenance: Provenance) -> Complex:
    """``[line, line]`` of the noise: sum w^2 exp(-2 pi j m n/N)/sum w^2 for lines m apart, by the window w."""
    numbers = np.rint(frequency_hz / spacing_hz).astype(np.int64)
    apart = numbers[:, np.newaxis] - numbers
    decay = provenance.window_decay_per_s * provenance.segment_s
    if decay > 0:
        return np.asarray(decay / (decay + 1j * np.pi * apart), dtype=np.complex128)
    if provenance.averaging == "periodic":
        return np.asarray(apart == 0, dtype=np.complex128)
    power = named_window(provenance.window) ** 2
    lags = np.fft.fft(power) / power.sum()
    return np.where(np.abs(apart) < power.size // 2, lags[apart % power.size], 0.0)


def resonances(
    response: FrequencyResponse,
    lines: MobilityLines,
    *,
    count: int | None,
    frequencies_hz: Sequence[float] | None,
) -> tuple[list[Resonance], list[str]]:
    """Find the peaks of all functions that are peaks of one structure, by rising frequency, and notes on them.

    Peaks of several functions within the half-power bandwidth of the surest are one. With `count` the surest are
    taken; `frequencies_hz` are moved to the highest line within 1 % or two lines.
    """
    if count is not None and count < 1:
        raise EstimateError(f"count is {count}; ask for at least one mode")
    notes: list[str] = []
    if frequencies_hz is not None:
        found = [_nearest(lines, float(frequency_hz)) for frequency_hz in frequencies_hz]
    else:
        found = _merged(lines, _peaks(response))
        if count is not None and len(found) < count:
            notes.append(f"{counted(count, 'mode')} asked for, but only {counted(len(found), 'peak')} stand out")
        found = found[:count]
    if not found:
        notes.append("no peak stands out of the scatter; take more averages, or name the frequencies")
    unique = {resonance.line: resonance for resonance in reversed(found)}
    return _bounded(lines, [unique[line] for line in sorted(unique)]), notes


def _peaks(response: FrequencyResponse) -> list[tuple[Peak, int, int]]:
    """Peaks of the functions that show them best, the surest first."""
    functions = len(response.responses) * len(response.references)
    named = []
    for row, column in _telling(response):
        one = replace(
            response,
            values=response.values[row : row + 1, column : column + 1],
            std=response.std[row : row + 1, column : column + 1],
            coherence=response.coherence[row : row + 1],
            responses=response.responses[row : row + 1],
            references=response.references[column : column + 1],
        )
        peaks = find_response_peaks(one, count=PEAKS_A_FUNCTION, false_alarm=0.01 / functions)
        named += [(peak, row, column) for peak in peaks]
    return sorted(named, key=lambda entry: -entry[0].height / entry[0].height_std)


def _telling(response: FrequencyResponse) -> list[tuple[int, int]]:
    """Functions that are the surest of all on most lines: hundreds of others tell the same, more slowly."""
    values, std = np.abs(response.values), response.std
    surely = np.divide(values, std, out=np.zeros(values.shape), where=np.isfinite(values) & (std > 0))
    # Without a std to go by all are as sure, and the highest tell most.
    surely = np.where(surely.any(), surely, np.nan_to_num(values))
    surest = np.argmax(surely.reshape(-1, values.shape[2])[:, response.excited], axis=0)
    lines = np.bincount(surest, minlength=values.shape[0] * values.shape[1])
    chosen = np.argsort(-lines, kind="stable")[:MOST_FUNCTIONS]
    return [(int(row), int(column)) for row, column in zip(*np.unravel_index(chosen, values.shape[:2]), strict=True)]


def _merged(lines: MobilityLines, peaks: list[tuple[Peak, int, int]]) -> list[Resonance]:
    merged: list[Resonance] = []
    for peak, row, column in peaks:
        if not lines.frequency_hz[0] <= peak.frequency_hz <= lines.frequency_hz[-1]:
            continue
        resonance = _resonance(lines, int(np.argmin(np.abs(lines.frequency_hz - peak.frequency_hz))), (row, column))
        centre_hz = lines.frequency_hz[resonance.line]
        near = (
            abs(centre_hz - lines.frequency_hz[known.line]) <= max(2 * known.half_width_hz, 2 * lines.spacing_hz)
            for known in merged
        )
        if not any(near):
            merged.append(resonance)
    return merged


def _nearest(lines: MobilityLines, frequency_hz: float) -> Resonance:
    reach_hz = max(REACH_SHARE * frequency_hz, REACH_LINES * lines.spacing_hz)
    near = np.flatnonzero(np.abs(lines.frequency_hz - frequency_hz) <= reach_hz)
    if not near.size:
        raise EstimateError(
            f"no excited line near {frequency_hz:g} Hz; lines go from {lines.frequency_hz[0]:g} to "
            f"{lines.frequency_hz[-1]:g} Hz"
        )
    surely = np.abs(lines.values[:, :, near]) / lines.std[:, :, near]
    row, column, at = np.unravel_index(int(np.argmax(surely)), surely.shape)
    return _resonance(lines, int(near[at]), (int(row), int(column)))


def _resonance(lines: MobilityLines, line: int, function: tuple[int, int]) -> Resonance:
    magnitude = np.abs(lines.values[function])
    # The peak of the mobility may be a line beside that of another form.
    first = max(line - 1, 0)
    top = first + int(np.argmax(magnitude[first : line + 2]))
    width = min(half_power_lines(magnitude, top), magnitude.size / 2)
    return Resonance(line=top, function=function, half_width_hz=0.5 * width * lines.spacing_hz)


def _bounded(lines: MobilityLines, found: list[Resonance]) -> list[Resonance]:
    """Resonances that end half-way to their neighbours."""
    centres = lines.frequency_hz[[resonance.line for resonance in found]]
    edges = np.concatenate([[0.0], (centres[1:] + centres[:-1]) / 2, [np.inf]])
    return [
        replace(resonance, low_hz=float(edges[number]), high_hz=float(edges[number + 1]))
        for number, resonance in enumerate(found)
    ]
