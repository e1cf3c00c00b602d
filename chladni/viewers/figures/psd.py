"""Power spectral densities with their one-sigma bands and named peaks."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.peak import Peak
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.study import Study
from chladni.signals.unit_text import printed_unit
from chladni.viewers.drawing import decibels_of_power, level_limits
from chladni.viewers.figures.log_axis import USUAL, Scales
from chladni.viewers.figures.peak_labels import STRIP_POINTS, label_peaks
from chladni.viewers.figures.sheet import BAND_OPACITY, BANDS_OF, legend, look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import Style

HEIGHT_IN = 2.9


def density_figures(study: Study, *, scales: Scales = USUAL) -> dict[str, Figure]:
    """Draw the densities on a logarithmic scale; one figure for each group of channels of one unit, by name.

    Parameters
    ----------
    study
        What to draw.
    scales
        How the axes are divided.
    """
    style = Style.of(study)
    with look():
        return {
            f"psd {place} {group.name}": _figure(study, density, group, style, scales)
            for place, density in enumerate(study.densities, start=1)
            for group in groups(density.channels)
        }


def _figure(study: Study, density: PowerSpectralDensity, group: Group, style: Style, scales: Scales) -> Figure:
    unit = density.units[group.rows[0]]
    names = {density.channels[row].name for row in group.rows}
    peaks = [peak for peak in study.peaks if peak.unit == unit and set(peak.channels[:1]) <= names]
    figure, (axes,) = sheet([HEIGHT_IN], above_points=STRIP_POINTS if peaks else 0.0)
    draw_densities(axes, density, group, style, peaks=peaks, scales=scales)
    axes.set_xlabel("Frequency [Hz]")
    return figure


def draw_densities(
    axes: Axes,
    density: PowerSpectralDensity,
    group: Group,
    style: Style,
    *,
    peaks: Sequence[Peak] = (),
    scales: Scales = USUAL,
) -> None:
    """Draw the densities of a group with their error bands, and the names of `peaks`."""
    # A logarithmic axis has no place for zero frequency.
    shown = density.frequency_hz > (0.0 if scales.log_frequency else -1.0)
    low, high = level_limits(decibels_of_power(density.values[list(group.rows)][:, shown]))
    scales.divide_levels(axes, low, high, decade_db=10)
    for row in group.rows:
        _draw(axes, density, row, shown, style, banded=len(group.rows) <= BANDS_OF)
    scales.divide_frequency(axes, density.frequency_hz[shown])
    named = label_peaks(axes, peaks)
    axes.set_ylabel(f"Power spectral density [{scales.unit(printed_unit(density.units[group.rows[0]]))}]")
    legend(axes, above_points=named)


def _draw(
    axes: Axes, density: PowerSpectralDensity, row: int, shown: np.ndarray, style: Style, *, banded: bool
) -> None:
    channel = density.channels[row]
    frequency_hz, values, std = density.frequency_hz[shown], density.values[row, shown], density.std[row, shown]
    colour = paint(style.on_light(channel))
    # A logarithmic axis can't show zero; NaN leaves a gap without a warning.
    positive = np.where(values > 0, values, np.nan)
    axes.plot(frequency_hz, positive, color=colour, label=plain(style.labels[channel.name]))
    if banded:
        bottom = axes.get_ylim()[0]
        upper = np.where(np.isfinite(std), positive + std, np.nan)
        # Below the frame, not at zero, which a logarithmic axis would clip to a wrong place.
        lower = np.maximum(positive - std, bottom * 1e-3)
        axes.fill_between(frequency_hz, lower, upper, color=colour, alpha=BAND_OPACITY, linewidth=0)
