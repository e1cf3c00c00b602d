"""The Campbell diagram: amplitudes of orders as circles, over speed and frequency."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.arrays import Real
from chladni.signals.order_spectra import OrderCuts
from chladni.signals.unit_text import printed_unit
from chladni.viewers.figures.sheet import legend, paint, plain, sheet
from chladni.viewers.style import ON_LIGHT

RPM = 60.0
# Circles along an order; more run into a band.
CIRCLES = 60
LARGEST_CIRCLE_POINTS = 14.0


def campbell_figure(cuts: OrderCuts, row: int, label: str) -> Figure:
    """Draw the orders of one channel; the area of a circle is the power."""
    figure, (axes,) = sheet([3.2])
    rpm = RPM * cuts.speed_hz
    amplitude = np.abs(cuts.values[row])
    largest = np.nanmax(amplitude, initial=0.0)
    for place, order in enumerate(cuts.orders.tolist()):
        _draw_order(axes, rpm, order, amplitude[place] / (largest or 1.0), place)
    axes.set_xlabel("Speed [rpm]")
    axes.set_ylabel("Frequency [Hz]")
    unit = printed_unit(cuts.channels[row].unit)
    order_title(figure, f"{label}: the largest circle is {largest:.3g} {unit}")
    legend(axes)
    return figure


def order_title(figure: Figure, text: str) -> None:
    """Put a title over the legend."""
    # Above the legend, which stands where a title of the axes would.
    figure.suptitle(plain(text), x=0.02, ha="left", fontsize=8.5)


def _draw_order(axes: Axes, rpm: Real, order: float, share: Real, place: int) -> None:
    colour = paint(ON_LIGHT[place % len(ON_LIGHT)])
    ends = np.array([rpm.min(), rpm.max()])
    axes.plot(ends, order * ends / RPM, color=colour, linewidth=0.5, label=f"order {order:g}")
    # The widest of each step of speed, so that no peak falls between two circles.
    step = np.digitize(rpm, np.linspace(ends[0], ends[1], CIRCLES))
    parts = [np.flatnonzero((step == number) & np.isfinite(share)) for number in np.unique(step)]
    chosen = [part[int(np.argmax(share[part]))] for part in parts if part.size]
    axes.scatter(
        rpm[chosen],
        order * rpm[chosen] / RPM,
        s=(LARGEST_CIRCLE_POINTS * share[chosen]) ** 2,
        facecolors="none",
        edgecolors=[colour],
        linewidths=0.7,
    )
