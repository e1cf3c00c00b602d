"""Logarithmic axes whose numbers are plain text, which is set many times faster than mathematics."""

from math import log10

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator

_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
# Over fewer decades than this, powers of ten alone are too few numbers.
FEW_DECADES = 2.0


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


def logarithmic(axes: Axes, low: float, high: float) -> None:
    """Give the y axis a logarithmic scale from `low` to `high`."""
    axes.set_yscale("log")
    axes.set_ylim(low, high)
    axis = axes.yaxis
    axis.set_major_locator(LogLocator(numticks=7))
    axis.set_major_formatter(FuncFormatter(lambda value, _: power_of_ten(value)))
    few = log10(high / low) < FEW_DECADES
    axis.set_minor_locator(LogLocator(subs=(2.0, 5.0) if few else tuple(range(2, 10)), numticks=12))
    axis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if few else ""))
