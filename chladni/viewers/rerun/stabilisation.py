"""The stabilisation diagram: poles of all model orders over the indicator, those taken for modes ringed."""

from dataclasses import replace

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from chladni.signals.arrays import Real
from chladni.signals.mode_set import ModeSet
from chladni.signals.stabilisation_diagram import StabilisationDiagram
from chladni.viewers.drawing import decibels_of_amplitude, level_limits, ticks
from chladni.viewers.labels import decibel_unit
from chladni.viewers.mode_tables import hertz
from chladni.viewers.rerun.canvas import BEHIND, BELOW, LETTERS, Canvas, draw_labels
from chladni.viewers.spread import spread
from chladni.viewers.stabilisation import STATUS_NAMES, frequency_range, order_range, title
from chladni.viewers.style import STATUS_ON_DARK

PATH = "/stabilisation"
# With the synthesis below it, and alone on its page.
WIDTH, HEIGHT, ALONE = 1440.0, 300.0, 670.0
# Half of a letter, to set a text right.
HALF_LETTER = 3.7
INDICATOR_COLOUR = (120, 120, 120)
MODE_COLOUR = (245, 245, 245)
HARMONIC_COLOUR = (235, 80, 80)
UPRIGHT = np.array([(0.0, -6.0), (0.0, 6.0)])
# Close modes are named above one another, as far as these rows go.
ROWS_OF_NAMES, NAME_WIDTH = 2, 54.0
ABOVE_RIGHT = np.array([1.2, -0.5]) * LETTERS


def draw_stabilisation(recording: rr.RecordingStream, modes: ModeSet) -> rrb.View | None:
    """Write the diagram and give its view; None for methods without model orders."""
    diagram = modes.stabilisation
    if diagram is None:
        return None
    height = ALONE if modes.fit is None else HEIGHT
    canvas = Canvas(
        width=WIDTH, height=height, x_range=frequency_range(modes.frequency_hz, diagram), y_range=order_range(diagram)
    )
    canvas.draw_axes(recording, f"{PATH}/axes", x_name="Frequency [Hz]", y_name="Model order")
    _draw_indicator(recording, canvas, diagram)
    _draw_modes(recording, canvas, modes)
    for status, name in enumerate(STATUS_NAMES):
        _draw_poles(recording, canvas, diagram, status, name)
    _draw_legend(recording, with_machines=len(modes.harmonics) > 0)
    return canvas.view(
        PATH, f"Stabilisation over {diagram.indicator_name} · point at a pole to read it", right=80.0, above=140.0
    )


def _draw_indicator(recording: rr.RecordingStream, canvas: Canvas, diagram: StabilisationDiagram) -> None:
    """Curves in decibels, over the whole height, with an axis of their own on the right."""
    level = decibels_of_amplitude(diagram.indicator)
    low, high = level_limits(level)
    over = replace(canvas, y_range=(low, high))
    inside = (diagram.indicator_hz >= canvas.x_range[0]) & (diagram.indicator_hz <= canvas.x_range[1])
    strips = []
    for curve in level:
        known = inside & np.isfinite(curve)
        strips.append(over.places(diagram.indicator_hz[known], np.maximum(curve[known], low)))
    lines = rr.LineStrips2D(
        [strip for strip in strips if len(strip) > 1],
        colors=[INDICATOR_COLOUR],
        radii=rr.Radius.ui_points(0.75),
        draw_order=BEHIND / 2,
    )
    recording.log(f"{PATH}/indicator", lines, static=True)
    numbers = ticks(low, high, count=8)
    right = over.places(np.full(numbers.size, canvas.x_range[1]), numbers) + ABOVE_RIGHT
    name = f"{title(diagram)} [{decibel_unit(diagram.indicator_unit)}]"
    places = np.vstack([right, [(WIDTH + 2 * LETTERS - HALF_LETTER * len(name), -3.2 * LETTERS)]])
    draw_labels(recording, f"{PATH}/indicator/numbers", places, [*(f"{number:g}" for number in numbers), name])


def _draw_modes(recording: rr.RecordingStream, canvas: Canvas, modes: ModeSet) -> None:
    """An upright line at each mode and at each line of a machine, named above the frame where there is room."""
    marks = [("modes", float(hertz), MODE_COLOUR) for hertz in modes.frequency_hz]
    marks += [("harmonics", line.frequency_hz, HARMONIC_COLOUR) for line in modes.harmonics]
    shown = [mark for mark in marks if canvas.x_range[0] <= mark[1] <= canvas.x_range[1]]
    for kind, colour in (("modes", MODE_COLOUR), ("harmonics", HARMONIC_COLOUR)):
        strips = [canvas.places([at, at], canvas.y_range) for name, at, _ in shown if name == kind]
        lines = rr.LineStrips2D(
            strips, colors=[(*colour, 90)] * len(strips), radii=rr.Radius.ui_points(0.5), draw_order=-2.0
        )
        recording.log(f"{PATH}/{kind}", lines, static=True)
    unnamed = list(range(len(shown)))
    for row in range(ROWS_OF_NAMES):
        tops = canvas.places([shown[place][1] for place in unnamed], np.full(len(unnamed), canvas.y_range[1]))
        named = spread(tops, apart=(NAME_WIDTH, 1.0))
        marked = [shown[unnamed[place]] for place in named]
        texts = [hertz(at) for _, at, _ in marked]
        above = tops[named] - [0.0, (1 + row) * LETTERS]
        draw_labels(recording, f"{PATH}/names/{row + 1}", above, texts, colours=[colour for _, _, colour in marked])
        unnamed = [place for at, place in enumerate(unnamed) if at not in named]


def _draw_poles(
    recording: rr.RecordingStream, canvas: Canvas, diagram: StabilisationDiagram, status: int, name: str
) -> None:
    chosen = (
        (diagram.status == status)
        & (diagram.frequency_hz >= canvas.x_range[0])
        & (diagram.frequency_hz <= canvas.x_range[1])
    )
    if not chosen.any():
        return
    places = canvas.places(diagram.frequency_hz[chosen], diagram.order[chosen])
    texts = [
        f"{hertz(f)} Hz, {zeta * 100:.2f} %, order {order}"
        for f, zeta, order in zip(
            diagram.frequency_hz[chosen], diagram.damping_ratio[chosen], diagram.order[chosen], strict=True
        )
    ]
    # Poles of noise are the most and matter the least.
    radius = 1.75 if status == 0 else 2.75
    dots = rr.Points2D(
        places,
        colors=[STATUS_ON_DARK[status]] * len(texts),
        radii=rr.Radius.ui_points(radius),
        # Told under the pointer.
        labels=texts,
        show_labels=False,
        draw_order=1.0 + status,
    )
    recording.log(f"{PATH}/poles/{name.replace(' ', '_')}", dots, static=True)
    taken = places[diagram.mode[chosen] >= 0]
    rings = [_ring(place) for place in taken]
    if rings:
        circles = rr.LineStrips2D(rings, colors=[(*MODE_COLOUR, 130)], radii=rr.Radius.ui_points(0.4), draw_order=9.0)
        recording.log(f"{PATH}/taken/{name.replace(' ', '_')}", circles, static=True)


def _ring(place: Real) -> Real:
    angle = np.linspace(0, 2 * np.pi, 13)
    return np.asarray(place + 4.2 * np.column_stack([np.cos(angle), np.sin(angle)]))


def _draw_legend(recording: rr.RecordingStream, *, with_machines: bool) -> None:
    """A row above the frame: a mark of each kind, and its meaning below it."""
    names = [*STATUS_NAMES, "taken for a mode", *(["line of a machine"] if with_machines else [])]
    across = WIDTH * (0.22 + 0.112 * np.arange(len(names)))
    places = np.column_stack([across, np.full(len(names), -5.4 * LETTERS)])
    kinds = len(STATUS_NAMES)
    dots = rr.Points2D(places[:kinds], colors=list(STATUS_ON_DARK), radii=rr.Radius.ui_points(4.0), show_labels=False)
    recording.log(f"{PATH}/legend/dots", dots, static=True)
    strips = [_ring(places[kinds]), *(place + UPRIGHT for place in places[kinds + 1 :])]
    colours = [MODE_COLOUR, HARMONIC_COLOUR][: len(strips)]
    marks = rr.LineStrips2D(strips, colors=colours, radii=rr.Radius.ui_points(0.5))
    recording.log(f"{PATH}/legend/marks", marks, static=True)
    draw_labels(recording, f"{PATH}/legend/names", places + BELOW, names)
