"""Frequency responses synthesised from the modes over the measured ones, with the error of each."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.arrays import Real
from chladni.signals.study import Study
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import decibels_of_amplitude, level_limits, line_breaks, with_breaks
from chladni.viewers.figures.log_axis import USUAL, Scales
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.overlays import Overlay, OverlayPage, left_out, overlay_pages
from chladni.viewers.style import Style

HEIGHT_IN, ALONE_IN = 1.5, 2.6
MODES = "#cccccc"
SYNTHESISED = "black"


def synthesis_figures(study: Study, *, scales: Scales = USUAL) -> dict[str, Figure]:
    """Draw measured and synthesised magnitudes, a pane a function with its error, by name."""
    if study.modes is None or study.modes.fit is None:
        return {}
    style = Style.of(study)
    rest = left_out(study.modes.fit)
    with look():
        return {
            f"synthesis {page.name}": _figure(page, study.modes.frequency_hz, style, rest, scales)
            for page in overlay_pages(study.modes, study.response)
        }


def _figure(page: OverlayPage, natural_hz: Real, style: Style, rest: str, scales: Scales) -> Figure:
    figure, stack = sheet(
        [HEIGHT_IN if len(page.overlays) > 1 else ALONE_IN] * len(page.overlays), above_points=30.0, sharex=True
    )
    for axes, overlay in zip(stack, page.overlays, strict=True):
        for hertz in natural_hz:
            axes.axvline(hertz, color=MODES, linewidth=0.6, zorder=1)
        _draw(axes, overlay, style, scales)
    first = page.overlays[0]
    scales.divide_frequency(stack[0], first.frequency_hz)
    stack[-1].set_xlabel("Frequency [Hz]")
    reference = plain(style.labels[first.reference.name])
    figure.supylabel(f"{page.quantity} |H| [{scales.unit(printed_unit(page.unit))}]\nto {reference}", fontsize=8.5)
    if rest:
        figure.suptitle(rest.removeprefix(" · "), fontsize=7.5, x=0.99, ha="right")
    # The name of the first function stands between the frame and the legend.
    legend(stack[0], above_points=12.0)
    return figure


def _draw(axes: Axes, overlay: Overlay, style: Style, scales: Scales) -> None:
    colour = paint(style.on_light(overlay.response))
    values = [np.abs(overlay.synthesised), np.abs(overlay.measured)]
    low, high = level_limits(decibels_of_amplitude(np.concatenate(values)))
    scales.divide_levels(axes, low, high, decade_db=20)
    if overlay.measured_hz.size:
        x, y = _broken(overlay.measured_hz, np.abs(overlay.measured))
        axes.plot(x, y, color=colour, linewidth=1.8, alpha=0.6, label="measured", zorder=2)
    x, y = _broken(overlay.frequency_hz, np.abs(overlay.synthesised))
    axes.plot(x, y, color=SYNTHESISED, linewidth=0.7, linestyle=(0, (4, 1.5)), label="synthesised", zorder=3)
    axes.set_title(f"{plain(style.labels[overlay.response.name])} · error {overlay.error:.1%}", loc="left", pad=2)


def _broken(frequency_hz: Real, magnitude: Real) -> tuple[Real, Real]:
    return with_breaks(frequency_hz, magnitude, line_breaks(frequency_hz))
