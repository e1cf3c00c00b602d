"""The score of a campaign as rows for people: what was measured, and what must be met."""

from collections.abc import Mapping, Sequence
from typing import Any

Row = list[str]
_ROUNDING = 1e-9
HEADER = ("what", "measured", "95 % interval", "cases", "must be", "met")


def score_rows(score: Mapping[str, Any]) -> list[Row]:
    """Give one row for each figure: ``what, measured, interval, cases, must be, met``.

    A share that meets what must be, of so few cases that a single wrong one would miss it, is ``too few``; a quantile
    or a mean of so few is, either way.
    """
    faint, two, closed = score["faint"], score["two"], score["closed"]
    rows = [
        _share("right effect, first place", score["effect"], at_least=0.92),
        _share("right effect, or told to be like the named one", score["effect_or_alternative"]),
        _share("right family", score["family"], at_least=0.96),
        _share("right effect by the lowest RMS alone (naive)", score["effect_naive"]),
        _share("right site, or a group that holds it", score["site"], at_least=0.95),
        _share("false alarm: an effect named where there is none", score["false_alarm"], at_most=0.03),
        _share("of those, with coloured noise", score["false_alarm_coloured"]),
        _share("unknown where nothing is missing", score["false_unknown"]),
        _share("wrong parameter: verdict parameters", score["parameter_named"]),
        _share("left out or outside: unknown, or a sibling", score["strange_recognised"], at_least=0.90),
        _share("unknown where the effect was in the catalogue", score["unknown_in_catalogue"], at_most=0.05),
        _number("gap closed over the true law's, median", closed["median"], closed["count"], at_least=0.98,
                may_miss=0.5),
        _number("gap closed, 10th percentile", closed["tenth_percentile"], closed["count"], at_least=0.92,
                may_miss=0.1),
        _number("expected calibration error", score["calibration"]["expected_error"], score["calibration"]["count"],
                at_most=0.07, may_miss=0.07),
        _share("two effects: both named", two["both"], at_least=0.75),
        _share("two effects: at least one", two["at_least_one"], at_least=0.95),
        _share("faint: wrong name with probability over 0.8", faint["confidently_wrong"], at_most=0.05),
        _share("faint: named rightly", faint["named"]),
    ]  # fmt: skip
    return rows + _three_rows(score["three"])


def _three_rows(three: Mapping[str, Any]) -> list[Row]:
    """Only campaigns that were asked for machines with three effects have them."""
    titles = {"all": "all named", "at_least_two": "at least two", "at_least_one": "at least one"}
    return [_share(f"three effects: {title}", three[key]) for key, title in titles.items() if three[key]["count"]]


def _share(what: str, told: Mapping[str, Any], *, at_least: float | None = None, at_most: float | None = None) -> Row:
    low, high = told["interval"]
    interval = f"{100 * low:.1f} to {100 * high:.1f} %" if told["count"] else "-"
    shown = "-" if told["share"] is None else f"{100 * told['share']:.1f} % ({told['right']})"
    demand, met = _demand(told["share"], at_least, at_most, "{:.0%}")
    wrong_may_be = 1.0 - at_least if at_least is not None else at_most
    # Where not even one may be wrong, what is met by all of so few is met by chance.
    few = wrong_may_be is not None and told["count"] * wrong_may_be < 1.0 - _ROUNDING
    return [what, shown, interval, str(told["count"]), demand, "too few" if met == "yes" and few else met]


def _number(what: str, value: float | None, count: int, *, may_miss: float, at_least: float | None = None,
            at_most: float | None = None) -> Row:  # fmt: skip
    """A row of what one number tells of many cases, of which the share `may_miss` may miss what must be."""
    demand, met = _demand(value, at_least, at_most, "{:g}")
    if value is not None and count * may_miss < 1.0 - _ROUNDING:
        met = "too few"
    return [what, "-" if value is None else f"{value:.4f}", "", str(count), demand, met]


def _demand(value: float | None, at_least: float | None, at_most: float | None, form: str) -> tuple[str, str]:
    if at_least is None and at_most is None:
        return "", ""
    if at_least is not None:
        return f"at least {form.format(at_least)}", "-" if value is None else "yes" if value >= at_least else "no"
    return f"at most {form.format(at_most)}", "-" if value is None else "yes" if value <= (at_most or 0.0) else "no"


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
        [one["case"], one["kind"], _pairs(one["hidden"]) or one["off"] or "nothing",
         _pairs(one["named"]) or one["verdict"], "-" if one["probability"] is None else f"{one['probability']:.2f}"]
        for one in score["marks"] if not one["right"]
    ]  # fmt: skip
    return ["case", "kind", "hidden", "named", "probability"], rows


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
