"""Scores a campaign: every figure that the withheld check promises, with its uncertainty."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

from chladni.signals.errors import SetupError
from chladni_withheld.folders import FAILURE_FORMAT, RESULT_FORMAT, case_folders, read_json, truth_of_case, write_json
from chladni_withheld.marking import FAILED, Mark, mark
from chladni_withheld.vocabulary import FAMILY_OF

_Z = 1.959963984540054


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """`right` of `count`, with Wilson's 95 % interval.

    E. B. Wilson, Journal of the American Statistical Association 22 (1927).

    Examples
    --------
    >>> one = Share(right=9, count=10)
    >>> one.value, round(one.low, 3), round(one.high, 3)
    (0.9, 0.596, 0.982)
    >>> Share(right=0, count=0).value is None
    True
    """

    right: int
    count: int

    @property
    def value(self) -> float | None:
        """The share; None of nothing."""
        return self.right / self.count if self.count else None

    @property
    def low(self) -> float:
        """Lower end of the interval; 0 of nothing."""
        return self._end(-1.0)

    @property
    def high(self) -> float:
        """Upper end of the interval; 1 of nothing."""
        return self._end(1.0)

    def _end(self, side: float) -> float:
        if not self.count:
            return 0.0 if side < 0 else 1.0
        n, p, z2 = self.count, self.right / self.count, _Z**2
        middle, half = p + z2 / (2 * n), _Z * sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        # Rounding would leave an end a hair outside.
        return min(max((middle + side * half) / (1 + z2 / n), 0.0), 1.0)

    def told(self) -> dict[str, Any]:
        """Give it for JSON."""
        return {"right": self.right, "count": self.count, "share": self.value, "interval": [self.low, self.high]}


def share_of(marks: Sequence[bool]) -> Share:
    """Share of those that are true."""
    return Share(right=sum(marks), count=len(marks))


@dataclass(frozen=True, slots=True, kw_only=True)
class Reliability:
    """One bin of a reliability diagram."""

    low: float
    high: float
    count: int
    probability: float
    right: float


def reliability(probabilities: Sequence[float], right: Sequence[bool], *, bins: int = 10) -> list[Reliability]:
    """Bins of equal width that hold any, each with its mean probability and its share of right answers.

    Examples
    --------
    >>> [(one.count, one.right) for one in reliability([0.95, 0.97, 0.3], [True, False, False])]
    [(1, 0.0), (2, 0.5)]
    """
    p, hit = np.asarray(probabilities, dtype=float), np.asarray(right, dtype=float)
    place = np.minimum((p * bins).astype(int), bins - 1)
    return [
        Reliability(low=k / bins, high=(k + 1) / bins, count=int(np.sum(place == k)),
                    probability=float(p[place == k].mean()), right=float(hit[place == k].mean()))
        for k in range(bins) if np.any(place == k)
    ]  # fmt: skip


def calibration_error(table: Sequence[Reliability]) -> float | None:
    """Expected calibration error: mean distance of probability and share, weighted by the bins' counts.

    M. P. Naeini, G. F. Cooper, M. Hauskrecht, AAAI (2015), equation 6.
    """
    total = sum(one.count for one in table)
    return sum(one.count * abs(one.probability - one.right) for one in table) / total if total else None


SCORE_FORMAT = "chladni.blind-score/1"
#: Effects that move the outputs by at least so many times the noise must be found.
CLEAR_RATIO = 3.0
#: A wrong name with more than this probability is given with confidence.
CONFIDENT = 0.8
#: Edges of the detection curve, effect over noise.
FAINT_EDGES = (0.3, 0.6, 1.0, 1.7, 3.0)


def score_cases(directory: Path) -> dict[str, Any]:
    """Open the truths, verify their seals, mark the answers; write ``score.json`` and give its content.

    Cases without a result are counted and left out.

    Raises
    ------
    SetupError
        When a truth doesn't fit its seal, or there is nothing to score.
    """
    marks, missing = [], []
    for case in case_folders(directory):
        # All seals are verified, answered or not: a campaign with one broken seal is worth nothing.
        truth = truth_of_case(directory, case)
        path = directory / "results" / f"{case.name}.json"
        if path.is_file():
            result = read_json(path, RESULT_FORMAT, FAILURE_FORMAT)
            marks.append(mark(case.name, truth, result, path=path))
        else:
            missing.append(case.name)
    if not marks:
        raise SetupError(f"{directory / 'results'}: holds no result; run chladni blind run {directory} first")
    score = scored(marks) | {"missing": missing}
    write_json(directory / "score.json", score)
    return score


def scored(marks: Sequence[Mark]) -> dict[str, Any]:
    """Give all figures of a campaign, ready for JSON."""
    clear = [one for one in marks if one.kind == "effect" and (one.ratio is None or one.ratio >= CLEAR_RATIO)]
    quiet = [one for one in marks if one.kind in ("none", "parameters")]
    strange = [one for one in marks if one.kind in ("leave_out", "outside")]
    return {
        "format": SCORE_FORMAT,
        "cases": len(marks),
        "kinds": dict(Counter(one.kind for one in marks)),
        "failed": [one.name for one in marks if one.verdict == FAILED],
        "effect": _told(clear, lambda one: one.word_is_right),
        "family": _told(clear, lambda one: one.family_is_right),
        "effect_or_alternative": _told(clear, lambda one: one.is_among_the_alike),
        "effect_naive": _told(clear, lambda one: one.naive_is_right),
        "site": _told(clear, lambda one: one.site_is_right),
        "group_sizes": _group_sizes(clear),
        "false_alarm": _told(quiet, lambda one: one.first is not None),
        "false_alarm_coloured": _told([one for one in quiet if one.coloured], lambda one: one.first is not None),
        "false_unknown": _told(quiet, lambda one: one.verdict == "unknown"),
        "parameter_named": _told([one for one in quiet if one.off], lambda one: one.verdict == "parameters"),
        "strange_recognised": _told(strange, recognised),
        "left_out_recognised": _told([one for one in strange if one.kind == "leave_out"], recognised),
        "outside_recognised": _told([one for one in strange if one.kind == "outside"], recognised),
        "unknown_in_catalogue": _told(clear, lambda one: one.verdict == "unknown"),
        "closed": _closed(clear),
        "calibration": _calibration(marks),
        "two": _several([one for one in marks if one.kind == "two"], {"both": 2, "at_least_one": 1}),
        "three": _several(
            [one for one in marks if one.kind == "three"], {"all": 3, "at_least_two": 2, "at_least_one": 1}
        ),
        "faint": _faint([one for one in marks if one.kind == "faint"]),
        "confusion": _confusion(clear, word=lambda effect: effect),
        "confusion_family": _confusion(clear, word=lambda effect: FAMILY_OF.get(effect, "parameter")),
        "marks": [_row(one) for one in marks],
    }


def recognised(one: Mark) -> bool:
    """Whether a case without a right word was answered ``unknown``, or with a sibling of what was hidden."""
    return one.verdict == "unknown" or one.family_is_right


def _told(marks: Sequence[Mark], right: Callable[[Mark], bool]) -> dict[str, Any]:
    return share_of([right(one) for one in marks]).told()


def _group_sizes(marks: Sequence[Mark]) -> dict[str, int]:
    """How many answers had how many sites in their group."""
    sizes = Counter(max(len(one.first.group), 1) for one in marks if one.first is not None)
    return {str(size): sizes[size] for size in sorted(sizes)}


def _closed(marks: Sequence[Mark]) -> dict[str, Any]:
    """Share of the gap closed over what the true law closes; answers that give none are counted apart."""
    values = [one.closed for one in marks if one.closed is not None]
    low, middle = np.quantile(values, (0.1, 0.5)) if values else (None, None)
    return {
        "median": None if middle is None else float(middle),
        "tenth_percentile": None if low is None else float(low),
        "count": len(values),
        "without": len(marks) - len(values),
    }


def _calibration(marks: Sequence[Mark]) -> dict[str, Any]:
    """Probability of the first cause against its being right, over every case in which an effect was named."""
    named = [one for one in marks if one.first is not None]
    table = reliability([one.first.probability for one in named if one.first], [one.is_right for one in named])
    return {
        "expected_error": calibration_error(table),
        "count": len(named),
        "bins": [
            {"low": one.low, "high": one.high, "count": one.count, "probability": one.probability,
             "right": one.right, "interval": _interval(one)}
            for one in table
        ],
    }  # fmt: skip


def _interval(one: Reliability) -> list[float]:
    share = Share(right=round(one.right * one.count), count=one.count)
    return [share.low, share.high]


def _several(marks: Sequence[Mark], least: Mapping[str, int]) -> dict[str, Any]:
    """How often at least so many of the effects of machines that have several were named."""
    return {title: share_of([one.found() >= count for one in marks]).told() for title, count in least.items()}


def _faint(marks: Sequence[Mark]) -> dict[str, Any]:
    """Detection over severity, and names that were wrong and given with confidence."""
    curve = []
    for low, high in pairwise(FAINT_EDGES):
        inside = [one for one in marks if one.ratio is not None and low <= one.ratio < high]
        curve.append({
            "low": low, "high": high,
            "noticed": share_of([one.verdict != "none" for one in inside]).told(),
            "named": share_of([one.is_right for one in inside]).told(),
        })  # fmt: skip
    wrong = [one.first is not None and not one.word_is_right and one.first.probability > CONFIDENT for one in marks]
    return {"curve": curve, "named": _told(marks, lambda one: one.is_right), "confidently_wrong":
            Share(right=sum(wrong), count=len(wrong)).told()}  # fmt: skip


def _confusion(marks: Sequence[Mark], *, word: Callable[[str], str]) -> dict[str, dict[str, int]]:
    """Rows: what was hidden; columns: what was named, or the verdict where nothing was."""
    table: dict[str, Counter[str]] = {}
    for one in marks:
        answer = word(one.first.effect) if one.first is not None else one.verdict
        table.setdefault(word(one.hidden[0][0]), Counter())[answer] += 1
    return {hidden: dict(sorted(answers.items())) for hidden, answers in sorted(table.items())}


def _row(one: Mark) -> Mapping[str, Any]:
    first = one.first
    return {
        "case": one.name, "kind": one.kind, "coloured": one.coloured,
        "hidden": [list(pair) for pair in one.hidden], "off": one.off or None, "ratio": one.ratio,
        "ratio_tuned": one.ratio_tuned, "verdict": one.verdict,
        "named": [[cause.effect, cause.site] for cause in one.causes],
        "probability": None if first is None else first.probability,
        "right": _is_right(one), "closed": one.closed,
    }  # fmt: skip


def _is_right(one: Mark) -> bool:
    if one.kind in ("leave_out", "outside"):
        return recognised(one)
    if one.kind == "none":
        return one.verdict == "none"
    if one.kind == "parameters":
        return one.verdict == "parameters"
    return one.found() == len(one.hidden) if one.kind in ("two", "three") else one.is_right
