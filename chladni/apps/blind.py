"""The withheld check with this project's own diagnosis, on all cores."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from chladni.apps.diagnose import diagnosis_json
from chladni.apps.processes import workers
from chladni.gap.blind.composition import composition_of
from chladni.gap.blind.make import make_cases
from chladni.gap.blind.run import RunReport, run_cases
from chladni.gap.blind.score import score_cases

Progress = Callable[[float], None]


def make_campaign(
    directory: Path,
    *,
    count: int,
    seed: int,
    kinds: Sequence[str] = (),
    jobs: int | None = None,
    progress: Progress = lambda _share: None,
) -> int:
    """Make a campaign, or what is missing of it; give the number of cases made.

    Parameters
    ----------
    directory
        Where cases and truths go, see `chladni.gap.blind.make.make_cases`.
    count, seed
        Number of cases, and where everything random in them comes from.
    kinds
        How many of which kind in proportion, see `chladni.gap.blind.composition.composition_of`.
    jobs
        Processes; as many as the machine has cores if None.
    progress
        Gets the share done.
    """
    composition = composition_of(kinds)
    with workers(jobs) as executor:
        return make_cases(
            directory, count=count, seed=seed, composition=composition, executor=executor, progress=progress
        )


def run_campaign(
    directory: Path, *, seed: int = 0, jobs: int | None = None, progress: Progress = lambda _share: None
) -> RunReport:
    """Diagnose every case that has no result yet; the truth isn't opened.

    Parameters
    ----------
    directory, seed
        See `chladni.gap.blind.run.run_cases`.
    jobs
        Processes; as many as the machine has cores if None.
    progress
        Gets the share done.
    """
    with workers(jobs) as executor:
        return run_cases(directory, diagnosis_json, seed=seed, executor=executor, progress=progress)


def score_campaign(directory: Path) -> Mapping[str, Any]:
    """Verify the seals, mark the answers, write ``score.json`` and give its content."""
    return score_cases(directory)
