"""What stabilisation diagrams of every kind of picture share: words and ranges."""

import numpy as np

from chladni.signals.arrays import Real
from chladni.signals.stabilisation_diagram import StabilisationDiagram

# Share of the poles' span that is left free on both sides, and the share of the whole below which it's zoomed.
ROOM, WORTH_ZOOMING = 0.1, 0.6
# In the order of POLE_STATUSES: each includes those before it.
STATUS_NAMES = ("new", "frequency stable", "and damping", "and vector")


def frequency_range(named_hz: Real, diagram: StabilisationDiagram) -> tuple[float, float]:
    """Give the frequencies that are shown: those of the indicator, or the part of them that has poles or names."""
    poles = np.concatenate([diagram.frequency_hz, named_hz])
    low, high = _ends(diagram.indicator_hz if diagram.indicator_hz.size > 1 else poles)
    if not poles.size:
        return low, high
    first, last = _ends(poles)
    room = ROOM * (last - first)
    first, last = max(low, first - room), min(high, last + room)
    # The ends of the indicator are worth seeing, but not at the price of poles that can't be told apart.
    return (first, last) if last - first < WORTH_ZOOMING * (high - low) else (low, high)


def title(diagram: StabilisationDiagram) -> str:
    """Name the indicator as a label begins."""
    return diagram.indicator_name[:1].upper() + diagram.indicator_name[1:]


def _ends(values: Real) -> tuple[float, float]:
    if not values.size:
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    return (low, high) if high > low else (0.9 * low, 1.1 * low + 1e-3)


def order_range(diagram: StabilisationDiagram) -> tuple[float, float]:
    """Give the model orders that are shown, from zero to one above the highest."""
    return 0.0, float(diagram.order.max(initial=1)) + 1.0
