"""The modal assurance criterion between the modes themselves, as a picture with numbers."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.mode_set import ModeSet
from chladni.signals.mode_validation import ModeValidation
from chladni.viewers.mode_tables import hertz
from chladni.viewers.rerun.canvas import draw_labels
from chladni.viewers.style import mac_colours

PATH = "/mac"
# Up to so many modes every cell has its number; beyond, only those of different modes that look alike.
ALL_NUMBERED = 10
ALIKE = 0.2
NUMBERS = 100
INK = (235, 235, 235)
# Labels hang below their place by about this share of a picture that half the window shows.
DROP = 0.035


def draw_mac(recording: rr.RecordingStream, modes: ModeSet, validation: ModeValidation) -> rrb.View:
    """Write the matrix, a cell a unit, and give its view."""
    mac, count = validation.auto_mac, modes.frequency_hz.size
    recording.log(f"{PATH}/cells", rr.Image(mac_colours(mac), magnification_filter="Nearest"), static=True)
    _draw_numbers(recording, mac)
    margin = 0.22 * count
    every = -(-count // 12)
    shown = np.arange(0, count, every)
    drop = DROP * (count + margin)
    across = np.column_stack([shown + 0.5, np.full(shown.size, float(count))])
    down = np.column_stack([np.full(shown.size, -0.55 * margin), shown + 0.5 - drop])
    names = [f"{row + 1}" for row in shown]
    sides = [f"{row + 1}: {hertz(float(modes.frequency_hz[row]))}" for row in shown]
    draw_labels(recording, f"{PATH}/names", np.vstack([across, down]), [*names, *sides])
    return rrb.Spatial2DView(
        origin=PATH,
        name="AutoMAC · mode: Hz",
        visual_bounds=rrb.VisualBounds2D(
            x_range=(-margin, count + 0.1 * margin), y_range=(-0.1 * margin, count + 0.6 * margin)
        ),
    )


def _draw_numbers(recording: rr.RecordingStream, mac: np.ndarray) -> None:
    count = len(mac)
    wanted = np.ones(mac.shape, dtype=np.bool_)
    if count > ALL_NUMBERED:
        wanted = (mac >= ALIKE) & ~np.eye(count, dtype=np.bool_)
    rows, columns = np.nonzero(wanted)
    # Too many would hide the cells, whose colour says the same.
    if rows.size > NUMBERS:
        return
    places = np.column_stack([columns + 0.5, rows + 0.5 - DROP * count])
    texts = [f"{mac[row, column]:.2f}" for row, column in zip(rows, columns, strict=True)]
    draw_labels(recording, f"{PATH}/numbers", places, texts, colours=[INK] * len(texts))
