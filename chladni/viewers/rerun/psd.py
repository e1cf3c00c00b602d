"""Power spectral densities over frequency."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.study import Study
from chladni.viewers.drawing import decibels_of_power, level_limits
from chladni.viewers.groups import Group, groups
from chladni.viewers.labels import decibel_unit, part_of_several
from chladni.viewers.rerun.entities import channel_entity, folder
from chladni.viewers.rerun.lines import draw_band, draw_line
from chladni.viewers.rerun.several_logs import GroupView, over_one_another
from chladni.viewers.rerun.timelines import frequency_axis
from chladni.viewers.style import Style


def draw_densities(recording: rr.RecordingStream, study: Study, style: Style) -> list[rrb.View]:
    """Write the densities in decibels and give a view for each group of channels, which several logs share."""
    return over_one_another(
        study,
        [
            _draw_group(recording, study, density, group, style, place)
            for place, density in enumerate(study.densities, start=1)
            for group in groups(density.channels)
        ],
    )


def _draw_group(
    recording: rr.RecordingStream,
    study: Study,
    density: PowerSpectralDensity,
    group: Group,
    style: Style,
    place: int,
) -> GroupView:
    parent = folder("density", str(place), group.name)
    for row in group.rows:
        _draw_channel(recording, density, row, parent, style, lines_in_view=len(group.rows))
    levels = decibels_of_power(density.values[list(group.rows)])
    part = part_of_several(place, len(study.densities), f"to {density.frequency_hz[-1]:g} Hz") * (not study.logs)
    limits = level_limits(levels)
    view = rrb.TimeSeriesView(
        origin=parent,
        name=f"{group.name} PSD [{decibel_unit(density.units[group.rows[0]])}] · 1 ms = 1 Hz{part}",
        axis_x=frequency_axis(0.0, float(density.frequency_hz[-1])),
        axis_y=rrb.ScalarAxis(range=limits),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
    )
    return GroupView(group=group, view=view, end=float(density.frequency_hz[-1]), levels=limits)


def _draw_channel(
    recording: rr.RecordingStream,
    density: PowerSpectralDensity,
    row: int,
    parent: str,
    style: Style,
    *,
    lines_in_view: int,
) -> None:
    channel = density.channels[row]
    path, colour = channel_entity(parent, channel), style.on_dark(channel)
    values, std = density.values[row], density.std[row]
    level = decibels_of_power(values)
    draw_line(recording, path, density.frequency_hz, level, name=style.labels[channel.name], colour=colour)
    # An infinite sigma has no upper bound to draw; a lower bound below zero has no decibels.
    bounds = [decibels_of_power(values - std), decibels_of_power(np.where(np.isfinite(std), values + std, np.nan))]
    draw_band(recording, path, density.frequency_hz, bounds, colour=colour, lines_in_view=lines_in_view)
