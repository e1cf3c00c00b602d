"""Doubts that come before any answer: a model that runs away, a log that is short, a scale that isn't the model's."""

from collections.abc import Sequence
from math import exp

import numpy as np

from chladni.gap.calibration import EFFECTIVE_SAMPLES, LISTED, MOST, SLIP, TIMES, UNNOTICED, USUAL_S
from chladni.gap.records.measurement import Measurement
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.stability import growing_poles
from chladni.models.effects.wrong_unit import PREFIXES, is_apart, near, short
from chladni.signals.arrays import Complex, Real


def instability(name: str, compiled: CompiledModel) -> str | None:
    """Say that a model is unstable, with its poles and what to check; None when it isn't.

    An axis that is free to move away isn't: its poles lie at 0.
    """
    poles = growing_poles(compiled)
    if not poles.size:
        return None
    return (
        f"model {name!r} is unstable: {_told(poles)}; what it predicts holds for short windows only, and an effect "
        "may be named because it steadies the model: check the gains, signs and units of its loops, unless the "
        "machine runs away too"
    )


def instability_found(nominal: CompiledModel, found: CompiledModel) -> str | None:
    """Say where the values and effects that were found change whether a model is stable, None where they don't."""
    before, after = growing_poles(nominal), growing_poles(found)
    if after.size and not before.size:
        return (
            f"with the values and effects that were found the model is unstable: {_told(after)}; simulated with them "
            "it runs away, unless a law limits it"
        )
    if before.size and not after.size:
        return "with the values and effects that were found the model is stable"
    return None


def _told(poles: Complex) -> str:
    """Poles from the fastest growing one on, and how fast that is."""
    ordered = poles[np.argsort(-poles.real)]
    listed = ", ".join(_pole(pole) for pole in ordered[:LISTED])
    more = "" if poles.size <= LISTED else f" and {poles.size - LISTED} more"
    word = "a pole" if poles.size == 1 else "poles"
    return f"{word} at {listed}{more} rad/s, so that any error grows e-fold in {1.0 / ordered[0].real:.2g} s"


def _pole(pole: complex) -> str:
    return f"{pole.real:.4g}" if pole.imag == 0 else f"{pole.real:.4g} ± {pole.imag:.4g}j"


def shortness(compiled: CompiledModel, measurement: Measurement) -> str | None:
    """Say how a log is too short for any name to be sure, None when it isn't.

    What lasts less than the model's own motion looks like a start, a trend, a gain: many causes make the same few
    samples, and each follows them down to the noise.
    """
    duration_s, found = measurement.duration_s, []
    if measurement.samples < EFFECTIVE_SAMPLES:
        found.append(f"{measurement.samples} samples, where {EFFECTIVE_SAMPLES} or more tell more")
    modes_hz, shown_s = modes_of(compiled), _shown_s(compiled)
    if duration_s < shown_s and modes_hz.size:
        cycles = f"{duration_s * modes_hz.min():.2g} cycles of the lowest mode ({modes_hz.min():.3g} Hz)"
        found.append(f"{duration_s:.3g} s hold {cycles}, where {TIMES:g} or more tell more")
    elif duration_s < shown_s:
        found.append(f"{duration_s:.3g} s, where the model shows what it does of itself in {shown_s:.2g} s")
    if not found:
        return None
    return (
        f"{measurement.log} is short: {'; '.join(found)}; many causes follow so few samples; take a longer part, "
        "or record longer"
    )


def modes_of(compiled: CompiledModel) -> Real:
    """Natural frequencies of the model's vibrating modes in Hz, one for each pair of poles."""
    poles = _poles(compiled)
    vibrating = poles.imag > UNNOTICED * float(np.abs(poles).max(initial=0.0))
    return np.asarray(np.abs(poles[vibrating]) / (2 * np.pi))


def _shown_s(compiled: CompiledModel) -> float:
    """Seconds in which a model shows what it does of itself; 0 when nothing in it moves by itself."""
    poles, modes_hz = _poles(compiled), modes_of(compiled)
    if not poles.size:
        return 0.0
    if modes_hz.size:
        return TIMES / float(modes_hz.min())
    rates = np.abs(poles)
    slowest = float(rates[rates > UNNOTICED * rates.max()].min(initial=np.inf))
    return min(USUAL_S, TIMES / slowest) if np.isfinite(slowest) else USUAL_S


def _poles(compiled: CompiledModel) -> Complex:
    return np.asarray(np.linalg.eigvals(compiled.a) if compiled.states else [], dtype=np.complex128)


def scale_doubt(measured: Real, simulated: Real, output_names: Sequence[str]) -> str | None:
    """Give a sentence on the output whose scale differs most, None where all agree within a factor of 30.

    A signal that the model gives in another shape tells nothing of its scale.

    Parameters
    ----------
    measured, simulated
        ``[output, sample]``, the latter of the nominal model.

    Examples
    --------
    >>> metres = np.sin(np.arange(100.0))[None]
    >>> scale_doubt(metres, 1.5 * metres, ["rod"])
    >>> print(scale_doubt(200.0 * metres, metres, ["rod"]))
    At rod the model as it is gives 0.005 times what was measured: check its channel and unit, and the inputs'.
    """
    own, made = (one - one.mean(axis=1, keepdims=True) for one in (measured, simulated))
    ratios = {
        name: float(np.std(one) / np.std(other))
        for name, one, other in zip(output_names, made, own, strict=True)
        if abs(one @ other) > MOST * float(np.linalg.norm(one) * np.linalg.norm(other))
    }
    worst = max(ratios, key=lambda name: abs(np.log(ratios[name])), default=None)
    if worst is None or not is_apart(ratios[worst]):
        return None
    like = (f"; about the factor {words}" for factor, words in PREFIXES if near(ratios[worst], factor, exp(SLIP)))
    return (
        f"At {worst} the model as it is gives {short(ratios[worst])} times what was measured: "
        f"check its channel and unit, and the inputs'{next(like, '')}."
    )
