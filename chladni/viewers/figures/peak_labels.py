"""Names of peaks in a figure: a mark on each, and its frequency in a row above the frame, crossed by no line."""

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation

from chladni.signals.arrays import Real
from chladni.signals.peak import Peak

# Peaks nearer than this share of the axis are one to the eye.
ROOM = 0.012
LABELS = 8
LETTERS_POINTS = 6.5
# "0.1234 Hz", the longest label, and a blank.
LABEL_POINTS = 38.0
# A line of letters, over the lines that lead to them.
RISE_POINTS = 7.0
STRIP_POINTS = RISE_POINTS + LETTERS_POINTS + 3.0
LEADER = "#999999"


def label_peaks(axes: Axes, peaks: Iterable[Peak]) -> float:
    """Mark peaks, and write the frequencies of the highest above the frame; the limits must be set already.

    A peak without room for its label keeps its mark.

    Returns
    -------
    float
        Points that the labels take above the frame; 0 when there are none.
    """
    low, high = axes.get_xlim()
    # The highest first, so that it is the low ones that lose their label for want of room.
    shown = sorted((peak for peak in peaks if low <= peak.frequency_hz <= high), key=lambda peak: -peak.height)
    if not shown:
        return 0.0
    axes.plot(
        [peak.frequency_hz for peak in shown],
        [peak.height for peak in shown],
        linestyle="none",
        marker="v",
        markersize=3,
        color="black",
        zorder=4,
    )
    room = LABEL_POINTS / (axes.bbox.width / axes.figure.dpi * 72)
    labelled = _with_room(axes, shown, most=min(LABELS, int(1 / room)))
    # Thin and behind the curves: they lead the eye from a name to its mark.
    top = axes.get_ylim()[1]
    places = [peak.frequency_hz for peak in labelled]
    axes.vlines(places, [peak.height for peak in labelled], top, colors=LEADER, linewidth=0.4, zorder=1)
    _write_above(axes, labelled, room)
    return STRIP_POINTS


def _with_room(axes: Axes, peaks: list[Peak], *, most: int) -> list[Peak]:
    chosen: list[tuple[float, Peak]] = []
    for peak in peaks:
        # Distances on paper, for a logarithmic axis has none in hertz.
        place = axes.transAxes.inverted().transform(axes.transData.transform((peak.frequency_hz, peak.height)))[0]
        if len(chosen) < most and all(abs(place - other) > ROOM for other, _ in chosen):
            chosen.append((place, peak))
    return [peak for _, peak in chosen]


def _hertz(frequency_hz: float) -> str:
    # Four digits, but no powers of ten.
    return f"{frequency_hz:.0f} Hz" if frequency_hz >= 1000 else f"{frequency_hz:.4g} Hz"


def _write_above(axes: Axes, peaks: list[Peak], room: float) -> None:
    """Write the frequencies above the frame, moved aside where they would meet, and lead a line to each."""
    if not peaks:
        return
    # In shares of the frame's width, whatever its scale.
    marks = [(peak.frequency_hz, peak.height) for peak in peaks]
    across = axes.transAxes.inverted().transform(axes.transData.transform(marks))[:, 0]
    above = axes.transAxes + ScaledTranslation(0, RISE_POINTS / 72, axes.figure.dpi_scale_trans)
    for peak, at, moved in zip(peaks, across, apart(across, room), strict=True):
        axes.annotate(
            _hertz(peak.frequency_hz),
            (float(at), 1.0),
            xytext=(float(moved), 1.0),
            xycoords="axes fraction",
            textcoords=above,
            ha="center",
            va="bottom",
            fontsize=LETTERS_POINTS,
            arrowprops={
                "arrowstyle": "-",
                "color": LEADER,
                "linewidth": 0.4,
                "shrinkA": 0,
                "shrinkB": 0,
                "relpos": (0.5, 0.0),
            },
            annotation_clip=False,
        )


def apart(places: Real, distance: float) -> Real:
    """Move places as little as possible (least squares) so that neighbours are `distance` apart, and inside 0 to 1.

    Examples
    --------
    >>> apart(np.array([0.5, 0.5, 0.9]), 0.1).round(6).tolist()
    [0.45, 0.55, 0.9]
    """
    order = np.argsort(places, kind="stable")
    steps = distance * np.arange(places.size)
    level = _not_falling(places[order] - steps)
    highest = 1.0 - (steps[-1] if steps.size else 0.0)
    moved = np.empty(places.size)
    moved[order] = np.clip(level, 0.0, max(highest, 0.0)) + steps
    return moved


def _not_falling(values: Real) -> Real:
    """Give what is nearest in least squares and doesn't fall: isotonic regression, by pooling adjacent violators.

    SciPy has it, but to load `scipy.optimize` for eight labels takes a tenth of the time to the first picture.
    """
    pools: list[tuple[float, int]] = []
    for value in values.tolist():
        pools.append((value, 1))
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            (later, count), (earlier, before) = pools.pop(), pools.pop()
            pools.append(((earlier * before + later * count) / (before + count), before + count))
    return np.repeat([mean for mean, _ in pools], [count for _, count in pools]).astype(np.float64)
