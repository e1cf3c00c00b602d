"""The stabilisation diagram over its indicator."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.arrays import Real
from chladni.signals.mode_set import ModeSet
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.study import Study
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import decibels_of_amplitude, level_limits
from chladni.viewers.figures.log_axis import USUAL, Scales, logarithmic, logarithmic_frequency
from chladni.viewers.figures.sheet import legend, look, paint, sheet
from chladni.viewers.figures.upright import STRIP_POINTS, name_above
from chladni.viewers.stabilisation import STATUS_NAMES, frequency_range, order_range, title
from chladni.viewers.style import STATUS_ON_LIGHT

HEIGHT_IN = 3.4
INDICATOR = "#8a8a8a"
MACHINE = "#c03030"
MARKS = (".", "^", "s", "o")
TAKEN = "taken for a mode"
# Of the distance between two model orders.
MARK_SHARE, MARK_POINTS = 0.55, (0.9, 2.2)
# More of them hide the poles that they ring.
RINGS = 250


def stabilisation_figures(study: Study, *, scales: Scales = USUAL) -> dict[str, Figure]:
    """Draw the poles of all model orders over the indicator, by name; none for methods without model orders."""
    if study.modes is None or study.modes.stabilisation is None:
        return {}
    with look():
        return {"stabilisation": _figure(study.modes, study.modes.stabilisation, scales)}


def _figure(modes: ModeSet, diagram: StabilisationDiagram, scales: Scales) -> Figure:
    named = modes.frequency_hz.size + len(modes.harmonics) > 0
    figure, (poles,) = sheet([HEIGHT_IN], above_points=STRIP_POINTS if named else 0.0)
    machines_hz = [line.frequency_hz for line in modes.harmonics]
    draw_stabilisation(poles, diagram, modes.frequency_hz, machines_hz, scales=scales)
    poles.set_xlabel("Frequency [Hz]")
    return figure


def draw_stabilisation(
    poles: Axes,
    diagram: StabilisationDiagram,
    modes_hz: Real,
    machines_hz: Sequence[float] = (),
    *,
    scales: Scales = USUAL,
) -> None:
    """Draw poles over the indicator, and the frequencies of modes and of machines."""
    shown_hz = frequency_range(modes_hz, diagram)
    _draw_indicator(poles, shown_hz, diagram)
    lines_hz = diagram.indicator_hz[(diagram.indicator_hz >= shown_hz[0]) & (diagram.indicator_hz > 0)]
    if scales.log_frequency and lines_hz.size:
        # From the first line above 0 Hz on.
        shown_hz = (float(lines_hz[0]), shown_hz[1])
        logarithmic_frequency(poles, *shown_hz)
    else:
        poles.set_xlim(*shown_hz)
    poles.set_ylim(*order_range(diagram))
    _draw_poles(poles, diagram)
    poles.set_ylabel("Model order")
    names = [(float(hz), "black") for hz in modes_hz] + [(hz, MACHINE) for hz in machines_hz]
    low_hz, high_hz = shown_hz
    names = [(hertz, colour) for hertz, colour in names if low_hz <= hertz <= high_hz]
    for hertz, colour in names:
        poles.axvline(hertz, color=colour, linewidth=0.4, alpha=0.5, zorder=2)
    legend(poles, above_points=name_above(poles, names), mark_scale=MARK_POINTS[1] / _mark_points(diagram))


def _draw_poles(poles: Axes, diagram: StabilisationDiagram) -> None:
    """Poles by status, each kind with a mark and a colour of its own, and those marked that became modes."""
    size = _mark_points(diagram)
    for status, (name, mark) in enumerate(zip(STATUS_NAMES, MARKS, strict=True)):
        chosen = diagram.status == status
        poles.plot(
            diagram.frequency_hz[chosen],
            diagram.order[chosen],
            linestyle="none",
            marker=mark,
            # A dot is drawn at half its size.
            markersize=size if status else 1.4 * size,
            color=paint(STATUS_ON_LIGHT[status]),
            markeredgewidth=0.0,
            label=name,
            zorder=3 + status,
        )
    taken = diagram.mode >= 0
    if int(taken.sum()) > RINGS:
        _join(poles, diagram)
        return
    poles.plot(
        diagram.frequency_hz[taken],
        diagram.order[taken],
        linestyle="none",
        marker="o",
        markersize=3.8,
        markerfacecolor="none",
        markeredgecolor="black",
        markeredgewidth=0.4,
        label=TAKEN,
        zorder=8,
    )


def _mark_points(diagram: StabilisationDiagram) -> float:
    """So large that marks of neighbouring orders don't run into one bar."""
    orders = np.ptp(diagram.order) + 1 if diagram.order.size else 1
    return float(np.clip(MARK_SHARE * HEIGHT_IN * 72 / orders, *MARK_POINTS))


def _join(poles: Axes, diagram: StabilisationDiagram) -> None:
    """Join the poles of each mode by a line: so many rings would hide them."""
    for mode in np.unique(diagram.mode[diagram.mode >= 0]):
        rows = np.flatnonzero(diagram.mode == mode)
        rows = rows[np.argsort(diagram.order[rows])]
        poles.plot(
            diagram.frequency_hz[rows],
            diagram.order[rows],
            color="black",
            linewidth=0.6,
            alpha=0.7,
            label=TAKEN if mode == diagram.mode.max() else None,
            zorder=2.5,
        )


def _draw_indicator(poles: Axes, shown_hz: tuple[float, float], diagram: StabilisationDiagram) -> None:
    """Curves on a logarithmic axis of their own on the right, behind the poles."""
    behind = poles.twinx()
    poles.set_zorder(behind.get_zorder() + 1)
    poles.patch.set_visible(False)
    low_hz, high_hz = shown_hz
    inside = (diagram.indicator_hz >= low_hz) & (diagram.indicator_hz <= high_hz)
    low, high = level_limits(decibels_of_amplitude(diagram.indicator[:, inside]))
    logarithmic(behind, 10 ** (low / 20), 10 ** (high / 20))
    for place, curve in enumerate(diagram.indicator):
        positive = np.where(curve > 0, curve, np.nan)
        # The first curve leads; those behind it tell of close modes.
        behind.plot(diagram.indicator_hz, positive, color=INDICATOR, linewidth=0.9 if place == 0 else 0.5)
    behind.set_ylabel(f"{title(diagram)} [{printed_unit(diagram.indicator_unit)}]")
    behind.spines.right.set_visible(True)
    behind.grid(visible=False)
