"""Names of peaks in a figure: a mark on each, and its frequency where there's room."""

from collections.abc import Iterable

from matplotlib.axes import Axes

from chladni.signals.peak import Peak

# Share of the axis that an upright label takes.
ROOM = 0.035
LABELS = 8
LABEL_POINTS = 40.0
# Share of a figure's height that is left for the axes between labels and legend.
AXES_SHARE = 0.78


def headroom(low_db: float, high_db: float, *, height_in: float) -> float:
    """Give the upper limit in decibels that leaves room for upright labels above the highest peak.

    Parameters
    ----------
    low_db, high_db
        Range of the data.
    height_in
        Height of the axes with their labels, inches.
    """
    share = LABEL_POINTS / (72 * height_in * AXES_SHARE)
    return low_db + (high_db - low_db) / (1 - share)


def label_peaks(axes: Axes, peaks: Iterable[Peak]) -> None:
    """Mark peaks, and write the frequency of the highest upright above them; a peak without room keeps its mark."""
    low, high = axes.get_xlim()
    shown = [peak for peak in peaks if low <= peak.frequency_hz <= high]
    labelled: list[float] = []
    # The highest first, so that it is the low ones that lose their label for want of room.
    for peak in sorted(shown, key=lambda peak: -peak.height):
        axes.plot(peak.frequency_hz, peak.height, marker="v", markersize=3, color="black", zorder=4)
        # Distances on paper, for a logarithmic axis has none in hertz.
        place = axes.transAxes.inverted().transform(axes.transData.transform((peak.frequency_hz, peak.height)))[0]
        if len(labelled) < LABELS and all(abs(place - other) > ROOM for other in labelled):
            labelled.append(place)
            axes.annotate(
                f"{peak.frequency_hz:.4g} Hz",
                (peak.frequency_hz, peak.height),
                xytext=(0, 4),
                textcoords="offset points",
                rotation=90,
                ha="center",
                va="bottom",
                fontsize=6.5,
            )
