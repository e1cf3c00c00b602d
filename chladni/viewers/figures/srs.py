"""Shock response spectra on logarithmic axes."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from chladni.signals.shock_response import ShockResponse
from chladni.signals.unit_text import printed_unit
from chladni.viewers.figures.log_axis import logarithmic, logarithmic_frequency
from chladni.viewers.figures.sheet import BANDS_OF, legend, look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import Style

HEIGHT_IN = 3.2
X_LABEL = "Natural frequency [Hz]"
DIRECTIONS: dict[str, Literal[":", "--"]] = {"positive": ":", "negative": "--"}
_WORDS = {
    "absolute-acceleration": "Absolute acceleration",
    "relative-displacement": "Relative displacement",
    "pseudo-velocity": "Pseudo velocity",
}


def shock_figures(responses: Sequence[ShockResponse]) -> dict[str, Figure]:
    """Draw the maximax spectra, those of each direction thin beside; one figure for each unit's group, by name."""
    style = Style.of_channels(channel for response in responses for channel in response.channels)
    with look():
        return {
            f"srs {place} {group.name}": _figure(response, group, style)
            for place, response in enumerate(responses, start=1)
            for group in groups(response.channels)
        }


def _figure(response: ShockResponse, group: Group, style: Style) -> Figure:
    figure, (axes,) = sheet([HEIGHT_IN])
    draw_shock(axes, response, group, style)
    axes.set_xlabel(X_LABEL)
    return figure


def draw_shock(axes: Axes, response: ShockResponse, group: Group, style: Style) -> None:
    """Draw the spectra of one group into given axes."""
    rows = list(group.rows)
    for row in rows:
        _draw(axes, response, row, style, directions=len(rows) <= BANDS_OF)
    if len(rows) <= BANDS_OF:
        for word, dashes in DIRECTIONS.items():
            axes.add_line(Line2D([], [], linestyle=dashes, color="#555555", linewidth=0.6, label=word))
    shown = response.maximax[rows]
    positive = shown[shown > 0]
    if positive.size:
        # One direction alone may be orders below: what it shows there is no response.
        logarithmic(axes, float(positive.min()) / 3, float(positive.max()) * 1.5)
    logarithmic_frequency(axes, float(response.frequency_hz[0]), float(response.frequency_hz[-1]))
    axes.set_ylabel(f"{_WORDS[response.quantity]}, Q = {response.q:g} [{printed_unit(group.unit)}]")
    legend(axes)


def _draw(axes: Axes, response: ShockResponse, row: int, style: Style, *, directions: bool) -> None:
    channel = response.channels[row]
    colour = paint(style.on_light(channel))
    frequency_hz = response.frequency_hz
    axes.plot(frequency_hz, _drawn(response.maximax[row]), color=colour, label=plain(style.labels[channel.name]))
    if not directions:
        return
    for values, dashes in zip((response.positive, response.negative), DIRECTIONS.values(), strict=True):
        axes.plot(frequency_hz, _drawn(values[row]), dashes, color=colour, linewidth=0.6)


def _drawn(values: np.ndarray) -> np.ndarray:
    return np.where(values > 0, values, np.nan)
