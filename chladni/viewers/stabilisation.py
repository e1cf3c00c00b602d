"""What stabilisation diagrams of every kind of picture share: words and ranges."""

import numpy as np

from chladni.signals.mode_set import ModeSet
from chladni.signals.stabilisation_diagram import StabilisationDiagram

# In the order of POLE_STATUSES: each includes those before it.
STATUS_NAMES = ("new", "frequency stable", "and damping", "and vector")


def frequency_range(modes: ModeSet, diagram: StabilisationDiagram) -> tuple[float, float]:
    """Give the frequencies that are shown: those of the indicator, else of modes and poles."""
    shown = diagram.indicator_hz if diagram.indicator_hz.size > 1 else diagram.frequency_hz
    everything = np.concatenate([shown, modes.frequency_hz])
    if everything.size == 0:
        return 0.0, 1.0
    low, high = float(everything.min()), float(everything.max())
    return (low, high) if high > low else (0.9 * low, 1.1 * low + 1e-3)


def order_range(diagram: StabilisationDiagram) -> tuple[float, float]:
    """Give the model orders that are shown, from zero to one above the highest."""
    return 0.0, float(diagram.order.max(initial=1)) + 1.0
