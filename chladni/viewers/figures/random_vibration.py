"""Random vibration tests: spectra inside their tolerance, spread of amplitudes, response of oscillators."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.arrays import Real
from chladni.signals.power_spectral_density import PowerSpectralDensity
from chladni.signals.random_vibration import ProbabilityDensity, RandomProfile, VibrationResponse
from chladni.signals.unit_text import printed_unit
from chladni.signals.units import power_density_unit, si_factor
from chladni.viewers.figures.log_axis import logarithmic, logarithmic_frequency
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import Style

HEIGHT_IN = 3.2
LEAST = 1e-5
ASKED, ALLOWED = "#222222", "#999999"


def tolerance_figures(
    densities: Sequence[PowerSpectralDensity], profile: RandomProfile, *, unit: str
) -> dict[str, Figure]:
    """Draw spectra with the profile and its tolerance, densities in `unit`^2/Hz; by name."""
    factor, _ = si_factor(unit)
    style = Style.of_channels(channel for one in densities for channel in one.channels)
    with look():
        return {
            f"tolerance {place} {group.name}": _tolerance_figure(density, group, profile, style, unit, factor**2)
            for place, density in enumerate(densities, start=1)
            for group in groups(density.channels)
        }


def _tolerance_figure(
    density: PowerSpectralDensity, group: Group, profile: RandomProfile, style: Style, unit: str, scale: float
) -> Figure:
    figure, (axes,) = sheet([HEIGHT_IN])
    low_hz, high_hz = float(profile.frequency_hz[0]) / 1.5, float(profile.frequency_hz[-1]) * 1.5
    shown = (density.frequency_hz > low_hz) & (density.frequency_hz < high_hz)
    for row in group.rows:
        channel = density.channels[row]
        values = _positive(density.values[row, shown] / scale)
        colour, label = paint(style.on_light(channel)), plain(style.labels[channel.name])
        axes.plot(density.frequency_hz[shown], values, color=colour, linewidth=0.7, label=label)
    asked = profile.density / scale
    axes.plot(profile.frequency_hz, asked, color=ASKED, linewidth=1.0, label="profile")
    for step_db, word in ((profile.upper_db, "tolerance"), (-profile.lower_db, None)):
        allowed = asked * 10 ** (step_db / 10)
        axes.plot(profile.frequency_hz, allowed, "--", color=ALLOWED, linewidth=0.9, label=word)
    logarithmic(axes, float(asked.min()) / 20, float(asked.max()) * 10)
    logarithmic_frequency(axes, low_hz, high_hz)
    axes.set_xlabel("Frequency [Hz]")
    axes.set_ylabel(f"Power spectral density [{printed_unit(power_density_unit(unit))}]")
    legend(axes)
    return figure


def draw_probability(axes: Axes, found: ProbabilityDensity, style: Style) -> None:
    """Draw how often amplitudes occur, on a logarithmic scale, beside Gaussian noise."""
    axes.plot(found.deviation, found.gaussian, "--", color=ALLOWED, label="Gaussian")
    for row, channel in enumerate(found.channels):
        colour = paint(style.on_light(channel))
        # An empty bin lies below the picture.
        density = np.maximum(found.density[row], LEAST / 10)
        axes.step(found.deviation, density, where="mid", color=colour, label=plain(style.labels[channel.name]))
    logarithmic(axes, LEAST, 2.0)
    axes.set_ylabel("Probability density")
    legend(axes)


def draw_vibration_response(axes: Axes, found: VibrationResponse, group: Group, style: Style) -> None:
    """Draw the peaks over natural frequency, with three times the RMS by Miles beside."""
    for row in group.rows:
        channel = found.channels[row]
        colour = paint(style.on_light(channel))
        axes.plot(
            found.frequency_hz, _positive(found.peak[row]), color=colour, label=plain(style.labels[channel.name])
        )
        axes.plot(found.frequency_hz, _positive(3 * found.miles[row]), ":", color=colour)
    axes.plot([], [], ":", color="#555555", label="3 × Miles")
    positive = found.peak[found.peak > 0]
    if positive.size:
        logarithmic(axes, float(positive.min()) / 3, float(positive.max()) * 2)
    logarithmic_frequency(axes, float(found.frequency_hz[0]), float(found.frequency_hz[-1]))
    axes.set_ylabel(f"Peak in {found.duration_s:g} s, Q = {found.q:g} [{printed_unit(group.unit)}]")
    legend(axes)


def _positive(values: Real) -> Real:
    return np.where(values > 0, values, np.nan)
