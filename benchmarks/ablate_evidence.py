"""What the numbers of evidence and belief are worth: each halved and doubled, and the kept fits weighed anew.

Every sealed case is diagnosed once, as shipped; its fits stay in memory. Weighing them anew runs no fit: a row tells
what a number decides among them, not what it would have led the search to. A number that changes no answer may go.
Cases that are looked at by this are none for the score.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

sys.path.insert(0, str(Path(__file__).parents[1]))

from scipy.stats import binomtest

from chladni.gap import calibration
from chladni.gap.comparison.measuring import measurement_of
from chladni.gap.diagnosis.naming import causes_named
from chladni.gap.diagnosis.search import Search
from chladni.gap.diagnosis.study import study_of
from chladni.gap.diagnosis.verdict import judged, searched
from chladni.io.log import open_log
from chladni.models.files.model_file import load_model
from chladni.signals.errors import ChladniError
from chladni_withheld.folders import RESULT_FORMAT, CaseFolder, case_folders, truth_of_case
from chladni_withheld.marking import Mark, mark

NUMBERS = (
    "DETAILS", "ELSEWHERE", "USUAL", "UNUSUAL", "DOUBT", "SIGMAS", "SIZE", "SLIP", "EFFECTIVE_SAMPLES",
    "ANOTHER", "LEAST_SHARE", "NAMED", "TEMPER", "LAPSE", "CLOSE",
)  # fmt: skip
FACTORS = (0.5, 2.0)


@contextmanager
def number(name: str, value: float) -> Iterator[None]:
    """Give a number of the calibration another value in every module that reads it."""
    readers = [one for key, one in sys.modules.items() if key.startswith("chladni.gap") and hasattr(one, name)]
    former = getattr(calibration, name)
    try:
        for one in readers:
            setattr(one, name, value)
        yield
    finally:
        for one in readers:
            setattr(one, name, former)


def search_of(case: CaseFolder) -> Search:
    """Diagnose a case as far as its fits."""
    model = load_model(case.model)
    compiled = model.compile()
    wanted = {name for one in (*compiled.inputs, *compiled.outputs) for name in (one.channel, one.name)}
    with open_log(case.log) as log:
        series = log.read([one.name for one in log.channels if one.name in wanted])
    measurement, _ = measurement_of(model, series, log=case.log.name)
    return searched(study_of(model, measurement, leave_out=case.leave_out, own={}), lambda _: None)


def answer(search: Search) -> dict[str, Any]:
    """Weigh all fits, and give what a score reads of the answer."""
    anew = search.over(search.study)
    # What is told of spreads costs a step of a fit, and no score asks for it.
    with patch.object(anew.study.contest, "with_spread", lambda found: found):
        causes = judged(anew)
    named = [
        {"effect": one.effect, "site": one.site, "group": list(one.group), "probability": one.probability}
        for one in causes_named(anew.study, causes)
    ]
    return {"format": RESULT_FORMAT, "verdict": causes.verdict, "causes": named}


def standing(one: Mark) -> str:
    """Right, unknown or wrong."""
    if one.whole_is_right:
        return "right"
    return "unknown" if one.verdict == "unknown" else "wrong"


def standings(kept: Sequence[tuple[str, Mapping[str, Any], Search]]) -> list[str]:
    """Weigh all cases, and hold each against its truth."""
    return [standing(mark(name, truth, answer(search))) for name, truth, search in kept]


def row(what: str, found: Sequence[str], base: Sequence[str]) -> str:
    """Give a row of the table, with McNemar's exact test of the cases that are right by one of two only."""
    counts = " | ".join(str(sum(one == word for one in found)) for word in ("right", "wrong", "unknown"))
    gained = sum(one == "right" != other for one, other in zip(found, base, strict=True))
    lost = sum(other == "right" != one for one, other in zip(found, base, strict=True))
    p = f"{binomtest(gained, gained + lost).pvalue:.2g}" if gained + lost else "-"
    return f"| {what} | {counts} | +{gained} -{lost} | {p} |"


def kept_fits(directory: Path, most: int | None) -> Iterator[tuple[str, Mapping[str, Any], Search]]:
    """Diagnose the cases of a campaign, one after another."""
    for case in case_folders(directory)[:most]:
        try:
            found = search_of(case)
        except ChladniError as error:
            print(f"{case.name}: {error}", file=sys.stderr)
            continue
        print(case.name, file=sys.stderr, flush=True)
        yield case.name, truth_of_case(directory, case), found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", type=Path, help="campaign with its cases and truths")
    parser.add_argument("--most", type=int, help="cases, all by default")
    given = parser.parse_args()
    kept = list(kept_fits(given.directory, given.most))
    base = standings(kept)
    print("| number | right | wrong | unknown | changed | p |\n| --- | --- | --- | --- | --- | --- |")
    print(row("as shipped", base, base))
    for name in NUMBERS:
        shipped = getattr(calibration, name)
        for factor in FACTORS:
            with number(name, factor * shipped):
                print(row(f"`{name}` {factor * shipped:.3g} for {shipped:.3g}", standings(kept), base), flush=True)


if __name__ == "__main__":
    main()
