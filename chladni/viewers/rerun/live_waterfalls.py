"""Waterfalls of a live source: pictures in turn, with axes that move along."""

from io import BytesIO
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from chladni.signals.channel import Channel
from chladni.signals.live_state import LiveState
from chladni.signals.time_series import NS_PER_S
from chladni.signals.units import power_density_unit
from chladni.signals.waterfall import Waterfall
from chladni.viewers.drawing import block_maximum, decibels_of_power, ticks
from chladni.viewers.labels import decibel_unit
from chladni.viewers.rerun.canvas import LABEL_COLOUR, Canvas
from chladni.viewers.rerun.entities import folder
from chladni.viewers.rerun.timelines import log_at
from chladni.viewers.style import Style, amplitude_colours

#: How often each picture is redrawn, in seconds of the source: pictures weigh more than curves.
EVERY_S: Final = 5.0
#: Waterfalls drawn, the first channels of each grid.
MOST: Final = 12
#: Size of a picture.
PICTURE: Final = (1000, 420)
#: Levels from the greatest down that have a colour of their own.
SPAN_DB: Final = 60.0

_COLOURS: Final = amplitude_colours(np.linspace(0.0, 1.0, 256))


class LiveWaterfalls:
    """Draws the waterfalls of one source, one picture at a time, so that none holds up the waveforms."""

    def __init__(self, recording: rr.RecordingStream) -> None:
        self._recording = recording
        self._views: dict[str, rrb.View] = {}
        self._turn, self._pictures = 0, 1
        self._before_s = -np.inf

    @property
    def count(self) -> int:
        """Pictures drawn so far, each counted once."""
        return len(self._views)

    def views(self) -> list[rrb.View]:
        """Give a view of each picture."""
        return list(self._views.values())

    def draw(self, state: LiveState, style: Style, *, origin_ns: int) -> None:
        """Draw the picture whose turn it is, if it's time; all of them in the last state."""
        if not state.ended and state.time_s - self._before_s < EVERY_S / self._pictures:
            return
        self._before_s = state.time_s
        shown = [
            (folder("waterfall", str(place), str(row)), fall, row)
            for place, fall in enumerate(state.waterfalls, start=1)
            for row in range(min(MOST, len(fall.channels)))
        ]
        self._pictures = max(1, len(shown))
        for one in range(len(shown) if state.ended else min(1, len(shown))):
            path, fall, row = shown[(self._turn + one) % len(shown)]
            self._draw(path, fall, row, style, state.time_s, origin_ns)
        self._turn += 1

    def _draw(self, path: str, fall: Waterfall, row: int, style: Style, time_s: float, origin_ns: int) -> None:
        levels = decibels_of_power(fall.values[row])
        known = levels[np.isfinite(levels)]
        if not known.size:
            return
        high = float(np.percentile(known, 99.9))
        share = np.nan_to_num(np.clip((levels - high) / SPAN_DB + 1, 0.0, 1.0))
        picture = _COLOURS[_resized((255 * share).astype(np.uint8), PICTURE)]
        log_at(
            self._recording,
            f"{path}/picture",
            time_s,
            rr.EncodedImage(contents=_jpeg(picture), media_type="image/jpeg"),
        )
        canvas = _canvas(fall, (fall.start_time_ns - origin_ns) / NS_PER_S)
        log_at(self._recording, f"{path}/axes", time_s, _axes(canvas))
        if path not in self._views:
            self._views[path] = canvas.view(path, _title(fall.channels[row], style))


def _title(channel: Channel, style: Style) -> str:
    return f"{style.labels[channel.name]} [{decibel_unit(power_density_unit(channel.unit))}]"


def _canvas(fall: Waterfall, start_s: float) -> Canvas:
    step_s = float(fall.time_s[1] - fall.time_s[0]) if fall.time_s.size > 1 else 1.0
    first_s, last_s = float(fall.time_s[0]) - step_s / 2 + start_s, float(fall.time_s[-1]) + step_s / 2 + start_s
    return Canvas(
        width=PICTURE[0],
        height=PICTURE[1],
        x_range=(0.0, float(fall.frequency_hz[-1])),
        y_range=(last_s, first_s),
    )


def _axes(canvas: Canvas) -> rr.Points2D:
    """Numbers beside and below the picture; they move with it."""
    x, y = ticks(*canvas.x_range, count=10), ticks(canvas.y_range[1], canvas.y_range[0], count=6)
    below = canvas.places(x, np.full(x.size, canvas.y_range[0])) + np.array([0.0, 4.0])
    beside = canvas.places(np.zeros(y.size), y) - np.array([24.0, 8.0])
    names = np.array([(canvas.width / 2, canvas.height + 34.0), (-24.0, -34.0)])
    labels = [f"{one:g}" for one in (*x, *y)] + ["Hz", "s"]
    return rr.Points2D(
        np.vstack([below, beside, names]),
        labels=labels,
        show_labels=True,
        colors=[LABEL_COLOUR] * len(labels),
        radii=rr.Radius.ui_points(0.0),
        draw_order=10.0,
    )


def _resized(levels: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """Levels ``[time, line]`` as ``[row, column]`` of a picture; peaks stay."""
    shown, _ = block_maximum(levels, axis=1, limit=size[0])
    shown, _ = block_maximum(shown, axis=0, limit=size[1])
    rows = np.arange(size[1]) * shown.shape[0] // size[1]
    columns = np.arange(size[0]) * shown.shape[1] // size[0]
    return np.asarray(shown[rows[:, np.newaxis], columns], dtype=np.uint8)


def _jpeg(picture: NDArray[Any]) -> bytes:
    from PIL import Image

    held = BytesIO()
    Image.fromarray(picture).save(held, "JPEG", quality=85)
    return held.getvalue()
