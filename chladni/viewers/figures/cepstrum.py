"""Cepstra over quefrency, with the peaks that stand out."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.signals.cepstrum import Cepstrum
from chladni.signals.study import Study
from chladni.viewers.drawing import thin
from chladni.viewers.figures.sheet import legend, look, paint, plain, sheet
from chladni.viewers.figures.waveforms import POINTS
from chladni.viewers.groups import groups
from chladni.viewers.style import Style

HEIGHT_IN = 1.5
PEAKS_NAMED = 4
X_LABEL = "Quefrency [ms]"
# Beyond the smooth shape of the spectrum, whose values near 0 are many times those of an echo.
SHOWN_STDS = 8.0


def cepstrum_figures(study: Study) -> dict[str, Figure]:
    """Draw the cepstra; one figure for each group of channels of one unit, axes for each channel, by name."""
    style = Style.of(study)
    found = {}
    with look():
        for place, one in enumerate(study.cepstra, start=1):
            for group in groups(one.channels):
                figure, stack = sheet([HEIGHT_IN] * len(group.rows), sharex=True)
                for axes, row in zip(stack, group.rows, strict=True):
                    draw_cepstrum(axes, found=one, row=row, style=style)
                stack[-1].set_xlabel(X_LABEL)
                found[f"cepstrum {place} {group.name}"] = figure
    return found


def draw_cepstrum(axes: Axes, found: Cepstrum, row: int, style: Style) -> None:
    """Draw a channel's cepstrum; dots mark the peaks that stand out, grey is three sigma where nothing repeats."""
    channel, values = found.channels[row], found.values[row]
    chosen, _ = thin(values, limit=POINTS)
    at_ms = 1e3 * found.quefrency_s
    sigma = 3 * found.std if found.kind == "real" else 4 * (3 * found.std) ** 2
    axes.fill_between(
        at_ms, -sigma if found.kind == "real" else 0.0, sigma, color="#cccccc", linewidth=0,
        label="3 sigma",
    )  # fmt: skip
    colour, label = paint(style.on_light(channel)), plain(style.labels[channel.name])
    axes.plot(at_ms[chosen], values[chosen], color=colour, linewidth=0.7, label=label)
    peaks_s = found.peaks_s[row]
    heights = [found.at(row, peak_s) for peak_s in peaks_s]
    axes.plot(
        [1e3 * peak_s for peak_s in peaks_s], heights, linestyle="", marker=".", color="#333333", markersize=4,
        label=_told(peaks_s),
    )  # fmt: skip
    top = max(SHOWN_STDS / 3 * float(np.max(sigma)), 1.2 * max(heights, default=0.0))
    # A record's smooth spectrum lies in the first quefrencies.
    lowest = float(values[values.size // 20 :].min())
    axes.set_ylim(min(1.2 * lowest, -SHOWN_STDS / 3 * float(np.max(sigma))) if found.kind == "real" else 0.0, top)
    axes.set_xlim(0.0, at_ms[-1])
    axes.set_ylabel("Cepstrum [Np]" if found.kind == "real" else "Cepstrum [Np²]")
    legend(axes)


def _told(peaks_s: Sequence[float]) -> str:
    """Name the highest peaks."""
    if not peaks_s:
        return "no peak stands out"
    named = ", ".join(f"{1e3 * peak_s:.4g}" for peak_s in peaks_s[:PEAKS_NAMED])
    return f"peaks: {named}{', ...' if len(peaks_s) > PEAKS_NAMED else ''} ms"
