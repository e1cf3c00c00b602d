"""Logarithmic axes whose numbers are plain text, which is set many times faster than mathematics."""

from dataclasses import dataclass
from math import log10

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import Formatter, FuncFormatter, LogLocator, NullLocator

from chladni.signals.arrays import Mask, Real

_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
# Over fewer decades than this, powers of ten alone are too few numbers.
FEW_DECADES = 2.0
# An axis between these has no powers of ten: its numbers are as short.
PLAIN_FROM, PLAIN_TO = 1e-3, 1e4
# Over fewer decibels, steps of ten are too few numbers.
FEW_DECIBELS = 40.0


class DecibelFormatter(Formatter):
    """Numbers of a logarithmic axis in decibels over 1 of its unit; `decade_db`: 10 for powers, 20 for amplitudes."""

    def __init__(self, decade_db: float) -> None:
        self.decade_db = decade_db

    def __call__(self, x: float, pos: int | None = None) -> str:  # noqa: ARG002  # matplotlib's own
        """Print one number."""
        return f"{self.decade_db * log10(x):.0f}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Scales:
    """How the axes of spectra are divided.

    Attributes
    ----------
    decibels
        Whether levels are numbered in decibels over 1 of their unit.
    log_frequency
        Whether frequency has a logarithmic scale.
    band_hz
        Frequencies that are shown; None for all.
    """

    decibels: bool = False
    log_frequency: bool = False
    band_hz: tuple[float, float] | None = None

    def shown(self, frequency_hz: Real) -> Mask:
        """Tell which frequencies are shown."""
        low_hz, high_hz = self.band_hz or (-np.inf, np.inf)
        return np.asarray((frequency_hz >= low_hz) & (frequency_hz <= high_hz))

    def unit(self, printed: str) -> str:
        """Give what a level is numbered in, where `printed` is the unit of its values."""
        if not self.decibels:
            return printed
        # Of pure numbers, and of their densities (1/Hz), the unit is the 1.
        return f"dB over {printed}" if printed.startswith("1") else f"dB over 1 {printed}"

    def divide_frequency(self, axes: Axes, frequency_hz: Real) -> None:
        """Give the x axis its scale and limits; a logarithmic one begins at the first line above 0 Hz."""
        shown = self.shown(frequency_hz)
        frequency_hz = frequency_hz[shown] if shown.any() else frequency_hz
        if self.log_frequency and frequency_hz[-1] > 0:
            logarithmic_frequency(axes, frequency_hz[frequency_hz > 0][0], frequency_hz[-1])
        else:
            axes.set_xlim(frequency_hz[0], frequency_hz[-1])

    def divide_levels(self, axes: Axes, low_db: float, high_db: float, *, decade_db: float) -> None:
        """Give the y axis its scale and limits; `decade_db` is 10 for powers and 20 for amplitudes."""
        logarithmic(axes, 10 ** (low_db / decade_db), 10 ** (high_db / decade_db))
        if not self.decibels:
            return
        step_db = 10.0 if high_db - low_db >= FEW_DECIBELS else 5.0
        axes.yaxis.set_major_locator(LogLocator(base=10 ** (step_db / decade_db), numticks=12))
        axes.yaxis.set_major_formatter(DecibelFormatter(decade_db))
        axes.yaxis.set_minor_locator(NullLocator())


#: Powers of ten over hertz.
USUAL = Scales()


def power_of_ten(value: float) -> str:
    """Print a power of ten.

    Examples
    --------
    >>> power_of_ten(0.001), power_of_ten(1.0), power_of_ten(100.0)
    ('10⁻³', '1', '100')
    """
    exponent = round(log10(value))
    if -1 <= exponent <= 3:
        return f"{10.0**exponent:g}"
    return "10" + str(exponent).translate(_SUPERSCRIPTS)


def logarithmic_frequency(axes: Axes, low_hz: float, high_hz: float) -> None:
    """Give the x axis a logarithmic scale from `low_hz` to `high_hz`; numbers at 1, 2 and 5 where there is room."""
    axes.set_xscale("log")
    axes.set_xlim(low_hz, high_hz)
    _number_frequencies(axes.xaxis, low_hz, high_hz)


def logarithmic_lines(axes: Axes, frequency_hz: Real) -> None:
    """Give the y axis a logarithmic scale of frequency, from the first line above 0 Hz to the last."""
    low_hz, high_hz = float(frequency_hz[frequency_hz > 0][0]), float(frequency_hz[-1])
    axes.set_yscale("log")
    axes.set_ylim(low_hz, high_hz)
    _number_frequencies(axes.yaxis, low_hz, high_hz)


def _number_frequencies(axis: Axis, low_hz: float, high_hz: float) -> None:
    few = log10(high_hz / low_hz) < 2 * FEW_DECADES
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,), numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def logarithmic(axes: Axes, low: float, high: float, *, numbers: int = 7) -> None:
    """Give the y axis a logarithmic scale from `low` to `high`, with at most so many powers of ten."""
    axes.set_yscale("log")
    axes.set_ylim(low, high)
    axis = axes.yaxis
    axis.set_major_locator(LogLocator(numticks=numbers))
    # Both ways of writing on one axis read badly.
    plain = low >= PLAIN_FROM and high <= PLAIN_TO
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}" if plain else power_of_ten(value)))
    few = log10(high / low) < FEW_DECADES
    minor = LogLocator(subs=(2.0, 5.0) if few else tuple(range(2, 10)), numticks=12)
    # Marks of so many decades that not each of them has its number would run into one bar.
    axis.set_minor_locator(minor if log10(high / low) < numbers else NullLocator())
    axis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if few else ""))
