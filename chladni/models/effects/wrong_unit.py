"""Factors that a wrong unit, a wrong prefix or a wrong channel makes."""

import numpy as np

#: Factor beyond which no effect explains that a number differs from another.
APART = 30.0
#: What prefixes, and units, are apart, as a factor and in words.
PREFIXES = ((1e3, "of a prefix such as mm for m or kN for N"), (1e6, "of a prefix such as um for m or MN for N"))
CONVERSIONS = (
    *PREFIXES,
    (180 / np.pi, "between degrees and rad"),
    (9.80665, "between g and m/s^2"),
)
#: A fitted factor that is so near to a conversion, over it, is one.
EXACTLY = 0.02


def is_apart(ratio: float) -> bool:
    """Whether a ratio, or its inverse, is that of a wrong scale."""
    return not 1 / APART < ratio < APART


def near(ratio: float, factor: float, within: float) -> bool:
    """Whether a ratio is a factor or its inverse, but for another factor at most."""
    return any(1 / within < ratio / one < within for one in (factor, 1 / factor))


def short(value: float) -> str:
    """Two digits, without an exponent where there need be none."""
    return f"{float(f'{value:.2g}'):g}"
