"""Whether a model and a log are of one scale at all: what a wrong unit or channel does."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]
#: Factor between model and log beyond which no effect explains it; least correlation that says it's one signal.
_APART, _ALIKE = 30.0, 0.5
#: What prefixes, and units, are apart, as a factor and in words.
_PREFIXES = ((1e3, "of a prefix such as mm for m or kN for N"), (1e6, "of a prefix such as um for m or MN for N"))
_CONVERSIONS = (
    *_PREFIXES,
    (180 / np.pi, "between degrees and rad"),
    (9.80665, "between g and m/s^2"),
)
#: A fitted factor that is so near to a conversion, over it, is one; a model's scale, only so near to it.
_EXACTLY, _ROUGHLY = 0.02, 2.0


def scale_doubt(measured: Matrix, simulated: Matrix, output_names: Sequence[str]) -> str | None:
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
        if abs(one @ other) > _ALIKE * float(np.linalg.norm(one) * np.linalg.norm(other))
    }
    worst = max(ratios, key=lambda name: abs(np.log(ratios[name])), default=None)
    if worst is None or not _is_apart(ratios[worst]):
        return None
    like = (f"; about the factor {words}" for factor, words in _PREFIXES if _near(ratios[worst], factor, _ROUGHLY))
    return (
        f"At {worst} the model as it is gives {_short(ratios[worst])} times what was measured: "
        f"check its channel and unit, and the inputs'{next(like, '')}."
    )


def gain_doubt(site: str, gain: float) -> str | None:
    """Give a sentence on a fitted gain that a wrong unit rather than a sensitivity has.

    Examples
    --------
    >>> gain_doubt("tip", 1.3)
    >>> print(gain_doubt("tip", -0.102))
    A gain of -0.102 at tip is the factor between g and m/s^2: check the unit of its channel.
    >>> print(gain_doubt("motor", 7.1e-4))
    A gain of 0.00071 at motor is rather that of a wrong unit: check the unit of its channel.
    """
    if gain == 0.0:
        return None
    for factor, words in _CONVERSIONS:
        if _near(abs(gain), factor, 1.0 + _EXACTLY):
            return f"A gain of {gain:.3g} at {site} is the factor {words}: check the unit of its channel."
    if not _is_apart(abs(gain)):
        return None
    return f"A gain of {_short(gain)} at {site} is rather that of a wrong unit: check the unit of its channel."


def mass_doubt(site: str, added: float, modelled: float, unit: str) -> str | None:
    """Give a sentence on an added mass that is many times what the model has there.

    Examples
    --------
    >>> mass_doubt("carriage", 10.0, 5.0, "kg")
    >>> print(mass_doubt("carriage", 101.2, 0.095, "kg"))
    What is added at carriage is 1100 times the 0.095 kg that the model has there: check that number and its unit.
    """
    if not added > _APART * modelled > 0:
        return None
    return (
        f"What is added at {site} is {_short(added / modelled)} times the {modelled:.3g} {unit} that the model has "
        "there: check that number and its unit."
    )


def _is_apart(ratio: float) -> bool:
    return not 1 / _APART < ratio < _APART


def _near(ratio: float, factor: float, within: float) -> bool:
    return any(1 / within < ratio / one < within for one in (factor, 1 / factor))


def _short(value: float) -> str:
    """Two digits, without an exponent where there need be none."""
    return f"{float(f'{value:.2g}'):g}"
