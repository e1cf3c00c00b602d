"""Sine sweep tests: the tracked amplitude over frequency inside its tolerance."""

import numpy as np
from matplotlib.axes import Axes

from chladni.signals.sine_vibration import SineCheck, SineProfile
from chladni.viewers.figures.log_axis import logarithmic, logarithmic_frequency
from chladni.viewers.figures.sheet import legend, paint, plain
from chladni.viewers.style import Style

HEIGHT_IN = 3.2
ASKED, ALLOWED = "#222222", "#999999"
LABEL = "Peak acceleration [m/s²]"
# Corners of a tolerance stand on both axes; what lies further away says that there is no sweep.
ROOM = 3.0


def draw_sine_profile(axes: Axes, profile: SineProfile) -> None:
    """Draw a profile and its tolerance."""
    axes.plot(profile.frequency_hz, profile.amplitude, color=ASKED, linewidth=1.0, label="profile")
    for step_db, word in ((profile.upper_db, "tolerance"), (-profile.lower_db, "_lower tolerance")):
        allowed = profile.amplitude * 10 ** (step_db / 20)
        axes.plot(profile.frequency_hz, allowed, "--", color=ALLOWED, linewidth=0.9, label=word)
    logarithmic(axes, float(profile.amplitude.min()) / ROOM, float(profile.amplitude.max()) * ROOM)
    logarithmic_frequency(axes, float(profile.frequency_hz[0]) / 1.2, float(profile.frequency_hz[-1]) * 1.2)
    axes.set_ylabel(LABEL)
    legend(axes)


def draw_sine_check(axes: Axes, found: SineCheck, style: Style) -> None:
    """Draw tracked amplitudes over the sweep's frequency; the share outside stands in the legend."""
    for row, channel in enumerate(found.channels):
        label = f"{plain(style.labels[channel.name])}, {found.outside[row]:.0%} outside"
        amplitude = np.where(found.amplitude[row] > 0, found.amplitude[row], np.nan)
        axes.plot(found.frequency_hz, amplitude, color=paint(style.on_light(channel)), linewidth=0.9, label=label)
    draw_sine_profile(axes, found.profile)
