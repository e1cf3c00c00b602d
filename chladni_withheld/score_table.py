"""The score of a campaign as rows for people: what was measured, and what must be met."""

from collections.abc import Mapping, Sequence
from typing import Any

from chladni_withheld.score import QUESTIONS, Question

Row = list[str]
_ROUNDING = 1e-9
HEADER = ("what", "measured", "95 % interval", "cases", "must be", "met")
PAIRED_HEADER = ("what", "cases", "here", "there", "only here", "only there", "p")
#: What must be of another generator's machines, where it isn't what must be of the first one's.
_MUST_BE: Mapping[str, Mapping[str, float]] = {
    "networks": {"effect": 0.90, "site": 0.95, "false_alarm": 0.02},
    "robots": {"effect": 0.92, "site": 0.96, "false_alarm": 0.02, "named_rightly": 0.80, "unknown_nameable": 0.10,
               "wrong.0.9": 0.01, "two.both": 0.80},
}  # fmt: skip


def score_rows(score: Mapping[str, Any]) -> list[Row]:
    """Give one row for each figure: ``what, measured, interval, cases, must be, met``.

    A share that meets what must be, of so few cases that a single wrong one would miss it, is ``too few``; a quantile
    or a mean of so few is, either way.
    """
    closed, calibration = score["closed"], score["calibration"]
    rows = [row for question in QUESTIONS if (row := _question(score, question))]
    return [
        *rows,
        _number("gap closed over the true law's, median", closed["median"], closed["count"], at_least=0.98,
                may_miss=0.5),
        _number("gap closed, 10th percentile", closed["tenth_percentile"], closed["count"], at_least=0.92,
                may_miss=0.1),
        _number("expected calibration error", calibration["expected_error"], calibration["count"], at_most=0.05,
                may_miss=0.05),
    ]  # fmt: skip


def _question(score: Mapping[str, Any], question: Question) -> Row | None:
    outer, _, inner = question.key.partition(".")
    told = score[outer][inner] if inner else score[outer]
    if question.optional and not told["count"]:
        return None
    must = _MUST_BE.get(score.get("generator") or "", {}).get(question.key)
    least, most = (None if bound is None else must or bound for bound in (question.at_least, question.at_most))
    return _share(question.what, told, at_least=least, at_most=most)


def paired_rows(against: Mapping[str, Any]) -> list[Row]:
    """Give one row for each share of two versions' answers to the same cases, where any case counts."""
    return [
        [one["what"], *(str(one[key]) for key in ("count", "here", "there", "only_here", "only_there")),
         "-" if one["p"] is None else f"{one['p']:.3f}"]
        for one in against["rows"] if one["count"]
    ]  # fmt: skip


def changed_rows(against: Mapping[str, Any]) -> tuple[list[str], list[Row]]:
    """Give header and rows of the cases that one of two versions answers rightly and the other doesn't."""
    rows = [
        [one["here"]["case"], one["here"]["kind"], _hidden(one["here"]), _answer(one["here"]), _answer(one["there"]),
         "here" if one["here"]["right"] else "there"]
        for one in against["changed"]
    ]  # fmt: skip
    return ["case", "kind", "hidden", "here", "there", "right"], rows


def _share(what: str, told: Mapping[str, Any], *, at_least: float | None = None, at_most: float | None = None) -> Row:
    low, high = told["interval"]
    interval = f"{100 * low:.1f} to {100 * high:.1f} %" if told["count"] else "-"
    shown = "-" if told["share"] is None else f"{100 * told['share']:.1f} % ({told['right']})"
    demand, met = _demand(told["share"], at_least, at_most, percent=True)
    wrong_may_be = 1.0 - at_least if at_least is not None else at_most
    # Where not even one may be wrong, what is met by all of so few is met by chance.
    few = wrong_may_be is not None and told["count"] * wrong_may_be < 1.0 - _ROUNDING
    return [what, shown, interval, str(told["count"]), demand, "too few" if met == "yes" and few else met]


def _number(what: str, value: float | None, count: int, *, may_miss: float, at_least: float | None = None,
            at_most: float | None = None) -> Row:  # fmt: skip
    """A row of what one number tells of many cases, of which the share `may_miss` may miss what must be."""
    demand, met = _demand(value, at_least, at_most, percent=False)
    if value is not None and count * may_miss < 1.0 - _ROUNDING:
        met = "too few"
    return [what, "-" if value is None else f"{value:.4f}", "", str(count), demand, met]


def _demand(value: float | None, at_least: float | None, at_most: float | None, *, percent: bool) -> tuple[str, str]:
    bound = at_most if at_least is None else at_least
    if bound is None:
        return "", ""
    meets = value is not None and (value >= bound if at_most is None else value <= bound)
    shown = f"{100 * bound:g}%" if percent else f"{bound:g}"
    return f"at {'least' if at_most is None else 'most'} {shown}", "-" if value is None else "yes" if meets else "no"


def confusion_rows(table: Mapping[str, Mapping[str, int]]) -> tuple[list[str], list[Row]]:
    """Give header and rows of a confusion matrix: hidden down, named across."""
    answers = sorted({answer for row in table.values() for answer in row})
    rows = [[hidden, *(str(row[answer]) if answer in row else "" for answer in answers)] for hidden, row in
            table.items()]  # fmt: skip
    return ["hidden, down; named, across", *answers], rows


def reliability_rows(score: Mapping[str, Any]) -> tuple[list[str], list[Row]]:
    """Give header and rows of the reliability diagram."""
    rows = [
        [f"{one['low']:.1f} to {one['high']:.1f}", str(one["count"]), f"{one['probability']:.3f}",
         f"{one['right']:.3f}"]
        for one in score["calibration"]["bins"]
    ]  # fmt: skip
    return ["probability", "answers", "mean probability", "share right"], rows


def detection_rows(score: Mapping[str, Any]) -> tuple[list[str], list[Row]]:
    """Give header and rows of the detection curve of faint effects."""
    rows = []
    for one in score["faint"]["curve"]:
        noticed, named = one["noticed"], one["named"]
        rows.append([f"{one['low']:g} to {one['high']:g}", str(noticed["count"]), str(noticed["right"]),
                     str(named["right"])])  # fmt: skip
    return ["effect over noise", "cases", "noticed", "named rightly"], rows


def missed_rows(score: Mapping[str, Any]) -> tuple[list[str], list[Row]]:
    """Give header and rows of the cases that were answered wrongly."""
    rows = [
        [one["case"], one["kind"], _hidden(one), _answer(one),
         "-" if one["probability"] is None else f"{one['probability']:.2f}"]
        for one in score["marks"] if not one["right"]
    ]  # fmt: skip
    return ["case", "kind", "hidden", "named", "probability"], rows


def _hidden(mark: Mapping[str, Any]) -> str:
    return _pairs(mark["hidden"]) or mark["off"] or "nothing"


def _answer(mark: Mapping[str, Any]) -> str:
    return _pairs(mark["named"]) or str(mark["verdict"])


def _pairs(named: Sequence[Sequence[str]]) -> str:
    return ", ".join(f"{effect} at {site}" for effect, site in named)


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Give a Markdown table.

    Examples
    --------
    >>> print(markdown(["a", "b"], [["1", "2"]]))
    | a | b |
    | --- | --- |
    | 1 | 2 |
    """
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
