"""A live source drawn as it comes: waveforms that scroll, spectra that settle, modes that are followed."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor
from typing import Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from chladni.signals.arrays import Real
from chladni.signals.channel import Channel
from chladni.signals.live_state import LiveState, TrackedMode
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.time_series import NS_PER_S, TimeSeries
from chladni.signals.visible import visible
from chladni.signals.waterfall import Waterfall
from chladni.viewers.drawing import block_maximum, decibels_of_amplitude, decibels_of_power
from chladni.viewers.groups import Group, groups
from chladni.viewers.labels import decibel_unit, thinned
from chladni.viewers.rerun.canvas import Canvas, draw_labels
from chladni.viewers.rerun.drawing import APPLICATION
from chladni.viewers.rerun.entities import folder
from chladni.viewers.rerun.lifetimes import send_blueprint
from chladni.viewers.rerun.live_waterfalls import LiveWaterfalls
from chladni.viewers.rerun.timelines import TIME, log_at, send_scalars, time_index
from chladni.viewers.style import ON_DARK, Style

#: Seconds of waveform that are seen at a time.
SCROLL_S: Final = 5.0
#: Seconds over which modes are seen.
MODES_S: Final = 120.0
#: Values a second that are drawn as they are; of more, the extremes of stretches.
VALUES_A_SECOND: Final = 300_000
#: How often curves are redrawn, in seconds of the source.
CURVES_EVERY_S: Final = 0.5
#: Points of a curve: about as many as a window has pixels.
POINTS: Final = 1200
#: Size of canvases; coherence has less height.
CANVAS: Final = (1000.0, 480.0)
FLAT: Final = 220.0
SPAN_DB: Final = 100.0
STEP_DB: Final = 20.0


@dataclass(slots=True, kw_only=True, eq=False)
class _Plane:
    """A canvas whose range is widened when a curve leaves it."""

    path: str
    canvas: Canvas | None = None

    def fitted(
        self,
        recording: rr.RecordingStream,
        high_hz: float,
        levels: Real,
        *,
        name: str,
        step: float,
        span: float,
        height: float = CANVAS[1],
    ) -> Canvas:
        """Give the canvas that holds these levels, with its axes drawn."""
        known = levels[np.isfinite(levels)]
        top = step * ceil(float(known.max()) / step + 0.05) if known.size else 0.0
        lowest = max(float(known.min()), top - span) if known.size else top - span
        bottom = min(step * floor(lowest / step), top - step)
        canvas = self.canvas
        if canvas is None or top > canvas.y_range[1] or bottom < canvas.y_range[0] or canvas.x_range[1] != high_hz:
            if canvas is not None and canvas.x_range[1] == high_hz:
                top, bottom = max(top, canvas.y_range[1]), min(bottom, canvas.y_range[0])
            canvas = Canvas(width=CANVAS[0], height=height, x_range=(0.0, high_hz), y_range=(bottom, top))
            canvas.draw_axes(recording, f"{self.path}/axes", x_name="Hz", y_name=name)
            self.canvas = canvas
        return canvas


class LiveDrawing:
    """Draws states of one source into one recording, which is connected already.

    Parameters
    ----------
    recording
        Where to.
    """

    def __init__(self, recording: rr.RecordingStream) -> None:
        self._recording = recording
        self._style: Style | None = None
        self._channels: tuple[Channel, ...] = ()
        self._grids: list[tuple[tuple[Channel, ...], float]] = []
        self._origin_ns = 0
        self._stretch = 1
        self._planes: dict[str, _Plane] = {}
        self._falls = LiveWaterfalls(recording)
        self._curves_s = -np.inf
        self._parts: set[str] = set()
        self._tracked: set[int] = set()

    def draw(self, state: LiveState, *, curves: bool = True) -> bool:
        """Write what is new in a state; whether views were added, so that they have to be arranged anew.

        Parameters
        ----------
        state
            What there is.
        curves
            Whether averages are drawn; a state with newer ones may be waiting.
        """
        if self._style is None:
            self._recording.send_recording_name(visible(state.title))
            self._origin_ns = state.start_time_ns
        before = len(self._parts) + len(self._grids) + self._falls.count
        self._note_channels(state)
        for event in state.events:
            log_at(
                self._recording, "/events", event.time_s, rr.TextLog(visible(event.text), level=_level(event.kind))
            )
        for series in state.series:
            self._waveforms(series)
        if curves and state.fresh and (state.time_s - self._curves_s >= CURVES_EVERY_S or state.ended):
            self._curves_s = state.time_s
            self._curves(state)
        if self._style is not None and (curves or state.ended):
            self._falls.draw(state, self._style, origin_ns=self._origin_ns)
        return len(self._parts) + len(self._grids) + self._falls.count > before

    def arrange(self) -> None:
        """Send the blueprint: everything in its place."""
        send_blueprint(self._recording, self._blueprint())

    # --- waveforms ---

    def _note_channels(self, state: LiveState) -> None:
        for series in state.series:
            if series.channels not in [channels for channels, _ in self._grids]:
                self._grids.append((series.channels, series.sample_rate_hz))
                self._channels += tuple(one for one in series.channels if one not in self._channels)
                self._style = Style.of_channels(self._channels, origin_ns=self._origin_ns)
                self._stretch = ceil(sum(len(some) * rate for some, rate in self._grids) / VALUES_A_SECOND)
                for group, path in self._groups(series.channels):
                    names = [self._style.labels[series.channels[row].name] for row in group.rows]
                    colours = [self._style.on_dark(series.channels[row]) for row in group.rows]
                    lines = rr.SeriesLines(
                        names=names, colors=colours, widths=[1.0] * len(names), aggregation_policy="MinMax"
                    )
                    self._recording.log(path, lines, static=True)

    def _groups(self, channels: tuple[Channel, ...]) -> list[tuple[Group, str]]:
        place = [some for some, _ in self._grids].index(channels) + 1
        return [(group, folder("waveforms", str(place), group.name)) for group in groups(channels)]

    def _waveforms(self, series: TimeSeries) -> None:
        values, places = _thinned(series, self._stretch)
        start_ns = series.start_time_ns - self._origin_ns
        offsets_ns = np.rint(places / series.sample_rate_hz * NS_PER_S).astype(np.int64) + start_ns
        for group, path in self._groups(series.channels):
            send_scalars(
                self._recording, path, time_index(offsets_ns), np.ascontiguousarray(values[list(group.rows)].T)
            )

    # --- curves ---

    def _curves(self, state: LiveState) -> None:
        for place, density in enumerate(state.densities, start=1):
            exponential = state.exponential[place - 1] if place <= len(state.exponential) else None
            held = state.peak_hold[place - 1] if place <= len(state.peak_hold) else None
            for group in groups(density.channels):
                path = folder("density", str(place), group.name)
                self._densities(state.time_s, path, group, (density, exponential, held))
        if state.response is not None and state.coherence is not None:
            self._response(state)
        for levels in state.levels:
            rms = np.where(np.isfinite(levels.rms[:, 0]), levels.rms[:, 0], np.nan)
            for group in groups(levels.channels):
                path = folder("levels", group.name)
                self._scalars(path, state.time_s, rms[list(group.rows)], [levels.channels[row] for row in group.rows])
        self._modes(state)

    def _densities(
        self,
        time_s: float,
        path: str,
        group: Group,
        densities: tuple[PowerSpectralDensity, PowerSpectralDensity | None, PowerSpectralDensity | None],
    ) -> None:
        mean, exponential, held = densities
        if self._style is None:
            return
        levels = [decibels_of_power(one.values[list(group.rows)]) for one in densities if one is not None]
        plane = self._plane(path)
        unit = decibel_unit(mean.units[group.rows[0]])
        canvas = plane.fitted(
            self._recording,
            float(mean.frequency_hz[-1]),
            np.concatenate([one[:, 1:] for one in levels]),
            name=unit,
            step=STEP_DB,
            span=SPAN_DB,
        )
        colours = [self._style.on_dark(mean.channels[row]) for row in group.rows]
        for part, density, alpha, width in (
            ("held", held, 70, 0.75), ("exponential", exponential, 120, 0.75), ("mean", mean, 255, 1.25),
        ):  # fmt: skip
            if density is not None:
                curves = decibels_of_power(density.values[list(group.rows)])
                self._strips(f"{path}/{part}", time_s, canvas, density.frequency_hz, curves, colours, alpha, width)
        self._legend(path, canvas, [mean.channels[row] for row in group.rows])

    def _response(self, state: LiveState) -> None:
        response, coherent = state.response, state.coherence
        if response is None or coherent is None or self._style is None:
            return
        reference = self._style.labels[response.references[0].name]
        for group in groups(response.responses):
            rows = list(group.rows)
            values = np.where(response.excited, np.abs(response.values[rows, 0]), np.nan)
            levels = decibels_of_amplitude(values)
            path = folder("response", group.name)
            colours = [self._style.on_dark(response.responses[row]) for row in rows]
            name = decibel_unit(response.unit_at("values", (rows[0], 0)))
            canvas = self._plane(path).fitted(
                self._recording, float(response.frequency_hz[-1]), levels, name=name, step=STEP_DB, span=SPAN_DB
            )
            self._strips(f"{path}/curves", state.time_s, canvas, response.frequency_hz, levels, colours, 255, 1.25)
            self._legend(path, canvas, [response.responses[row] for row in rows], over=reference)
            path = folder("coherence", group.name)
            canvas = self._plane(path).fitted(
                self._recording,
                float(coherent.frequency_hz[-1]),
                np.array([0.0, 0.95]),
                name="",
                step=0.2,
                span=1.0,
                height=FLAT,
            )
            values = coherent.values[rows]
            self._strips(f"{path}/curves", state.time_s, canvas, coherent.frequency_hz, values, colours, 255, 1.25)

    def _plane(self, path: str) -> _Plane:
        self._parts.add(path)
        return self._planes.setdefault(path, _Plane(path=path))

    def _strips(
        self,
        path: str,
        time_s: float,
        canvas: Canvas,
        frequency_hz: Real,
        curves: Real,
        colours: Sequence[tuple[int, int, int]],
        alpha: int,
        width: float,
    ) -> None:
        shown, run = block_maximum(curves, axis=1, limit=POINTS)
        places = frequency_hz[::run]
        strips, chosen = [], []
        for curve, colour in zip(np.clip(shown, *canvas.y_range), colours, strict=True):
            for first, last in _known_runs(curve):
                strips.append(canvas.places(places[first:last], curve[first:last]))
                chosen.append((*colour, alpha))
        log_at(
            self._recording,
            path,
            time_s,
            rr.LineStrips2D(strips, colors=chosen or None, radii=rr.Radius.ui_points(width), draw_order=5.0),
        )

    def _legend(self, path: str, canvas: Canvas, channels: Sequence[Channel], over: str = "") -> None:
        if f"{path}/legend" in self._parts or self._style is None:
            return
        self._parts.add(f"{path}/legend")
        texts = [self._style.labels[channel.name] + (f" / {over}" if over else "") for channel in channels]
        places = np.array([(canvas.width - 120.0, 32.0 * row) for row in range(len(texts))])
        draw_labels(
            self._recording, f"{path}/legend", places, texts, colours=[self._style.on_dark(one) for one in channels]
        )

    # --- modes ---

    def _modes(self, state: LiveState) -> None:
        for mode in state.tracked:
            path = f"/modes/{mode.number}"
            if mode.number not in self._tracked:
                self._tracked.add(mode.number)
                colour = ON_DARK[(mode.number - 1) % len(ON_DARK)]
                look = rr.SeriesPoints(names=f"mode {mode.number}", colors=[colour], marker_sizes=3.0)
                self._recording.log(path, look, static=True)
            if mode.missed == 0:
                log_at(self._recording, path, mode.last_s, rr.Scalars(mode.frequency_hz))
        text = rr.TextDocument(_mode_table(state.tracked), media_type=rr.MediaType.MARKDOWN)
        log_at(self._recording, "/mode_table", state.time_s, text)

    # --- writing ---

    def _scalars(self, path: str, time_s: float, values: Real, channels: Sequence[Channel]) -> None:
        if path not in self._parts and self._style is not None:
            self._parts.add(path)
            lines = rr.SeriesLines(
                names=[self._style.labels[one.name] for one in channels],
                colors=[self._style.on_dark(one) for one in channels],
                widths=[1.5] * len(channels),
            )
            self._recording.log(path, lines, static=True)
        send_scalars(self._recording, path, time_index(_ns(time_s)), values[np.newaxis])

    # --- arrangement ---

    def _blueprint(self) -> rrb.Blueprint:
        waves = [
            self._scroll(path, f"{group.title}{thinned(self._stretch)}")
            for channels, _ in self._grids
            for group, path in self._groups(channels)
        ]
        spectra = [self._plane_view(path, "PSD") for path in sorted(self._parts) if self._is_plane(path, "/density")]
        answers = [self._plane_view(path, "H1") for path in sorted(self._parts) if self._is_plane(path, "/response")]
        coherences = [
            self._plane_view(path, "Coherence") for path in sorted(self._parts) if self._is_plane(path, "/coherence")
        ]
        events = rrb.TextLogView(origin="/events", name="What happened and changed")
        modes = rrb.Horizontal(
            rrb.TimeSeriesView(origin="/modes", name="Modes of the present [Hz]", axis_x=_last(MODES_S)),
            rrb.TextDocumentView(origin="/mode_table", name="Modes of the present"),
            column_shares=[1, 1.1],
            name="Modes",
        )
        levels = [
            rrb.TimeSeriesView(origin=path, name=f"RMS, {path.rsplit('/', 1)[-1].replace('_', ' ')}")
            for path in sorted(self._parts)
            if path.startswith("/levels")
        ]
        first = rrb.Horizontal(
            rrb.Vertical(_stack(waves), events, row_shares=[2.2, 1]),
            rrb.Vertical(rrb.Tabs(*spectra), modes, row_shares=[1.5, 1]),
            column_shares=[1, 1.1],
            name="Overview",
        )
        pages: list[rrb.Container] = [first]
        if self._falls.count:
            pages.append(rrb.Tabs(*self._falls.views(), name="Waterfalls"))
        if answers:
            pages.append(
                rrb.Vertical(_stack(answers), _stack(coherences), row_shares=[2, 1], name="Frequency responses")
            )
        if levels:
            pages.append(rrb.Vertical(*levels, name="Levels"))
        return rrb.Blueprint(
            rrb.Tabs(*pages, active_tab=0),
            rrb.BlueprintPanel(state="hidden"),
            rrb.SelectionPanel(state="hidden"),
            # The newest sample is what one looks for, in a file as well: at its first none there is nothing yet.
            rrb.TimePanel(state="collapsed", timeline=TIME, play_state="following"),
            auto_layout=False,
            auto_views=False,
        )

    def _is_plane(self, path: str, parent: str) -> bool:
        return path.startswith(f"{parent}/") and not path.endswith("/legend")

    def _scroll(self, path: str, name: str) -> rrb.View:
        return rrb.TimeSeriesView(
            origin=path,
            name=visible(name),
            axis_x=_last(SCROLL_S),
            plot_legend=rrb.PlotLegend(visible=True, corner=rrb.Corner2D.LeftTop),
        )

    def _plane_view(self, path: str, what: str) -> rrb.View:
        canvas = self._planes[path].canvas
        name = f"{what}, {path.rsplit('/', 1)[-1].replace('_', ' ')}"
        if canvas is None:
            raise AssertionError("a plane without a canvas has no view")
        # Above stands the name of the axis, where it has one.
        return canvas.view(path, name, left=110.0, above=30.0 if canvas.height == FLAT else 100.0)


def _last(seconds: float) -> rrb.TimeAxis:
    """An axis of so many seconds up to the cursor."""
    boundary = rr.TimeRangeBoundary
    return rrb.TimeAxis(
        view_range=rr.TimeRange(
            start=boundary.cursor_relative(seconds=-seconds), end=boundary.cursor_relative(seconds=0.0)
        )
    )


def _stack(views: Sequence[rrb.View]) -> rrb.Container:
    return rrb.Vertical(*views) if len(views) <= 3 else rrb.Tabs(*views)


def _ns(time_s: float) -> NDArray[np.int64]:
    return np.array([round(time_s * NS_PER_S)], np.int64)


def _level(kind: str) -> str:
    told = {"gap": "WARN", "clock": "WARN", "silent": "WARN", "skipped": "WARN", "late": "WARN", "sensor": "WARN"}
    return told.get(kind, "INFO")


def _thinned(series: TimeSeries, stretch: int) -> tuple[Real, Real]:
    """Values ``[channel, row]`` and their places; of stretches of samples the least and the greatest."""
    values = series.values.astype(np.float64)
    if series.valid is not None:
        values[~series.valid] = np.nan
    if stretch <= 2 or series.samples < 2 * stretch:
        return values, np.arange(series.samples, dtype=np.float64)
    starts = np.arange(0, series.samples, stretch)
    low, high = np.fmin.reduceat(values, starts, axis=1), np.fmax.reduceat(values, starts, axis=1)
    shown = np.stack((low, high), axis=-1).reshape(len(values), -1)
    places = np.stack((starts, starts + stretch / 2), axis=-1).ravel()
    return shown, places


def _known_runs(curve: Real) -> list[tuple[int, int]]:
    """Stretches of two points and more without a NaN."""
    known = np.concatenate(([False], np.isfinite(curve), [False]))
    edges = np.flatnonzero(known[1:] != known[:-1])
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]


def _mode_table(modes: Sequence[TrackedMode]) -> str:
    if not modes:
        return "No mode stands out of the scatter yet."
    head = "| mode | Hz | ± | damping % | ± | MAC | seen |\n|---:|---:|---:|---:|---:|---:|---:|\n"
    rows = [
        f"| {one.number} | {one.frequency_hz:.5g} | {one.frequency_std_hz:.2g} | {100 * one.damping_ratio:.3g} | "
        f"{100 * one.damping_std:.2g} | {one.mac:.2f} | {one.looks} |"
        for one in modes
    ]
    return head + "\n".join(rows)


def rehearse() -> None:
    """Draw a made state into a recording that nobody sees, so that the first one that counts isn't late."""
    recording = rr.RecordingStream(APPLICATION)
    stream = rr.binary_stream(recording)
    noise = np.random.default_rng(0).standard_normal((2, 256))
    series = TimeSeries.from_arrays(noise, sample_rate_hz=256.0, units="m/s^2")
    density = PowerSpectralDensity.from_arrays(np.arange(9.0), noise[:, :9] ** 2, units="m/s^2", averages=9)
    fall = Waterfall(
        time_s=np.arange(4.0),
        frequency_hz=np.arange(9.0),
        values=np.ones((1, 4, 9)),
        channels=series.channels[:1],
        start_time_ns=0,
        bandwidth_hz=1.5,
        provenance=density.provenance,
    )
    drawing = LiveDrawing(recording)
    state = LiveState(title="", series=(series,), fresh=True, densities=(density,), waterfalls=(fall,), ended=True)
    drawing.draw(state)
    drawing.arrange()
    stream.read()
    recording.disconnect()
