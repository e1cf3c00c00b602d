"""Whether a model runs away by itself: poles that grow."""

import numpy as np

from chladni.gap.calibration import LISTED
from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.stability import growing_poles
from chladni.signals.arrays import Complex


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
