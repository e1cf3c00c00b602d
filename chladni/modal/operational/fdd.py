"""Frequency domain decomposition: a first look at the modes in responses."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np

from chladni.modal.fit.lag_window import LagWindow, lag_window
from chladni.modal.operational.response_modes import ResponseMode, response_mode_set
from chladni.modal.operational.response_peaks import PickedPeaks, ResponsePeak, close_mode_notes, pick_peaks
from chladni.modal.operational.response_shapes import shape_at
from chladni.modal.operational.spectral_bell import own_half_width
from chladni.modal.operational.spectral_decomposition import SpectralDecomposition, decompose, relative_std
from chladni.signals.arrays import Real
from chladni.signals.cross_spectra import CrossSpectra
from chladni.signals.errors import EstimateError
from chladni.signals.mode_set import ModeSet

HALF_POWER = (
    "FDD reads the damping from the half-power width of a scattering peak, corrected for the window; its error bar "
    "says how little that is, and EnhancedFrequencyDomainDecomposition fits the whole bell"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FrequencyDomainDecomposition:
    """Modes from the peaks of the first singular value of the response spectra (Brincker, Zhang & Andersen 2001).

    Frequencies lie between the lines by interpolation; the shape is the first singular vector over the top of the
    peak; the damping ratio is half the half-power width over the frequency, corrected for what the window widens.
    Modes closer than two half-power widths make one peak: they are found as one, with a note that the second singular
    value rises too, or left out for their mixed shape.

    Attributes
    ----------
    false_alarm
        Chance that spectra without any mode give a peak, 0 to 1.
    min_mac
        Agreement of the shapes beside a peak that makes it a mode's, 0 to 1.

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
    >>> modes = FrequencyDomainDecomposition().identify(cross_spectra(series, resolution_hz=0.05))
    >>> modes.frequency_hz.round(1), modes.shapes.real.round(1)
    (array([4.]), array([[ 1. , -0.5]]))
    """

    false_alarm: float = 0.01
    min_mac: float = 0.8

    def __post_init__(self) -> None:
        require_shares(false_alarm=self.false_alarm, min_mac=self.min_mac)

    def identify(
        self,
        spectra: CrossSpectra,
        *,
        band_hz: tuple[float, float] | None = None,
        count: int | None = None,
        frequencies_hz: Sequence[float] | Real | None = None,
    ) -> ModeSet:
        """Identify modes.

        Parameters
        ----------
        spectra
            Averaged cross-spectra of responses to random excitation, as of `chladni.spectral.cross_spectra`.
        band_hz
            Take only modes between these two.
        count
            Most modes to give, the strongest; fewer when the spectra hold fewer, and a note says so.
        frequencies_hz
            Take the highest lines near these instead of choosing peaks.

        Returns
        -------
        ModeSet
            Empty when no peak stands out of the scatter.

        Raises
        ------
        EstimateError
            When the spectra are no average of random responses, hold NaN, have too few averages or lines, or the
            request lies outside them.
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
        modes = [_mode(decomposition, peak, width) for peak, width in zip(picked.peaks, widths, strict=True)]
        close = close_mode_notes(decomposition, picked.peaks, widths)
        notes = (*picked.notes, *nothing_found(picked), *close, HALF_POWER)
        return response_mode_set(decomposition, modes, estimator="FDD", notes=notes)


def require_shares(**shares: float) -> None:
    """Raise `EstimateError` naming the first setting that doesn't lie between 0 and 1."""
    for name, value in shares.items():
        if not 0 < value < 1:
            raise EstimateError(f"{name} is {value}; it must lie between 0 and 1")


def nothing_found(picked: PickedPeaks) -> tuple[str, ...]:
    """Say why a set is empty, if it is."""
    if picked.peaks:
        return ()
    return ("no mode: no peak of the first singular value stands out of its scatter; longer records have less",)


def half_power_half_width(decomposition: SpectralDecomposition, peak: ResponsePeak) -> float:
    """Half of the half-power width of a mode in Hz, without what the window adds to it."""
    window = required_lag_window(decomposition)
    # The window widens every bell in the same way, so that what it adds can be taken back.
    shown = _shown_half_width(decomposition.values[:, 0], peak.line)
    return own_half_width(shown, window) * decomposition.spacing_hz


def required_lag_window(decomposition: SpectralDecomposition) -> LagWindow:
    """Lag window of the spectra; `EstimateError` when they don't tell their segments."""
    window = lag_window(decomposition.provenance)
    if window is None or abs(window.segment_s * decomposition.spacing_hz - 1) > 1e-6:
        raise EstimateError(
            f"the provenance's segments of {decomposition.provenance.segment_s:g} s don't belong to lines "
            f"{decomposition.spacing_hz:g} Hz apart; use spectra as `cross_spectra` gives them"
        )
    return window


def _mode(decomposition: SpectralDecomposition, peak: ResponsePeak, half_width_hz: float) -> ResponseMode:
    scatter = relative_std(decomposition)
    # Near its half-power point a Lorentzian falls by its own value in a half width: a line wrong by sigma moves its
    # crossing by sigma half widths; the top, chosen as the highest of many lines, is wrong by more and moves both.
    of_scatter = 2 * half_width_hz * scatter
    of_lines = decomposition.spacing_hz / sqrt(12)
    return ResponseMode(
        frequency_hz=peak.frequency_hz,
        frequency_std_hz=hypot(peak.frequency_std_hz, of_lines),
        damping_ratio=half_width_hz / peak.frequency_hz,
        damping_std=hypot(of_scatter, of_lines) / peak.frequency_hz,
        shape=shape_at(decomposition, peak.line, half_width_hz),
    )


def _shown_half_width(power: Real, line: int) -> float:
    """Half of the distance, in lines, of the half-power points beside a peak, each between two lines."""
    # From the peak outwards the first line below half: farther ones belong to other modes.
    below = np.flatnonzero(power[: line + 1] <= power[line] / 2)
    above = np.flatnonzero(power[line:] <= power[line] / 2)
    sides = []
    if below.size:
        sides.append(line - _crossing(power, int(below[-1]), int(below[-1]) + 1, power[line] / 2))
    if above.size:
        sides.append(_crossing(power, line + int(above[0]), line + int(above[0]) - 1, power[line] / 2) - line)
    # A peak cut off by the end of the spectra shows its other flank.
    return float(np.mean(sides)) if sides else float(power.size)


def _crossing(power: Real, low: int, high: int, level: float) -> float:
    """Place between a line at or below the level and its neighbour above it."""
    return low + (high - low) * float((level - power[low]) / (power[high] - power[low]))
