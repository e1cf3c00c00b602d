"""A plane with axes drawn by us, for plots that rerun has no view for."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.arrays import Real
from chladni.signals.visible import visible
from chladni.viewers.drawing import ticks

GRID_COLOUR = (50, 50, 50)
AXIS_COLOUR = (110, 110, 110)
LABEL_COLOUR = (170, 170, 170)
# Labels hang below their point, at one size on the screen; a canvas is laid out for about one unit a pixel.
LETTERS = 24.0
BEHIND = -10.0
# From a place on an axis to that of its number.
BELOW = np.array([0.0, 4.0])
BESIDE = np.array([0.8, 0.5]) * LETTERS


@dataclass(frozen=True, slots=True, kw_only=True)
class Canvas:
    """A rectangle of `width` x `height` units that shows a range of two quantities, the second upwards.

    Attributes
    ----------
    width, height
        About as many units as the view has pixels.
    x_range, y_range
        What the rectangle's sides stand for.
    """

    width: float
    height: float
    x_range: tuple[float, float]
    y_range: tuple[float, float]

    def places(self, x: Real | Sequence[float], y: Real | Sequence[float]) -> Real:
        """Give ``[point, 2]`` in units; the viewer's own y axis points down."""
        across = (np.asarray(x, dtype=np.float64) - self.x_range[0]) / (self.x_range[1] - self.x_range[0])
        up = (np.asarray(y, dtype=np.float64) - self.y_range[0]) / (self.y_range[1] - self.y_range[0])
        return np.stack(np.broadcast_arrays(across * self.width, (1 - up) * self.height), axis=-1)

    def draw_axes(self, recording: rr.RecordingStream, path: str, *, x_name: str, y_name: str) -> None:
        """Write frame, grid, numbers and names of both axes."""
        x, y = ticks(*self.x_range, count=10), ticks(*self.y_range, count=6)
        (left, right), (low, high) = self.x_range, self.y_range
        grid = [self.places([at, at], [low, high]) for at in x] + [self.places([left, right], [at, at]) for at in y]
        frame = [self.places([left, left, right], [high, low, low])]
        colours = [GRID_COLOUR] * len(grid) + [AXIS_COLOUR] * len(frame)
        strips = rr.LineStrips2D(grid + frame, colors=colours, radii=rr.Radius.ui_points(0.5), draw_order=BEHIND)
        recording.log(path, strips, static=True)
        numbers = [f"{at:g}" for at in (*x, *y)]
        below = self.places(x, np.full(x.size, low)) + BELOW
        beside = self.places(np.full(y.size, left), y) - BESIDE
        # Above what may be written over the frame.
        names = [(self.width / 2, self.height + 1.4 * LETTERS), (0.0, -3.2 * LETTERS)]
        draw_labels(recording, f"{path}/numbers", np.vstack([below, beside, names]), [*numbers, x_name, y_name])

    def view(
        self, origin: str, name: str, *, left: float = 60.0, right: float = 30.0, above: float = 45.0
    ) -> rrb.View:
        """Give a view of the rectangle with its numbers, and some units more to the sides and above."""
        return rrb.Spatial2DView(
            origin=origin,
            name=visible(name),
            visual_bounds=rrb.VisualBounds2D(
                x_range=(-left, self.width + right), y_range=(-above, self.height + 2.7 * LETTERS)
            ),
        )


def draw_labels(
    recording: rr.RecordingStream,
    path: str,
    places: Real,
    texts: Sequence[str],
    *,
    colours: Sequence[tuple[int, int, int]] | None = None,
) -> None:
    """Write texts, each centred below its place; nothing when there are none."""
    if not texts:
        return
    labels = rr.Points2D(
        places,
        labels=[visible(text) for text in texts],
        show_labels=True,
        colors=colours or [LABEL_COLOUR] * len(texts),
        radii=rr.Radius.ui_points(0.0),
        draw_order=BEHIND / 2,
    )
    recording.log(path, labels, static=True)
