"""Points of curves on their way to the browser: no more than pixels can show, and in one message."""

from base64 import b64encode
from gzip import compress
from sys import byteorder
from typing import Any, cast

import numpy as np
from bokeh.core.serialization import Serializable, Serializer
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

#: A curve is thinned to so many stretches, more than a chart has columns of pixels on most screens.
STRETCHES = 1000


class InlineArray(np.ndarray, Serializable):
    """An array that travels inside its message.

    Bokeh sends each array as two frames of its own; with six charts the forty frames of one turn of a knob, each of
    which wakes the browser, took longer than everything else together.
    """

    def to_serializable(self, serializer: Serializer) -> Any:  # noqa: ARG002  # Bokeh's signature
        """Give the array as Bokeh writes arrays into standalone pages."""
        # The browser expects gzip's frame around it; on one computer, stored is faster than packed.
        data = b64encode(compress(self.tobytes(), compresslevel=0, mtime=0)).decode("ascii")
        return {
            "type": "ndarray",
            "array": {"type": "bytes", "data": data},
            "shape": list(self.shape),
            "dtype": self.dtype.name,
            "order": byteorder,
        }


def inline(values: Matrix) -> InlineArray:
    """Give an array that travels inside its message."""
    return cast("InlineArray", np.asarray(values, dtype=np.float64).view(InlineArray))


def thinned(x: Matrix, y: Matrix) -> tuple[Matrix, Matrix]:
    """Leave out points that no screen can show, of a line over rising x.

    Of each stretch its lowest and its highest point stay, so that no peak is lost; the ends of the line stay too.
    """
    size = len(x) // STRETCHES
    # Curves that turn back, and such with gaps, are drawn as they are.
    if size < 4 or not np.all(np.diff(x) >= 0) or not np.all(np.isfinite(y)):
        return x, y
    whole = len(x) // size * size
    rows = y[:whole].reshape(-1, size)
    first = np.arange(0, whole, size)
    rest = np.arange(whole, len(x))
    kept = np.unique(
        np.concatenate([[0, len(x) - 1], first + rows.argmin(axis=1), first + rows.argmax(axis=1), rest])
    )
    return x[kept], y[kept]
