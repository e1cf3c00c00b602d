"""Frequency responses: magnitude, phase and coherence above one another."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.peak import Peak
from chladni.signals.study import Study
from chladni.viewers.drawing import decibels_of_amplitude, level_limits, line_breaks, phase_wraps, with_breaks
from chladni.viewers.figures.log_axis import USUAL, Scales
from chladni.viewers.figures.peak_labels import STRIP_POINTS, label_peaks
from chladni.viewers.figures.sheet import BAND_OPACITY, BANDS_OF, legend, look, paint, plain, sheet
from chladni.viewers.panels import Panel, panels
from chladni.viewers.style import Style

CONVENTION = "H = Y/X, exp(+jωt)"
HEIGHTS_IN = (2.5, 1.35, 1.1)
# Room for the mark on the highest peak.
MARK_DB = 2.0


def response_figures(study: Study, *, scales: Scales = USUAL) -> dict[str, Figure]:
    """Draw the frequency responses on their excited lines; one figure for each group and reference, by name.

    The magnitude carries its one-sigma band, the phase its convention; `scales` says how the axes are divided.
    """
    if study.response is None:
        return {}
    style = Style.of(study)
    with look():
        return {
            f"response {panel.reference + 1} {panel.group.name}": _figure(study, panel, style, scales)
            for panel in panels(study.response)
        }


def is_coherent(panel: Panel) -> bool:
    """Whether there is a coherence to draw: a file and an array needn't hold one."""
    return any(np.isfinite(panel.coherence(row)).any() for row in panel.group.rows)


def _figure(study: Study, panel: Panel, style: Style, scales: Scales) -> Figure:
    peaks = _peaks(study, panel)
    figure, (magnitude, phase, *below) = sheet(
        HEIGHTS_IN if is_coherent(panel) else HEIGHTS_IN[:2], above_points=STRIP_POINTS if peaks else 0.0, sharex=True
    )
    draw_magnitude(magnitude, panel, style, peaks, scales=scales)
    draw_phase(phase, panel, style)
    for axes in below:
        draw_coherence(axes, panel, style)
    figure.axes[-1].set_xlabel("Frequency [Hz]")
    return figure


def draw_phase(axes: Axes, panel: Panel, style: Style) -> None:
    """Draw the phase, broken where it wraps."""
    for row in panel.group.rows:
        angle = np.angle(panel.function(row), deg=True)
        breaks = np.union1d(line_breaks(panel.frequency_hz()), phase_wraps(angle))
        colour = paint(style.on_light(panel.response.responses[row]))
        axes.plot(*with_breaks(panel.frequency_hz(), angle, breaks), color=colour)
    axes.set_ylabel(f"Phase [deg]\n{CONVENTION}")
    axes.set_ylim(-190, 190)
    axes.set_yticks([-180, -90, 0, 90, 180])


def draw_coherence(axes: Axes, panel: Panel, style: Style) -> None:
    """Draw the coherence."""
    breaks = line_breaks(panel.frequency_hz())
    for row in panel.group.rows:
        colour = paint(style.on_light(panel.response.responses[row]))
        axes.plot(*with_breaks(panel.frequency_hz(), panel.coherence(row), breaks), color=colour)
    axes.set_ylabel(("Coherence" if len(panel.response.references) == 1 else "Multiple\ncoherence") + " [1]")
    axes.set_ylim(0, 1.04)


def draw_magnitude(
    axes: Axes, panel: Panel, style: Style, peaks: Sequence[Peak] = (), *, scales: Scales = USUAL
) -> None:
    """Draw the magnitude with its error bands, and the names of `peaks`."""
    magnitudes = np.array([np.abs(panel.function(row)) for row in panel.group.rows])
    low, high = level_limits(decibels_of_amplitude(magnitudes))
    # A resonance narrower than a line rises above every line.
    high = max([high, *(20 * np.log10(peak.height) + MARK_DB for peak in peaks)])
    scales.divide_levels(axes, low, high, decade_db=20)
    frequency_hz = panel.frequency_hz()
    scales.divide_frequency(axes, frequency_hz)
    breaks = line_breaks(frequency_hz)
    for row, value in zip(panel.group.rows, magnitudes, strict=True):
        channel, std = panel.response.responses[row], panel.deviation(row)
        colour = paint(style.on_light(channel))
        upper = np.where(np.isfinite(std), value + std, np.nan)
        lower = np.maximum(value - std, 10 ** (low / 20) * 1e-3)
        x, curves = with_breaks(frequency_hz, np.column_stack([value, lower, upper]), breaks)
        axes.plot(x, curves[:, 0], color=colour, label=plain(style.labels[channel.name]))
        if len(panel.group.rows) <= BANDS_OF:
            axes.fill_between(x, curves[:, 1], curves[:, 2], color=colour, alpha=BAND_OPACITY, linewidth=0)
    reference = plain(style.labels[panel.response.references[panel.reference].name])
    axes.set_ylabel(
        f"{panel.quantity} |H| [{scales.unit(panel.unit)}]\n{panel.response.provenance.estimator}, to {reference}"
    )
    named = label_peaks(axes, peaks)
    legend(axes, above_points=named)


def _peaks(study: Study, panel: Panel) -> list[Peak]:
    """Peaks of the functions drawn: those that name a response here, and this reference where they name one."""
    unit = panel.response.unit(panel.group.rows[0], panel.reference)
    responses = {panel.response.responses[row].name for row in panel.group.rows}
    reference = panel.response.references[panel.reference].name
    alone = len(panel.response.references) == 1
    return [
        peak
        for peak in study.response_peaks
        if peak.unit == unit
        and set(peak.channels[:1]) <= responses
        # A peak that doesn't say to which of several references it belongs has a height that may not be on a line.
        and (alone if len(peak.channels) < 2 else peak.channels[1] == reference)
    ]
