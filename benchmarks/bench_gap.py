"""The withheld check of the gap diagnosis: makes a campaign, diagnoses it with the truths out of reach, scores it.

Goes on where it was interrupted, on all cores. Cases of the default campaign take about a second each to make and ten
or twenty to diagnose on one core.
"""

import argparse
import json
import statistics
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from chladni.apps.blind import make_campaign, run_campaign, score_campaign
from chladni.apps.campaign_pictures import campaign_album
from chladni.viewers.figures.saving import save_album
from chladni_withheld.score_table import (
    HEADER,
    confusion_rows,
    detection_rows,
    markdown,
    reliability_rows,
    score_rows,
)


@contextmanager
def truths_away(directory: Path) -> Iterator[None]:
    """Move the truths out of the campaign's folder while it's diagnosed."""
    truth, away = directory / "truth", directory.with_name(f"{directory.name}-truth")
    # A run that was interrupted may have left them there.
    if truth.is_dir():
        truth.rename(away)
    try:
        yield
    finally:
        away.rename(truth)


def show(text: str) -> None:
    """Progress, beside the tables."""
    print(text, file=sys.stderr, flush=True)


def shares(what: str):
    """A function that tells every tenth share."""
    told = [0.0]

    def tell(share: float) -> None:
        if share >= told[0] + 0.05 or share == 1.0:
            told[0] = share
            show(f"{what}: {share:.0%}")

    return tell


def times(directory: Path) -> list[float]:
    """Seconds of each diagnosis."""
    path = directory / "times.jsonl"
    return [json.loads(line)["seconds"] for line in path.read_text().splitlines()] if path.is_file() else []


def report(directory: Path, score: dict) -> None:
    """Print all tables."""
    kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(score["kinds"].items()))
    print(f"{score['cases']} cases: {kinds}\n")
    print(markdown(HEADER, score_rows(score)))
    groups = ", ".join(f"{count} of {size}" for size, count in score["group_sizes"].items())
    print(f"\nSites in the answers' groups: {groups or 'no answer'}")
    for title, (header, rows) in (
        ("Families", confusion_rows(score["confusion_family"])),
        ("Effects", confusion_rows(score["confusion"])),
        ("Reliability", reliability_rows(score)),
        ("Faint effects", detection_rows(score)),
    ):
        print(f"\n{title}\n\n{markdown(header, rows)}")
    wrong = [row for row in score["marks"] if not row["right"]]
    print("\nAnswers that weren't right\n")
    print(markdown(["case", "kind", "hidden", "ratio", "verdict", "named", "probability"], [
        [row["case"], row["kind"], " ".join("@".join(pair) for pair in row["hidden"]) or row["off"] or "-",
         "-" if row["ratio"] is None else f"{row['ratio']:.1f}", row["verdict"],
         " ".join("@".join(pair) for pair in row["named"]) or "-",
         "-" if row["probability"] is None else f"{row['probability']:.2f}"]
        for row in wrong
    ]))  # fmt: skip
    if seconds := times(directory):
        print(f"\nSeconds a case: median {statistics.median(seconds):.1f}, most {max(seconds):.1f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", type=Path, help="folder of the campaign; made when it isn't there")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, required=True, help="one that was never looked at")
    parser.add_argument("--generator", default="chains", help="what draws the machines")
    parser.add_argument("--kind", action="append", default=[], help="such as three=20; may be repeated")
    parser.add_argument("--jobs", type=int, default=None)
    parser.add_argument("--figures", type=Path, default=None, help="folder for confusion, reliability, detection")
    arguments = parser.parse_args()
    folder = arguments.directory
    folder.mkdir(parents=True, exist_ok=True)
    if not (away := folder.with_name(f"{folder.name}-truth")).is_dir():
        make_campaign(
            folder, count=arguments.count, seed=arguments.seed, generator=arguments.generator, kinds=arguments.kind,
            jobs=arguments.jobs, progress=shares("made"),
        )  # fmt: skip
    else:
        show(f"the truths are in {away}: the campaign is made, and its run goes on")
    with truths_away(folder):
        run_campaign(folder, jobs=arguments.jobs, progress=shares("diagnosed"))
    score = dict(score_campaign(folder))
    report(folder, score)
    if arguments.figures is not None:
        for path in save_album(campaign_album(score), arguments.figures):
            show(f"figure: {path}")
