"""Enhanced frequency domain decomposition: damping and frequency from the whole bell of each mode."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.modal.operational.fdd import half_power_half_width, nothing_found, require_shares, required_lag_window
from chladni.modal.operational.response_modes import ResponseMode, response_mode_set
from chladni.modal.operational.response_peaks import ResponsePeak, close_mode_notes, pick_peaks
from chladni.modal.operational.response_shapes import ResponseShape, modal_filters, modal_spectrum, shape_at
from chladni.modal.operational.spectral_bell import Bell, BellData, fit_bell
from chladni.modal.operational.spectral_decomposition import SpectralDecomposition, decompose
from chladni.signals.arrays import Real
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.machine_harmonic import MachineHarmonic
from chladni.signals.mode_set import ModeSet

# Beyond ten half widths a bell is a hundredth of its top and tells nothing more; a few lines are needed in any case.
REACH_WIDTHS = 10.0
LEAST_REACH_LINES = 6
# So many lines beside each other have to disagree with a shape before the bell ends: one may by chance.
DISAGREEING_LINES = 2
# A bell narrower than this share of a line shows no decay at all: a sine.
NO_WIDTH_LINES = 0.02
# A line of noise, chosen by hand, may look as narrow; it doesn't stand so far over its floor.
SINE_OVER_FLOOR = 10.0
# A mode stands over the floor of its bell by this many sigma.
LEAST_POWER_SIGMA = 3.0
# Above it there's no resonance to speak of, and one bell isn't told from a sloping floor.
MOST_DAMPING = 0.3
# How often a sensor differentiates the displacement.
DERIVATIVES = {"m": 0, "m/s": 1, "m/s^2": 2, "rad": 0, "rad/s": 1, "rad/s^2": 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class EnhancedFrequencyDomainDecomposition:
    """Modes from the spectral bells around the peaks of the first singular value.

    Peaks and shapes are those of `FrequencyDomainDecomposition`. The spectrum of each modal coordinate, the responses
    weighted by the shapes, holds one bell (frequency-spatial domain decomposition: Zhang, Wang & Tamura 2010); the
    bell of a damped mode is fitted to it in the frequency domain, as the window shows it, so that neither frequency
    nor damping is biased by the resolution. Error bars follow from the record's length, not from the number of lines.

    Attributes
    ----------
    false_alarm
        Chance that spectra without any mode give a peak, 0 to 1.
    min_mac
        Agreement of the shapes beside a peak that makes it a mode's, 0 to 1.
    bell_mac
        Agreement with the shape that lines of the bell have, 0 to 1 (Jacobsen, Andersen & Brincker 2006 take 0.8).

    Examples
    --------
    >>> from scipy.signal import lfilter
    >>> from chladni.signals.channel import Channel
    >>> from chladni.signals.time_series import TimeSeries
    >>> from chladni.spectral.cross_spectra import cross_spectra
    >>> pole = np.exp(2 * np.pi * 4.0 * (-0.02 + 1j) / 50)  # 4 Hz with 2 % damping, 50 samples a second
    >>> noise = np.random.default_rng(0).standard_normal((3, 60_000))
    >>> mode = lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], noise[0])
    >>> series = TimeSeries(
    ...     values=np.stack([mode, -0.5 * mode]) + noise[1:],
    ...     sample_rate_hz=50.0,
    ...     channels=(Channel(name="a", unit="m/s^2"), Channel(name="b", unit="m/s^2")),
    ... )
    >>> modes = EnhancedFrequencyDomainDecomposition().identify(cross_spectra(series, resolution_hz=0.05))
    >>> modes.frequency_hz.round(1), bool(abs(modes.damping_ratio[0] - 0.02) < 3 * modes.damping_std[0])
    (array([4.]), True)
    """

    false_alarm: float = 0.01
    min_mac: float = 0.8
    bell_mac: float = 0.8

    def __post_init__(self) -> None:
        require_shares(false_alarm=self.false_alarm, min_mac=self.min_mac, bell_mac=self.bell_mac)

    def identify(
        self,
        spectra: CrossSpectra,
        *,
        band_hz: tuple[float, float] | None = None,
        count: int | None = None,
        frequencies_hz: Sequence[float] | Real | None = None,
    ) -> ModeSet:
        """Identify modes; parameters, result and errors are those of `FrequencyDomainDecomposition.identify`.

        A peak whose bell can't be fitted is left out, and a note says why; one without any width is a machine's and
        goes to ``harmonics``.
        """
        decomposition = decompose(spectra)
        picked = pick_peaks(
            decomposition,
            band_hz=band_hz,
            count=count,
            frequencies_hz=frequencies_hz,
            false_alarm=self.false_alarm,
            min_mac=self.min_mac,
        )
        widths = [half_power_half_width(decomposition, peak) for peak in picked.peaks]
        shapes = [shape_at(decomposition, peak.line, width) for peak, width in zip(picked.peaks, widths, strict=True)]
        # All peaks together, also those that turn out to be none: they are in the spectra of the others.
        filters = modal_filters([shape.vector for shape in shapes])
        modes: list[ResponseMode] = []
        close = close_mode_notes(decomposition, picked.peaks, widths)
        notes, harmonics = [*picked.notes, *nothing_found(picked), *close], []
        for row, peak in enumerate(picked.peaks):
            realm = _realm(decomposition, picked.peaks, row)
            spectrum = modal_spectrum(decomposition, filters[row])
            try:
                bell = self._bell(decomposition, spectrum, peak, shapes[row], widths[row], realm)
                found = _sine(bell, decomposition) or _mode(bell, shapes[row])
            except EstimateError as error:
                notes.append(f"the peak at {peak.frequency_hz:.4g} Hz is left out: {error}")
                continue
            if isinstance(found, MachineHarmonic):
                harmonics.append(found)
            else:
                modes.append(found)
        return response_mode_set(decomposition, modes, estimator="EFDD", notes=notes, harmonics=harmonics)

    def _bell(
        self,
        decomposition: SpectralDecomposition,
        spectrum: Real,
        peak: ResponsePeak,
        shape: ResponseShape,
        half_width_hz: float,
        realm: tuple[int, int],
    ) -> Bell:
        """Fit twice: how far a bell reaches follows from its width, which the first fit tells better than the eye."""
        agreeing = _agreeing(decomposition, shape, peak.line, self.bell_mac)
        first, last = max(agreeing[0], realm[0]), min(agreeing[1], realm[1])
        frequency_hz = peak.frequency_hz
        for _ in range(2):
            reach = max(LEAST_REACH_LINES, int(REACH_WIDTHS * half_width_hz / decomposition.spacing_hz))
            lines = slice(max(first, peak.line - reach, 1), min(last, peak.line + reach) + 1)
            data = BellData(
                frequency_hz=decomposition.frequency_hz[lines],
                power=spectrum[lines],
                lag_window=required_lag_window(decomposition),
                window=decomposition.provenance.window,
                record_s=decomposition.record_s,
                derivatives=_derivatives(decomposition, shape),
            )
            bell = fit_bell(data, frequency_hz=frequency_hz, half_width_hz=half_width_hz)
            frequency_hz, half_width_hz = bell.frequency_hz, bell.damping_ratio * bell.frequency_hz
        return bell


def _realm(decomposition: SpectralDecomposition, peaks: Sequence[ResponsePeak], row: int) -> tuple[int, int]:
    """Lines nearer to a peak than to its neighbours."""
    first = (peaks[row - 1].line + peaks[row].line) // 2 if row else 0
    last = (peaks[row].line + peaks[row + 1].line) // 2 if row + 1 < len(peaks) else len(decomposition.values) - 1
    return first, last


def _agreeing(
    decomposition: SpectralDecomposition, shape: ResponseShape, line: int, bell_mac: float
) -> tuple[int, int]:
    """First and last of the lines around a peak whose first singular vector is the shape's."""
    mac = np.abs(decomposition.vectors[:, :, 0].conj() @ shape.vector) ** 2
    # The window spreads the peak itself over these lines.
    low = mac < bell_mac
    low[max(line - 2, 0) : line + 3] = False
    runs = np.convolve(low, np.ones(DISAGREEING_LINES), mode="valid") >= DISAGREEING_LINES
    left, right = np.flatnonzero(runs[:line]), np.flatnonzero(runs[line:])
    first = int(left[-1]) + DISAGREEING_LINES if left.size else 0
    return first, line + int(right[0]) - 1 if right.size else low.size - 1


def _derivatives(decomposition: SpectralDecomposition, shape: ResponseShape) -> int:
    # Over a bell the power of the frequency changes little; the channel that moves most decides which it is.
    largest = int(np.argmax(np.abs(shape.vector)))
    # Most sensors are accelerometers, also those whose log tells no unit.
    return DERIVATIVES.get(decomposition.channels[largest].unit, 2)


def _sine(bell: Bell, decomposition: SpectralDecomposition) -> MachineHarmonic | None:
    """A machine, if the bell is as narrow as the window makes a sine."""
    width_lines = bell.damping_ratio * bell.frequency_hz / decomposition.spacing_hz
    if width_lines > NO_WIDTH_LINES or bell.power < SINE_OVER_FLOOR * bell.floor:
        return None
    return MachineHarmonic(
        frequency_hz=bell.frequency_hz,
        reason=f"damping ratio {bell.damping_ratio:.1e}, near zero: no wider than the window makes a sine, lines "
        f"{decomposition.spacing_hz:.3g} Hz apart",
    )


def _mode(bell: Bell, shape: ResponseShape) -> ResponseMode:
    if bell.damping_ratio > MOST_DAMPING:
        raise EstimateError(f"its bell has a damping ratio of {bell.damping_ratio:.2g}, no resonance to speak of")
    if bell.power < LEAST_POWER_SIGMA * bell.power_std:
        raise EstimateError("its bell can't be told from the floor around it")
    std = np.sqrt(np.diag(bell.covariance))
    return ResponseMode(
        frequency_hz=bell.frequency_hz,
        frequency_std_hz=float(std[0]),
        damping_ratio=bell.damping_ratio,
        damping_std=float(std[1]),
        shape=shape,
    )
