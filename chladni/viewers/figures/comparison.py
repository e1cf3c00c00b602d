"""What changed between two measurements: decibels over frequency, with the lines that scatter doesn't explain."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.arrays import Mask, Real
from chladni.signals.channel import Channel
from chladni.signals.comparison import DensityComparison, ResponseComparison
from chladni.viewers.drawing import line_breaks, with_breaks
from chladni.viewers.figures.sheet import BAND_OPACITY, legend, look, paint, plain, sheet
from chladni.viewers.groups import Group, groups
from chladni.viewers.style import Style

HEIGHT_IN = 1.15
GREY = "#777777"
# A change of a hundredth of a decibel shouldn't fill the frame.
LEAST_SPAN_DB = 1.0
# Legend and frequencies.
AROUND_POINTS = 50.0
# The channel's name stands between the first frame and the legend.
TITLE_POINTS = 12.0


def comparison_figures(
    densities: Sequence[DensityComparison], response: ResponseComparison | None = None
) -> dict[str, Figure]:
    """Draw the changes of densities and magnitudes; one figure for each group of channels of one unit, by name.

    Each channel has axes of its own: the change in decibels, after over before, with its one-sigma band, and in
    colour the lines that differ by more than scatter explains. Of a transfer function that is the complex
    difference: a line whose phase alone changed is marked at 0 dB.

    Parameters
    ----------
    densities
        Changes of spectra, one entry a sample rate.
    response
        Changes of transfer functions; None when there are none.
    """
    style = Style.of_channels(_channels(densities, response))
    with look():
        return {
            **{
                f"change of psd {place} {group.name}": _density_figure(density, group, style)
                for place, density in enumerate(densities, start=1)
                for group in groups(density.channels)
            },
            **(_response_figures(response, style) if response else {}),
        }


def _channels(densities: Sequence[DensityComparison], response: ResponseComparison | None) -> Iterator[Channel]:
    for density in densities:
        yield from density.channels
    if response is not None:
        yield from (*response.references, *response.responses)


def _density_figure(density: DensityComparison, group: Group, style: Style) -> Figure:
    figure, stack = sheet([HEIGHT_IN] * len(group.rows), above_points=AROUND_POINTS, sharex=True)
    for axes, row in zip(stack, group.rows, strict=True):
        changes = (density.change_db[row], density.change_std_db[row], density.significant[row])
        _draw(axes, density.frequency_hz, *changes, channel=density.channels[row], style=style)
    return _finished(figure, stack, density.frequency_hz, "Change of PSD [dB]")


def _response_figures(response: ResponseComparison, style: Style) -> dict[str, Figure]:
    # What wasn't excited in both has no change; without any line left there is nothing to draw.
    if not np.isfinite(response.change_db).any():
        return {}
    return {
        f"change of response {column + 1} {group.name}": _response_figure(response, column, group, style)
        for column in range(len(response.references))
        for group in groups(response.responses)
    }


def _response_figure(response: ResponseComparison, column: int, group: Group, style: Style) -> Figure:
    figure, stack = sheet([HEIGHT_IN] * len(group.rows), above_points=AROUND_POINTS, sharex=True)
    known = np.isfinite(response.change_db).any(axis=(0, 1))
    frequency_hz = response.frequency_hz[known]
    for axes, row in zip(stack, group.rows, strict=True):
        at = (row, column, known)
        changes = (response.change_db[at], response.change_std_db[at], response.significant[at])
        _draw(axes, frequency_hz, *changes, channel=response.responses[row], style=style)
    reference = plain(style.labels[response.references[column].name])
    return _finished(figure, stack, frequency_hz, f"Change of |H| [dB]\nto {reference}")


def _draw(
    axes: Axes,
    frequency_hz: Real,
    change_db: Real,
    std_db: Real,
    significant: Mask,
    *,
    channel: Channel,
    style: Style,
) -> None:
    # An infinite sigma has no bounds to draw.
    sigma = np.where(np.isfinite(std_db), std_db, np.nan)
    curves = np.column_stack([change_db, change_db - sigma, change_db + sigma])
    x, curves = with_breaks(frequency_hz, curves, line_breaks(frequency_hz))
    axes.axhline(0, color="black", linewidth=0.6, zorder=1)
    axes.fill_between(x, curves[:, 1], curves[:, 2], color=GREY, alpha=BAND_OPACITY, linewidth=0)
    axes.plot(x, curves[:, 0], color=GREY, linewidth=0.5, label="after over before, ± 1 sigma")
    _draw_significant(axes, frequency_hz, change_db, significant, paint(style.on_light(channel)))
    axes.set_ylim(*_limits(change_db, sigma))
    axes.set_title(plain(style.labels[channel.name]), loc="left", pad=2)


def _draw_significant(
    axes: Axes, frequency_hz: Real, change_db: Real, significant: Mask, colour: tuple[float, float, float]
) -> None:
    """Colour the curve where it differs; thousands of dots on it would hide it."""
    coloured = np.where(significant, change_db, np.nan)
    x, y = with_breaks(frequency_hz, coloured, line_breaks(frequency_hz))
    axes.plot(x, y, color=colour, linewidth=0.8, label="in colour: more than scatter explains", zorder=3)
    # A line alone among others would have no length.
    beside = np.convolve(significant, [1, 0, 1], mode="same") > 0
    alone = significant & ~beside
    axes.plot(frequency_hz[alone], change_db[alone], linestyle="none", marker=".", markersize=2.5, color=colour)


def _limits(change_db: Real, sigma_db: Real) -> tuple[float, float]:
    """From the changes and a usual band around them; bands are endless where next to nothing is known."""
    change = change_db[np.isfinite(change_db)]
    sigma = sigma_db[np.isfinite(sigma_db)]
    usual = float(np.median(sigma)) if sigma.size else 0.0
    # Zero is always in sight: how far from it a line is, is what the figure is about.
    low = float(change.min(initial=-LEAST_SPAN_DB / 2))
    high = float(change.max(initial=LEAST_SPAN_DB / 2))
    low, high = low - usual, high + usual
    return low - 0.05 * (high - low), high + 0.05 * (high - low)


def _finished(figure: Figure, stack: list[Axes], frequency_hz: Real, label: str) -> Figure:
    stack[0].set_xlim(frequency_hz[0], frequency_hz[-1])
    stack[-1].set_xlabel("Frequency [Hz]")
    figure.supylabel(label, fontsize=8.5)
    legend(stack[0], above_points=TITLE_POINTS)
    return figure
