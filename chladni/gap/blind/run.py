"""Lets a diagnosis work on every case of a campaign. The truth is never opened here."""

import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Protocol

from chladni.gap.blind.case_folder import CaseFolder, case_folders
from chladni.gap.blind.seal import write_json
from chladni.io.folder import made_folder
from chladni.signals.errors import ChladniError, LogError

FAILURE_FORMAT = "chladni.blind-failure/1"
Progress = Callable[[float], None]


class Diagnose(Protocol):
    """A diagnosis: ``chladni.gap/1``, ready for JSON. In worker processes it must be a function of a module."""

    def __call__(
        self, model: Path, logs: Sequence[Path], *, leave_out: frozenset[str], seed: int
    ) -> Mapping[str, object]:
        """Diagnose a model on logs, without the words of `leave_out`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunReport:
    """What a run did.

    Attributes
    ----------
    done
        Cases diagnosed now.
    there
        Cases that had a result already.
    failed
        Names of cases that the diagnosis refused.
    """

    done: int
    there: int
    failed: tuple[str, ...]


def run_cases(directory: Path, diagnose: Diagnose, *, seed: int = 0, executor: Executor | None = None,
              progress: Progress = lambda _share: None) -> RunReport:  # fmt: skip
    """Diagnose every case that has no result yet, and write ``results/case-0001.json``.

    A diagnosis that refuses a case (`ChladniError`) is written down as a failure, which counts as a wrong answer.
    Seconds of each case go to ``times.jsonl``: results stay the same to the byte from run to run.

    Parameters
    ----------
    directory
        The campaign; its folder ``truth`` may be elsewhere.
    diagnose
        See `Diagnose`.
    seed
        Handed to the diagnosis.
    executor
        Works on cases side by side; one after the other without.
    progress
        Gets the share done.

    Raises
    ------
    SetupError
        When a case isn't whole.
    LogError
        When a result can't be written.
    """
    cases = case_folders(directory)
    results = made_folder(directory / "results")
    waiting = [case for case in cases if not (results / f"{case.name}.json").is_file()]
    work = partial(_diagnosed, results, diagnose, seed)
    failed: list[str] = []
    finished: Iterable[tuple[str, float, bool]] = map(work, waiting) if executor is None else executor.map(
        work, waiting
    )  # fmt: skip
    for place, (name, seconds, sound) in enumerate(finished, start=1):
        _note_time(directory / "times.jsonl", name, seconds)
        failed += [] if sound else [name]
        progress(place / len(waiting))
    return RunReport(done=len(waiting), there=len(cases) - len(waiting), failed=tuple(failed))


def _diagnosed(results: Path, diagnose: Diagnose, seed: int, case: CaseFolder) -> tuple[str, float, bool]:
    """Diagnose and write; give name, seconds, and whether there was an answer."""
    began = time.perf_counter()
    try:
        content = diagnose(case.model, [case.log], leave_out=case.leave_out, seed=seed)
    except ChladniError as error:
        content = {"format": FAILURE_FORMAT, "error": str(error)}
    except Exception as error:
        # A mistake of ours ends the run, whose other cases say nothing of it; who mends it needs this one.
        error.add_note(f"while case {case.name} was diagnosed: {case.model.parent}")
        raise
    write_json(results / f"{case.name}.json", content)
    return case.name, time.perf_counter() - began, content.get("format") != FAILURE_FORMAT


def _note_time(path: Path, name: str, seconds: float) -> None:
    try:
        # One call, so that no line is cut in two by whatever ends this process.
        with path.open("ab", buffering=0) as file:
            file.write((json.dumps({"case": name, "seconds": round(seconds, 3)}) + "\n").encode())
    except OSError as error:
        raise LogError(f"{path}: can't be written: {error.strerror or error}; run it again to go on") from error
