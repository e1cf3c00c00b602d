"""Operating deflection shapes at any frequency, from frequency responses or from cross-spectra."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chladni.signals.arrays import Complex, Mask, Real
from chladni.signals.channel import Channel, find_channel
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance
from chladni.signals.value import Value, require_shape
from chladni.signals.wording import counted

# A line this near to the frequency asked for is that frequency, but for the digits a person types.
SAME_FREQUENCY = 1e-6
# Less coherence than this at a line: the motion there is mostly not that of the reference.
COHERENT = 0.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DeflectionShape(Value):
    """Motion of all channels at one line: of modes together, as they are excited, with its size.

    Attributes
    ----------
    frequency_hz
        The line that it is of.
    amplitude
        ``[channel]`` complex, each along its channel's direction, in the channel's `units`; the phase is that
        relative to `reference`.
    std
        ``[channel]`` one sigma of the real and of the imaginary part; infinite where the data give no bound.
    channels
        One for each amplitude.
    units
        Unit of each amplitude: motion per force from frequency responses, RMS of the motion from cross-spectra.
    reference
        Channel that the phase is relative to.
    provenance
        How it was made; notes are advice.
    """

    frequency_hz: float
    amplitude: NDArray[np.complexfloating]
    std: Real
    channels: tuple[Channel, ...]
    units: tuple[str, ...]
    reference: Channel
    provenance: Provenance

    def __post_init__(self) -> None:
        count = (len(self.channels),)
        require_shape("amplitude", self.amplitude, count, "channels")
        require_shape("std", self.std, count, "channels")
        require_shape("units", np.array(self.units), count, "channels")
        self._freeze()


def deflection_shape(
    response: FrequencyResponse, frequency_hz: float, *, reference: str | None = None
) -> DeflectionShape:
    """Give the motion of all responses per unit of one reference at a frequency.

    Parameters
    ----------
    response
        Functions in any form.
    frequency_hz
        Within the lines; the nearest excited line is taken, and a note says so when it is another.
    reference
        Name of the reference; default the only one.

    Returns
    -------
    DeflectionShape
        Of the nearest excited line, in units of the functions.

    Raises
    ------
    EstimateError
        When the frequency lies more than a line outside the excited ones, or the reference isn't there or isn't named
        among several.
    """
    column = _reference(response, reference)
    line, note = _nearest(response.frequency_hz, response.excited, frequency_hz)
    notes = [*note, *_masked_note(response, column, line)]
    return DeflectionShape(
        frequency_hz=float(response.frequency_hz[line]),
        amplitude=response.values[:, column, line],
        std=response.std[:, column, line],
        channels=response.responses,
        units=tuple(response.unit(row, column) for row in range(len(response.responses))),
        reference=response.references[column],
        provenance=response.provenance.with_notes(*notes),
    )


def phase_referenced_shape(spectra: CrossSpectra, frequency_hz: float, *, reference: str) -> DeflectionShape:
    """Give the motion of all channels at a frequency in operation, with phases relative to one of them.

    Parameters
    ----------
    spectra
        Averaged cross-spectra of responses.
    frequency_hz
        Within the lines; the nearest line is taken, and a note says so when it is another.
    reference
        Channel whose phase is zero; one that moves at this frequency.

    Returns
    -------
    DeflectionShape
        RMS in each channel's unit, of what goes together with the reference: of a tone its RMS, of noise that within
        the bandwidth of a line.

    Raises
    ------
    EstimateError
        When the frequency lies more than a line outside the spectra, the reference isn't there or doesn't move.

    Notes
    -----
    A_i = G_ri sqrt(B)/sqrt(G_rr) with the effective noise bandwidth B; |A_i|^2 is the coherent output power of
    channel i (Bendat & Piersol 2010, section 6.2). With the coherence gamma^2 and n effective averages one sigma of
    the real and of the imaginary part is |A_i| sqrt((1 - gamma^2)/(2 n gamma^2)) (table 9.6), without the scatter of
    the reference's own size, which all channels share.
    """
    row = find_channel(spectra.channels, reference, role="reference")
    line, note = _nearest(spectra.frequency_hz, np.ones(spectra.frequency_hz.size, dtype=np.bool_), frequency_hz)
    density = np.asarray(spectra.density[:, :, line], dtype=np.complex128)
    own = float(density[row, row].real)
    if not own > 0:
        raise EstimateError(
            f"{reference!r} doesn't move at {spectra.frequency_hz[line]:g} Hz; take a reference that does"
        )
    amplitude = density[row] * np.sqrt(spectra.bandwidth_hz / own)
    powers = np.diag(density).real
    # What isn't coherent scatters the cross-spectrum: power of a channel less that of its amplitude.
    stray = np.maximum(powers * spectra.bandwidth_hz - np.abs(amplitude) ** 2, 0.0)
    averages = spectra.provenance.effective_averages
    std = np.sqrt(stray / (2 * averages)) if averages > 1 else np.full(powers.shape, np.inf)
    return DeflectionShape(
        frequency_hz=float(spectra.frequency_hz[line]),
        amplitude=amplitude,
        std=np.asarray(std, dtype=np.float64),
        channels=spectra.channels,
        units=tuple(channel.unit for channel in spectra.channels),
        reference=spectra.channels[row],
        provenance=_provenance(spectra, [*note, *_coherence_note(spectra, amplitude, powers)]),
    )


def _reference(response: FrequencyResponse, reference: str | None) -> int:
    if reference is not None:
        return find_channel(response.references, reference, role="reference")
    if len(response.references) != 1:
        names = ", ".join(channel.name for channel in response.references)
        raise EstimateError(f"{counted(len(response.references), 'reference')} ({names}); name one of them")
    return 0


def _nearest(frequency_hz: Real, usable: Mask, wanted_hz: float) -> tuple[int, list[str]]:
    lines = np.flatnonzero(usable)
    if not lines.size:
        raise EstimateError("no line is excited, so there's no deflection shape")
    line = int(lines[np.argmin(np.abs(frequency_hz[lines] - wanted_hz))])
    taken_hz = float(frequency_hz[line])
    spacing_hz = float(np.median(np.diff(frequency_hz))) if frequency_hz.size > 1 else np.inf
    # Written so that NaN is refused too.
    if not abs(taken_hz - wanted_hz) <= spacing_hz:
        raise EstimateError(
            f"no excited line at {wanted_hz:g} Hz, the nearest is at {taken_hz:g} Hz; ask for a frequency that was "
            "excited"
        )
    if abs(taken_hz - wanted_hz) <= SAME_FREQUENCY * wanted_hz:
        return line, []
    return line, [f"the deflection shape is that of the nearest line, {taken_hz:.6g} Hz, for {wanted_hz:.6g} Hz"]


def _masked_note(response: FrequencyResponse, column: int, line: int) -> list[str]:
    finite = np.isfinite(response.values[:, column, line])
    missing = [channel.name for channel, known in zip(response.responses, finite, strict=True) if not known]
    return [f"{', '.join(missing)}: no value at this line"] if missing else []


def _coherence_note(spectra: CrossSpectra, amplitude: Complex, powers: Real) -> list[str]:
    moving = powers > 0
    explained = np.abs(amplitude[moving]) ** 2 < COHERENT * powers[moving] * spectra.bandwidth_hz
    names = [channel.name for channel, moves in zip(spectra.channels, moving, strict=True) if moves]
    weak = [name for name, low in zip(names, explained, strict=True) if low]
    if not weak:
        return []
    note = (
        f"{', '.join(weak)}: less than half of the motion at this line goes together with the reference; take one "
        "that moves more, or several"
    )
    return [note]


def _provenance(spectra: CrossSpectra, notes: list[str]) -> Provenance:
    return spectra.provenance.with_estimator("phase-referenced deflection shape").with_notes(*notes)
