"""The arrangement of all views, complete: nothing is left to be moved by hand."""

from collections.abc import Sequence
from dataclasses import dataclass

import rerun.blueprint as rrb

from chladni.viewers.rerun.timelines import PHASE, PHASE_STEPS_PER_S, TIME

# More tabs than this in one row don't fit into a window.
TABS_IN_A_ROW = 6
# More shapes than this are too small to tell anything.
SEEN_TOGETHER = 24
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
class ShapeViews:
    """A mode that moves: with its names, and small among all others."""

    large: rrb.View
    small: rrb.View


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeViews:
    """Plots of one mode."""

    number: int
    label: str
    frequency: str
    shape: ShapeViews
    complexity: rrb.View


@dataclass(frozen=True, slots=True, kw_only=True)
class ModesViews:
    """Everything about modes; parts without data are empty."""

    text: rrb.View
    shapes: Sequence[ModeViews] = ()
    mac: rrb.View | None = None
    stabilisation: rrb.View | None = None
    synthesis: Sequence[rrb.View] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Views:
    """Everything that was drawn of a study; parts without data are empty."""

    findings: rrb.View
    waveforms: Sequence[rrb.View] = ()
    densities: Sequence[rrb.View] = ()
    channels: Sequence[ChannelViews] = ()
    responses: Sequence[ResponseViews] = ()
    modes: ModesViews | None = None
    pictures: Sequence[rrb.View] = ()


def arrange(views: Views) -> rrb.Blueprint:
    """Put the views on pages: overview, spectra over time, frequency responses, modes."""
    pages = [_overview(views)]
    if views.channels:
        pages.append(_over_time(views))
    if views.responses:
        pages.append(_responses(views))
    if views.modes is not None:
        pages.append(_modes(views.modes))
    if views.pictures:
        pages.append(rrb.Tabs(*views.pictures, name="Pictures"))
    # Nothing is left to heuristics: they would add a view for every entity.
    return rrb.Blueprint(
        rrb.Tabs(*pages, active_tab=_first_page(views, len(pages))),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        # Paused: a file that starts to play runs away from whoever wants to read it.
        rrb.TimePanel(
            state="collapsed",
            timeline=_first_timeline(views),
            play_state="paused",
            loop_mode="all",
            fps=PHASE_STEPS_PER_S,
        ),
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


def _first_page(views: Views, count: int) -> int:
    """The overview, unless it has words alone and there are modes or pictures to look at, which come last."""
    last = views.modes is not None or bool(views.pictures)
    return count - 1 if last and not (views.waveforms or views.densities) else 0


def _first_timeline(views: Views) -> str:
    """Seconds, unless only shapes move: everything else is drawn over seconds too, and nothing over the phase."""
    others = (views.waveforms, views.densities, views.channels, views.responses)
    only_shapes = views.modes is not None and views.modes.shapes and not views.modes.synthesis and not any(others)
    return PHASE if only_shapes else TIME


def _modes(modes: ModesViews) -> rrb.Container:
    """Shapes with what is known of them; on a second page what they were taken from and how well they fit."""
    fit: list[rrb.View | rrb.Container] = [modes.stabilisation] if modes.stabilisation is not None else []
    fit += [rrb.Tabs(*modes.synthesis)] if modes.synthesis else []
    if not fit:
        return _shapes(modes, "Modes")
    shares = [1.3, 1][: len(fit)]
    poles = rrb.Vertical(*fit, row_shares=shares, name="Poles and fit")
    return rrb.Tabs(_shapes(modes, "Shapes"), poles, active_tab=0, name="Modes")


def _shapes(modes: ModesViews, name: str) -> rrb.Container:
    beside = modes.text if modes.mac is None else rrb.Vertical(modes.text, modes.mac, row_shares=[1.3, 1])
    if not modes.shapes:
        return rrb.Horizontal(beside, name=name)
    return rrb.Horizontal(_tabs(modes.shapes), beside, column_shares=[1.7, 1], name=name)


def _tabs(modes: Sequence[ModeViews]) -> rrb.Container:
    """All modes behind rows of tabs that fit into a window, and all together where they can be seen together."""
    tabs = _rows(modes)
    if 1 < len(modes) <= SEEN_TOGETHER:
        tabs.append(rrb.Grid(*(mode.shape.small for mode in modes), name="All"))
    return rrb.Tabs(*tabs, active_tab=0)


def _rows(modes: Sequence[ModeViews]) -> list[rrb.Container]:
    """A tab a mode, or a tab a group of modes, each named by its first and its last, that has tabs again."""
    if len(modes) <= TABS_IN_A_ROW:
        return [_mode(mode) for mode in modes]
    groups = min(TABS_IN_A_ROW, -(-len(modes) // TABS_IN_A_ROW))
    length = -(-len(modes) // groups)
    parts = [modes[start : start + length] for start in range(0, len(modes), length)]
    return [
        rrb.Tabs(
            *_rows(part),
            name=f"{part[0].number}–{part[-1].number}: {part[0].frequency}–{part[-1].frequency} Hz",
        )
        for part in parts
    ]


def _mode(mode: ModeViews) -> rrb.Container:
    return rrb.Horizontal(mode.shape.large, mode.complexity, column_shares=[1.7, 1], name=mode.label)


def _stack(plots: Sequence[rrb.View]) -> rrb.Container:
    return rrb.Vertical(*plots) if len(plots) <= STACKED else rrb.Tabs(*plots)
