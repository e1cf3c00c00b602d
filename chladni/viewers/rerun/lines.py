"""Lines over frequency, with the one-sigma band that every estimate has."""

from collections.abc import Sequence

import numpy as np
import rerun as rr

from chladni.signals.arrays import Real
from chladni.viewers.rerun.timelines import frequency_index, send_scalars
from chladni.viewers.style import Colour

# One entry for all bands of a legend, because the viewer joins lines of one name.
BAND_NAME = "± 1 sigma"
# More bands than this in one plot hide the lines; they can be switched on in the legend.
BANDS_SHOWN_OF = 4


def draw_line(
    recording: rr.RecordingStream, path: str, frequency_hz: Real, values: Real, *, name: str, colour: Colour
) -> None:
    """Write one line, ``[frequency]``; NaN breaks it."""
    # "Max", for the average that is the default would shave off every peak when zoomed out.
    style = rr.SeriesLines(names=name, colors=[colour], widths=1.5, aggregation_policy="Max")
    recording.log(path, style, static=True)
    send_scalars(recording, path, frequency_index(frequency_hz), values)


def draw_band(
    recording: rr.RecordingStream,
    path: str,
    frequency_hz: Real,
    bounds: Sequence[Real],
    *,
    colour: Colour,
    lines_in_view: int,
) -> None:
    """Write the lower and the upper bound of an estimate as thin lines beside it, under ``path``/band."""
    # Hidden, not left out: one click in the legend brings them back.
    shown = lines_in_view <= BANDS_SHOWN_OF
    # Two series on an entity of their own, so that the line can be read off without its band.
    style = rr.SeriesLines(
        names=[BAND_NAME, BAND_NAME],
        colors=[(*colour, 110), (*colour, 110)],
        widths=[0.75, 0.75],
        visible_series=[shown, shown],
        aggregation_policy="Max",
    )
    recording.log(f"{path}/band", style, static=True)
    send_scalars(recording, f"{path}/band", frequency_index(frequency_hz), np.column_stack(bounds))
