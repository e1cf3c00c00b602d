"""Mode sets with given shapes, for tests that don't care where modes come from."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chladni.signals.channel import Channel
from chladni.signals.mode_set import ModeSet
from chladni.signals.provenance import Provenance


def mode_set(shapes: ArrayLike, *, names: tuple[str, ...] = (), **fields: Any) -> ModeSet:
    """Modes at 10, 20, ... Hz with 1 % damping and small error bars, unless `fields` say otherwise."""
    array = np.atleast_2d(np.asarray(shapes, dtype=np.complex128))
    count, columns = array.shape
    channels = tuple(Channel(name=name, unit="m/s^2") for name in names or [f"c{i}" for i in range(columns)])
    base: dict[str, Any] = {
        "frequency_hz": 10.0 * np.arange(1, count + 1),
        "frequency_std_hz": np.full(count, 0.001),
        "damping_ratio": np.full(count, 0.01),
        "damping_std": np.full(count, 1e-4),
        "shapes": array,
        "shape_std": np.full(array.shape, 1e-3 * (1 + 1j)),
        "channels": channels,
        "provenance": Provenance(estimator="by hand"),
    }
    return ModeSet(**base | fields)
