"""Matrices of the modal assurance criterion, with numbers."""

from collections.abc import Sequence

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.arrays import Real
from chladni.signals.errors import EstimateError
from chladni.signals.study import Study
from chladni.viewers.figures.sheet import SQUARE_IN, look, plain
from chladni.viewers.mode_tables import has_mac, mode_ticks

# Up to so many columns every cell has its number; up to a few more, those that aren't small.
ALL_NUMBERED, ANY_NUMBERED = 10, 24
SMALL = 0.2
# A number is light on the dark half of the scale. Neither is a grey, which a dark page would turn over.
DARK_BELOW = 0.55
LIGHT, DARK = "#fffde0", "#00001f"
TICKS = 24


def mac_figures(study: Study) -> dict[str, Figure]:
    """Draw the AutoMAC, by name; none without a validation of several modes and channels."""
    modes, validation = study.modes, study.validation
    if modes is None or validation is None or not has_mac(modes):
        return {}
    names = mode_ticks(modes)
    figure = cross_mac_figure(
        validation.auto_mac, rows=names, columns=names, row_name="Mode: frequency [Hz]", column_name="Mode: Hz"
    )
    return {"mac": figure}


def cross_mac_figure(
    mac: Real, *, rows: Sequence[str], columns: Sequence[str], row_name: str = "", column_name: str = ""
) -> Figure:
    """Draw the modal assurance criterion between two sets of modes.

    Parameters
    ----------
    mac
        ``[row, column]``, 0 to 1.
    rows, columns
        Names of the modes, such as ``1: 24.67``.
    row_name, column_name
        What the sets are, with the unit of their names.

    Raises
    ------
    EstimateError
        When a set is empty, or the names aren't as many as the rows and columns.
    """
    if mac.shape != (len(rows), len(columns)) or not mac.size:
        raise EstimateError(
            f"a MAC of shape {mac.shape} can't be drawn with {len(rows)} and {len(columns)} names;"
            " give one or more modes on both sides, each with its name"
        )
    with look():
        share = min(1.0, 0.45 + 0.08 * len(columns))
        width = SQUARE_IN * share
        cell = (width - 1.4) / max(len(columns), 1)
        figure = Figure(figsize=(width, min(cell * len(rows) + 0.9, 2 * SQUARE_IN)), layout="constrained")
        axes = figure.subplots()
        draw_mac(axes, mac, rows=rows, columns=columns)
        axes.set_xlabel(plain(column_name))
        axes.set_ylabel(plain(row_name))
    return figure


def draw_mac(axes: Axes, mac: Real, *, rows: Sequence[str], columns: Sequence[str]) -> None:
    """Draw a matrix ``[row, column]`` with its numbers, the names of its modes, and a colour scale."""
    axes.grid(visible=False)
    image = axes.imshow(mac, vmin=0, vmax=1, cmap=mpl.colormaps["viridis"], interpolation="nearest")
    _draw_numbers(axes, mac)
    name_cells(axes, rows, columns)
    bar = axes.figure.colorbar(image, ax=axes, aspect=25, pad=0.02)
    bar.set_label("MAC [1]")
    bar.outline.set_linewidth(0.0)


def _draw_numbers(axes: Axes, mac: Real) -> None:
    columns = mac.shape[1]
    if columns > ANY_NUMBERED:
        return
    least = 0.0 if columns <= ALL_NUMBERED else SMALL
    for (row, column), value in [(place, float(mac[place])) for place in zip(*(mac >= least).nonzero(), strict=True)]:
        axes.text(
            column,
            row,
            f"{value:.2f}" if columns <= ALL_NUMBERED else f"{value:.1f}",
            ha="center",
            va="center",
            fontsize=6.5 if columns <= ALL_NUMBERED else 4.5,
            color=LIGHT if value < DARK_BELOW else DARK,
        )


def name_cells(axes: Axes, rows: Sequence[str], columns: Sequence[str]) -> None:
    """Write the names of rows and columns beside a matrix, every so many where there are many."""
    for axis, names, turned in ((axes.xaxis, columns, 90), (axes.yaxis, rows, 0)):
        every = -(-len(names) // TICKS)
        axis.set_ticks(
            range(0, len(names), max(every, 1)), [plain(name) for name in names[:: max(every, 1)]], rotation=turned
        )
