"""What matplotlib has drawn into axes, drawn again as Bokeh's glyphs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import pi
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, HoverTool, LinearColorMapper
from bokeh.models.annotations import BoxAnnotation, Label, LegendItem, Span
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection, PolyCollection
from matplotlib.colors import to_hex, to_rgba
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle
from matplotlib.text import Annotation, Text
from numpy.typing import ArrayLike

from chladni.signals.arrays import Real
from chladni.viewers.drawing import block_maximum
from chladni.viewers.interactive.inert import inert, packed


class UntranslatableError(Exception):
    """A figure holds what these plots can't show; it's shown as it is."""


# Pixels of a line's width or a mark's size for each point on paper.
PIXELS_A_POINT = 1.5
MOST_SEGMENTS = 2000
MS_A_DAY = 86_400_000.0
# Share of the width that a name above the frame takes, beside another plot in a window of 1280 pixels.
NAME_SHARE = 0.085
_MARKS = {
    ".": "circle", "o": "circle", "^": "triangle", "v": "inverted_triangle", "s": "square", "x": "x", "+": "cross",
    "d": "diamond", "D": "diamond",
}  # fmt: skip
_DASHES = {"-": "solid", "--": "dashed", ":": "dotted", "-.": "dashdot"}
_BASELINES = {"center": "middle", "center_baseline": "middle", "baseline": "alphabetic"}


@dataclass(kw_only=True)
class Target:
    """A plot to draw into, and how values of the figure become its own.

    Attributes
    ----------
    plot
        Bokeh's figure.
    range_name
        Of the y axis that is drawn over.
    decade_db
        Decibels of a decade, where the axis is numbered in decibels; else None.
    x_name, y_name
        Of the axes, for reading out.
    cells
        Most cells of an image.
    dates
        Whether the x axis is one of dates.
    items, words, columns
        Of the legend, and its words; by the identity of a line its source and column, where several share one.
    """

    plot: Any
    range_name: str
    decade_db: float | None
    x_name: str
    y_name: str
    cells: int
    dates: bool = False
    items: list[LegendItem] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    columns: dict[int, tuple[ColumnDataSource, str]] = field(default_factory=dict)

    def up(self, y: ArrayLike) -> Real:
        """Give values of the y axis as they are drawn."""
        values = np.ma.filled(np.ma.asarray(y, dtype=np.float64), np.nan)
        if self.decade_db is None:
            return values
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.decade_db * np.log10(values))

    def along(self, x: ArrayLike) -> Real:
        """Give values of the x axis as they are drawn: of dates, milliseconds where matplotlib has days."""
        return np.ma.filled(np.ma.asarray(x, dtype=np.float64), np.nan) * (MS_A_DAY if self.dates else 1.0)

    def told_x(self, column: str, digits: str) -> tuple[str, dict[str, Any]]:
        """Give how a box tells x, and the kind of formatter that this takes."""
        key = column if column.startswith("$") else f"@{column}"
        told = "{%F %H:%M}" if self.dates else f"{{%.{digits}}}"
        return f"{key}{told}", {key: "datetime" if self.dates else "printf"}

    def name(self, renderer: Any, artist: Artist, colour: str) -> None:
        """Add a renderer to the legend where its artist has a word; all of one colour hide together."""
        renderer.name = colour
        label = str(artist.get_label())
        if label and not label.startswith("_"):
            self.words.append(label)
            self.items.append(LegendItem(label={"value": inert(label)}, renderers=[renderer]))


def draw_artists(axes: Axes, target: Target) -> None:
    """Draw all that is in axes, in its order from back to front.

    Raises
    ------
    UntranslatableError
        When some of it can't be drawn.
    """
    _draw_read_out(axes, target)
    drawn: list[Artist] = [*axes.images, *axes.collections, *axes.patches, *axes.lines, *axes.texts]
    if axes.artists or axes.tables:
        raise UntranslatableError("artists of other kinds")
    # Of the highest first, which keep their names where there is no room for all.
    names: list[float] = []
    for artist in sorted((one for one in drawn if one.get_visible()), key=lambda one: one.get_zorder()):
        if isinstance(artist, Text):
            _draw_text(axes, target, artist, names)
        else:
            _way(artist)(axes, target, artist)


def _way(artist: Artist) -> Callable[[Axes, Target, Any], None]:
    ways: Sequence[tuple[type[Artist], Callable[[Axes, Target, Any], None]]] = (
        (Line2D, _draw_line),
        (AxesImage, _draw_image),
        (LineCollection, _draw_segments),
        (PathCollection, _draw_points),
        (PolyCollection, _draw_area),
        (Rectangle, _draw_rectangle),
        (Polygon, _draw_span),
    )
    for kind, way in ways:
        if isinstance(artist, kind):
            return way
    raise UntranslatableError(type(artist).__name__)


def _places(axes: Axes, artist: Artist) -> tuple[bool, bool]:
    """Whether across and up are values of the axes; else they are shares of the frame."""
    # A patch's own transform stretches a unit square, from which Matplotlib 3.9 doesn't see the axes.
    transform = artist.get_data_transform() if isinstance(artist, Patch) else artist.get_transform()
    across, up = transform.contains_branch_seperately(axes.transData)
    return bool(across), bool(up)


def _draw_read_out(axes: Axes, target: Target) -> None:
    """Put an unseen line below the curves of each x axis, whose box tells the values of all of them."""
    groups: dict[bytes, list[Line2D]] = {}
    for line in axes.lines:
        if np.size(line.get_xdata()) and _places(axes, line) == (True, True) and line.get_linestyle() != "None":
            groups.setdefault(target.along(line.get_xdata(orig=False)).tobytes(), []).append(line)
    for lines in groups.values():
        columns = {f"y{place}": packed(target.up(line.get_ydata())) for place, line in enumerate(lines)}
        source = ColumnDataSource({"x": packed(target.along(lines[0].get_xdata(orig=False))), **columns})
        for place, line in enumerate(lines):
            target.columns[id(line)] = (source, f"y{place}")
        unseen = target.plot.line("x", "y0", source=source, line_alpha=0.0, y_range_name=target.range_name)
        told = [(_word(line) or target.y_name, f"@y{place}{{%.5g}}") for place, line in enumerate(lines)]
        told_x, formatters = target.told_x("x", "7g")
        target.plot.add_tools(
            HoverTool(
                renderers=[unseen],
                mode="mouse" if axes.get_aspect() == 1 else "vline",
                tooltips=[(target.x_name, told_x), *told],
                formatters=formatters | dict.fromkeys((f"@{name}" for name in columns), "printf"),
            )
        )


def _word(line: Line2D) -> str:
    label = str(line.get_label())
    return "" if label.startswith("_") else inert(label)


def _draw_line(axes: Axes, target: Target, line: Line2D) -> None:
    across, up = _places(axes, line)
    colour = _hex(line.get_color())
    look: dict[str, Any] = {
        "line_color": colour,
        "line_width": max(line.get_linewidth() * PIXELS_A_POINT, 0.8),
        "line_dash": _DASHES.get(str(line.get_linestyle()), "dashed"),
        "line_alpha": _alpha(line, line.get_color()),
    }
    if (across, up) != (True, True):
        if across == up:
            raise UntranslatableError("a line over the frame")
        value = float((target.along(line.get_xdata(orig=False)) if across else target.up(line.get_ydata()))[0])
        target.plot.add_layout(
            Span(location=value, dimension="height" if across else "width", y_range_name=target.range_name, **look)
        )
        return
    if id(line) in target.columns:
        source, place = target.columns[id(line)]
    else:
        place = "y"
        x, y = target.along(line.get_xdata(orig=False)), target.up(line.get_ydata())
        # A legend shows the look of a first point, which a line for its word alone doesn't have.
        columns = (x, y) if x.size else (np.array([np.nan]), np.array([np.nan]))
        source = ColumnDataSource(dict(zip(("x", place), map(packed, columns), strict=True)))
    if line.get_linestyle() != "None":
        target.name(_stroke(target, line, source, place, look), line, colour)
    if line.get_marker() not in (None, "None", "", " "):
        renderer = _marks(target, line, source, place)
        if line.get_linestyle() == "None":
            target.name(renderer, line, colour)
            _read_points(target, renderer, "x", place)


def _stroke(target: Target, line: Line2D, source: ColumnDataSource, place: str, look: dict[str, Any]) -> Any:
    style = line.get_drawstyle()
    if style == "default":
        return target.plot.line("x", place, source=source, y_range_name=target.range_name, **look)
    mode = {"steps-pre": "before", "steps": "before", "steps-post": "after", "steps-mid": "center"}[style]
    return target.plot.step("x", place, source=source, mode=mode, y_range_name=target.range_name, **look)


def _marks(target: Target, line: Line2D, source: ColumnDataSource, place: str) -> Any:
    mark = str(line.get_marker())
    if mark not in _MARKS:
        raise UntranslatableError(f"marks {mark!r}")
    # A dot is drawn at half its size.
    size = line.get_markersize() * PIXELS_A_POINT * (0.7 if mark == "." else 1.2)
    face, edge = line.get_markerfacecolor(), line.get_markeredgecolor()
    hollow = isinstance(face, str) and face == "none"
    return target.plot.scatter(
        "x",
        place,
        source=source,
        marker=_MARKS[mark],
        size=size,
        fill_color=None if hollow else _hex(face),
        line_color=_hex(edge) if line.get_markeredgewidth() or hollow else None,
        line_width=max(line.get_markeredgewidth(), 0.5),
        alpha=_alpha(line, line.get_color()),
        y_range_name=target.range_name,
    )


def _read_points(target: Target, renderer: Any, x: str, y: str) -> None:
    told_x, formatters = target.told_x(x, "7g")
    target.plot.add_tools(
        HoverTool(
            renderers=[renderer],
            tooltips=[(target.x_name, told_x), (target.y_name, f"@{y}{{%.5g}}")],
            formatters={**formatters, f"@{y}": "printf"},
        )
    )


def _draw_image(axes: Axes, target: Target, image: AxesImage) -> None:
    if target.dates or image.norm.vmin is None or image.norm.vmax is None or axes.get_aspect() != "auto":
        raise UntranslatableError("an image without a scale")
    level = np.ma.filled(np.ma.asarray(image.get_array(), dtype=np.float64), np.nan)
    if level.ndim != 2:
        raise UntranslatableError("an image of colours")
    left, right, bottom, top = image.get_extent()
    if image.origin == "upper":
        level, bottom, top = level[::-1], min(bottom, top), max(bottom, top)
    rows, columns = level.shape
    # As many as the budget holds, in the shape that it has.
    share = min(1.0, (target.cells / max(rows * columns, 1)) ** 0.5)
    level, _ = block_maximum(level, axis=0, limit=max(1, int(rows * share)))
    level, _ = block_maximum(level, axis=1, limit=max(1, int(columns * share)))
    mapper = mapper_of(image)
    drawn = target.plot.image(
        image=[level.astype(np.float32)], x=left, y=bottom, dw=right - left, dh=top - bottom, color_mapper=mapper
    )
    target.plot.add_tools(
        HoverTool(
            renderers=[drawn],
            tooltips=[
                (target.x_name, "$x{%.6g}"),
                (target.y_name, "$y{%.6g}"),
                (bar_name(axes) or "value", "@image{%.1f}"),
            ],
            formatters={"$x": "printf", "$y": "printf", "@image": "printf"},
        )
    )


def mapper_of(mappable: Any) -> LinearColorMapper:
    """Give the scale of colours of an image or a colour bar."""
    colours = mappable.cmap
    palette = [to_hex(colours(share)) for share in np.linspace(0, 1, 256)]
    return LinearColorMapper(
        palette=palette,
        low=float(mappable.norm.vmin),
        high=float(mappable.norm.vmax),
        nan_color=to_hex(colours.get_bad()),
    )


def bar_name(axes: Axes) -> str:
    """Give what the colour bar beside an image says, which several axes may share; empty without one."""
    if not axes.images:
        return ""
    bars = [image.colorbar for one in axes.figure.axes for image in one.images if image.colorbar is not None]
    return next((inert(bar.ax.get_ylabel() or bar.ax.get_xlabel()) for bar in bars), "")


def _draw_segments(axes: Axes, target: Target, lines: LineCollection) -> None:
    segments = lines.get_segments()
    if lines.get_array() is not None or len(segments) > MOST_SEGMENTS or _places(axes, lines) != (True, True):
        raise UntranslatableError("segments")
    if not segments:
        return
    colours = [_hex(one) for one in _several(lines.get_color())] or ["#000000"]
    target.plot.multi_line(
        [packed(target.along(one[:, 0])) for one in segments],
        [packed(target.up(one[:, 1])) for one in segments],
        line_color=colours[0] if len(colours) == 1 else (colours * len(segments))[: len(segments)],
        line_width=max(float(np.max(lines.get_linewidth())) * PIXELS_A_POINT, 0.6),
        y_range_name=target.range_name,
    )


def _draw_points(axes: Axes, target: Target, points: PathCollection) -> None:
    if points.get_array() is not None or points.get_offset_transform() != axes.transData:
        raise UntranslatableError("points")
    places = np.ma.filled(np.ma.asarray(points.get_offsets(), dtype=np.float64), np.nan)
    colours = [_hex(one) for one in _several(points.get_facecolor())] or ["#000000"]
    one_colour = len(set(colours)) == 1
    columns: dict[str, Any] = {"x": packed(target.along(places[:, 0])), "y": packed(target.up(places[:, 1]))}
    if not one_colour:
        columns["colour"] = colours
    renderer = target.plot.scatter(
        "x",
        "y",
        source=ColumnDataSource(columns),
        size=float(np.sqrt(np.mean(points.get_sizes()))) * PIXELS_A_POINT * 1.2,
        color=colours[0] if one_colour else "colour",
        line_color=None,
        y_range_name=target.range_name,
    )
    target.name(renderer, points, colours[0] if one_colour else "points")
    _read_points(target, renderer, "x", "y")


def _draw_area(axes: Axes, target: Target, area: PolyCollection) -> None:
    paths = area.get_paths()
    if area.get_array() is not None or len(paths) > MOST_SEGMENTS or _places(axes, area) != (True, True):
        raise UntranslatableError("areas")
    if not paths:
        return
    (face, *others) = [_rgba(one) for one in _several(area.get_facecolor())] or [(0.0, 0.0, 0.0, 0.0)]
    if others:
        raise UntranslatableError("areas of several colours")
    corners = [np.asarray(path.vertices) for path in paths]
    renderer = target.plot.patches(
        [packed(target.along(one[:, 0])) for one in corners],
        [packed(target.up(one[:, 1])) for one in corners],
        fill_color=to_hex(face),
        fill_alpha=face[3],
        line_color=None,
        y_range_name=target.range_name,
    )
    target.name(renderer, area, to_hex(face))


def _draw_rectangle(axes: Axes, target: Target, one: Rectangle) -> None:
    across, up = _places(axes, one)
    left, right = sorted((one.get_x(), one.get_x() + one.get_width()))
    if across:
        left, right = target.along([left, right]).tolist()
    bottom, top = np.sort(target.up([one.get_y(), one.get_y() + one.get_height()])).tolist()
    face = _rgba(one.get_facecolor())
    if not (across and up):
        _add_box(target, one, (left, right) if across else None, (bottom, top) if up else None)
        return
    edge = _rgba(one.get_edgecolor())
    target.plot.quad(
        left=[left], right=[right], bottom=[bottom], top=[top], fill_color=to_hex(face), fill_alpha=face[3],
        line_color=to_hex(edge) if one.get_linewidth() and edge[3] else None, y_range_name=target.range_name,
    )  # fmt: skip


def _draw_span(axes: Axes, target: Target, one: Polygon) -> None:
    across, up = _places(axes, one)
    if across == up:
        raise UntranslatableError("a polygon")
    ends = np.asarray(one.get_xy(), dtype=np.float64)[:, 0 if across else 1]
    ends = target.along(ends) if across else target.up(ends)
    span = (float(ends.min()), float(ends.max()))
    _add_box(target, one, span if across else None, None if across else span)


def _add_box(
    target: Target, one: Rectangle | Polygon, across: tuple[float, float] | None, up: tuple[float, float] | None
) -> None:
    face = _rgba(one.get_facecolor())
    sides: dict[str, Any] = {}
    if across is not None:
        sides |= {"left": across[0], "right": across[1]}
    if up is not None:
        sides |= {"bottom": up[0], "top": up[1]}
    target.plot.add_layout(
        BoxAnnotation(
            **sides, fill_color=to_hex(face), fill_alpha=face[3], line_color=None, y_range_name=target.range_name
        )
    )


def _draw_text(axes: Axes, target: Target, text: Text, names: list[float]) -> None:
    """Draw a text where it stands in the data; of names above the frame those that have room, inside its top."""
    if not text.get_text():
        return
    across, up = _places(axes, text)
    x, y = (float(value) for value in text.get_position())
    if isinstance(text, Annotation):
        if text.xycoords not in ("axes fraction", "data"):
            raise UntranslatableError("an annotation")
        (x, y), across = text.xy, text.xycoords == "data"
        up = across
    share = x if not across else float(axes.transAxes.inverted().transform(axes.transData.transform((x, 1.0)))[0])
    upright = text.get_rotation() == 90
    if not up and y >= 1.0:
        apart = NAME_SHARE / (3 if upright else 1)
        if any(abs(share - other) < apart for other in names):
            return
        names.append(share)
    look: dict[str, Any] = {
        "text": inert(text.get_text()),
        "text_color": _hex(text.get_color()),
        "text_font_size": "10.5px",
        "angle": pi / 2 if upright else 0.0,
    }
    if not (across or up) and 0 <= y < 1.0:
        target.plot.title.text += f" · {look['text']}"
        return
    place_x = x if across else _unshared(axes.get_xlim(), x, log=axes.get_xscale() == "log")
    top = target.plot.y_range.end if target.range_name == "default" else target.plot.extra_y_ranges["right"].end
    inside = not across and x >= 1.0
    # A name in the middle over a mark at either edge would be cut there.
    aside = "right" if inside or (upright and not up) else text.get_horizontalalignment()
    if aside == "center" and not upright:
        aside = "left" if share < NAME_SHARE / 2 else "right" if share > 1 - NAME_SHARE / 2 else aside
    # Inside the top of the frame, where it stands above it on paper; an upright one beside its line.
    beside = "top" if share < NAME_SHARE / 3 else "bottom"
    baseline = text.get_verticalalignment() if up else (beside if upright else "top")
    look |= {
        "x": float(target.along([place_x])[0]),
        "y": float(target.up([y])[0]) if up else top,
        "text_align": aside,
        "text_baseline": _BASELINES.get(baseline, baseline),
        "y_range_name": target.range_name,
        "y_offset": 0 if up else -3,
        "x_offset": 0 if up or not upright else 2 if beside == "top" else -2,
    }
    target.plot.add_layout(Label(**look))


def _unshared(limits: tuple[float, float], share: float, *, log: bool) -> float:
    low, high = limits
    share = min(share, 1.0)
    return float(low * (high / low) ** share if log else low + share * (high - low))


def _hex(colour: Any) -> str:
    return to_hex(colour, keep_alpha=False)


def _several(colours: Any) -> list[Any]:
    """Colours of a collection, which matplotlib keeps as rows."""
    return list(colours)


def _rgba(colour: Any) -> tuple[float, float, float, float]:
    return to_rgba(colour)


def _alpha(artist: Artist, colour: Any) -> float:
    given = artist.get_alpha()
    return float(given) if given is not None else to_rgba(colour)[3]
