"""Envelope spectra under the kurtogram that chose their band, with a bearing's frequencies."""

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from chladni.signals.envelope import EnvelopeSpectrum, Kurtogram
from chladni.signals.study import Study
from chladni.signals.unit_text import printed_unit
from chladni.viewers.figures.peak_labels import STRIP_POINTS, label_peaks
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.style import ON_LIGHT, Colour, Style

KURTOGRAM_IN, SPECTRUM_IN = 1.7, 2.3
# Beside the mean, which isn't drawn, and above the highest frequency that is looked for.
LINES_LEFT_OUT, ROOM = 3, 1.3
# Without a bearing: lines that a figure of this width can still tell apart.
MOST_LINES = 1000
# Of the band that was chosen: no colour of the kurtogram's scale is near it.
FRAME = ON_LIGHT[1]


def envelope_figures(study: Study) -> dict[str, Figure]:
    """Draw each channel's envelope spectrum, by name; above it the kurtogram with the band framed, where it chose."""
    style = Style.of(study)
    with look():
        return {f"envelope {place}": _figure(one, style) for place, one in enumerate(study.envelopes, start=1)}


def envelope_label(found: EnvelopeSpectrum) -> str:
    """Say what runs along the axis of a picture of an envelope spectrum."""
    return f"Frequency [Hz], envelope of {_hertz(found.band_hz[0])} to {_hertz(found.band_hz[1])} Hz"


def _figure(found: EnvelopeSpectrum, style: Style) -> Figure:
    heights = [SPECTRUM_IN] if found.kurtogram is None else [KURTOGRAM_IN, SPECTRUM_IN]
    figure, stack = sheet(heights, above_points=STRIP_POINTS if found.peaks else 0.0)
    if found.kurtogram is not None:
        draw_kurtogram(stack[0], gram=found.kurtogram, band_hz=found.band_hz)
        stack[0].set_xlabel("Frequency [Hz]")
    draw_envelope(stack[-1], found=found, style=style)
    stack[-1].set_xlabel(envelope_label(found))
    return figure


def draw_kurtogram(axes: Axes, gram: Kurtogram, band_hz: tuple[float, float], *, row: int = 0) -> None:
    """Draw a channel's kurtogram, and frame a band."""
    # A level for each width, the widest above, as everywhere in the field.
    widths = np.round(np.log2((gram.high_hz[0] - gram.low_hz[0]) / (gram.high_hz - gram.low_hz)), 6)
    levels = np.unique(widths, return_inverse=True)[1]
    boxes = [_box(low, high, level) for low, high, level in zip(gram.low_hz, gram.high_hz, levels, strict=True)]
    values = gram.kurtosis[row]
    bands = PolyCollection(boxes, array=values, cmap=mpl.colormaps["viridis"], linewidths=0)
    bands.set_clim(0.0, max(float(values.max()), 0.1))
    axes.add_collection(bands)
    chosen = int(np.argmin(np.abs(gram.low_hz - band_hz[0]) + np.abs(gram.high_hz - band_hz[1])))
    frame = PolyCollection([boxes[chosen]], facecolors="none", edgecolors=[paint(FRAME)], linewidths=1.4)
    # Those from 0 Hz are never taken, however bright.
    frame.set_label("the band that is taken, not from 0 Hz")
    axes.add_collection(frame)
    legend(axes)
    axes.set_xlim(0.0, gram.high_hz[0])
    axes.set_ylim(levels.max() + 0.5, -0.5)
    ticks = list(range(0, levels.max() + 1, 3))
    axes.set_yticks(ticks, [_hertz(float((gram.high_hz - gram.low_hz)[levels == level][0])) for level in ticks])
    axes.set_ylabel("Width [Hz]")
    axes.grid(visible=False)
    bar = axes.figure.colorbar(bands, ax=axes, pad=0.02, aspect=12)
    bar.set_label("Spectral kurtosis")
    bar.outline.set_linewidth(0.0)


def _box(low_hz: float, high_hz: float, row: int) -> list[tuple[float, float]]:
    return [(low_hz, row - 0.5), (high_hz, row - 0.5), (high_hz, row + 0.5), (low_hz, row + 0.5)]


def draw_envelope(axes: Axes, found: EnvelopeSpectrum, style: Style) -> None:
    """Draw a squared envelope spectrum, with the frequencies of a bearing."""
    frequency_hz, amplitude = found.frequency_hz, found.amplitude
    highest_hz = ROOM * max((fault.expected_hz for fault in found.faults), default=0.0)
    end_hz = min(highest_hz or frequency_hz[min(MOST_LINES, frequency_hz.size - 1)], float(frequency_hz[-1]))
    shown = (np.arange(frequency_hz.size) >= LINES_LEFT_OUT) & (frequency_hz <= end_hz)
    top = float(amplitude[shown].max(initial=0.0)) or 1.0
    colour, label = paint(style.on_light(found.channel)), plain(style.labels[found.channel.name])
    label += "" if found.peaks else ": no line stands out"
    axes.plot(frequency_hz[shown], amplitude[shown], color=colour, label=label)
    _marks(axes, found)
    axes.set_xlim(0.0, end_hz)
    axes.set_ylim(0.0, 1.05 * top)
    legend(axes, above_points=label_peaks(axes, found.peaks))
    axes.set_ylabel(f"Squared envelope [{printed_unit(found.density.channels[0].unit)}]")


def _marks(axes: Axes, found: EnvelopeSpectrum) -> None:
    """Draw a bearing's frequencies and their multiples, a colour and an entry of the legend for each."""
    colours = iter(colour for colour in ON_LIGHT[1:] if colour != FRAME)
    drawn: dict[str, Colour] = {}
    for fault in found.faults:
        *multiple, name = fault.name.split()
        label = None
        if name not in drawn:
            drawn[name] = next(colours)
            label = f"{name} {fault.expected_hz / int(*multiple or (1,)):.4g} Hz"
        axes.axvline(
            fault.expected_hz, color=paint(drawn[name]), linewidth=0.7, linestyle="--", zorder=1, label=label
        )


def _hertz(frequency_hz: float) -> str:
    return f"{frequency_hz:.0f}" if frequency_hz >= 1000 else f"{frequency_hz:.4g}"
