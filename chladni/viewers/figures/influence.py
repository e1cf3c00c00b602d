"""The table of influence as a figure: cells coloured by strength and sign, the strongest marked."""

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from chladni.models.core.reading import InfluenceTable
from chladni.signals.arrays import Real
from chladni.viewers.figures.sheet import look, plain

ROW_IN, COLUMN_IN, MARGIN_IN = 0.34, 0.82, 1.5
# Blue lowers, white does nothing, orange raises; told apart with any colour vision. Stronger than 1 is full colour.
_COLOURS = LinearSegmentedColormap.from_list("influence", [(0.35, 0.6, 0.85), (1, 1, 1), (0.95, 0.65, 0.35)])
FULL_COLOUR = 1.0


def influence_figure(table: InfluenceTable, *, of: Literal["log_derivative", "finite"] = "log_derivative") -> Figure:
    """Draw a table of influence; a bold frame marks each row's strongest cell, a dot each column's.

    Parameters
    ----------
    table
        From `chladni.models.analysis.influence.influence`.
    of
        ``log_derivative``: d ln(behaviour)/d ln(construction); ``finite``: the paper's R_PCD/R_PCF.
    """
    rows, columns = table.log_derivative.shape
    with look():
        size = (MARGIN_IN + COLUMN_IN * columns, 1.3 + ROW_IN * rows)
        figure = Figure(figsize=size, layout="constrained")
        draw_influence(figure.subplots(), table, of=of)
    return figure


def draw_influence(
    axes: Axes, table: InfluenceTable, *, of: Literal["log_derivative", "finite"] = "log_derivative"
) -> None:
    """Draw the cells of a table."""
    coefficients = table.log_derivative if of == "log_derivative" else table.finite
    axes.imshow(np.ma.masked_invalid(coefficients), cmap=_COLOURS, vmin=-FULL_COLOUR, vmax=FULL_COLOUR, aspect="auto")
    _write(axes, coefficients)
    _mark(axes, coefficients)
    _name(axes, table)
    what = "d ln(behaviour)/d ln(construction)" if of == "log_derivative" else "R_PCD/R_PCF for a finite change"
    axes.set_title(f"Influence, {what}\nframe: strongest of its row, dot: strongest of its column", loc="left")


def _write(axes: Axes, coefficients: Real) -> None:
    for (row, column), value in np.ndenumerate(coefficients):
        axes.text(column, row, _number(value), ha="center", va="center", fontsize=7.5)


def _mark(axes: Axes, coefficients: Real) -> None:
    sizes = np.nan_to_num(np.abs(coefficients))
    for row, column in enumerate(np.argmax(sizes, axis=1)):
        if sizes[row, column] > 0:
            axes.add_patch(Rectangle((column - 0.47, row - 0.45), 0.94, 0.9, fill=False, linewidth=1.4))
    for column, row in enumerate(np.argmax(sizes, axis=0)):
        if sizes[row, column] > 0:
            axes.plot(column + 0.38, row - 0.3, "o", color="black", markersize=3)


def _name(axes: Axes, table: InfluenceTable) -> None:
    axes.set_xticks(range(len(table.behaviour)), ["\n".join(map(plain, name.split("_"))) for name in table.behaviour])
    axes.set_yticks(range(len(table.construction)), [plain(name.replace("_", " ")) for name in table.construction])
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def _number(value: float) -> str:
    if np.isnan(value):
        return "–"
    return f"{value:+.3g}" if value else "0"
