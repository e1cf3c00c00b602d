"""Circle fit: modes one at a time, from the circles they draw in the Nyquist plane."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from chladni.modal.experimental.exponential_window import without_window_damping
from chladni.modal.experimental.nyquist_circle import NyquistCircle, fit_circle, sweep
from chladni.modal.experimental.resonance_lines import MobilityLines, Resonance, mobility_lines, resonances
from chladni.modal.experimental.single_modes import SingleMode, left_out, mode_set
from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.mode_set import ModeSet

# Lines up to so many half-power half-widths from the peak span 250 of the circle's 360 degrees (Ewins asks for 270 at
# most, for there the sweep is slow and other modes are strong).
REACH_HALF_WIDTHS = 1.5
FEWEST_LINES = 5
# Of the variance that the std of the lines tells.
MISFIT_WORTH_A_WORD = 3.0
PAIR_SPREAD_WORTH_A_WORD = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class CircleFit:
    """Modes one at a time by circles in the Nyquist plane (Ewins 2000, section 4.3): a quick second look.

    Attributes
    ----------
    reach_half_widths
        Lines within so many half-power half-widths of a peak are fitted, 0.5 to 5.

    Notes
    -----
    Each mode is taken to be alone but for a constant that its neighbours add: modes nearer than some half-power
    bandwidths are one, or pull at each other. A note says where circles don't close. Use poly-reference least squares
    for the final word.
    """

    reach_half_widths: float = REACH_HALF_WIDTHS

    def __post_init__(self) -> None:
        if not 0.5 <= self.reach_half_widths <= 5:
            raise EstimateError(f"reach_half_widths is {self.reach_half_widths}; it must lie between 0.5 and 5")

    def identify(
        self,
        response: FrequencyResponse,
        *,
        band_hz: tuple[float, float] | None = None,
        count: int | None = None,
        frequencies_hz: Sequence[float] | None = None,
    ) -> ModeSet:
        """Fit a circle at each peak.

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
            Frequency at the greatest rate of sweep, damping and shape with their sigma, from the std of the lines and
            the distance of the lines from the circles, whichever is more. Unscaled. The damping of an exponential
            window is taken off, and a note says so.

        Raises
        ------
        EstimateError
            When a response is no motion, an argument is out of range, or too few lines are excited.
        """
        lines = mobility_lines(response, band_hz)
        found, notes = resonances(response, lines, count=count, frequencies_hz=frequencies_hz)
        modes = []
        for resonance in found:
            mode, words = self._mode(lines, resonance)
            modes += [mode] if mode else []
            notes += words if mode else [left_out(lines, resonance)]
        found_modes = mode_set(modes, response, estimator="circle fit", notes=[*notes, *closeness(modes), UNSCALED])
        return without_window_damping(found_modes, response.provenance.window_decay_per_s)

    def _mode(self, lines: MobilityLines, resonance: Resonance) -> tuple[SingleMode | None, list[str]]:
        centre_hz = float(lines.frequency_hz[resonance.line])
        circle, reach_hz = None, resonance.half_width_hz
        # The width of a peak between few lines is known badly: the second round has a better one.
        for _ in range(2):
            span = lines.around(centre_hz, self.reach_half_widths * reach_hz, at_least=FEWEST_LINES)
            span = resonance.within(lines, span, at_least=FEWEST_LINES)
            circle = fit_circle(lines, span, centre_hz, reach_hz / centre_hz)
            if circle is None:
                break
            reach_hz = circle.damping_ratio * circle.frequency_hz
        if circle is None:
            return None, []
        return _single_mode(circle), _words(lines, span, resonance, circle)


UNSCALED = "one mode at a time: close modes pull at each other, and shapes are unscaled; a look, not the final word"


def closeness(modes: Sequence[SingleMode]) -> list[str]:
    """Name the modes that lie within three of their half-power bandwidths together."""
    ordered = sorted(modes, key=lambda mode: mode.frequency_hz)
    return [
        f"the modes at {one.frequency_hz:.5g} and {next_one.frequency_hz:.5g} Hz are close for their damping: take "
        "them for one look at both, and fit them together"
        for one, next_one in pairwise(ordered)
        if next_one.frequency_hz - one.frequency_hz
        < 3 * (one.damping_ratio * one.frequency_hz + next_one.damping_ratio * next_one.frequency_hz)
    ]


def _single_mode(circle: NyquistCircle) -> SingleMode:
    # What doesn't fit is no scatter: it doesn't average out over lines.
    inflation = 1 + circle.excess * circle.lines / 2
    std = np.sqrt(inflation * np.diag(circle.covariance))
    return SingleMode(
        frequency_hz=circle.frequency_hz,
        frequency_std_hz=float(std[0]),
        damping_ratio=circle.damping_ratio,
        damping_std=float(std[1]),
        diameter=circle.diameter,
        diameter_std=np.sqrt(inflation) * circle.diameter_std,
    )


def _words(lines: MobilityLines, span: slice, resonance: Resonance, circle: NyquistCircle) -> list[str]:
    words = []
    if lines.std_known and circle.excess > MISFIT_WORTH_A_WORD:
        words.append(
            f"at {circle.frequency_hz:.5g} Hz lines lie {np.sqrt(circle.misfit):.2g} times their std from the "
            "circles: a close mode, leakage or nonlinearity; its error bars are widened by that"
        )
    pairs = pair_damping(lines, span, resonance.function, circle)
    if pairs.size > 1 and np.std(pairs) > PAIR_SPREAD_WORTH_A_WORD * circle.damping_ratio:
        words.append(
            f"at {circle.frequency_hz:.5g} Hz pairs of points give damping ratios of {np.median(pairs):.3g} with a "
            f"scatter of {np.std(pairs):.2g}: noise, a close mode or nonlinearity"
        )
    return words


def pair_damping(lines: MobilityLines, span: slice, function: tuple[int, int], circle: NyquistCircle) -> Real:
    """Give the damping ratio of each pair of points on either side of the resonance, on one function's circle.

    Notes
    -----
    With the angles alpha from the resonance, seen from the circle's origin side, tan(alpha/2) = x: so

        zeta = (g_b - g_a)/(2 (tan(alpha_b/2) - tan(alpha_a/2))),  g = f/f_r - f_r/f

    (Ewins 2000, eq. 4.20, for viscous damping). Points beyond 3/8 of a turn are slow in the sweep and left out.
    """
    f_hz = lines.frequency_hz[span]
    values = lines.values[function][span]
    centre = circle.origin[function] + circle.diameter[function] / 2
    # From the resonance, against the sweep: the circle is run through clockwise.
    half_angle = -np.angle((values - centre) / circle.diameter[function]) / 2
    tangent = np.tan(half_angle)
    gap = sweep(f_hz, circle.frequency_hz, 0.5)
    below, above = ((np.abs(half_angle) < 3 * np.pi / 8) & side for side in (gap < 0, gap > 0))
    apart = tangent[above][:, None] - tangent[below][None]
    ratios = (gap[above][:, None] - gap[below][None]) / (2 * np.where(apart == 0, np.nan, apart))
    return np.asarray(ratios[np.isfinite(ratios)], dtype=np.float64)
