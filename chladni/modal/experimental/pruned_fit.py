"""A modal model with just the modes that the data need."""

from dataclasses import dataclass
from math import pi

import numpy as np

from chladni.modal.experimental.candidates import Candidates
from chladni.modal.experimental.grouped_refinement import grouped_refinement, select_modes
from chladni.modal.experimental.judged_lines import JudgedLines
from chladni.modal.experimental.significance import (
    FEWEST_LINES,
    REACH,
    ModeSignificance,
    SignificanceRules,
    mode_significance,
)
from chladni.modal.fit.fitted_modes import FittedModes
from chladni.modal.fit.lsfd import least_squares_frequency_domain
from chladni.modal.fit.synthesis import modal_fit
from chladni.signals.arrays import Complex, Index, Mask, Real
from chladni.signals.frequency_response import FrequencyResponse
from chladni.spectral.forms import ORDER, form

# A pole whose sigma is this part of its half-power width, or of a line where that is more, isn't known to be one; the
# same for the width.
UNSURE = 0.5
# Two poles within so many sigmas with shapes so much alike are one.
SAME_SIGMAS, SAME_MAC = 2.0, 0.9
# Each refinement may take a few modes along; more rounds than this would only shuffle them.
ROUNDS = 8
STEPS = 15


def needed_modes(
    lines: JudgedLines, poles: Complex, participation: Complex, rules: SignificanceRules, *, always: Mask
) -> Mask:
    """Leave out the modes that the data don't need, the least significant of each neighbourhood first.

    Parameters
    ----------
    lines
        What was measured.
    poles, participation
        ``[mode]`` in rad/s and ``[mode, reference]``.
    rules
        What a mode must show.
    always
        ``[mode]`` that were asked for and stay in any case.

    Returns
    -------
    ndarray
        ``[mode]`` whether it stays.
    """
    kept = np.ones(poles.size, bool)
    passes, chance = np.zeros(poles.size, bool), np.zeros(poles.size)
    stale = np.arange(poles.size)
    while stale.size:
        rows = np.flatnonzero(kept)
        found = mode_significance(lines, poles[rows], participation[rows], modes=np.searchsorted(rows, stale))
        passes[stale] = found.passes(rules)
        chance[stale] = found.log_false_alarm - 1e-3 * found.contribution
        failing = rows[~passes[rows] & ~always[rows]]
        dropped = _one_of_each_place(poles, failing[np.argsort(-chance[failing], kind="stable")])
        kept[dropped] = False
        # Only what shared lines with those that went looks different now.
        stale = np.flatnonzero(kept & _sharing_lines(lines, poles, dropped))
    return kept


def _sharing_lines(lines: JudgedLines, poles: Complex, others: list[int]) -> Mask:
    reach = np.maximum(-REACH * poles.real, pi * FEWEST_LINES * lines.step_hz)
    apart = np.abs(poles.imag[:, None] - poles.imag[others])
    return np.asarray(np.any(apart <= 2 * (reach[:, None] + reach[others]), axis=1))


def _one_of_each_place(poles: Complex, worst_first: Index) -> list[int]:
    """Modes that don't share lines: each of two that explain one peak looks needless as long as both are there."""
    chosen: list[int] = []
    for mode in worst_first:
        apart = np.abs(poles[chosen].imag - poles[mode].imag)
        if np.all(apart > -REACH * (poles[chosen].real + poles[mode].real)):
            chosen.append(int(mode))
    return chosen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PrunedFit:
    """Modes that stood up to the data.

    Attributes
    ----------
    fitted
        Of maximum likelihood; None when no mode is left.
    significance
        How much the data need each mode.
    started
        ``[mode]`` candidate that each mode began as.
    unresolved
        ``[mode]`` poles in rad/s that the data need, but whose place or width they don't tell: left out.
    """

    fitted: FittedModes | None
    significance: ModeSignificance
    started: Index
    unresolved: Complex


def explained(
    response: FrequencyResponse, lines: JudgedLines, found: Candidates, rules: SignificanceRules
) -> Complex:
    """``[response, reference, line]`` receptance of the candidates that the data need, without refinement."""
    kept = needed_modes(lines, found.pole, found.vector, rules, always=found.asked)
    if not kept.any():
        return np.zeros_like(lines.values)
    factor = (2j * pi * lines.frequency_hz) ** ORDER[form(response)]
    model = least_squares_frequency_domain(response, found.pole[kept], found.vector[kept])
    return np.asarray(modal_fit(response, model).synthesised / factor)


def pruned_fit(
    response: FrequencyResponse, lines: JudgedLines, candidates: Candidates, rules: SignificanceRules
) -> PrunedFit:
    """Refine candidates by maximum likelihood and leave out those that don't stand up to it, until all do."""
    poles, participation, always = candidates.pole, candidates.vector, candidates.asked
    started = np.flatnonzero(needed_modes(lines, poles, participation, rules, always=always))
    poles, participation, always = poles[started], participation[started], always[started]
    fitted: FittedModes | None = None
    unresolved = np.zeros(0, np.complex128)
    significance = mode_significance(lines, poles, participation, modes=np.zeros(0, np.intp))
    for _ in range(ROUNDS):
        if not poles.size:
            break
        refined = grouped_refinement(response, poles, participation, max_iterations=STEPS)
        poles, participation = refined.model.poles, np.asarray(refined.model.participation, dtype=np.complex128)
        found = mode_significance(lines, poles, participation)
        started, always = started[refined.kept], always[refined.kept]
        stays = always | ~_doubtful(lines, refined, found, rules)
        blurred = ~stays & found.passes(rules) & (_doubt(lines, refined) > 1)
        unresolved = np.append(unresolved, poles[blurred])
        # After the last round what still doesn't stand up goes, without another fit of the rest.
        fitted, significance = select_modes(refined, stays), found.select(stays)
        poles, participation, started, always = poles[stays], participation[stays], started[stays], always[stays]
        if stays.all():
            break
    return PrunedFit(
        fitted=fitted if started.size else None, significance=significance, started=started, unresolved=unresolved
    )


def _doubtful(lines: JudgedLines, fitted: FittedModes, found: ModeSignificance, rules: SignificanceRules) -> Mask:
    """Modes to leave out next: all outside the band, else the worst of each neighbourhood."""
    frequency_hz = fitted.model.frequency_hz
    outside = (frequency_hz < lines.frequency_hz[0]) | (frequency_hz > lines.frequency_hz[-1])
    # A fit that has a mode too many uses it up as a background.
    outside |= fitted.model.damping_ratio > rules.damping
    if outside.any():
        return np.asarray(outside)
    failing = (_doubt(lines, fitted) > 1) | ~found.passes(rules) | _twins(fitted, found)
    # Among those that fail the least significant goes first; what its neighbour then shows decides on that.
    rows = np.flatnonzero(failing)
    worst_first = rows[np.argsort(-found.log_false_alarm[rows], kind="stable")]
    doubtful = np.zeros(frequency_hz.size, bool)
    doubtful[_one_of_each_place(fitted.model.poles, worst_first)] = True
    return doubtful


def _doubt(lines: JudgedLines, fitted: FittedModes) -> Real:
    """``[mode]`` sigma of place and width over what it may be at most; above 1 the pole isn't known to be one.

    Of a mode narrower than a line the lines tell where it is, and that its damping is small.
    """
    frequency_hz, damping_ratio = fitted.model.frequency_hz, fitted.model.damping_ratio
    width_hz = np.maximum(2 * damping_ratio * frequency_hz, lines.step_hz)
    doubt = np.maximum(fitted.frequency_std_hz, 2 * fitted.damping_std * frequency_hz) / (UNSURE * width_hz)
    return np.where(np.isfinite(doubt), doubt, np.inf)


def _twins(fitted: FittedModes, found: ModeSignificance) -> Mask:
    """The weaker of each two modes that their own sigmas don't tell apart and whose shapes are alike."""
    model = fitted.model
    frequency_hz, std = model.frequency_hz, fitted.frequency_std_hz
    twins = np.zeros(frequency_hz.size, bool)
    close = np.abs(frequency_hz[:, None] - frequency_hz) <= SAME_SIGMAS * np.hypot(std[:, None], std)
    length = np.linalg.norm(model.shapes, axis=1)
    likeness = np.abs(model.shapes.conj() @ model.shapes.T) ** 2 / np.outer(length, length) ** 2
    for one, other in np.argwhere(np.triu(close & (likeness > SAME_MAC), 1)):
        twins[one if found.log_false_alarm[one] > found.log_false_alarm[other] else other] = True
    return twins
