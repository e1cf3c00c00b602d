"""Modes and numbers with error bars, as sentences name them."""

from collections.abc import Sequence

from chladni.signals.mode_set import ModeSet


def mode_name(modes: ModeSet, row: int) -> str:
    """Name one mode by number, counted from 1, and frequency: ``mode 2 (3.962 Hz)``."""
    return f"mode {row + 1} ({modes.frequency_hz[row]:.4g} Hz)"


def mode_names(modes: ModeSet, rows: Sequence[int]) -> str:
    """Name several modes: ``modes 1, 2 and 4 (3.47, 3.962 and 6.61 Hz)``."""
    if len(rows) == 1:
        return mode_name(modes, rows[0])
    numbers = joined([str(row + 1) for row in rows])
    return f"modes {numbers} ({joined([f'{modes.frequency_hz[row]:.4g}' for row in rows])} Hz)"


def synthesised_from(modes: ModeSet) -> str:
    """Name what the synthesis of the modes' fit is made of: ``the modes and 7 further poles that were found``."""
    others = 0 if modes.fit is None else modes.fit.others(modes.frequency_hz.size)
    which = "the mode" if modes.frequency_hz.size == 1 else "the modes"
    if not others:
        return which
    further = "one further pole that was" if others == 1 else f"{others} further poles that were"
    return f"{which} and {further} found"


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
