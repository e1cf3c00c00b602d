"""Modes and numbers with error bars, as sentences name them."""

from collections.abc import Sequence
from math import floor, isfinite, log10

from chladni.signals.mode_set import ModeSet

# More are those of functions without noise, from a model, and nobody reads them.
_MOST_DECIMALS = 9


def mode_name(modes: ModeSet, row: int) -> str:
    """Name one mode by number, counted from 1, and frequency: ``mode 2 (3.962 Hz)``."""
    return f"mode {row + 1} ({modes.frequency_hz[row]:.4g} Hz)"


def mode_names(modes: ModeSet, rows: Sequence[int]) -> str:
    """Name several modes: ``modes 1, 2 and 4 (3.47, 3.962 and 6.61 Hz)``."""
    if len(rows) == 1:
        return mode_name(modes, rows[0])
    numbers = joined([str(row + 1) for row in rows])
    return f"modes {numbers} ({joined([f'{modes.frequency_hz[row]:.4g}' for row in rows])} Hz)"


def capital(text: str) -> str:
    """Begin a sentence; the rest keeps its case, which units need.

    Examples
    --------
    >>> capital("mode 1 (3 Hz)")
    'Mode 1 (3 Hz)'
    """
    return text[:1].upper() + text[1:]


def joined(words: Sequence[str], *, most: int = 6) -> str:
    """Join words with commas and an ``and``; beyond `most` the rest is counted.

    Examples
    --------
    >>> joined(["a", "b", "c"]), joined(["a", "b", "c", "d"], most=2)
    ('a, b and c', 'a, b and 2 more')
    """
    # A list that nobody reads to its end hides what stands first.
    if len(words) > most:
        words = [*words[:most], f"{len(words) - most} more"]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def with_std(number: float, std: float) -> str:
    """Give a number as far as its error bar lets it be known, two digits of which are shown.

    Examples
    --------
    >>> with_std(3.96214, 0.00372), with_std(1407.31, 12.0), with_std(2.5, float("nan")), with_std(51.5, 2e-13)
    ('3.9621 ± 0.0037', '1407 ± 12', '2.5 (no error bar)', '51.5 ± 2e-13')
    """
    if not (isfinite(std) and isfinite(number)):
        return f"{number:.4g} (no error bar)"
    if std <= 0:
        return f"{number:.6g} ± 0"
    # The second digit of the error bar is the last that says anything about the number.
    decimals = max(1 - floor(log10(std)), 0)
    if decimals > _MOST_DECIMALS:
        return f"{number:.{_MOST_DECIMALS}g} ± {std:.1g}"
    return f"{number:.{decimals}f} ± {std:.{decimals}f}"


def prefixed(number: float, unit: str) -> str:
    """Give a number of three digits with the prefix that keeps it short.

    Examples
    --------
    >>> prefixed(8342.0, "N s/m"), prefixed(275.3, "N s/m"), prefixed(5e6, "N/m"), prefixed(0.0021, "N/m")
    ('8.34 kN s/m', '275 N s/m', '5 MN/m', '0.0021 N/m')
    """
    # Rounded first: 999.6 is 1 k, not 1e+03.
    rounded = float(f"{number:.3g}")
    for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if abs(rounded) >= factor:
            return f"{rounded / factor:.3g} {prefix}{unit}"
    return f"{rounded:.3g} {unit}"


def percent_with_std(ratio: float, std: float) -> str:
    """Give a ratio in percent with its error bar.

    Examples
    --------
    >>> percent_with_std(0.0123, 0.0004)
    '1.230 ± 0.040 %'
    """
    return f"{with_std(100 * ratio, 100 * std)} %"
