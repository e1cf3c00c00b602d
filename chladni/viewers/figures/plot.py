"""One picture of one value, whatever it is: what ``value.plot()`` draws."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial, singledispatch
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.models.core.reading import Chart, InfluenceTable, InstrumentReading
from chladni.models.core.simulation import Simulation
from chladni.signals.arrays import Real
from chladni.signals.cepstrum import Cepstrum
from chladni.signals.channel import Channel
from chladni.signals.coherence import Coherence
from chladni.signals.cross_correlation import CrossCorrelation, TimeDelays
from chladni.signals.deflection_shapes import DeflectionShapes
from chladni.signals.envelope import EnvelopeSpectrum, Kurtogram
from chladni.signals.errors import SetupError
from chladni.signals.filtered_series import FilteredSeries
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.levels import Levels, OctaveLevels, Severity
from chladni.signals.modal_assurance import ModalAssurance
from chladni.signals.mode_set import ModeSet
from chladni.signals.order_spectra import OrderCuts, OrderMap
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.random_vibration import ProbabilityDensity, VibrationResponse
from chladni.signals.shock_response import ShockResponse
from chladni.signals.sine_vibration import SineCheck, SineProfile
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.signals.unit_text import printed_unit
from chladni.signals.value import Value
from chladni.signals.waterfall import Waterfall
from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum
from chladni.viewers.drawing import thin
from chladni.viewers.figures import (
    amplitude,
    cepstrum,
    correlation,
    envelope,
    frf,
    influence,
    levels,
    octaves,
    ods,
    orders,
    psd,
    random_vibration,
    sine_vibration,
    srs,
    waterfall,
)
from chladni.viewers.figures.chart import chart_height_in, draw_chart
from chladni.viewers.figures.mac import draw_mac, name_cells
from chladni.viewers.figures.sheet import WIDTH_IN, legend, look, paint, plain
from chladni.viewers.figures.stabilisation import HEIGHT_IN as STABILISATION_IN
from chladni.viewers.figures.stabilisation import draw_stabilisation
from chladni.viewers.figures.waveforms import POINTS
from chladni.viewers.groups import Group, groups
from chladni.viewers.mode_tables import hertz, mode_ticks
from chladni.viewers.panels import panels
from chladni.viewers.style import ON_LIGHT, Style

# More than these in one figure are too many to look at: the value should be selected from.
MOST_PICTURES = 6
LEGEND_IN, LINES_IN = 0.25, 1.9
CELL_IN = 0.22


@dataclass(frozen=True, slots=True)
class Part:
    """Axes of a picture: their height, and what draws into them."""

    height_in: float
    draw: Callable[[Axes], object]


@dataclass(frozen=True, slots=True)
class Picture:
    """Parts above one another over one axis; the first alone tells most."""

    parts: tuple[Part, ...]
    x_label: str = ""


def draw_pictures(found: Sequence[Picture], *, ax: Axes | None, make: Callable[..., Figure] = Figure) -> Axes:
    """Draw pictures one under another in a figure made by `make`, or the only one's first part into given axes.

    Raises
    ------
    SetupError
        When there is nothing to draw, or more than the axes given can hold.
    """
    if not found:
        raise SetupError("there is nothing to draw: the value holds no line, mode or channel")
    if ax is not None:
        if len(found) > 1:
            raise SetupError(f"it takes {len(found)} pictures: select channels of one unit, or leave ax out")
        found[0].parts[0].draw(ax)
        ax.set_xlabel(found[0].x_label)
        return ax
    shown = found[:MOST_PICTURES]
    parts = [part for picture in shown for part in picture.parts]
    with look():
        heights = [part.height_in for part in parts]
        figure = make(figsize=(WIDTH_IN, sum(heights) + LEGEND_IN * len(shown)), layout="constrained")
        stack: list[Axes] = list(figure.subplots(len(parts), 1, squeeze=False, height_ratios=heights)[:, 0])
        for axes, part in zip(stack, parts, strict=True):
            part.draw(axes)
        _share(stack, shown)
        if len(found) > len(shown):
            figure.supxlabel(f"the first {len(shown)} of {len(found)} pictures; select channels for the others")
    return stack[0]


def _share(stack: Sequence[Axes], shown: Sequence[Picture]) -> None:
    """Let the parts of each picture share their axis, and name it below the last."""
    ends = np.cumsum([len(picture.parts) for picture in shown]).tolist()
    for (first, last), picture in zip(pairwise([0, *ends]), shown, strict=True):
        for axes in stack[first + 1 : last]:
            axes.sharex(stack[first])
        for axes in stack[first : last - 1]:
            axes.tick_params(labelbottom=False)
        stack[last - 1].set_xlabel(picture.x_label)


@singledispatch
def pictures(value: object) -> list[Picture]:
    """Give the pictures of a value, one for each unit and reference."""
    if isinstance(value, Value) and value.AXES and getattr(value, next(iter(value.AXES))).dtype.kind in "fci":
        return [Picture((Part(LINES_IN, partial(_draw_lines, value=value)),), plain(value.ROWS))]
    raise SetupError(f"a {type(value).__name__} has no picture; take its fields")


def _of_groups(
    channels: Sequence[Channel], height_in: float, draw: Callable[..., object], x_label: str
) -> list[Picture]:
    """Give a picture for each group of channels of one unit."""
    return [Picture((Part(height_in, partial(draw, group=group)),), x_label) for group in groups(channels)]


def _of_rows(
    channels: Sequence[Channel], height_in: float, draw: Callable[..., object], x_label: str
) -> list[Picture]:
    """Give a picture for each channel."""
    return [Picture((Part(height_in, partial(draw, row=row)),), x_label) for row in range(len(channels))]


@pictures.register
def _(value: TimeSeries) -> list[Picture]:
    style = Style.of_channels(value.channels)
    draw = partial(_draw_waveforms, series=value, style=style)
    return _of_groups(value.channels, LINES_IN, draw, "Time [s]")


@pictures.register
def _(value: PowerSpectralDensity) -> list[Picture]:
    style = Style.of_channels(value.channels)
    draw = partial(psd.draw_densities, density=value, style=style)
    return _of_groups(value.channels, psd.HEIGHT_IN, draw, "Frequency [Hz]")


@pictures.register
def _(value: FrequencyResponse) -> list[Picture]:
    style = Style.of_channels((*value.references, *value.responses))
    found = []
    for panel in panels(value):
        drawn = [frf.draw_magnitude, frf.draw_phase]
        if frf.is_coherent(panel):
            drawn.append(frf.draw_coherence)
        parts = tuple(
            Part(height_in, partial(draw, panel=panel, style=style))
            for draw, height_in in zip(drawn, frf.HEIGHTS_IN, strict=False)
        )
        found.append(Picture(parts, "Frequency [Hz]"))
    return found


@pictures.register
def _(value: Coherence) -> list[Picture]:
    style = Style.of_channels(value.responses)
    return [Picture((Part(LINES_IN, partial(_draw_coherence, coherence=value, style=style)),), "Frequency [Hz]")]


@pictures.register
def _(value: Levels) -> list[Picture]:
    style = Style.of_channels(value.channels, origin_ns=value.running.start_time_ns)
    return [
        Picture(
            tuple(
                Part(height_in, partial(draw, levels=value, column=column, group=group, style=style))
                for draw, height_in in zip(
                    (levels.draw_strength, levels.draw_kurtosis), levels.HEIGHTS_IN, strict=True
                )
            ),
            levels.levels_label(value, column),
        )
        for column in range(len(value.bands_hz))
        for group in groups(value.channels)
    ]


@pictures.register
def _(value: Severity) -> list[Picture]:
    style = Style.of_channels(value.channels, origin_ns=value.running.start_time_ns)
    draw = partial(levels.draw_severity, severity=value, style=style)
    return _of_groups(value.channels, levels.SEVERITY_HEIGHT_IN, draw, levels.severity_label(value))


@pictures.register
def _(value: OctaveLevels) -> list[Picture]:
    style = Style.of_channels(value.channels)
    draw = partial(octaves.draw_octaves, found=value, style=style)
    return _of_groups(value.channels, octaves.HEIGHT_IN, draw, octaves.octaves_label(value))


@pictures.register
def _(value: EnvelopeSpectrum) -> list[Picture]:
    style = Style.of_channels([value.channel])
    draw = partial(envelope.draw_envelope, found=value, style=style)
    return [Picture((Part(envelope.SPECTRUM_IN, draw),), envelope.envelope_label(value))]


@pictures.register
def _(value: Cepstrum) -> list[Picture]:
    style = Style.of_channels(value.channels)
    draw = partial(cepstrum.draw_cepstrum, found=value, style=style)
    return _of_rows(value.channels, cepstrum.HEIGHT_IN, draw, cepstrum.X_LABEL)


@pictures.register
def _(value: Kurtogram) -> list[Picture]:
    found = []
    for row in range(len(value.channels)):
        best = value.best(row)
        band_hz = (float(value.low_hz[best]), float(value.high_hz[best]))
        draw = partial(envelope.draw_kurtogram, gram=value, band_hz=band_hz, row=row)
        found.append(Picture((Part(envelope.KURTOGRAM_IN, draw),), "Frequency [Hz]"))
    return found


@pictures.register
def _(value: Waterfall) -> list[Picture]:
    style = Style.of_channels(value.channels, origin_ns=value.start_time_ns)
    draw = partial(_draw_waterfall, fall=value, style=style)
    return _of_rows(value.channels, LINES_IN, draw, "Time [s]")


@pictures.register
def _(value: ModeSet) -> list[Picture]:
    if not value.frequency_hz.size:
        return []
    height_in = 0.9 + CELL_IN * len(value.channels)
    return [Picture((Part(height_in, partial(_draw_shapes, modes=value)),), "Mode: frequency [Hz]")]


@pictures.register
def _(value: StabilisationDiagram) -> list[Picture]:
    numbers = np.unique(value.mode[value.mode >= 0])
    modes_hz = np.array([float(value.frequency_hz[value.mode == number].mean()) for number in numbers])
    draw = partial(draw_stabilisation, diagram=value, modes_hz=modes_hz)
    return [Picture((Part(STABILISATION_IN, draw),), "Frequency [Hz]")]


@pictures.register
def _(value: ModalAssurance) -> list[Picture]:
    if not value.values.size:
        return []
    return [Picture((Part(1.2 + CELL_IN * value.a_hz.size, partial(_draw_assurance, found=value)),), "Mode of b: Hz")]


@pictures.register
def _(value: FilteredSeries) -> list[Picture]:
    return pictures(value.series)


@pictures.register
def _(value: ShockResponse) -> list[Picture]:
    style = Style.of_channels(value.channels)
    draw = partial(srs.draw_shock, response=value, style=style)
    return _of_groups(value.channels, srs.HEIGHT_IN, draw, srs.X_LABEL)


@pictures.register
def _(value: OrderMap) -> list[Picture]:
    labels = Style.of_channels(value.channels).labels
    return [
        Picture(
            (Part(orders.MAP_IN, partial(orders.draw_order_map, found=value, row=row, label=labels[channel.name])),),
            orders.along(value)[1],
        )
        for row, channel in enumerate(value.channels)
    ]


@pictures.register
def _(value: OrderCuts) -> list[Picture]:
    drawn = zip(orders.CUTS_IN, (orders.draw_order_sizes, orders.draw_order_phases), strict=True)
    parts = [(height_in, draw) for height_in, draw in drawn]
    return [
        Picture(
            tuple(Part(height_in, partial(draw, cuts=value, row=row)) for height_in, draw in parts),
            orders.along(value)[1],
        )
        for row in range(len(value.channels))
    ]


@pictures.register
def _(value: CrossCorrelation) -> list[Picture]:
    return _correlations(value, np.full(len(value.responses), np.nan))


@pictures.register
def _(value: TimeDelays) -> list[Picture]:
    return _correlations(value.correlation, value.delay_s)


def _correlations(found: CrossCorrelation, delays_s: Real) -> list[Picture]:
    parts = tuple(
        Part(correlation.HEIGHT_IN, partial(_draw_correlation, found=found, row=row, delay_s=delay_s))
        for row, delay_s in enumerate(delays_s.tolist())
    )
    return [Picture(parts, plain(f"Lag after {found.reference.name} [s]"))]


@pictures.register
def _(value: DeflectionShapes) -> list[Picture]:
    return [
        Picture(
            tuple(
                Part(ods.HEIGHT_IN, partial(_draw_deflection, found=value, group=group, row=row))
                for row in range(value.frequency_hz.size)
            )
        )
        for group in groups(value.channels, size=len(value.channels))
    ]


@pictures.register
def _(value: AmplitudeSpectrum) -> list[Picture]:
    style = Style.of_channels(value.channels)
    draw = partial(amplitude.draw_amplitudes, found=value, style=style)
    return _of_groups(value.channels, amplitude.HEIGHT_IN, draw, "Frequency [Hz]")


@pictures.register
def _(value: ProbabilityDensity) -> list[Picture]:
    style = Style.of_channels(value.channels)
    draw = partial(random_vibration.draw_probability, found=value, style=style)
    return [Picture((Part(random_vibration.HEIGHT_IN, draw),), "Deviation from the mean [standard deviations]")]


@pictures.register
def _(value: SineProfile) -> list[Picture]:
    draw = partial(sine_vibration.draw_sine_profile, profile=value)
    return [Picture((Part(sine_vibration.HEIGHT_IN, draw),), "Frequency [Hz]")]


@pictures.register
def _(value: SineCheck) -> list[Picture]:
    draw = partial(sine_vibration.draw_sine_check, found=value, style=Style.of_channels(value.channels))
    return [Picture((Part(sine_vibration.HEIGHT_IN, draw),), "Frequency [Hz]")]


@pictures.register
def _(value: VibrationResponse) -> list[Picture]:
    style = Style.of_channels(value.channels)
    draw = partial(random_vibration.draw_vibration_response, found=value, style=style)
    return _of_groups(value.channels, random_vibration.HEIGHT_IN, draw, "Natural frequency [Hz]")


@pictures.register
def _(value: Simulation) -> list[Picture]:
    return [*pictures(value.outputs), *pictures(value.inputs)]


@pictures.register
def _(value: InfluenceTable) -> list[Picture]:
    rows = value.log_derivative.shape[0]
    height_in = 1.3 + influence.ROW_IN * rows
    return [Picture((Part(height_in, partial(influence.draw_influence, table=value)),))]


@pictures.register
def _(value: Chart) -> list[Picture]:
    return [
        Picture((Part(chart_height_in(value), partial(draw_chart, chart=value)),), plain(printed_unit(value.x_label)))
    ]


@pictures.register
def _(value: InstrumentReading) -> list[Picture]:
    return [picture for chart in value.charts for picture in pictures(chart)]


@pictures.register
def _(value: Study) -> list[Picture]:
    held: list[Any] = [*value.densities, value.response, value.modes]
    return [picture for one in held if one is not None for picture in pictures(one)]


def _draw_waveforms(axes: Axes, series: TimeSeries, group: Group, style: Style) -> None:
    for row in group.rows:
        values = series.values[row].astype(np.float64)
        if series.valid is not None:
            values[~series.valid[row]] = np.nan
        chosen, _ = thin(values, limit=POINTS)
        channel = series.channels[row]
        axes.plot(
            chosen / series.sample_rate_hz,
            values[chosen],
            color=paint(style.on_light(channel)),
            linewidth=0.6,
            label=plain(style.labels[channel.name]),
        )
    axes.set_xlim(0.0, series.duration_s)
    axes.set_ylabel(group.title)
    legend(axes)


def _draw_coherence(axes: Axes, coherence: Coherence, style: Style) -> None:
    for channel, values in zip(coherence.responses, coherence.values, strict=True):
        colour = paint(style.on_light(channel))
        axes.plot(coherence.frequency_hz, values, color=colour, label=plain(style.labels[channel.name]))
    axes.set_xlim(coherence.frequency_hz[0], coherence.frequency_hz[-1])
    axes.set_ylim(0, 1.04)
    axes.set_ylabel(f"{coherence.kind.capitalize()} coherence [1]")
    legend(axes)


def _draw_waterfall(axes: Axes, fall: Waterfall, row: int, style: Style) -> None:
    level = waterfall.level_of(fall, row)
    image = waterfall.draw_waterfall(axes, fall, level, waterfall.colour_limits([level]), style)
    waterfall.add_scale(image, [axes], Group(name="", unit=fall.channels[row].unit, rows=(row,)))
    axes.set_title(plain(style.labels[fall.channels[row].name]), loc="left", pad=2)
    axes.set_ylabel("Frequency [Hz]")


def _draw_shapes(axes: Axes, modes: ModeSet) -> None:
    """Draw the real part of every shape as a column, blue and orange to both sides of white."""
    style = Style.of_channels(modes.channels)
    axes.grid(visible=False)
    image = axes.imshow(modes.shapes.real.T, vmin=-1, vmax=1, cmap=mpl.colormaps["PuOr"], aspect="auto")
    labels = [style.labels[channel.name] for channel in modes.channels]
    name_cells(axes, labels, mode_ticks(modes))
    bar = axes.figure.colorbar(image, ax=axes, aspect=25, pad=0.02)
    bar.set_label("Re ψ, largest 1")
    bar.outline.set_linewidth(0.0)


def _draw_assurance(axes: Axes, found: ModalAssurance) -> None:
    rows, columns = (
        [f"{row + 1}: {hertz(hz)}" if np.isfinite(hz) else str(row + 1) for row, hz in enumerate(numbers.tolist())]
        for numbers in (found.a_hz, found.b_hz)
    )
    draw_mac(axes, found.values, rows=rows, columns=columns)
    axes.set_ylabel("Mode of a: Hz")


def _draw_correlation(axes: Axes, found: CrossCorrelation, row: int, delay_s: float) -> None:
    correlation.draw_correlation(axes, found, row, delay_s)
    axes.set_title(plain(found.responses[row].name), loc="left", pad=2)
    axes.set_ylabel("Correlation")


def _draw_deflection(axes: Axes, found: DeflectionShapes, group: Group, row: int) -> None:
    labels = Style.of_channels(found.channels).labels
    ods.draw_deflection(axes, found, group, row)
    ods.name_channels(axes, [plain(labels[found.channels[column].name]) for column in group.rows])
    axes.set_ylabel(f"RMS [{printed_unit(group.unit)}]")
    if row == 0:
        legend(axes, above_points=10.0)


def _draw_lines(axes: Axes, value: Value) -> None:
    """Draw the main field of any value over its rows, a line for each channel."""
    name, along = next(iter(value.AXES.items()))
    numbers = np.moveaxis(getattr(value, name), along.index(value.ROWS), -1)
    flat = np.abs(numbers) if np.iscomplexobj(numbers) else numbers
    others = [one for one in along if one != value.ROWS]
    labels = [str(label) for label in value.coordinate(others[0])] if len(others) == 1 else []
    for place, line in enumerate(flat.reshape(-1, flat.shape[-1])):
        label = plain(labels[place]) if labels else None
        axes.plot(value.coordinate(value.ROWS), line, color=paint(ON_LIGHT[place % len(ON_LIGHT)]), label=label)
    unit = value.unit_at(name, (0,) * len(others))
    axes.set_ylabel(f"{name} [{printed_unit(unit)}]" if unit else name)
    legend(axes)
