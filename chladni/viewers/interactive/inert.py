"""Texts and numbers as Bokeh takes them: no text is mathematics, and no number longer than it must be."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chladni.signals.visible import visible

# Bokeh sets what stands between such pairs as TeX, and asks a server for the program that can.
_DELIMITERS = ("$$", "\\[", "\\(")
_WORD_JOINER = "\u2060"
# Of single precision's 24 bits so many are left for a step between neighbours: a thousandth of it can be told.
_STEP_BITS = 14


def inert(text: str) -> str:
    """Make a text of a figure one that is drawn as it stands.

    Examples
    --------
    >>> inert("$$x$$") == "$$x$$", inert("$$x$$").replace(chr(0x2060), "")
    (False, '$$x$$')
    """
    # matplotlib's own escapes, made for the figure; names of axes have lines, names from logs none.
    shown = "\n".join(visible(line.replace(r"\$", "$").strip()) for line in text.split("\n"))
    for pair in _DELIMITERS:
        shown = shown.replace(pair, _WORD_JOINER.join(pair))
    return shown


def packed(values: ArrayLike) -> Any:
    """Give numbers in single precision where that tells neighbours apart, and infinities as NaN."""
    array = np.array(values, dtype=np.float64)
    array[~np.isfinite(array)] = np.nan
    single = array.astype(np.float32)
    steps = np.abs(np.diff(array))
    steps = steps[steps > 0]
    known = np.abs(array[~np.isnan(array)])
    if not steps.size or not known.size:
        return single
    # By the usual step: neighbours that are nearly equal are drawn as one.
    coarse = float(known.max()) > float(np.median(steps)) * 2.0**_STEP_BITS
    small = 0 < float(known.max()) < np.finfo(np.float32).tiny or float(known.max()) > np.finfo(np.float32).max
    return array if coarse or small else single
