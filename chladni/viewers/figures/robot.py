"""Figures of a diagnosed robot, small and many: torque that is missing, friction maps, errors of the motion."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from chladni.gap.records.diagnosis import GapSignals
from chladni.gap.records.robot import JointMotion, Over, TorqueMap, site_words
from chladni.signals.arrays import Real
from chladni.signals.engineering import axis_scale, percent
from chladni.viewers.drawing import thin, with_breaks
from chladni.viewers.figures.gap_signals import AFTER, BEFORE, LEGEND
from chladni.viewers.figures.panes import pages, panes
from chladni.viewers.figures.sheet import look, plain
from chladni.viewers.gap_evidence import GapEvidence
from chladni.viewers.restoring_force import spread_over
from chladni.viewers.style import AMPLITUDES, amplitude_colours
from chladni.viewers.torque_maps import load_reach, maps_over, motion_name, torque_range, turns_of

#: Of a pane that is a third of the sheet wide.
COLUMNS, HEIGHT_IN, MOST = 3, 1.45, 12
POINTS = 1500
_LOAD = LinearSegmentedColormap.from_list("load", AMPLITUDES / 255)


def residual_figures(evidence: GapEvidence) -> dict[str, Figure]:
    """Draw the torque that is missing at every joint over the log, before and after; none of a model."""
    signals = evidence.signals
    if signals is None or evidence.found.motion is None:
        return {}
    shares = {one.name: one.share for one in evidence.found.where.sites}

    def draw(axes: Axes, row: int) -> None:
        _residual(axes, signals, row, after=evidence.after)
        name = signals.output_names[row]
        told = f" {percent(shares[name])}" if name in shares else ""
        axes.set_title(plain(f"{name}{told}"), loc="left", pad=3, fontsize=7.5)

    return _multiples("torque residual", len(signals.output_names), draw, x_label="Time [s]", sharex=True)


def motion_figures(evidence: GapEvidence) -> dict[str, Figure]:
    """Draw the error of every joint's simulated position over the log; none where no simulation holds."""
    motion = evidence.found.motion
    if motion is None or (motion.before is None and motion.after is None):
        return {}

    def draw(axes: Axes, row: int) -> None:
        _position_error(axes, motion, row, after=evidence.after)
        axes.set_title(plain(motion.joints[row]), loc="left", pad=3, fontsize=7.5)

    return _multiples("position error", len(motion.joints), draw, x_label="Time [s]", sharex=True)


def torque_map_figures(evidence: GapEvidence, over: Over) -> dict[str, Figure]:
    """Draw torques of the joints over their speed or their position, coloured by load; none of a model."""
    maps = maps_over(evidence.found, over)

    def draw(axes: Axes, row: int) -> None:
        _map(axes, maps[row])

    name = "friction" if over == "velocity" else "torque over position"
    figures = _multiples(name, len(maps), draw, x_label=None)
    for figure in figures.values():
        colours = ScalarMappable(norm=Normalize(0, 1), cmap=_LOAD)
        bar = figure.colorbar(colours, ax=figure.axes, location="bottom", aspect=60, shrink=0.6, pad=0.02)
        bar.set_ticks([0, 1], labels=["none", "most at this joint"])
        bar.set_label("Load: torque that the motion needs", fontsize=7)
        bar.ax.tick_params(labelsize=6.5)
        bar.outline.set_linewidth(0.0)
    return figures


def _multiples(
    name: str, count: int, draw: Callable[[Axes, int], None], *, x_label: str | None, **options: bool
) -> dict[str, Figure]:
    found: dict[str, Figure] = {}
    if not count:
        return found
    with look():
        for part, rows in pages(count, MOST):
            figure, stack = panes(len(rows), columns=COLUMNS, height_in=HEIGHT_IN, **options)
            for axes, row in zip(stack, rows, strict=True):
                draw(axes, row)
                axes.tick_params(labelsize=6.5)
                axes.yaxis.label.set_fontsize(7)
                axes.xaxis.label.set_fontsize(7)
            # Of the pane that has most of them: one may lack a law.
            handles, labels = max((one.get_legend_handles_labels() for one in stack), key=lambda one: len(one[1]))
            figure.legend(handles, labels, loc="outside upper left", **LEGEND)
            if x_label is not None:
                for axes in stack[-COLUMNS:]:
                    axes.set_xlabel(x_label)
            found[f"{name}{part}"] = figure
    return found


def _residual(axes: Axes, signals: GapSignals, row: int, *, after: str) -> None:
    starts = np.array(signals.window_starts[1:], dtype=np.intp)
    error = signals.measured[row] - np.stack([signals.before[row], signals.after[row]])
    scale, unit = axis_scale(error, signals.output_units[row])
    for values, colour, width, label in (
        (error[0], BEFORE, 0.9, "missing before"),
        (error[1], AFTER, 0.7, f"missing {after}"),
    ):
        x, y = with_breaks(signals.seconds, values / scale, starts)
        chosen, _ = thin(y, limit=POINTS)
        axes.plot(x[chosen], y[chosen], color=colour, linewidth=width, label=label)
    noise = float(signals.noise_rms[row]) / scale
    axes.axhspan(-noise, noise, color="black", alpha=0.25, linewidth=0, zorder=4, label="noise")
    axes.set_xlim(*signals.span_s)
    axes.set_ylabel(f"[{unit}]", labelpad=1)


def _position_error(axes: Axes, motion: JointMotion, row: int, *, after: str) -> None:
    courses = (
        (motion.before, BEFORE, 0.9, "error before"),
        (motion.after, AFTER, 0.7, f"error {after}"),
    )
    errors = [one[row] - motion.measured[row] for one, *_ in courses if one is not None]
    scale, unit = axis_scale(np.concatenate(errors), motion.units[row])
    for simulated, colour, width, label in courses:
        if simulated is None:
            # Drawn it would hide the other; a legend without it would leave open why.
            axes.plot([], [], color=colour, linewidth=width, label=f"{label}: more than the motion itself")
            continue
        values = (simulated[row] - motion.measured[row]) / scale
        x, y = with_breaks(motion.time_s, values, np.array(motion.gaps, dtype=np.intp) + 1)
        chosen, _ = thin(y, limit=POINTS)
        axes.plot(x[chosen], y[chosen], color=colour, linewidth=width, label=label)
    axes.set_xlim(motion.time_s[0], motion.time_s[-1])
    axes.set_ylabel(f"[{unit}]", labelpad=1)


def _map(axes: Axes, one: TorqueMap) -> None:
    rows = spread_over(one.motion.size)
    across, x_unit = axis_scale(one.motion, one.motion_unit)
    low, high = torque_range(one)
    up, y_unit = axis_scale(np.array([low, high]), one.torque_unit)
    shade = amplitude_colours(np.abs(one.load[rows]) / load_reach(one)) / 255
    axes.scatter(one.motion[rows] / across, one.torque[rows] / up, c=shade, s=2.0, linewidths=0.0, rasterized=True)
    if one.over == "velocity":
        _broken(axes, one, one.described / up, across, color=BEFORE, linewidth=1.2, linestyle="--",
                label="described")  # fmt: skip
    axes.errorbar(
        one.centre / across, one.mean / up, yerr=one.error / up, color="black", fmt="o", markersize=1.4,
        linewidth=0.6, label="mean ± σ", zorder=3,
    )  # fmt: skip
    if one.law is not None and one.spread is not None:
        label = "found" if one.is_named else "suggested, not named"
        _broken(axes, one, one.law / up, across, color=AFTER, linewidth=1.2, label=label, zorder=4)
    axes.set_ylim(low / up, high / up)
    axes.set_title(plain(site_words(one.site)), loc="left", pad=3, fontsize=7.5)
    axes.set_xlabel(plain(f"{motion_name(one)} [{x_unit}]"), labelpad=1)
    axes.set_ylabel(f"[{y_unit}]", labelpad=1)


def _broken(axes: Axes, one: TorqueMap, values: Real, across: float, **options: Any) -> None:
    """Draw a line over the bins, broken where the motion turns: friction jumps there."""
    x, y = with_breaks(one.centre / across, values, turns_of(one))
    axes.plot(x, y, **options)
