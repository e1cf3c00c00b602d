"""Figures of many small panes: how many to a figure, and how they stand in it."""

from collections.abc import Iterator
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.viewers.figures.sheet import WIDTH_IN


def pages(count: int, size: int) -> Iterator[tuple[str, range]]:
    """Divide `count` things into pages of at most `size`, even ones, and name each by its first and last.

    Examples
    --------
    >>> list(pages(3, 6)), list(pages(7, 4))
    ([('', range(0, 3))], [(' 1–4', range(0, 4)), (' 5–7', range(4, 7))])
    """
    number = -(-count // size)
    length = -(-count // number)
    for start in range(0, count, length):
        rows = range(start, min(start + length, count))
        yield ("" if number == 1 else f" {rows.start + 1}–{rows.stop}"), rows


def panes(count: int, *, columns: int, height_in: float, **options: Any) -> tuple[Figure, list[Axes]]:
    """Make a figure of `count` axes in as few rows as `columns` allow, even ones; places left over stay white."""
    rows = -(-count // columns)
    columns = -(-count // rows)
    figure = Figure(figsize=(WIDTH_IN, rows * height_in + 0.35), layout="constrained")
    stack = list(figure.subplots(rows, columns, squeeze=False, **options).flat)
    for axes in stack[count:]:
        axes.remove()
    # Shared axes are numbered in the last row only, which some columns don't reach; and all frames are of one height.
    if count < rows * columns:
        for axes in stack[:count]:
            axes.tick_params(labelbottom=True)
    return figure, stack[:count]
