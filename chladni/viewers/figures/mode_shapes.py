"""Mode shapes: the structure at rest and at its furthest, or a bar a channel where the setup knows no places."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.mode_set import ModeSet
from chladni.signals.study import Study
from chladni.viewers.figures.panes import pages, panes
from chladni.viewers.figures.sheet import look, paint, plain
from chladni.viewers.mode_tables import mode_title
from chladni.viewers.style import AMPLITUDES, Style
from chladni.viewers.wireframe import DRAWN_SHARE, Wireframe, along, amplitude, furthest

GHOST, NAMES = "#bbbbbb", "#777777"
SHAPES_IN_A_FIGURE = 6
PANE_HEIGHT_IN = 2.0
PIECES, SEGMENTS = 8, 1200
# More names than this hide the structure.
POINTS_NAMED = 12
BARS_NAMED = 24
BAR_HEIGHT_IN = 0.16


def mode_shape_figures(study: Study) -> dict[str, Figure]:
    """Draw every mode in a pane of its own, several to a figure, by name; none without modes.

    A single channel has no shape to draw: its only component is 1.
    """
    modes = study.modes
    if modes is None or not modes.frequency_hz.size or len(modes.channels) == 1:
        return {}
    wireframe = Wireframe.of(study.geometry, modes.channels)
    style = Style.of(study)
    with look():
        return {
            f"mode shapes{part}": _bars(modes, rows, style) if wireframe is None else _wires(modes, wireframe, rows)
            for part, rows in pages(modes.frequency_hz.size, SHAPES_IN_A_FIGURE)
        }


def _wires(modes: ModeSet, wireframe: Wireframe, rows: range) -> Figure:
    figure, stack = panes(len(rows), columns=3, height_in=PANE_HEIGHT_IN)
    motion = wireframe.motion(modes.shapes[rows.start : rows.stop])
    moved = furthest(motion) * DRAWN_SHARE * wireframe.size
    scale = LinearSegmentedColormap.from_list("amplitude", AMPLITUDES / 255)
    for axes, row, one, shape in zip(stack, rows, moved, motion, strict=True):
        _draw(axes, wireframe, one, shape, scale)
        axes.set_title(mode_title(modes, row), loc="left", pad=2)
    _one_scale(stack, wireframe, moved)
    bar = figure.colorbar(
        mpl.cm.ScalarMappable(Normalize(0, 1), scale), ax=stack, location="bottom", aspect=60, pad=0.02, shrink=0.6
    )
    bar.set_label("Amplitude |ψ| of the point over that of the greatest · grey: at rest")
    bar.outline.set_linewidth(0.0)
    return figure


def _draw(
    axes: Axes, wireframe: Wireframe, moved: Real, motion: NDArray[np.complexfloating], scale: LinearSegmentedColormap
) -> None:
    share = amplitude(motion)
    share = share / (float(share.max()) or 1.0)
    rest = _projected(wireframe, wireframe.rest)
    there = _projected(wireframe, wireframe.rest + moved)
    for line in wireframe.lines:
        axes.plot(*rest[list(line)].T, color=GHOST, linewidth=0.6, zorder=1)
    parts = sum(len(line) - 1 for line in wireframe.lines)
    ends, cuts = wireframe.segments(max(1, min(PIECES, SEGMENTS // max(parts, 1))))
    if len(ends):
        shade = along(share[:, None], ends, cuts).mean(axis=(1, 2))
        wires = LineCollection(list(along(there, ends, cuts)), linewidths=1.3, zorder=3, capstyle="round")
        wires.set_color(scale(shade))
        axes.add_collection(wires)
    few = len(wireframe.names) <= 60
    shown = there[wireframe.measured]
    axes.scatter(
        shown[:, 0], shown[:, 1], s=10 if few else 2, color=scale(share[wireframe.measured]), zorder=4, linewidths=0
    )
    axes.scatter(rest[:, 0], rest[:, 1], s=4 if few else 0.5, color=GHOST, zorder=2, linewidths=0)
    if len(wireframe.names) <= POINTS_NAMED:
        for name, place in zip(wireframe.names, rest, strict=True):
            text = axes.annotate(
                plain(name), place, (-3, 3), textcoords="offset points", ha="right", fontsize=6, color=NAMES, zorder=5
            )
            # A wire that moves over a name must not make it unreadable.
            text.set_path_effects([withStroke(linewidth=1.5, foreground="white")])


def _one_scale(stack: list[Axes], wireframe: Wireframe, moved: Real) -> None:
    """Give every pane the room that the furthest of all shapes takes to both sides, so that all have one scale."""
    everywhere = np.concatenate([wireframe.rest[None], wireframe.rest + moved, wireframe.rest - moved])
    places = _projected(wireframe, everywhere).reshape(-1, 2)
    margin = 0.05 * wireframe.size
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    # A corner for the directions, under the structure.
    low[1] -= 2 * margin
    for axes in stack:
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
        axes.set_aspect("equal")
        axes.set_axis_off()
        _draw_axes(axes, wireframe, low, 1.4 * margin)


def _draw_axes(axes: Axes, wireframe: Wireframe, corner: Real, length: float) -> None:
    """Directions of x, y and z in a corner."""
    origin = _projected(wireframe, np.zeros((1, 3)))[0]
    arms = _projected(wireframe, np.eye(3)) - origin
    foot = corner + 0.5 * length
    for name, arm in zip("xyz", arms, strict=True):
        tip = foot + length * arm
        axes.plot(*np.array([foot, tip]).T, color="#888888", linewidth=0.6)
        # An axis that points at the reader has no room for its name.
        if np.linalg.norm(arm) > 0.35:
            x, y = foot + 1.5 * length * arm
            axes.text(x, y, name, fontsize=5.5, color="#888888", ha="center", va="center")


def _projected(wireframe: Wireframe, places: Real) -> Real:
    """Places as seen from the wireframe's direction, without perspective: ``[..., across and up]``."""
    towards = wireframe.direction / np.linalg.norm(wireframe.direction)
    across = np.cross([0.0, 0.0, 1.0], towards)
    across /= np.linalg.norm(across)
    return np.asarray(places @ np.column_stack([across, np.cross(towards, across)]))


def _bars(modes: ModeSet, rows: range, style: Style) -> Figure:
    count = len(modes.channels)
    height_in = min(max(1.3, 0.5 + BAR_HEIGHT_IN * count), 4.5)
    figure, stack = panes(len(rows), columns=3, height_in=height_in, sharey=True, sharex=True)
    places = np.arange(count)
    colours = [paint(style.on_light(channel)) for channel in modes.channels]
    for axes, row in zip(stack, rows, strict=True):
        shape, std = modes.shapes[row], modes.shape_std[row]
        axes.barh(places, 2 * np.abs(shape), left=-np.abs(shape), height=0.8, color="#eeeeee", zorder=1)
        error = np.where(np.isfinite(std.real), std.real, 0.0)
        axes.barh(places, shape.real, height=0.6, color=colours, xerr=error, error_kw={"linewidth": 0.7}, zorder=2)
        axes.axvline(0, color="#555555", linewidth=0.6, zorder=3)
        axes.set_title(mode_title(modes, row), loc="left", pad=2)
        axes.set_xlim(-1.1, 1.1)
    _name_bars(stack, modes, style)
    figure.supxlabel("Re ψ with one sigma · light: |ψ| · channels in their order", fontsize=8.5)
    return figure


def _name_bars(stack: list[Axes], modes: ModeSet, style: Style) -> None:
    count = len(modes.channels)
    shown = np.arange(0, count, -(-count // BARS_NAMED))
    for axes in stack:
        axes.set_yticks(shown, [plain(style.labels[modes.channels[row].name]) for row in shown], fontsize=6.5)
        # The first channel on top.
        axes.set_ylim(count - 0.5, -0.5)
        axes.grid(visible=False, axis="y")
