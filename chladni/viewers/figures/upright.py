"""Frequencies written upright above the frame, crossed by no line."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from chladni.viewers.figures.peak_labels import LETTERS_POINTS
from chladni.viewers.mode_tables import hertz
from chladni.viewers.spread import spread

# Share of the axis that an upright name takes.
ROOM = 0.022
GAP_POINTS = 3.0
# "0.1234 Hz", the longest name.
STRIP_POINTS = 35.0


def name_above(axes: Axes, names: Sequence[tuple[float, str]]) -> float:
    """Write frequencies, each in its colour, above the frame; one without room is left out, its line stays.

    Returns
    -------
    float
        Points that the names take above the frame; 0 when there are none.
    """
    low, high = axes.get_xlim()
    shown = [(at, colour) for at, colour in names if low <= at <= high]
    if not shown:
        return 0.0
    at_hz = np.array([at for at, _ in shown])
    if axes.get_xscale() == "log":
        low, high, at_hz = np.log(low), np.log(high), np.log(at_hz)
    places = np.column_stack([(at_hz - low) / (high - low), np.zeros(at_hz.size)])
    for row in spread(places, apart=(ROOM, 1.0)):
        at, colour = shown[row]
        axes.annotate(
            f"{hertz(at)} Hz",
            (float(places[row, 0]), 1.0),
            xytext=(0.0, GAP_POINTS),
            xycoords="axes fraction",
            textcoords="offset points",
            rotation=90,
            ha="center",
            va="bottom",
            fontsize=LETTERS_POINTS,
            color=colour,
        )
    return STRIP_POINTS
