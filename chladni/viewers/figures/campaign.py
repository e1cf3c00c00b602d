"""How good a campaign of diagnoses was: how reliable its probabilities, what was taken for what, what was noticed."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from chladni.signals.arrays import Real, Whole
from chladni.signals.errors import EstimateError
from chladni.viewers.figures.sheet import look, paint, plain, sheet
from chladni.viewers.gap_evidence import AFTER_ON_LIGHT, BEFORE_ON_LIGHT
from chladni.viewers.style import ON_LIGHT

SQUARE_IN, COUNTS_IN, DETECTION_IN = 3.4, 0.8, 2.2
CELL_IN, MARGIN_IN, LETTER_IN = 0.24, 0.5, 0.065
RIGHT, WRONG = paint(AFTER_ON_LIGHT), paint(BEFORE_ON_LIGHT)
# White where nothing was, darker the more of a row is there.
_RIGHT_COLOURS = LinearSegmentedColormap.from_list("right", [(1, 1, 1), RIGHT])
_WRONG_COLOURS = LinearSegmentedColormap.from_list("wrong", [(1, 1, 1), WRONG])


@dataclass(frozen=True, slots=True, kw_only=True)
class ReliabilityBin:
    """Answers of about one probability.

    Attributes
    ----------
    low, high
        Probabilities that fall into it.
    said
        Mean of the probabilities that were given.
    right
        Share of the answers that were right.
    interval
        95 % interval of `right`, Wilson's.
    cases
        How many answers.
    """

    low: float
    high: float
    said: float
    right: float
    interval: tuple[float, float]
    cases: int


def calibration_figure(bins: Sequence[ReliabilityBin], *, error: float | None = None) -> Figure:
    """Draw the reliability diagram: how often answers of a probability were right, over that probability.

    Parameters
    ----------
    bins
        By rising probability; empty ones are left out.
    error
        Expected calibration error, for the title.

    Examples
    --------
    >>> one = ReliabilityBin(low=0.8, high=1.0, said=0.93, right=0.9, interval=(0.8, 0.96), cases=50)
    >>> len(calibration_figure([one], error=0.03).axes)
    2
    """
    shown = [one for one in bins if one.cases]
    with look():
        figure, (reliability, counts) = sheet([SQUARE_IN, COUNTS_IN], sharex=True)
        _draw_reliability(reliability, shown)
        middles = [(one.low + one.high) / 2 for one in shown]
        counts.bar(middles, [one.cases for one in shown], [one.high - one.low for one in shown], color=RIGHT,
                   edgecolor="white", linewidth=0.6)  # fmt: skip
        counts.set_ylabel("Answers")
        counts.set_xlabel("Probability that was given")
        counts.set_xlim(0, 1)
        if error is not None:
            reliability.set_title(f"Expected calibration error {error:.3f}", loc="left")
    return figure


def _draw_reliability(axes: Axes, bins: Sequence[ReliabilityBin]) -> None:
    axes.plot([0, 1], [0, 1], color="#888888", linewidth=0.8, linestyle=(0, (4, 2)), label="as given")
    said, right = [one.said for one in bins], [one.right for one in bins]
    # An interval may miss its own share by rounding when all or none were right.
    below = [max(one.right - one.interval[0], 0.0) for one in bins]
    above = [max(one.interval[1] - one.right, 0.0) for one in bins]
    axes.errorbar(said, right, yerr=[below, above], fmt="o", color=RIGHT, markersize=4, linewidth=1.0, capsize=2,
                  label="answers, 95 % interval")  # fmt: skip
    axes.set_ylim(-0.02, 1.04)
    axes.set_ylabel("Share that was right")
    axes.legend(loc="upper left", frameon=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """How often effects of about one severity were noticed, or named.

    Attributes
    ----------
    low, high
        What the effect moves the outputs by, over the noise.
    share, interval
        Of the cases, with its 95 % interval.
    what
        ``noticed`` or ``named rightly``, as the legend says it.
    """

    low: float
    high: float
    share: float
    interval: tuple[float, float]
    what: str


def detection_figure(steps: Sequence[Detection]) -> Figure:
    """Draw the detection curve: shares over severity, one line for each thing that was counted."""
    kinds = list(dict.fromkeys(one.what for one in steps))
    with look():
        figure, (axes,) = sheet([DETECTION_IN])
        for place, kind in enumerate(kinds):
            _draw_detection(axes, [one for one in steps if one.what == kind], place)
        edges = sorted({edge for one in steps for edge in (one.low, one.high)})
        axes.set_xscale("log")
        axes.set_xticks(edges, [f"{edge:g}" for edge in edges])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_ylim(-0.02, 1.04)
        axes.set_xlabel("Effect over noise")
        axes.set_ylabel("Share of the cases")
        # Above: intervals of a few cases reach everywhere.
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=len(kinds), frameon=False)
    return figure


def _draw_detection(axes: Axes, steps: Sequence[Detection], place: int) -> None:
    # A little apart, so that the intervals don't cover each other.
    middles = [sqrt(one.low * one.high) * (1.0 + 0.03 * place) for one in steps]
    below = [max(one.share - one.interval[0], 0.0) for one in steps]
    above = [max(one.interval[1] - one.share, 0.0) for one in steps]
    axes.errorbar(middles, [one.share for one in steps], yerr=[below, above], marker="o", markersize=4, capsize=2,
                  linewidth=1.0, color=paint(ON_LIGHT[place]), label=steps[0].what)  # fmt: skip


def confusion_figure(counts: Whole, *, truths: Sequence[str], answers: Sequence[str]) -> Figure:
    """Draw how often each truth got each answer: blue where they are the same word, orange where not.

    Parameters
    ----------
    counts
        ``[truth, answer]``.
    truths, answers
        Words of rows and columns.

    Raises
    ------
    EstimateError
        When the counts don't fit the words.
    """
    if counts.shape != (len(truths), len(answers)):
        raise EstimateError(f"counts of shape {counts.shape} for {len(truths)} truths and {len(answers)} answers")
    across, up = (LETTER_IN * max(map(len, words), default=0) + MARGIN_IN for words in (truths, answers))
    with look():
        size = (across + CELL_IN * len(answers), up + CELL_IN * len(truths))
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        axes.imshow(_colours(counts, truths, answers), aspect="equal")
        for (row, column), count in np.ndenumerate(counts):
            if count:
                axes.text(column, row, str(count), ha="center", va="center", fontsize=6.5)
        axes.set_xticks(range(len(answers)), [plain(word) for word in answers], rotation=90, fontsize=6.5)
        axes.set_yticks(range(len(truths)), [plain(word) for word in truths], fontsize=6.5)
        axes.xaxis.tick_top()
        axes.xaxis.set_label_position("top")
        axes.set_xlabel("Answer")
        axes.set_ylabel("Truth")
        _grid(axes, len(truths), len(answers))
    return figure


def _colours(counts: Whole, truths: Sequence[str], answers: Sequence[str]) -> Real:
    """``[truth, answer, rgba]`` by the share of its truth."""
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    same = np.array([[truth == answer for answer in answers] for truth in truths], dtype=np.bool_)
    # Full colour would hide the number; a single mistake among many right answers must show all the same.
    faded = np.where(counts > 0, 0.2 + 0.55 * share, 0.0)
    return np.asarray(np.where(same[..., None], _RIGHT_COLOURS(faded), _WRONG_COLOURS(faded)))


def _grid(axes: Axes, rows: int, columns: int) -> None:
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    for row in range(rows + 1):
        axes.axhline(row - 0.5, color="#dddddd", linewidth=0.5)
    for column in range(columns + 1):
        axes.axvline(column - 0.5, color="#dddddd", linewidth=0.5)
