"""Scores a campaign: every figure that the withheld check promises, and pairs of two versions' answers."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from chladni.signals.errors import SetupError
from chladni_withheld.campaign import generator_in
from chladni_withheld.case import PARAMETER, QUIET, Kind
from chladni_withheld.folders import (
    FAILURE_FORMAT,
    RESULT_FORMAT,
    case_folders,
    checksums,
    read_json,
    require_files,
    truth_of_case,
    write_json,
)
from chladni_withheld.marking import FAILED, MODEL_WRONG, STRANGE, Mark, mark
from chladni_withheld.vocabulary import FAMILY_OF


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """`right` of `count`, with Wilson's 95 % interval.

    E. B. Wilson, Journal of the American Statistical Association 22 (1927).

    Examples
    --------
    >>> one = Share(right=9, count=10)
    >>> one.value, *(round(end, 3) for end in one.interval)
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
    def interval(self) -> tuple[float, float]:
        """Ends of the interval; all that a share can be, of nothing."""
        if not self.count:
            return 0.0, 1.0
        ends = binomtest(self.right, self.count).proportion_ci(0.95, "wilson")
        return float(ends.low), float(ends.high)

    def told(self) -> dict[str, Any]:
        """Give it for JSON."""
        return {"right": self.right, "count": self.count, "share": self.value, "interval": list(self.interval)}


def share_of(marks: Sequence[bool]) -> Share:
    """Share of those that are true."""
    return Share(right=sum(marks), count=len(marks))


@dataclass(frozen=True, slots=True, kw_only=True)
class Reliability:
    """One bin of a reliability diagram."""

    low: float
    high: float
    probability: float
    share: Share


def reliability(probabilities: Sequence[float], right: Sequence[bool], *, bins: int = 10) -> list[Reliability]:
    """Bins of equal width that hold any, each with its mean probability and its share of right answers.

    Examples
    --------
    >>> [(one.share.count, one.share.value) for one in reliability([0.95, 0.97, 0.3], [True, False, False])]
    [(1, 0.0), (2, 0.5)]
    """
    p = np.asarray(probabilities, dtype=float)
    place = np.minimum((p * bins).astype(int), bins - 1)
    return [
        Reliability(low=k / bins, high=(k + 1) / bins, probability=float(p[place == k].mean()),
                    share=share_of([hit for hit, own in zip(right, place, strict=True) if own == k]))
        for k in range(bins) if np.any(place == k)
    ]  # fmt: skip


def calibration_error(table: Sequence[Reliability]) -> float | None:
    """Expected calibration error: mean distance of probability and share, weighted by the bins' counts.

    M. P. Naeini, G. F. Cooper, M. Hauskrecht, AAAI (2015), equation 6.
    """
    total = sum(one.share.count for one in table)
    off = sum(abs(one.share.count * one.probability - one.share.right) for one in table)
    return off / total if total else None


SCORE_FORMAT = "chladni.blind-score/1"
#: A wrong name with more than this probability is given with confidence.
CONFIDENT = 0.8
#: Edges of the detection curve, effect over noise.
FAINT_EDGES = (0.3, 0.6, 1.0, 1.7, 3.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """A share that a campaign tells.

    Attributes
    ----------
    key
        Where it stands in the score; a dot is a level.
    what
        In words, as a row of the table.
    of, counts
        Which cases it's a share of, by their truths alone, and which of those count; of parts of cases, which parts.
    at_least, at_most
        What must be, where anything must.
    optional
        Whether it's left out of the table when the campaign has no such case.
    """

    key: str
    what: str
    of: Callable[[Mark], bool]
    counts: Callable[[Mark], bool | Sequence[bool]]
    at_least: float | None = None
    at_most: float | None = None
    optional: bool = False

    def flags(self, marks: Sequence[Mark]) -> list[bool]:
        """Whether each case that it's a share of counts, or each of its parts."""
        found = [self.counts(one) for one in marks if self.of(one)]
        return [flag for one in found for flag in ([one] if isinstance(one, bool) else one)]


def _clear(one: Mark) -> bool:
    return one.kind == "effect" and one.is_clear


def _quiet(one: Mark) -> bool:
    return one.kind in QUIET


def _of(*kinds: Kind) -> Callable[[Mark], bool]:
    return lambda one: one.kind in kinds


def _names_an_effect(one: Mark) -> bool:
    return one.first is not None


def _is_unknown(one: Mark) -> bool:
    return one.verdict == "unknown"


def _all_found(one: Mark) -> bool:
    return one.all_found()


def _found(count: int) -> Callable[[Mark], bool]:
    return lambda one: one.found() >= count


def _wrong(least: float) -> Callable[[Mark], bool]:
    return lambda one: one.wrongly_named(least)


def _hides(word: str, site: str = "", kind: Kind = "effect") -> Callable[[Mark], bool]:
    """Whether a case hides this alone, at that site or anywhere."""
    return lambda one: one.kind == kind and one.is_clear and any(
        effect == word and site in ("", at) for effect, at in one.hidden
    )  # fmt: skip


def _values_within(word: str, most: float) -> Callable[[Mark], Sequence[bool]]:
    return lambda one: [
        off <= most for key, off in one.values.items() if key[0] == word and key not in one.faint_too
    ]  # fmt: skip


QUESTIONS = (
    Question(key="effect", what="right effect, first place", of=_clear, counts=lambda one: one.word_is_right,
             at_least=0.95),
    Question(key="effect_at_site", what="right effect at the right site", of=_clear, counts=lambda one: one.is_right),
    Question(key="effect_or_alternative", what="right effect, or told to be like the named one", of=_clear,
             counts=lambda one: one.is_among_the_alike),
    Question(key="family", what="right family", of=_clear, counts=lambda one: one.family_is_right, at_least=0.96),
    Question(key="effect_naive", what="right effect by the lowest RMS alone (naive)", of=_clear,
             counts=lambda one: one.naive_is_right),
    Question(key="site", what="right site, or a group that holds it", of=_clear, counts=lambda one: one.site_is_right,
             at_least=0.97),
    Question(key="false_alarm", what="false alarm: an effect named where there is none", of=_quiet,
             counts=_names_an_effect, at_most=0.015),
    Question(key="false_alarm_coloured", what="of those, with coloured noise",
             of=lambda one: _quiet(one) and one.coloured, counts=_names_an_effect),
    Question(key="false_unknown", what="unknown where nothing is missing", of=_quiet, counts=_is_unknown),
    Question(key="parameter_named", what="wrong parameter: verdict parameters",
             of=lambda one: _quiet(one) and bool(one.off), counts=lambda one: one.verdict == "parameters"),
    Question(key="strange_recognised", what="left out or outside: unknown, or a sibling", of=_of(*STRANGE),
             counts=lambda one: one.recognised, at_least=0.93),
    Question(key="left_out_recognised", what="of those, left out", of=_of("leave_out"),
             counts=lambda one: one.recognised),
    Question(key="outside_recognised", what="of those, outside", of=_of("outside"),
             counts=lambda one: one.recognised),
    Question(key="unknown_in_catalogue", what="unknown where the effect was in the catalogue", of=_clear,
             counts=_is_unknown, at_most=0.05),
    Question(key="named_rightly", what="nameable: all named rightly with 0.6 or more, and nothing else",
             of=lambda one: one.is_nameable,
             counts=lambda one: one.all_found(least=0.6) and not one.wrongly_named(0.6), at_least=0.75),
    Question(key="unknown_nameable", what="nameable: unknown", of=lambda one: one.is_nameable, counts=_is_unknown,
             at_most=0.12),
    Question(key="wrong.0.9", what="a wrong name with 0.9 or more, of all cases", of=lambda _: True,
             counts=_wrong(0.9), at_most=0.02),
    Question(key="wrong.0.6", what="a wrong name with 0.6 or more, of all cases", of=lambda _: True,
             counts=_wrong(0.6)),
    Question(key="two.both", what="two effects: both named", of=_of("two"), counts=_all_found, at_least=0.85),
    Question(key="two.at_least_one", what="two effects: at least one", of=_of("two"), counts=_found(1),
             at_least=0.95),
    Question(key="faint.confidently_wrong", what="faint: wrong name with probability over 0.8", of=_of("faint"),
             counts=lambda one: one.first is not None and not one.word_is_right and one.first.probability > CONFIDENT,
             at_most=0.05),
    Question(key="faint.named", what="faint: named rightly", of=_of("faint"), counts=lambda one: one.is_right),
    Question(key="three.all", what="three effects: all named", of=_of("three"), counts=_all_found, at_least=0.60,
             optional=True),
    Question(key="three.at_least_two", what="three effects: at least two", of=_of("three"), counts=_found(2),
             optional=True),
    Question(key="three.at_least_one", what="three effects: at least one", of=_of("three"), counts=_found(1),
             optional=True),
    Question(key="model_wrong.named", what="a wrong model: all that is wrong named, at its place",
             of=_of(*MODEL_WRONG), counts=_all_found, at_least=0.85, optional=True),
    Question(key="model_wrong.topology", what="of those, a missing link", of=_of("topology"), counts=_all_found,
             optional=True),
    Question(key="model_wrong.value", what="of those, wrong values", of=_of("value"), counts=_all_found,
             optional=True),
    Question(key="model_wrong.value_and_effect", what="of those, values and effects", of=_of("value_and_effect"),
             counts=_all_found, optional=True),
    Question(key="model_wrong.wrong", what="a wrong model: a wrong name with 0.6 or more", of=_of(*MODEL_WRONG),
             counts=_wrong(0.6), at_most=0.02, optional=True),
    Question(key="robots.joints", what="friction in all joints: named, and within 20 %, of the joints",
             of=_of("all_joints"), counts=_values_within("coulomb_friction", 0.20), at_least=0.90, optional=True),
    Question(key="robots.ordinary_told", what="friction, common delay, a heavier link: all told, or remarked",
             of=_of("ordinary"), counts=lambda one: one.all_told(), at_least=1.0, optional=True),
    Question(key="robots.ordinary", what="of those, all as causes", of=_of("ordinary"), counts=_all_found,
             optional=True),
    Question(key="robots.gains_site", what="unknown gains: the cause's site", of=_of("gains"),
             counts=lambda one: one.site_is_right, at_least=0.85, optional=True),
    Question(key="robots.gains", what="unknown gains: each within 5 %", of=_of("gains"),
             counts=lambda one: [off <= 0.05 for off in one.gains], optional=True),
    Question(key="robots.afloat_site", what="a base that floats: the cause's site", of=_of("afloat"),
             counts=lambda one: one.site_is_right, at_least=0.80, optional=True),
    Question(key="robots.afloat_wrong", what="a base that floats: a wrong name with 0.6 or more",
             of=_of("afloat", "afloat_none"), counts=_wrong(0.6), at_most=0.0, optional=True),
    Question(key="robots.delay", what="a common delay: within 1 ms", of=_hides("delay", "all commands"),
             counts=_values_within("delay", 0.001), optional=True),
    Question(key="robots.payload", what="a payload: within 5 %", of=_hides("payload"),
             counts=_values_within("payload", 0.05), optional=True),
    Question(key="robots.push", what="a push: unknown, with its place and time", of=_hides("push", kind="outside"),
             counts=lambda one: one.told, optional=True),
    Question(key="robots.coupled", what="joints that are coupled: named at both, or unknown with one of them",
             of=lambda one: any(word.startswith("coupled_") for word, _ in one.hidden),
             counts=lambda one: one.is_right or one.told, optional=True),
)  # fmt: skip


def score_cases(directory: Path, *, against: Path | None = None) -> dict[str, Any]:
    """Open the truths, verify their seals, mark the answers; write ``score.json`` and give its content.

    Cases without a result are counted and left out.

    Parameters
    ----------
    against
        Another campaign of the same cases, answered by another version; its results are held against these, pair by
        pair, under the key ``against``, which ``score.json`` doesn't have.

    Raises
    ------
    SetupError
        When a truth doesn't fit its seal, the other campaign holds other cases, or there is nothing to score.
    """
    cases = case_folders(directory)
    # All seals are verified, answered or not: a campaign with one broken seal is worth nothing.
    truths = {case.name: truth_of_case(directory, case) for case in cases}
    marks = _marks(directory, truths)
    if not marks:
        raise SetupError(f"{directory / 'results'}: holds no result; run chladni blind run {directory} first")
    compared = {} if against is None else {"against": _against(directory, marks, truths, against)}
    answered = {one.name for one in marks}
    score = scored(marks) | {"generator": generator_in(directory),
                             "missing": [name for name in truths if name not in answered]}  # fmt: skip
    write_json(directory / "score.json", score)
    return score | compared


def _marks(directory: Path, truths: Mapping[str, Mapping[str, Any]]) -> list[Mark]:
    paths = {name: directory / "results" / f"{name}.json" for name in truths}
    return [
        mark(name, truths[name], read_json(path, RESULT_FORMAT, FAILURE_FORMAT), path=path)
        for name, path in paths.items()
        if path.is_file()
    ]


def _against(directory: Path, marks: Sequence[Mark], truths: Mapping[str, Mapping[str, Any]], other: Path,
             ) -> dict[str, Any]:  # fmt: skip
    """Hold this campaign's marks against those of another's answers to the same cases."""
    here = {case.name: case for case in case_folders(directory)}
    for case in case_folders(other):
        if case.name in here:
            require_files(case, checksums(here[case.name]))
    there = {one.name: one for one in _marks(other, truths)}
    pairs = [(one, there[one.name]) for one in marks if one.name in there]
    if not pairs:
        raise SetupError(f"{other / 'results'}: answers none of the cases that are answered here; take another")
    return paired(pairs)


def paired(pairs: Sequence[tuple[Mark, Mark]]) -> dict[str, Any]:
    """Tell for each share in how many cases only one of two versions counts, and how likely chance does as much.

    McNemar's test of the pairs that differ (Q. McNemar, Psychometrika 12 (1947)), exact: were the versions alike, a
    pair that differs would favour either like a coin. `p` has two sides, and is None where no pair differs.
    """
    rows = []
    for question in QUESTIONS:
        counted = list(zip(*(question.flags(side) for side in zip(*pairs, strict=True)), strict=True))
        only = Counter(counted)
        here, there = only[True, False], only[False, True]
        rows.append({
            "key": question.key, "what": question.what, "count": len(counted), "here": here + only[True, True],
            "there": there + only[True, True], "only_here": here, "only_there": there,
            "p": float(binomtest(here, here + there).pvalue) if here + there else None,
        })  # fmt: skip
    changed = [{"here": _row(here), "there": _row(there)} for here, there in pairs
               if here.whole_is_right != there.whole_is_right]  # fmt: skip
    return {"pairs": len(pairs), "rows": rows, "changed": changed}


def scored(marks: Sequence[Mark]) -> dict[str, Any]:
    """Give all figures of a campaign, ready for JSON."""
    clear = [one for one in marks if _clear(one)]
    score: dict[str, Any] = {
        "format": SCORE_FORMAT,
        "cases": len(marks),
        "kinds": dict(Counter(one.kind for one in marks)),
        "failed": [one.name for one in marks if one.verdict == FAILED],
        "group_sizes": _group_sizes(clear),
        "closed": _closed(clear),
        "calibration": _calibration(marks),
        "faint": {"curve": _detection([one for one in marks if one.kind == "faint"])},
        "confusion": _confusion(clear, word=lambda effect: effect),
        "confusion_family": _confusion(clear, word=lambda effect: FAMILY_OF.get(effect, PARAMETER)),
        "marks": [_row(one) for one in marks],
    }
    for question in QUESTIONS:
        outer, _, inner = question.key.partition(".")
        share = share_of(question.flags(marks)).told()
        if inner:
            score.setdefault(outer, {})[inner] = share
        else:
            score[outer] = share
    return score


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
    """Probability of the first effect against its being right, over every case in which an effect was named."""
    named = [one for one in marks if one.first is not None]
    table = reliability([one.first.probability for one in named if one.first], [one.is_right for one in named])
    return {
        "expected_error": calibration_error(table),
        "count": len(named),
        "bins": [
            {"low": one.low, "high": one.high, "count": one.share.count, "probability": one.probability,
             "right": one.share.value, "interval": list(one.share.interval)}
            for one in table
        ],
    }  # fmt: skip


def _detection(marks: Sequence[Mark]) -> list[dict[str, Any]]:
    """How many effects are noticed and named over their severity."""
    curve = []
    for low, high in pairwise(FAINT_EDGES):
        inside = [one for one in marks if one.ratio is not None and low <= one.ratio < high]
        curve.append({
            "low": low, "high": high,
            "noticed": share_of([one.verdict != "none" for one in inside]).told(),
            "named": share_of([one.is_right for one in inside]).told(),
        })  # fmt: skip
    return curve


def _confusion(marks: Sequence[Mark], *, word: Callable[[str], str]) -> dict[str, dict[str, int]]:
    """Rows: what was hidden; columns: what was named, or the verdict where nothing was."""
    table: dict[str, Counter[str]] = {}
    for one in marks:
        answer = word(one.first.effect) if one.first is not None else one.verdict
        table.setdefault(word(one.hidden[0][0]), Counter())[answer] += 1
    return {hidden: dict(sorted(answers.items())) for hidden, answers in sorted(table.items())}


def _row(one: Mark) -> Mapping[str, Any]:
    return {
        "case": one.name, "kind": one.kind, "coloured": one.coloured,
        "hidden": [list(pair) for pair in one.hidden], "off": ", ".join(one.off) or None, "ratio": one.ratio,
        "ratio_tuned": one.ratio_tuned, "verdict": one.verdict,
        "named": [[cause.effect, cause.site] for cause in one.named],
        "probability": one.named[0].probability if one.named else None,
        "right": one.whole_is_right, "closed": one.closed,
    }  # fmt: skip
