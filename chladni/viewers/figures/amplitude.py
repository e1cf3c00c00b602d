"""Amplitude spectra, with the highest line of each channel named."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.unit_text import printed_unit
from chladni.spectral.amplitude_spectrum import AmplitudeSpectrum
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import Style

HEIGHT_IN = 2.9


def amplitude_figures(found: AmplitudeSpectrum) -> dict[str, Figure]:
    """Draw the amplitudes over frequency, one figure for each group of channels of one unit, by name."""
    style = Style.of_channels(found.channels)
    figures = {}
    with look():
        for group in groups(found.channels):
            figure, (axes,) = sheet([HEIGHT_IN])
            draw_amplitudes(axes, found, group, style)
            axes.set_xlabel("Frequency [Hz]")
            figures[f"amplitudes {group.name}"] = figure
    return figures


def draw_amplitudes(axes: Axes, found: AmplitudeSpectrum, group: Group, style: Style) -> None:
    """Draw the amplitudes of one group into given axes."""
    for row in group.rows:
        channel = found.channels[row]
        highest = int(np.argmax(found.values[row]))
        label = plain(f"{style.labels[channel.name]}: {found.frequency_hz[highest]:.6g} Hz")
        axes.plot(found.frequency_hz, found.values[row], color=paint(style.on_light(channel)), label=label)
    axes.set_xlim(found.frequency_hz[0], found.frequency_hz[-1])
    axes.set_ylim(bottom=0)
    # Of a narrow band every digit counts.
    axes.ticklabel_format(axis="x", useOffset=False)
    what = "Peak" if found.quantity == "peak" else "RMS"
    axes.set_ylabel(f"{what} amplitude [{printed_unit(group.unit)}]")
    legend(axes)
