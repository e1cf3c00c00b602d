"""The withheld check with this project's own diagnosis, on all cores."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from chladni.apps.diagnose import diagnosis_json
from chladni.apps.processes import workers
from chladni.apps.study.cluster import Connect
from chladni_withheld.campaign import RunReport, make_cases, run_cases
from chladni_withheld.score import score_cases

Progress = Callable[[float], None]


def make_campaign(
    directory: Path,
    *,
    count: int,
    seed: int,
    generator: str = "chains",
    kinds: Sequence[str] = (),
    jobs: int | None = None,
    progress: Progress = lambda _share: None,
) -> int:
    """Make a campaign, or what is missing of it; give the number of cases made.

    Parameters
    ----------
    directory, count, seed, generator, kinds, progress
        See `chladni_withheld.campaign.make_cases`.
    jobs
        Processes; as many as the machine has cores if None.
    """
    with workers(jobs) as executor:
        return make_cases(
            directory, count=count, seed=seed, generator=generator, kinds=kinds, executor=executor, progress=progress
        )


def run_campaign(
    directory: Path,
    *,
    seed: int = 0,
    jobs: int | None = None,
    connect: Connect | None = None,
    progress: Progress = lambda _share: None,
) -> RunReport:
    """Diagnose every case that has no result yet; the truth isn't opened.

    Parameters
    ----------
    directory, seed, progress
        See `chladni_withheld.campaign.run_cases`.
    jobs
        Processes; as many as the machine has cores if None.
    connect
        Gives a client of a cluster whose workers see the folder under the same name, in place of processes; see
        `chladni.apps.study.cluster.cluster`.
    """
    if connect is not None:
        with connect() as client:
            # Dask does a case of a lost worker again. What raises is a defect, and would be one again.
            return run_cases(
                directory.resolve(), diagnosis_json, seed=seed, executor=client.get_executor(retries=0),
                progress=progress,
            )  # fmt: skip
    with workers(jobs) as executor:
        return run_cases(directory, diagnosis_json, seed=seed, executor=executor, progress=progress)


def score_campaign(directory: Path, *, against: Path | None = None) -> Mapping[str, Any]:
    """Verify the seals, mark the answers, write ``score.json`` and give its content.

    Parameters
    ----------
    directory, against
        See `chladni_withheld.score.score_cases`.
    """
    return score_cases(directory, against=against)
