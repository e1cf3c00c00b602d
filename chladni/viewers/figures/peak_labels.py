"""Names of peaks in a figure: a mark on each, and its frequency in a row above the frame, crossed by no line."""

from collections.abc import Iterable

from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation

from chladni.signals.peak import Peak

# Share of the axis that an upright label takes.
ROOM = 0.035
LABELS = 8
LETTERS_POINTS = 6.5
GAP_POINTS = 3.0
# "0.1234 Hz", the longest label, set upright.
STRIP_POINTS = 35.0
LEADER = "#999999"


def label_peaks(axes: Axes, peaks: Iterable[Peak]) -> float:
    """Mark peaks, and write the frequencies of the highest upright above the frame; the limits must be set already.

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
    labelled = _with_room(axes, shown)
    # Thin and behind the curves: they lead the eye from a name to its mark.
    top = axes.get_ylim()[1]
    places = [peak.frequency_hz for peak in labelled]
    axes.vlines(places, [peak.height for peak in labelled], top, colors=LEADER, linewidth=0.4, zorder=1)
    for peak in labelled:
        _name(axes, peak)
    return STRIP_POINTS


def _with_room(axes: Axes, peaks: list[Peak]) -> list[Peak]:
    chosen: list[tuple[float, Peak]] = []
    for peak in peaks:
        # Distances on paper, for a logarithmic axis has none in hertz.
        place = axes.transAxes.inverted().transform(axes.transData.transform((peak.frequency_hz, peak.height)))[0]
        if len(chosen) < LABELS and all(abs(place - other) > ROOM for other, _ in chosen):
            chosen.append((place, peak))
    return [peak for _, peak in chosen]


def _hertz(frequency_hz: float) -> str:
    # Four digits, but no powers of ten.
    return f"{frequency_hz:.0f} Hz" if frequency_hz >= 1000 else f"{frequency_hz:.4g} Hz"


def _name(axes: Axes, peak: Peak) -> None:
    above = ScaledTranslation(0, GAP_POINTS / 72, axes.figure.dpi_scale_trans)
    axes.text(
        peak.frequency_hz,
        1.0,
        _hertz(peak.frequency_hz),
        transform=axes.get_xaxis_transform() + above,
        rotation=90,
        ha="center",
        va="bottom",
        fontsize=LETTERS_POINTS,
    )
