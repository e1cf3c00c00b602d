"""The look that all figures share: size, type, colours, legends, and text that came from a log."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.ft2font import FT2Font
from matplotlib.transforms import ScaledTranslation

from chladni.signals.visible import visible
from chladni.viewers.style import Colour

# Both columns of a journal's page; a report shows it as wide as its text.
WIDTH_IN = 7.2
# Of what is as high as it's wide: one column.
SQUARE_IN = 4.6
LEGEND_COLUMNS = 6
# Numbers and the name of an axis, and the line with its blanks beside a legend's word.
BESIDE_AXES_POINTS = 50.0
BESIDE_WORD_POINTS = 27.0
BAND_OPACITY = 0.2
# More bands than this in one plot hide the lines.
BANDS_OF = 4

# Keys are names of settings, which matplotlib types one by one.
_LOOK: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.labelsize": 8.5,
    "axes.titlesize": 8.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "lines.linewidth": 0.9,
    "lines.solid_joinstyle": "round",
    "xtick.direction": "out",
    "ytick.direction": "out",
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
}


@contextmanager
def look() -> Iterator[None]:
    """Draw with the look of chladni's figures, whatever the user's own settings are; those come back after."""
    # From the defaults, not from the user's file: a figure looks the same on every computer.
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_LOOK)
        yield


def sheet(
    heights_in: Sequence[float], *, above_points: float = 0.0, width_in: float = WIDTH_IN, **options: Any
) -> tuple[Figure, list[Axes]]:
    """Make a figure of stacked axes, one for each height, with some points more for what stands above the first."""
    # Not through pyplot: that would choose a window system and keep every figure alive.
    figure = Figure(figsize=(width_in, sum(heights_in) + above_points / 72), layout="constrained")
    axes = figure.subplots(len(heights_in), 1, squeeze=False, height_ratios=list(heights_in), **options)
    return figure, list(axes[:, 0])


def legend(axes: Axes, *, above_points: float = 0.0, mark_scale: float = 1.0) -> None:
    """Put the legend above the axes, where it can't cover data, and above what stands there already.

    `mark_scale` enlarges marks that are small for their number.
    """
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        # A legend wider than the axes would leave none of them.
        room = axes.figure.bbox.width / axes.figure.dpi * 72 - BESIDE_AXES_POINTS
        labels = [_fitted(label, room - BESIDE_WORD_POINTS) for label in labels]
        axes.legend(
            handles,
            labels,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            bbox_transform=axes.transAxes + ScaledTranslation(0, above_points / 72, axes.figure.dpi_scale_trans),
            ncols=_columns([_width_points(label) for label in labels], room),
            frameon=False,
            borderaxespad=0.2,
            handlelength=1.4,
            columnspacing=1.2,
            markerscale=mark_scale,
        )


def _columns(widths_points: Sequence[float], room_points: float) -> int:
    """Give as many columns of a legend as there is room for, with its words from above to below as they are set."""
    for columns in range(min(LEGEND_COLUMNS, len(widths_points)), 1, -1):
        parts = np.array_split(np.asarray(widths_points), columns)
        if sum(float(part.max()) + BESIDE_WORD_POINTS for part in parts) <= room_points:
            return columns
    return 1


def _fitted(text: str, room_points: float) -> str:
    """Leave out the middle of a text that is too wide, since names differ at their ends more often."""
    width = _width_points(text)
    if width <= room_points:
        return text
    half = max(1, int(len(text) * room_points / width) // 2)
    return f"{text[: half - 1]}…{text[-half:]}"


def _width_points(text: str) -> float:
    font = _font()
    font.set_size(_LOOK["legend.fontsize"], 72)
    font.set_text(text)
    return float(font.get_width_height()[0]) / 64


def paint(colour: Colour) -> tuple[float, float, float]:
    """Give a colour as matplotlib takes it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


def plain(text: str) -> str:
    r"""Make a text that came from a log safe to print: visible, no mathematics, no missing glyphs, kept in legends.

    Examples
    --------
    >>> plain("$x_$")
    '\\$x_\\$'
    >>> plain("_hidden")
    ' _hidden'
    """
    # matplotlib warns at each missing glyph and draws a box; this is told once, by the mark.
    known = _glyphs()
    shown = "".join(character if ord(character) in known else "\ufffd" for character in visible(text))
    # matplotlib leaves labels that begin with an underscore out of legends.
    return (" " if shown.startswith("_") else "") + shown.replace("$", r"\$")


@cache
def _glyphs() -> frozenset[int]:
    return frozenset(_font().get_charmap())


@cache
def _font() -> FT2Font:
    return FT2Font(findfont(FontProperties(family="DejaVu Sans")))
