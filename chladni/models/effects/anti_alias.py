"""Anti-alias filter: a steep low-pass in front of a converter, or behind one, that other channels don't have."""

from collections.abc import Iterator
from dataclasses import replace
from math import pi, sin

import numpy as np

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.effects.attaching import pass_through
from chladni.models.effects.clues import Clues, FittedForm
from chladni.models.effects.effect_kind import EffectKind, Site, Values, Variant
from chladni.models.effects.linear_filter import first_order, second_order
from chladni.models.effects.trial import Trial, TrialMotion, numbers, shaped
from chladni.signals.arrays import Complex

#: Hz; a filter as fast as that is none.
_NONE_HZ = 1e9
#: Share of its power, at the highest frequency that moved, that a filter must take to be told from a delay.
_SEEN = 0.1


def damping_ratios(order: int) -> list[float]:
    """Give those of Butterworth's pairs of poles: ``sin((2 k - 1) pi/(2 n))``; of an odd order a real pole is left.

    Examples
    --------
    >>> [round(one, 4) for one in damping_ratios(4)]
    [0.3827, 0.9239]
    """
    return [sin((2 * k - 1) * pi / (2 * order)) for k in range(1, order // 2 + 1)]


def attach(compiled: CompiledModel, site: Site, values: Values) -> CompiledModel:
    """Put the filter's stages one behind another."""
    if values["corner"] >= _NONE_HZ:
        return compiled
    omega, order = 2 * pi * values["corner"], int(values["order"])
    for damping_ratio in damping_ratios(order):
        compiled = pass_through(compiled, site, second_order(omega, damping_ratio))
    return pass_through(compiled, site, first_order(1 / omega)) if order % 2 else compiled


def response(s: Complex, corner_hz: float, order: int) -> Complex:
    """Give the filter's response at ``s = j omega``."""
    p = s / (2 * pi * corner_hz)
    gain = np.ones_like(p) if order % 2 == 0 else 1 / (p + 1)
    for damping_ratio in damping_ratios(order):
        gain = gain / (p**2 + 2 * damping_ratio * p + 1)
    return np.asarray(gain, dtype=np.complex128)


def _is_late_only(corner_hz: float, order: float, highest_hz: float) -> bool:
    """Whether all that moved passes: what such a filter does is a delay."""
    return bool((highest_hz / corner_hz) ** (2 * order) < _SEEN)


def _is_degenerate(fitted: FittedForm) -> bool:
    return _is_late_only(fitted.values["corner"], fitted.values["order"], fitted.band_hz[1])


def _trials(motion: TrialMotion) -> Iterator[Trial]:
    if motion.is_still:
        return
    corners = (motion.sample_rate_hz * np.geomspace(0.02, 2.0, 20)).tolist()
    yield from (_trial(motion, corners, order) for order in (2, 4, 6, 8))


def _trial(motion: TrialMotion, corners: list[float], order: int) -> Trial:
    signal, s = motion.spectrum(motion.displacement), motion.s
    found = shaped(lambda corner: signal * (response(s, corner, order) - 1), corners, "corner")
    return replace(found, values=lambda shape, _: {"corner": numbers(shape)[0], "order": float(order)})


def _check(values: Values) -> str:
    return "" if values["order"] == int(values["order"]) else f"order = {values['order']:g} must be a whole number"


ANTI_ALIAS = EffectKind(
    name="anti_alias",
    said="an anti-alias filter",
    family="sensor",
    meaning="a steep low-pass that the other channels don't have",
    sites=("output", "input"),
    parameters=Parameters(
        (
            Parameter(
                name="corner", value=200.0, unit="Hz", low=1.0, high=1e5, minimum=1e-6, maximum=_NONE_HZ,
                meaning="where 3 dB are lost",
            ),
            Parameter(
                name="order", value=4.0, unit="1", low=2.0, high=8.0, minimum=2.0, maximum=8.0, role="function",
                meaning="a whole number of poles",
            ),
        )
    ),
    optional=("order",),
    neutral={"corner": _NONE_HZ},
    linear=True,
    check=_check,
    clues=Clues(trials=_trials, is_degenerate=_is_degenerate),
    variants=(
        Variant(
            name="butterworth",
            attach=attach,
            formula="|y_recorded/y|^2 = 1/(1 + (f/corner)^(2 order)), poles as Butterworth's",
        ),
    ),
)  # fmt: skip
