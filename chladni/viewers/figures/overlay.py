"""Spectra and transfer functions of several logs over one another, a curve for each log."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.channel import Channel, labels_of
from chladni.signals.study import Study
from chladni.viewers.figures.frf import (
    HEIGHTS_IN,
    draw_coherence,
    draw_magnitude,
    draw_phase,
    is_coherent,
)
from chladni.viewers.figures.log_axis import USUAL, Scales
from chladni.viewers.figures.psd import draw_densities
from chladni.viewers.figures.sheet import legend, look, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.panels import Panel, panels
from chladni.viewers.style import ON_LIGHT, Style, drawn_channels

# Two plots above one another have the height of one of a single log; more of them become flatter.
HEIGHT_IN = 2.9
FLATTEST_IN = 1.5
MOST_IN_A_FIGURE = 5
TITLE_POINTS = 12.0
LEGEND_POINTS = 24.0


def overlaid_figures(studies: Sequence[Study], *, scales: Scales = USUAL) -> dict[str, dict[str, Figure]]:
    """Draw the densities and the transfer functions of several logs over one another; figures by name, in sections.

    Parameters
    ----------
    studies
        Of one log each; curves have their titles as names.
    scales
        How the axes are divided.

    Returns
    -------
    dict
        ``densities``: all channels of one unit in a figure, with axes of their own; ``responses``: a figure for each
        function. Channels are matched by their names; a unit that each log has one channel in needs none.
    """
    with look():
        return {"densities": _densities(studies, scales), "responses": _responses(studies, scales)}


def overlaid_densities(studies: Sequence[Study], *, scales: Scales = USUAL) -> dict[str, Figure]:
    """Draw the densities alone, as `overlaid_figures` does."""
    with look():
        return _densities(studies, scales)


# --- densities ---------------------------------------------------------------------------------------------------

#: What draws one curve into axes.
Curve = Callable[[Axes], None]


def _densities(studies: Sequence[Study], scales: Scales) -> dict[str, Figure]:
    drawn: dict[str, dict[str, list[Curve]]] = {}
    single = _single_units(studies)
    for number, study in enumerate(studies):
        for density in study.densities:
            for group in groups(density.channels, size=len(density.channels)):
                for row in group.rows:
                    channel = density.channels[row]
                    name = "" if channel.unit in single else channel.name
                    curves = drawn.setdefault(group.name, {}).setdefault(name, [])
                    one = Group(name=group.name, unit=group.unit, rows=(row,))
                    style = _style(studies, number, [channel], named=not name)
                    curves.append(partial(draw_densities, density=density, group=one, style=style, scales=scales))
    labels = _labels(studies)
    return {
        f"psd {name}{part}": _density_figure(page, labels, scales)
        for name, channels in drawn.items()
        for part, page in _pages(channels)
    }


def _labels(studies: Sequence[Study]) -> dict[str, str]:
    return labels_of(channel for study in studies for channel in drawn_channels(study))


def _single_units(studies: Sequence[Study]) -> set[str]:
    """Units in which each log has at most one channel, and not all the same: they are meant to be compared."""
    units: dict[str, list[list[str]]] = {}
    for study in studies:
        own: dict[str, list[str]] = {}
        for channel in (channel for density in study.densities for channel in density.channels):
            own.setdefault(channel.unit, []).append(channel.name)
        for unit, names in own.items():
            units.setdefault(unit, []).append(names)
    return {
        unit
        for unit, logs in units.items()
        if all(len(names) == 1 for names in logs) and len({names[0] for names in logs}) > 1
    }


def _pages(channels: dict[str, list[Curve]]) -> Iterator[tuple[str, dict[str, list[Curve]]]]:
    names = list(channels)
    count = -(-len(names) // MOST_IN_A_FIGURE)
    for number, part in enumerate(np.array_split(np.asarray(names, dtype=object), count), start=1):
        yield f" {number}" if count > 1 else "", {name: channels[name] for name in part}


def _density_figure(channels: dict[str, list[Curve]], labels: Mapping[str, str], scales: Scales) -> Figure:
    height_in = max(HEIGHT_IN / len(channels), FLATTEST_IN)
    figure, stack = sheet([height_in] * len(channels), above_points=LEGEND_POINTS, sharex=True)
    for axes, (name, curves) in zip(stack, channels.items(), strict=True):
        _draw_over(axes, curves, scales, decade_db=10)
        if name:
            axes.set_title(plain(labels[name]), loc="left", pad=2)
        if axes is not stack[0] and (repeated := axes.get_legend()) is not None:
            repeated.remove()
    legend(stack[0], above_points=TITLE_POINTS if any(channels) else 0.0)
    _share_label(figure, stack)
    stack[-1].set_xlabel("Frequency [Hz]")
    return figure


def _share_label(figure: Figure, stack: Sequence[Axes]) -> None:
    """Write what all axes show once, beside them."""
    if len(stack) > 1:
        figure.supylabel(stack[0].get_ylabel(), fontsize=8.5)
        for axes in stack:
            axes.set_ylabel("")


# --- transfer functions ------------------------------------------------------------------------------------------


def _responses(studies: Sequence[Study], scales: Scales) -> dict[str, Figure]:
    found: dict[tuple[str, str], list[tuple[int, Panel]]] = {}
    counts = {len(study.response.responses) * len(study.response.references) for study in studies if study.response}
    for number, study in enumerate(studies):
        for panel in panels(study.response) if study.response is not None else ():
            for row in panel.group.rows:
                names = (panel.response.responses[row].name, panel.response.references[panel.reference].name)
                one = Panel(
                    response=panel.response,
                    group=Group(name=panel.group.name, unit=panel.group.unit, rows=(row,)),
                    reference=panel.reference,
                )
                # One function each is meant to be compared, whatever its channels are called.
                found.setdefault(("", "") if counts == {1} else names, []).append((number, one))
    labels = _labels(studies)
    return {
        f"response {place} {labels.get(names[0], '')}".rstrip(): _response_figure(studies, curves, labels, scales)
        for place, (names, curves) in enumerate(found.items(), start=1)
    }


def _response_figure(
    studies: Sequence[Study], panels_: Sequence[tuple[int, Panel]], labels: Mapping[str, str], scales: Scales
) -> Figure:
    coherent = any(is_coherent(panel) for _, panel in panels_)
    figure, stack = sheet(HEIGHTS_IN if coherent else HEIGHTS_IN[:2], above_points=LEGEND_POINTS, sharex=True)
    names = {panel.response.responses[panel.group.rows[0]].name for _, panel in panels_}
    curves: list[list[Curve]] = [[], [], []]
    for number, panel in panels_:
        drawn = [panel.response.responses[panel.group.rows[0]], panel.response.references[panel.reference]]
        style = _style(studies, number, drawn, named=len(names) > 1)
        curves[0].append(partial(draw_magnitude, panel=panel, style=style, scales=scales))
        curves[1].append(partial(draw_phase, panel=panel, style=style))
        curves[2].append(partial(draw_coherence, panel=panel, style=style))
    _draw_over(stack[0], curves[0], scales, decade_db=20)
    for axes, some in zip(stack[1:], curves[1:], strict=False):
        for draw in some:
            draw(axes)
    if len(names) == 1:
        stack[0].set_title(plain(labels[names.pop()]), loc="left", pad=2)
    legend(stack[0], above_points=TITLE_POINTS)
    stack[-1].set_xlabel("Frequency [Hz]")
    return figure


# --- both --------------------------------------------------------------------------------------------------------


def _draw_over(axes: Axes, curves: Sequence[Curve], scales: Scales, *, decade_db: float) -> None:
    """Draw curves into the same axes, wide enough for all."""
    limits = []
    for draw in curves:
        draw(axes)
        limits.append((*axes.get_xlim(), *axes.get_ylim()))
    low_x, _, low, _ = np.min(limits, axis=0)
    _, high_x, _, high = np.max(limits, axis=0)
    axes.set_xlim(low_x, high_x)
    scales.divide_levels(axes, decade_db * np.log10(low), decade_db * np.log10(high), decade_db=decade_db)


def _style(studies: Sequence[Study], number: int, channels: Sequence[Channel], *, named: bool) -> Style:
    """Give the curves of one log its title and its colour; `named` adds the channel."""
    title, labels = studies[number].title, labels_of(channels)
    # The reference stands in the label of the axis, where its own name belongs.
    first, *others = channels
    words = {first.name: f"{title}: {labels[first.name]}" if named else title}
    return Style(
        labels=words | {one.name: labels[one.name] for one in others if one.name not in words},
        numbers=dict.fromkeys((channel.name for channel in channels), number % len(ON_LIGHT)),
        origin_ns=0,
    )
