"""The arrangement of all views, complete: nothing is left to be moved by hand."""

from collections.abc import Sequence
from dataclasses import dataclass

import rerun.blueprint as rrb

from chladni.viewers.rerun.timelines import TIME

# More plots than this above one another are too flat to read; the rest goes behind tabs.
STACKED = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class ResponseViews:
    """Plots of one group of frequency responses."""

    magnitude: rrb.View
    phase: rrb.View
    coherence: rrb.View
    nyquist: rrb.View
    deflection: rrb.View | None
    label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelViews:
    """Plots of one channel over time; the waveform is missing when only its waterfall is known."""

    label: str
    waveform: rrb.View | None
    waterfall: rrb.View
    spectrum: rrb.View


@dataclass(frozen=True, slots=True, kw_only=True)
class Views:
    """Everything that was drawn of a study; parts without data are empty."""

    findings: rrb.View
    waveforms: Sequence[rrb.View] = ()
    densities: Sequence[rrb.View] = ()
    channels: Sequence[ChannelViews] = ()
    responses: Sequence[ResponseViews] = ()


def arrange(views: Views) -> rrb.Blueprint:
    """Put the views on pages: overview, spectra over time, frequency responses."""
    pages = [_overview(views)]
    if views.channels:
        pages.append(_over_time(views))
    if views.responses:
        pages.append(_responses(views))
    # Nothing is left to heuristics: they would add a view for every entity.
    return rrb.Blueprint(
        rrb.Tabs(*pages, active_tab=0),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        # Paused: a file that starts to play runs away from whoever wants to read it.
        rrb.TimePanel(state="collapsed", timeline=TIME, play_state="paused"),
        auto_layout=False,
        auto_views=False,
    )


def _overview(views: Views) -> rrb.Container:
    columns = [_stack(plots) for plots in (views.waveforms, views.densities) if plots]
    if not columns:
        return rrb.Vertical(views.findings, name="Overview")
    return rrb.Horizontal(views.findings, rrb.Vertical(*columns), column_shares=[1, 2.4], name="Overview")


def _over_time(views: Views) -> rrb.Container:
    return rrb.Tabs(*(_channel(channel) for channel in views.channels), name="Spectra over time")


def _channel(channel: ChannelViews) -> rrb.Container:
    over_time = [channel.waterfall] if channel.waveform is None else [channel.waveform, channel.waterfall]
    shares = [1, 2][-len(over_time) :]
    return rrb.Horizontal(rrb.Vertical(*over_time, row_shares=shares), channel.spectrum, name=channel.label)


def _responses(views: Views) -> rrb.Container:
    name = "Frequency responses"
    if len(views.responses) == 1:
        return _response(views.responses[0], name)
    return rrb.Tabs(*(_response(response, response.label) for response in views.responses), name=name)


def _response(response: ResponseViews, name: str) -> rrb.Container:
    curves = rrb.Vertical(response.magnitude, response.phase, response.coherence, row_shares=[2, 1, 1])
    side = [response.nyquist] if response.deflection is None else [response.deflection, response.nyquist]
    return rrb.Horizontal(curves, rrb.Vertical(*side), column_shares=[1.9, 1], name=name)


def _stack(plots: Sequence[rrb.View]) -> rrb.Container:
    return rrb.Vertical(*plots) if len(plots) <= STACKED else rrb.Tabs(*plots)
