"""Peak with half-power bandwidth: modes at a first look."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chladni.modal.experimental.circle_fit import UNSCALED, closeness
from chladni.modal.experimental.exponential_window import without_window_damping
from chladni.modal.experimental.nyquist_circle import sweep
from chladni.modal.experimental.resonance_lines import MobilityLines, Resonance, mobility_lines, resonances
from chladni.modal.experimental.single_modes import SingleMode, left_out, mode_set
from chladni.signals.arrays import Complex, Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet

STEPS = 30
ROUNDS = 3
FEWEST_LINES = 5
# A frequency is never better known than this share of a line, nor a bandwidth than twice that.
SURELY_LINES = 0.02
# Where the mode's own curve has fallen far enough to show what others add, and not so far that it says nothing.
FLANK_HALF_WIDTHS = (1.5, 4.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfPower:
    """Modes from the height and the half-power bandwidth of peaks (Ewins 2000, section 4.2): a first look.

    Notes
    -----
    The mobility of one viscously damped mode has its peak at the natural frequency f_r and half of its power at two
    frequencies 2 zeta f_r apart, exactly. Peak and half-power points are interpolated by that mode's own curve,
    |Y|^2 = h/(1 + x^2), through the lines above half of the power in the function that shows the peak best. Shapes
    are the complex mobilities at the peak. What neighbouring modes add there isn't taken off, but is seen on the
    lines 1.5 to 4 half-widths away, as far as they miss the mode's own curve, and widens the error bars.
    """

    def identify(
        self,
        response: FrequencyResponse,
        *,
        band_hz: tuple[float, float] | None = None,
        count: int | None = None,
        frequencies_hz: Sequence[float] | None = None,
    ) -> ModeSet:
        """Read frequency, damping and shape at each peak.

        Parameters
        ----------
        response
            Functions in any form; motions per reference.
        band_hz
            Low and high end of the lines to use; default all that are excited.
        count
            Most modes to give, those of the surest peaks; fewer are given, with a note, when fewer stand out.
        frequencies_hz
            Where to look instead of at the peaks that are found.

        Returns
        -------
        ModeSet
            Sigma from the std of the lines and from the spacing between them. Unscaled. The damping of an
            exponential window is taken off, and a note says so.

        Raises
        ------
        EstimateError
            When a response is no motion, an argument is out of range, or too few lines are excited.
        """
        lines = mobility_lines(response, band_hz)
        found, notes = resonances(response, lines, count=count, frequencies_hz=frequencies_hz)
        modes = []
        for resonance in found:
            mode = _mode(lines, resonance)
            if mode is None:
                notes.append(left_out(lines, resonance))
            else:
                modes.append(mode)
        found_modes = mode_set(modes, response, estimator="half-power", notes=[*notes, *closeness(modes), UNSCALED])
        return without_window_damping(found_modes, response.provenance.window_decay_per_s)


def _mode(lines: MobilityLines, resonance: Resonance) -> SingleMode | None:
    centre_hz = float(lines.frequency_hz[resonance.line])
    half_width_hz = max(resonance.half_width_hz, 0.3 * lines.spacing_hz)
    peak, span = None, slice(0)
    # Noise cuts the first width short; later rounds have that of the curve, or twice as much when none fitted.
    for _ in range(ROUNDS):
        span = lines.around(centre_hz, half_width_hz, at_least=FEWEST_LINES)
        span = resonance.within(lines, span, at_least=FEWEST_LINES)
        peak = _peak(lines, span, resonance.function, centre_hz, half_width_hz)
        centre_hz, half_width_hz = (centre_hz, 2 * half_width_hz) if peak is None else peak.place()
    return None if peak is None else _single_mode(lines, span, resonance, peak)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Peak:
    """Frequency and half-power half-width of a peak, and one sigma of each."""

    frequency_hz: float
    half_width_hz: float
    std_hz: Real

    def place(self) -> tuple[float, float]:
        return self.frequency_hz, self.half_width_hz


def _peak(
    lines: MobilityLines, span: slice, function: tuple[int, int], centre_hz: float, half_width_hz: float
) -> _Peak | None:
    values, std = lines.values[function][span], lines.std[function][span]
    magnitude = np.abs(values)
    # Noise adds its own power to every line, 2 sigma^2.
    power, power_std = magnitude**2 - 2 * std**2, 2 * std * np.hypot(magnitude, std)
    # Of the power only the part of the noise in phase with the mobility is seen.
    phase = np.exp(1j * np.angle(values))
    correlation = (phase.conj()[:, None] * lines.correlation(span) * phase).real
    first = np.array([power.max(), centre_hz, half_width_hz])
    return _lorentzian(lines.frequency_hz[span], power, power_std, correlation, first)


def _single_mode(lines: MobilityLines, span: slice, resonance: Resonance, peak: _Peak) -> SingleMode:
    frequency_hz, half_width_hz = peak.place()
    values, at_std = _at_peak(lines, span, frequency_hz, half_width_hz)
    others = _others(lines, resonance, values, frequency_hz, half_width_hz)
    # A background of b on a peak of height h moves it, and its half-power points, by up to b/h of the half-width.
    share = float(others[resonance.function] / np.abs(values[resonance.function]))
    least_hz = np.hypot(SURELY_LINES * lines.spacing_hz, half_width_hz * share)
    frequency_std_hz, width_std_hz = np.hypot(peak.std_hz, least_hz)
    return SingleMode(
        frequency_hz=frequency_hz,
        frequency_std_hz=float(frequency_std_hz),
        damping_ratio=half_width_hz / frequency_hz,
        damping_std=float(width_std_hz / frequency_hz),
        diameter=values,
        diameter_std=np.hypot(at_std, others),
    )


def _lorentzian(f_hz: Real, power: Real, std: Real, correlation: Real, place: Real) -> _Peak | None:
    """Fit |Y|^2 = h/(1 + x^2) from a first (height, frequency, half-width); None when there's no such peak."""
    for _ in range(STEPS):
        model, jacobian = _curve(f_hz, place)
        step, *_ = np.linalg.lstsq(jacobian / std[:, None], (power - model) / std, rcond=None)
        share = min(1.0, 0.5 * place[2] / max(abs(step[2]), abs(step[1]), np.finfo(float).tiny))
        place = place + share * step
        if not (f_hz[0] <= place[1] <= f_hz[-1] and place[0] > 0 and place[2] < 0.5 * place[1]):
            return None
        if share == 1 and abs(step[1]) + abs(step[2]) < 1e-9 * place[2]:
            break
    model, jacobian = _curve(f_hz, place)
    residual = (power - model) / std
    weighted = jacobian / std[:, None]
    inverse = np.linalg.pinv(weighted)
    misfit = float(residual @ residual) / (f_hz.size - 3)
    # The curve is the mode's own only; what others add makes lines miss it by more than their scatter.
    std_hz = np.sqrt(np.diag(inverse @ correlation @ inverse.T * max(misfit, 1.0))[1:])
    if not np.all(std_hz < np.ptp(f_hz)):
        # One line stands so far above its neighbours that any narrow peak fits them.
        return None
    return _Peak(frequency_hz=float(place[1]), half_width_hz=float(place[2]), std_hz=std_hz)


def _curve(f_hz: Real, place: Real) -> tuple[Real, Real]:
    """|Y|^2 and its derivatives by height, frequency and half-width."""
    height, natural, half_width = place
    x = sweep(f_hz, natural, half_width / natural)
    model = 1 / (1 + x**2)
    by_x = -2 * height * x * model**2
    by_natural = by_x * (-natural / f_hz / half_width)
    return height * model, np.stack([model, by_natural, by_x * -x / half_width], axis=1)


def _at_peak(lines: MobilityLines, span: slice, frequency_hz: float, half_width_hz: float) -> tuple[Complex, Real]:
    """Mobility of all functions at the peak: lines above half the power, each raised to what it is there."""
    raised = 1 + 1j * sweep(lines.frequency_hz[span], frequency_hz, half_width_hz / frequency_hz)
    weights = 1 / (np.abs(raised) * lines.std[:, :, span]) ** 2
    gains = weights * raised / weights.sum(axis=2, keepdims=True)
    scatter = gains * lines.std[:, :, span]
    variance = np.einsum("rck,kl,rcl->rc", scatter, lines.correlation(span), scatter.conj(), optimize=True).real
    return (gains * lines.values[:, :, span]).sum(axis=2), np.sqrt(variance)


def _others(
    lines: MobilityLines,
    resonance: Resonance,
    values: Complex,
    frequency_hz: float,
    half_width_hz: float,
) -> Real:
    """RMS of what lines on the flanks show beyond the mode and their scatter, of each function."""
    x = sweep(lines.frequency_hz, frequency_hz, half_width_hz / frequency_hz)
    flank = (np.abs(x) >= FLANK_HALF_WIDTHS[0]) & (np.abs(x) <= FLANK_HALF_WIDTHS[1])
    flank &= (lines.frequency_hz >= resonance.low_hz) & (lines.frequency_hz <= resonance.high_hz)
    if not flank.any():
        # Sharper than the lines: the nearest two, which then are the flanks.
        flank[max(resonance.line - 1, 0) : resonance.line + 2] = True
    own = values[:, :, None] / (1 + 1j * x[flank])
    excess = np.abs(lines.values[:, :, flank] - own) ** 2 - 2 * lines.std[:, :, flank] ** 2
    return np.asarray(np.sqrt(np.maximum(excess.mean(axis=2), 0.0)), dtype=np.float64)
