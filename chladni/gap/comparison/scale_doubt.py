"""Whether a model and a log are of one scale at all: what a wrong unit or channel does."""

from collections.abc import Sequence
from math import exp

import numpy as np

from chladni.gap.calibration import MOST, SLIP
from chladni.models.effects.wrong_unit import PREFIXES, is_apart, near, short
from chladni.signals.arrays import Real


def scale_doubt(measured: Real, simulated: Real, output_names: Sequence[str]) -> str | None:
    """Give a sentence on the output whose scale differs most, None where all agree within a factor of 30.

    A signal that the model gives in another shape tells nothing of its scale.

    Parameters
    ----------
    measured, simulated
        ``[output, sample]``, the latter of the nominal model.
    output_names
        Of the rows.

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
