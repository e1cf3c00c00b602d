"""Points of curves on their way to the browser: no more than a chart can show, and in one message."""

from base64 import b64encode
from gzip import compress
from sys import byteorder
from typing import Any, cast

import numpy as np
from bokeh.core.serialization import Serializable, Serializer

from chladni.models.core.reading import Scale
from chladni.signals.arrays import Complex, Real

#: A curve is thinned to so many stretches, more than a chart has columns of pixels on most screens.
STRETCHES = 1000
#: Height or width of a curve that a point left out may lie off the line between its neighbours, in each of so many
#: rounds; all together a tenth of a pixel of a chart of a thousand.
STRAIGHT, ROUNDS = 2e-5, 6
FEWEST = 32


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


def inline(values: Real) -> InlineArray:
    """Give an array that travels inside its message."""
    return cast("InlineArray", np.asarray(values, dtype=np.float64).view(InlineArray))


def thinned(x: Real, y: Real) -> tuple[Real, Real]:
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
    kept = np.zeros(len(x), dtype=bool)
    kept[[0, -1]] = kept[first + rows.argmin(axis=1)] = kept[first + rows.argmax(axis=1)] = True
    kept[whole:] = True
    return x[kept], y[kept]


def straightened(x: Real, y: Real, x_scale: Scale = "linear", y_scale: Scale = "linear") -> tuple[Real, Real]:
    """Leave out points that lie on the straight line between their neighbours as the chart draws it.

    In each round at most every other point goes, so that those stay between which it's missed by nobody.
    """
    kept = np.arange(len(x))
    place = _on_the_chart(x, x_scale) + 1j * _on_the_chart(y, y_scale)
    for _ in range(ROUNDS):
        if kept.size < FEWEST:
            break
        on_line = np.zeros(kept.size, dtype=bool)
        # A gap is near nothing, and what is next to it neither.
        on_line[1:-1:2] = _off_chord(place[:-2:2], place[1:-1:2], place[2::2]) <= STRAIGHT
        if not on_line.any():
            break
        kept, place = kept[~on_line], place[~on_line]
    return x[kept], y[kept]


def _on_the_chart(values: Real, scale: Scale) -> Real:
    """Place along an axis, in the span of the curve."""
    with np.errstate(divide="ignore", invalid="ignore"):
        place = np.log10(values) if scale == "log" else values
    known = place[np.isfinite(place)]
    span = float(np.ptp(known)) if known.size else 0.0
    return np.asarray(place / span if span > 0 else place)


def _off_chord(before: Complex, point: Complex, after: Complex) -> Real:
    """Distance of each point from the line, with its ends, that joins its neighbours."""
    with np.errstate(invalid="ignore"):
        chord, away = after - before, point - before
        length = chord.real**2 + chord.imag**2
        share = (away * chord.conj()).real / np.where(length > 0, length, 1.0)
        return np.asarray(np.abs(away - np.clip(share, 0.0, 1.0) * chord))
