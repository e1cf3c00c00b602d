"""Which modes the sensors can't tell apart by their shapes."""

from collections.abc import Sequence

import numpy as np

from chladni.modal.shapes.mac import auto_mac
from chladni.modal.shapes.mode_words import joined
from chladni.signals.arrays import Real
from chladni.signals.mode_set import ModeSet
from chladni.signals.wording import counted

ALIKE_MAC = 0.9
"""MAC from which two shapes count as the same vector (Allemang 2003)."""

_SIGNIFICANCE = 0.05
_MOST_PAIRS = 4


def alike_modes(modes: ModeSet, *, limit: float = ALIKE_MAC) -> tuple[tuple[int, int], ...]:
    """Find the pairs of modes whose shapes these sensors can't tell apart.

    A pair is alike when its MAC is `limit` or more, whatever the precision: neighbouring modes of a structure have
    different shapes, and sensors that don't show it stand in the wrong places. It is alike, too, when the difference
    that remains is one that the error bars of the shapes explain.

    Parameters
    ----------
    limit
        0 to 1.

    Returns
    -------
    Pairs of rows (first < second), the greatest MAC first.

    Notes
    -----
    1 - MAC is the squared sine of the angle between two shapes. When both are the same vector with independent
    errors, its mean is sum(var_a)/norm(a)^2 + sum(var_b)/norm(b)^2 (real and imaginary parts together) and it
    scatters as chi-squared with 2 (channels - 1) degrees of freedom; beyond the 95 % point of that, the shapes
    differ.
    """
    likeness = auto_mac(modes)
    explained = 1.0 - likeness <= _sine_squared_of_noise(modes)
    # The upper triangle: a pair is named once, and no mode is like itself.
    first, second = np.nonzero(np.triu((likeness >= limit) | explained, k=1))
    by_likeness = np.argsort(-likeness[first, second], kind="stable")
    return tuple((int(first[pair]), int(second[pair])) for pair in by_likeness)


def alike_sentence(
    modes: ModeSet, pairs: Sequence[tuple[int, int]], likeness: Real, *, limit: float = ALIKE_MAC
) -> str:
    """Say which modes are alike, why, and what to do; `pairs` must not be empty, `likeness` is their AutoMAC."""
    count = modes.frequency_hz.size
    values = [float(likeness[pair]) for pair in pairs]
    if count > 2 and len(pairs) == count * (count - 1) // 2:
        which = f"any two of the {count} modes apart (MAC {min(values):.2f} to {max(values):.2f})"
    else:
        which = f"modes {joined(_named(modes, pairs, likeness), most=_MOST_PAIRS)} apart"
    sensors = counted(len(modes.channels), "channel")
    verb = "doesn't" if len(modes.channels) == 1 else "don't"
    blurred = min(values) < limit
    reason = "; where the MAC is lower, the error bars of the shapes hide the difference" if blurred else ""
    return (
        f"{sensors} {verb} tell the shapes of {which}{reason}. Their "
        "frequencies and damping stand; don't rely on their shapes, on a MAC or on relative motion until sensors at "
        "further points or directions tell them apart."
    )


def _named(modes: ModeSet, pairs: Sequence[tuple[int, int]], likeness: Real) -> list[str]:
    return [
        f"{first + 1} and {second + 1} ({modes.frequency_hz[first]:.4g} and {modes.frequency_hz[second]:.4g} Hz, MAC "
        f"{likeness[first, second]:.2f})"
        for first, second in pairs
    ]


def _sine_squared_of_noise(modes: ModeSet) -> Real:
    """``[mode, mode]`` the 95 % point of 1 - MAC for shapes that differ by their errors only."""
    variance = np.nansum(np.abs(modes.shape_std) ** 2, axis=1) / np.sum(np.abs(modes.shapes) ** 2, axis=1)
    freedom = 2 * (len(modes.channels) - 1)
    # One component is 1 in every shape: the MAC is 1 whatever the errors.
    if freedom == 0:
        return np.zeros((variance.size, variance.size))
    # Imported here: it takes longer than all the rest of a validation.
    from scipy.special import chdtri

    quantile = float(chdtri(freedom, _SIGNIFICANCE)) / freedom
    return np.asarray(quantile * (variance[:, np.newaxis] + variance), dtype=np.float64)
