"""Operating deflection shapes: what of each channel moves with the reference, and what a quarter period ahead."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.channel import labels_of
from chladni.signals.deflection_shapes import DeflectionShapes
from chladni.signals.unit_text import printed_unit
from chladni.viewers.figures.panes import pages
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import ON_LIGHT

HEIGHT_IN = 1.5
A_SHEET = 5


def deflection_figures(found: DeflectionShapes) -> dict[str, Figure]:
    """Draw the shapes, one pane each, several sheets where there are many; one for each unit's group, by name."""
    labels = labels_of(found.channels)
    figures = {}
    with look():
        for group in groups(found.channels, size=max(len(found.channels), 1)):
            names = [plain(labels[found.channels[column].name]) for column in group.rows]
            for page, rows in pages(found.frequency_hz.size, A_SHEET):
                figures[f"ods {group.name}{page}"] = _figure(found, group, names, rows)
    return figures


def _figure(found: DeflectionShapes, group: Group, names: list[str], rows: range) -> Figure:
    figure, stack = sheet([HEIGHT_IN] * len(rows), sharex=True)
    for axes, row in zip(stack, rows, strict=True):
        draw_deflection(axes, found, group, row)
    name_channels(stack[-1], names)
    figure.supylabel(f"RMS [{printed_unit(group.unit)}]", fontsize=8.5)
    legend(stack[0], above_points=10.0)
    return figure


def name_channels(axes: Axes, names: list[str]) -> None:
    """Name the channels below, at an angle where they are many."""
    axes.set_xticks(range(len(names)), names, rotation=0 if len(names) < 5 else 30, ha="center")


def draw_deflection(axes: Axes, found: DeflectionShapes, group: Group, row: int) -> None:
    """Draw one shape of the channels of one unit into given axes."""
    columns = list(group.rows)
    values, std = found.values[row, columns], found.std[row, columns]
    place = np.arange(len(columns))
    axes.axhline(0, color="#888888", linewidth=0.6, zorder=0)
    for part, colour, late, word in (
        (values.real, ON_LIGHT[0], -0.1, "in phase"),
        (values.imag, ON_LIGHT[1], 0.1, "a quarter period ahead"),
    ):
        axes.vlines(place + late, 0, part, color=paint(colour), linewidth=1.2)
        axes.errorbar(
            place + late, part, yerr=np.where(np.isfinite(std), std, 0), fmt="o", color=paint(colour), markersize=3,
            elinewidth=0.7, capsize=2, label=word,
        )  # fmt: skip
    axes.set_title(f"{found.frequency_hz[row]:.5g} Hz", loc="left", pad=2)
    axes.set_xlim(-0.5, len(columns) - 0.5)
