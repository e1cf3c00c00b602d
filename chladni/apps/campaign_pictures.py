"""Figures of a campaign of the withheld check, from its score."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from chladni.signals.errors import SetupError
from chladni.viewers.figures.album import Album
from chladni.viewers.figures.campaign import (
    Detection,
    ReliabilityBin,
    calibration_figure,
    confusion_figure,
    detection_figure,
)


def campaign_album(score: Mapping[str, Any]) -> Album:
    """Draw reliability diagram, confusion matrix and detection curve of a score, as far as it holds any.

    Parameters
    ----------
    score
        What `score_cases` gave, or the content of its ``score.json``.

    Raises
    ------
    SetupError
        When it isn't a score.
    """
    try:
        figures = {
            "calibration": _calibration(score["calibration"]),
            "confusion": _confusion(score["confusion"]),
            "detection": _detection(score["faint"]["curve"]),
        }
    except (KeyError, TypeError) as error:
        raise SetupError(
            f"this is no score of a campaign: {error} is missing; chladni blind score makes one"
        ) from error
    return Album({"campaign": {name: figure for name, figure in figures.items() if figure is not None}})


def _calibration(told: Mapping[str, Any]) -> Figure | None:
    bins = [_bin(one) for one in told["bins"]]
    return calibration_figure(bins, error=told["expected_error"]) if bins else None


def _bin(one: Mapping[str, Any]) -> ReliabilityBin:
    return ReliabilityBin(
        low=one["low"],
        high=one["high"],
        said=one["probability"],
        right=one["right"],
        interval=tuple(one["interval"]),
        cases=one["count"],
    )


def _confusion(table: Mapping[str, Mapping[str, int]]) -> Figure | None:
    truths = list(table)
    if not truths:
        return None
    named = {answer for row in table.values() for answer in row}
    # In the order of the truths, so that right answers stand on the diagonal; verdicts and strays after them.
    answers = [*truths, *sorted(named.difference(truths))]
    counts = np.array([[table[truth].get(answer, 0) for answer in answers] for truth in truths], dtype=np.int64)
    return confusion_figure(counts, truths=truths, answers=answers)


def _detection(curve: Sequence[Mapping[str, Any]]) -> Figure | None:
    steps = [
        Detection(low=one["low"], high=one["high"], share=told["share"], interval=tuple(told["interval"]), what=what)
        for key, what in (("noticed", "noticed"), ("named", "named rightly"))
        for one in curve
        if (told := one[key])["count"]
    ]
    return detection_figure(steps) if steps else None
