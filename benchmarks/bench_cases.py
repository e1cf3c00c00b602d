"""Inputs that were once answered wrongly, and further ones of each kind, made with a known truth.

Each file is written with a truth in closed form, given to the commands as a user would, and judged:

right       the answer is the truth, and what must be said about it is said
asked       refused where a refusal is right, and following its advice gives the truth
untold      the answer is the truth, but what must be said about it isn't
refused     one line, no answer; `dead end` where the line's own advice doesn't lead to the truth
told wrong  the answer isn't the truth, but damage is told
WRONG       the answer isn't the truth and nothing says so; `defect` where the program broke

Exit code 1 when an answer is silently wrong.
"""

import argparse
import os
import sys
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from case_kinds import all_cases
from case_kinds.judging import SILENT, Case, Verdict, judge


def judge_all(cases: list[Case], folder: Path, tell: Callable[[str], None]) -> list[Verdict]:
    """Judge each case in a folder of its own."""
    verdicts = []
    for case in cases:
        place = folder / case.kind / case.name
        place.mkdir(parents=True, exist_ok=True)
        verdict = judge(case, place)
        if verdict is None:
            tell(f"{case.kind}/{case.name}: the given file isn't there")
            continue
        verdicts.append(verdict)
        tell(f"{case.kind}/{case.name}: {verdict.outcome} {verdict.why}".rstrip())
        for note in verdict.notes:
            tell(f"    {note}")
    return verdicts


def table(verdicts: list[Verdict]) -> str:
    """Table of kinds in Markdown, with each failing file below its kind."""
    lines = ["| kind | right | of | what the others are |", "| --- | --- | --- | --- |"]
    for kind in dict.fromkeys(verdict.case.kind for verdict in verdicts):
        of_kind = [verdict for verdict in verdicts if verdict.case.kind == kind]
        others = [verdict.outcome for verdict in of_kind if not verdict.good]
        words = ", ".join(f"{others.count(outcome)} {outcome}" for outcome in dict.fromkeys(others))
        lines.append(f"| {kind} | {len(of_kind) - len(others)} | {len(of_kind)} | {words} |")
    good = sum(verdict.good for verdict in verdicts)
    silent = sum(verdict.outcome in SILENT for verdict in verdicts)
    share = 100 * good / max(len(verdicts), 1)
    lines.append(f"| all | {good} | {len(verdicts)} | {share:.0f} % right, {silent} silently wrong |")
    failing = [f"{v.case.kind}/{v.case.name}: {v.outcome}: {v.why}" for v in verdicts if not v.good]
    return "\n".join([*lines, "", *failing])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--kind", action="append", default=[], help="only kinds whose name holds this; may be repeated"
    )
    parser.add_argument("--name", default="", help="only files whose name holds this")
    parser.add_argument("--verbose", action="store_true", help="tell of each file as it's judged")
    parser.add_argument("--keep", type=Path, help="folder in which the files stay")
    options = parser.parse_args()
    # A warning of a library is not an answer, and would drown the table.
    warnings.simplefilter("ignore")
    cases = [case for case in all_cases() if not options.kind or any(word in case.kind for word in options.kind)]
    cases = [case for case in cases if options.name in case.name]
    if not cases:
        parser.error(f"no such kind or name; kinds are {', '.join(dict.fromkeys(case.kind for case in all_cases()))}")

    def tell(line: str) -> None:
        if options.verbose:
            print(line, flush=True)

    with tempfile.TemporaryDirectory() as temporary:
        verdicts = judge_all(cases, options.keep or Path(temporary), tell)
    print(table(verdicts))
    return int(any(verdict.outcome in SILENT for verdict in verdicts))


if __name__ == "__main__":
    sys.exit(main())
