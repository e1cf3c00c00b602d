"""Checks of a set of modes: what tells whether they can be trusted, and sentences where they can't."""

from collections.abc import Sequence

import numpy as np

from chladni.modal.shapes.complexity import deviation_from_noise, mean_phase, phase_collinearity
from chladni.modal.shapes.distinguishability import alike_modes, alike_sentence
from chladni.modal.shapes.mac import auto_mac
from chladni.modal.shapes.mode_words import capital, joined, mode_name, mode_names
from chladni.signals.arrays import Mask, Real
from chladni.signals.modal_fit import ModalFit
from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.signals.order_spread import OrderSpread
from chladni.signals.wording import counted

# Beyond these a finding is written; each sentence gives the number it found and the one it went by.
_COLLINEAR = 0.9
_HIGH_DAMPING = 0.1
_WIDE_FREQUENCY = 0.01
_WIDE_DAMPING = 0.3
_WIDE_SHAPE = 0.1
_FIT_ERROR = 0.2
_FEWEST_ORDERS = 4
_FEW_ORDERS = 0.25
# Two estimates of one frequency differ by more than this in 3 of 1000 cases.
_SAME_MODE_SIGMA = 3.0
_SCATTER = 3.0


def validate(modes: ModeSet) -> ModeValidation:
    """Check modes: AutoMAC, collinearity, phases, and findings for whoever must rely on them.

    Returns
    -------
    ModeValidation
        Its findings, the gravest first: one mode found twice, shapes that these sensors can't tell apart, too few
        sensors, synthesis errors of functions and bands above 20 %, modes of few model orders or of a scatter over
        the orders that exceeds the error bar, damping ratios above 10 %, wide or missing error bars, complex shapes
        (MPC below 0.9).

    Examples
    --------
    >>> from chladni.signals.channel import Channel
    >>> from chladni.signals.provenance import Provenance
    >>> one = np.ones(1)
    >>> found = validate(
    ...     ModeSet(
    ...         frequency_hz=10 * one, frequency_std_hz=0.01 * one, damping_ratio=0.01 * one, damping_std=1e-4 * one,
    ...         shapes=np.array([[1.0, 0.8j]]), shape_std=np.zeros((1, 2), complex),
    ...         channels=(Channel(name="a"), Channel(name="b")), provenance=Provenance(),
    ...     )
    ... )
    >>> found.mpc.round(3), len(found.findings)
    (array([0.048]), 1)
    """
    likeness = auto_mac(modes)
    collinearity = phase_collinearity(modes.shapes)
    phase = mean_phase(modes.shapes)
    alike = alike_modes(modes)
    findings = (
        *_found_twice(modes, alike),
        *((alike_sentence(modes, alike, likeness),) if alike else ()),
        *_few_sensors(modes),
        *_poor_fit(modes),
        *_poor_support(modes),
        *_high_damping(modes),
        *_wide_error_bars(modes),
        *_complex_shapes(modes, collinearity, phase.deviation_deg),
    )
    return ModeValidation(
        auto_mac=likeness,
        mpc=collinearity,
        mpd_deg=phase.deviation_deg,
        mean_phase_deg=phase.phase_deg,
        alike=alike,
        findings=findings,
    )


def _found_twice(modes: ModeSet, alike: Sequence[tuple[int, int]]) -> list[str]:
    sentences = []
    for first, second in alike:
        apart_hz = abs(modes.frequency_hz[second] - modes.frequency_hz[first])
        std_hz = float(np.hypot(modes.frequency_std_hz[first], modes.frequency_std_hz[second]))
        if apart_hz <= _SAME_MODE_SIGMA * std_hz:
            sentences.append(
                f"{capital(mode_names(modes, (first, second)))} may be one mode found twice: their frequencies "
                f"differ by {apart_hz:.2g} Hz, within {_SAME_MODE_SIGMA:g} sigma ({std_hz:.2g} Hz each), and so do "
                "their shapes; take one, or measure longer."
            )
    return sentences


def _few_sensors(modes: ModeSet) -> list[str]:
    sensors, found = len(modes.channels), modes.frequency_hz.size
    # More shapes than components are linearly dependent, whatever the structure.
    if sensors >= found:
        return []
    sentence = (
        f"{counted(sensors, 'channel')} for {counted(found, 'mode')}: shapes of so few components can't be "
        "independent of each other; give at least as many sensors as modes, spread over the structure."
    )
    return [sentence]


def _poor_fit(modes: ModeSet) -> list[str]:
    fit = modes.fit
    if fit is None:
        return []
    poor = np.flatnonzero(fit.band_error > _FIT_ERROR)
    if not poor.size:
        return _poor_functions(modes, fit)
    worst_first = poor[np.argsort(-fit.band_error[poor], kind="stable")]
    named = [
        f"between {fit.bands_hz[band, 0]:.4g} and {fit.bands_hz[band, 1]:.4g} Hz ({100 * fit.band_error[band]:.0f} %)"
        for band in worst_first
    ]
    sentence = (
        f"The synthesis is off by more than {100 * _FIT_ERROR:.0f} % (RMS over RMS) {joined(named, most=3)}: noise, "
        "a missing mode, or a structure that isn't linear; look at the coherence, fit that band alone, or allow a "
        "higher model order."
    )
    return [*_poor_functions(modes, fit), sentence]


def _poor_functions(modes: ModeSet, fit: ModalFit) -> list[str]:
    poor = np.argwhere(fit.function_error > _FIT_ERROR)
    if not poor.size:
        return []
    worst_first = poor[np.argsort(-fit.function_error[tuple(poor.T)], kind="stable")]
    named = [
        f"{modes.channels[row].name} over {modes.references[column].name} "
        f"({100 * fit.function_error[row, column]:.0f} %)"
        for row, column in worst_first
    ]
    sentence = (
        f"The synthesis misses {joined(named, most=4)} by more than {100 * _FIT_ERROR:.0f} %: noise, overload or a "
        "wrong direction there; look at their coherence before their shape components are believed."
    )
    return [sentence]


def _poor_support(modes: ModeSet) -> list[str]:
    spread = modes.spread
    if spread is None or spread.orders.size == 0:
        return []
    sentences = []
    # A few orders in a row agree by chance; how many there could be depends on the orders that were tried.
    least = max(_FEWEST_ORDERS, _FEW_ORDERS * spread.orders.max())
    few = np.flatnonzero(spread.orders < least)
    if few.size:
        counts = joined([str(spread.orders[row]) for row in few])
        sentences.append(
            f"{capital(mode_names(modes, few.tolist()))} came out at only {counts} model orders (the best "
            f"supported at {spread.orders.max()}): look at the stabilisation diagram before believing it."
        )
    # Modes from functions are refined together: how the poles that they began from scatter says nothing of them.
    return sentences if modes.references else sentences + _scatter(modes, spread)


def _scatter(modes: ModeSet, spread: OrderSpread) -> list[str]:
    wide = np.flatnonzero(
        (spread.frequency_std_hz > _SCATTER * modes.frequency_std_hz)
        | (spread.damping_std > _SCATTER * modes.damping_std)
    )
    if not wide.size:
        return []
    sentence = (
        f"{capital(mode_names(modes, wide.tolist()))}: the scatter over model orders exceeds {_SCATTER:g} times "
        "the error bar, which counts random errors only: leakage, nonlinearity or a neighbouring mode adds to it."
    )
    return [sentence]


def _high_damping(modes: ModeSet) -> list[str]:
    return [
        f"{capital(mode_name(modes, row))} has a damping ratio of {100 * modes.damping_ratio[row]:.3g} %: above "
        f"{100 * _HIGH_DAMPING:.0f} % it's seldom a structural mode, but a drive's control loop, a filter or a "
        "residual of modes outside the band."
        for row in np.flatnonzero(modes.damping_ratio > _HIGH_DAMPING).tolist()
    ]


def _wide_error_bars(modes: ModeSet) -> list[str]:
    sentences = []
    # A missing error bar is told once, not as one that is too wide.
    known = _has_error_bar(modes)
    if not known.all():
        unknown = np.flatnonzero(~known).tolist()
        sentences.append(f"{capital(mode_names(modes, unknown))}: the error bars are unknown.")
    checks: tuple[tuple[str, Real, float], ...] = (
        ("frequency", modes.frequency_std_hz / modes.frequency_hz, _WIDE_FREQUENCY),
        ("damping", modes.damping_std / np.maximum(np.abs(modes.damping_ratio), 1e-12), _WIDE_DAMPING),
        ("shape", _largest_shape_std(modes), _WIDE_SHAPE),
    )
    for what, relative, limit in checks:
        wide = np.flatnonzero(known & (relative > limit))
        if wide.size:
            sizes = joined([f"{100 * relative[row]:.2g}" for row in wide])
            sentences.append(
                f"{capital(mode_names(modes, wide.tolist()))}: one sigma of the {what} is {sizes} % "
                f"(limit {100 * limit:.0f} %): average longer, take closer lines, or excite that mode more."
            )
    return sentences


def _has_error_bar(modes: ModeSet) -> Mask:
    numbers = (modes.frequency_std_hz, modes.damping_std, _largest_shape_std(modes))
    return np.asarray(np.isfinite(np.stack(numbers)).all(axis=0), dtype=np.bool_)


def _largest_shape_std(modes: ModeSet) -> Real:
    # hypot passes NaN and infinity on, where abs of a complex number would warn.
    return np.asarray(np.hypot(modes.shape_std.real, modes.shape_std.imag).max(axis=1), dtype=np.float64)


def _complex_shapes(modes: ModeSet, collinearity: Real, deviation_deg: Real) -> list[str]:
    # Two means of the deviation that error bars give alone: beyond, the phases are the structure's, not the noise's.
    explained_deg = 2 * deviation_from_noise(modes.shapes, modes.shape_std)
    sentences = []
    for row in np.flatnonzero(collinearity < _COLLINEAR).tolist():
        start = (
            f"{capital(mode_name(modes, row))}: the phases of its shape are not collinear (MPC "
            f"{collinearity[row]:.2f}, limit {_COLLINEAR:g}; MPD {deviation_deg[row]:.0f} degrees)"
        )
        if deviation_deg[row] <= explained_deg[row]:
            sentences.append(f"{start}; the error bars of the shape explain it.")
        else:
            sentences.append(
                f"{start}, more than its error bars explain: a complex mode (a damper, a drive, a close neighbour), "
                "a time shift between channels, or a poor fit."
            )
    return sentences
