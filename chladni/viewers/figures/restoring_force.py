"""The restoring-force surface: the force that the model lacks, over displacement and over velocity."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from chladni.gap.records.diagnosis import RestoringForce
from chladni.signals.engineering import axis_scale
from chladni.viewers.figures.sheet import WIDTH_IN, look, paint, plain
from chladni.viewers.gap_evidence import MEASURED_ON_LIGHT, GapEvidence
from chladni.viewers.gap_tables import force_title
from chladni.viewers.restoring_force import (
    SIGNED,
    Over,
    force_range,
    motion,
    motion_name,
    motion_reach,
    motion_unit,
    other,
    signed_colours,
    spread_out,
)

HEIGHT_IN, TIME_IN = 2.6, 1.2
_COLOURS = LinearSegmentedColormap.from_list("signed", SIGNED / 255)


def restoring_force_figures(evidence: GapEvidence) -> dict[str, Figure]:
    """Draw each recovered force over displacement, velocity and time, by name; none where none was recovered."""
    surfaces = [one for one in evidence.found.restoring_forces if one.force.size]
    # With one force alone, its site is told in the picture.
    names = ["restoring force"] if len(surfaces) == 1 else [f"restoring force at {one.site}" for one in surfaces]
    return {name: _figure(evidence, one) for name, one in zip(names, surfaces, strict=True)}


def _figure(evidence: GapEvidence, surface: RestoringForce) -> Figure:
    with look():
        figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN + TIME_IN), layout="constrained")
        grid = figure.add_gridspec(2, 2, height_ratios=(HEIGHT_IN, TIME_IN))
        over_displacement = figure.add_subplot(grid[0, 0])
        over_velocity = figure.add_subplot(grid[0, 1], sharey=over_displacement)
        draw_surfaces(figure, over_displacement, over_velocity, surface)
        _draw_over_time(figure.add_subplot(grid[1, :]), surface, evidence.telling_s)
        figure.suptitle(plain(force_title(evidence.found, surface.site)), fontsize=8.5, x=0.02, ha="left")
        return figure


def draw_surfaces(figure: Figure, over_displacement: Axes, over_velocity: Axes, surface: RestoringForce) -> None:
    """Draw the force twice, on axes that share the force."""
    _draw(figure, over_displacement, surface, "displacement")
    _draw(figure, over_velocity, surface, "velocity")
    # The axis is the neighbour's; its numbers stand there.
    over_velocity.set_ylabel("")
    over_velocity.tick_params(labelleft=False)
    if surface.law_force is not None:
        over_velocity.legend(loc="lower right", markerscale=4, frameon=False)


def _draw(figure: Figure, axes: Axes, surface: RestoringForce, over: Over) -> None:
    """Draw the force over one motion, coloured by the other, and the law in black."""
    rows, shade = spread_out(surface), motion(surface, other(over))
    across, x_unit = axis_scale(motion(surface, over), motion_unit(surface, over))
    up, force_unit = axis_scale(surface.force, surface.force_unit)
    x, reach = motion(surface, over)[rows] / across, motion_reach(surface, other(over))
    # As paths so many dots would make a file of megabytes.
    axes.scatter(
        x,
        surface.force[rows] / up,
        c=signed_colours(shade[rows] / reach) / 255,
        s=3.0,
        linewidths=0.0,
        rasterized=True,
    )
    if surface.law_force is not None:
        law = surface.law_force[rows] / up
        axes.plot(x, law, ".", color="black", markersize=1.6, markeredgewidth=0, label="law", rasterized=True)
    axes.set_ylim(*(end / up for end in force_range(surface)))
    axes.set_xlabel(f"{motion_name(surface, over)} [{x_unit}]")
    axes.set_ylabel(plain(f"Force at {surface.site} [{force_unit}]"))
    _colour_bar(figure, axes, surface, other(over))


#: A force over time that is so many times larger than the surface's axis rings.
_RINGS = 5.0


def _draw_over_time(axes: Axes, surface: RestoringForce, telling_s: tuple[float, float] | None) -> None:
    """Draw force and law where the model errs most; a whole log would be one dark band."""
    start_s, end_s = telling_s or (float(surface.time_s[0]), float(surface.time_s[-1]))
    rows = (surface.time_s >= start_s) & (surface.time_s <= end_s)
    up, force_unit = axis_scale(surface.force, surface.force_unit)
    axes.plot(surface.time_s[rows], surface.force[rows] / up, color=paint(MEASURED_ON_LIGHT), linewidth=2.0,
              label="recovered")  # fmt: skip
    if surface.law_force is not None:
        axes.plot(surface.time_s[rows], surface.law_force[rows] / up, color="black", linewidth=0.8, label="law")
    # All of it: in so short a stretch a force is followed sample by sample; but where the estimate rings at the ends
    # of a record nothing else would be seen.
    reach, shown = float(np.max(np.abs(surface.force[rows]), initial=0.0)), force_range(surface)
    if reach > _RINGS * max(abs(end) for end in shown):
        axes.set_ylim(*(end / up for end in shown))
        told = f"recovered: up to {reach / up:.2g} {force_unit} beyond the axis"
        axes.text(0.98, 0.94, told, transform=axes.transAxes, ha="right", va="top", fontsize=7)
    axes.set_xlim(start_s, end_s)
    axes.set_xlabel("Time [s]")
    axes.set_ylabel(f"Force [{force_unit}]")


def _colour_bar(figure: Figure, axes: Axes, surface: RestoringForce, shown: Over) -> None:
    scale, unit = axis_scale(motion(surface, shown), motion_unit(surface, shown))
    reach = motion_reach(surface, shown) / scale
    colours = ScalarMappable(norm=Normalize(-reach, reach), cmap=_COLOURS)
    bar = figure.colorbar(colours, ax=axes, location="top", aspect=25, pad=0.02, ticks=MaxNLocator(4))
    bar.set_label(f"{shown} [{unit}]", fontsize=7.5)
    bar.outline.set_linewidth(0.0)
