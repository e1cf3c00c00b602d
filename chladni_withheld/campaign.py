"""Campaigns: cases of a generator are made, with their truths sealed elsewhere, and a diagnosis works on each."""

import json
import re
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol, get_args

import numpy as np

from chladni.io.atomic import atomic_write
from chladni.io.folder import made_folder
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.errors import ChladniError, LogError, SetupError
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.time_series import TimeSeries
from chladni_withheld.case import DrawCase, Generator, Kind, WithheldCase
from chladni_withheld.folders import FAILURE_FORMAT, CaseFolder, case_folders, read_json, seal_case, write_json

Progress = Callable[[float], None]
CAMPAIGN_FORMAT = "chladni.blind-campaign/1"


def _chains() -> Generator:
    from chladni_withheld.chains.cases import CHAINS

    return CHAINS


def _networks() -> Generator:
    from chladni_withheld.networks.draw import DEFAULT, draw_case

    return Generator(composition=DEFAULT, draws=partial(one_by_one, draw_case))


def _robots() -> Generator:
    from chladni_withheld.robots.draw import DEFAULT, draw_case

    return Generator(composition=DEFAULT, draws=partial(one_by_one, draw_case))


#: Generators by name; each is imported when it's asked for.
GENERATORS: Mapping[str, Callable[[], Generator]] = {"chains": _chains, "networks": _networks,
                                                      "robots": _robots}  # fmt: skip


def generator_of(name: str) -> Generator:
    """Give a generator by its name.

    Raises
    ------
    SetupError
        When there is none of that name.
    """
    if name not in GENERATORS:
        raise SetupError(f"{name!r:.60} is no generator of cases; there are {', '.join(GENERATORS)}")
    return GENERATORS[name]()


def one_by_one(draw_case: DrawCase, counts: Mapping[Kind, int], seed: int) -> list[Callable[[], WithheldCase]]:
    """Give what draws each case of a campaign whose cases know nothing of each other, in random order of kinds."""
    kinds = [kind for kind, count in counts.items() for _ in range(count)]
    order = np.random.default_rng([seed, 0]).permutation(len(kinds))
    return [partial(draw_case, seed, index, kinds[place]) for index, place in enumerate(order, start=1)]


def composition_of(texts: Sequence[str], usual: Mapping[Kind, int]) -> dict[Kind, int]:
    """Read a composition from ``KIND=N`` each, such as ``two=20``, in any order; the `usual` one of none.

    Raises
    ------
    SetupError
        When one isn't of that form, names a kind that isn't in `usual`, or asks for none of a kind.
    """
    asked: dict[Kind, int] = {}
    kinds: list[Kind] = [kind for kind in get_args(Kind) if kind in usual]
    for text in texts:
        name, _, number = text.partition("=")
        kind = next((one for one in kinds if one == name.strip()), None)
        if kind is None:
            raise SetupError(f"{text!r:.60} names no kind of case; there are {', '.join(kinds)}")
        if not re.fullmatch("[1-9][0-9]{0,5}", number.strip()):
            raise SetupError(f"{text!r:.60} must be of the form {kind}=N, with N from 1 to 999999")
        asked[kind] = int(number)
    # What is drawn follows the order of kinds: that of the words must not make another campaign.
    return {kind: asked[kind] for kind in kinds if kind in asked} or {
        kind: share for kind, share in usual.items() if share
    }


def counts_of(count: int, composition: Mapping[Kind, int]) -> dict[Kind, int]:
    """Share `count` cases out in the proportions of `composition`, by largest remainders.

    Examples
    --------
    >>> counts_of(10, {"effect": 2, "none": 1})
    {'effect': 7, 'none': 3}
    """
    if count < 1:
        raise SetupError(f"count {count} must be at least 1")
    total = sum(composition.values())
    exact = {kind: count * share / total for kind, share in composition.items()}
    whole = {kind: int(share) for kind, share in exact.items()}
    for kind in sorted(exact, key=lambda one: whole[one] - exact[one])[: count - sum(whole.values())]:
        whole[kind] += 1
    return whole


def make_cases(directory: Path, *, count: int, seed: int, generator: str = "chains", kinds: Sequence[str] = (),
               executor: Executor | None = None, progress: Progress = lambda _share: None) -> int:  # fmt: skip
    """Make a campaign in `directory`, or what is missing of it.

    Parameters
    ----------
    directory
        Gets ``cases/case-0001/`` with ``model.toml``, ``log.mcap`` and ``case.json``, and ``truth/case-0001.json``.
    count, seed, generator, kinds
        Number of cases, where all random numbers come from, one of `GENERATORS`, and how many cases of each kind in
        proportion, see `composition_of`. The same four give the same cases; their seals differ, since a salt that
        follows from the seed would hide nothing.
    executor
        Makes cases side by side.
    progress
        Gets the share done.

    Returns
    -------
    int
        Cases made; those that were there already are left alone.

    Raises
    ------
    SetupError
        When `count`, `seed`, `generator` or `kinds` is impossible, or the campaign in the folder is another one.
    LogError
        When the folder can't be written.
    """
    if seed < 0:
        raise SetupError(f"seed {seed} must not be negative")
    made_by = generator_of(generator)
    composition = composition_of(kinds, made_by.composition)
    draws = made_by.draws(counts_of(count, composition), seed)
    waiting = [
        (f"case-{index:04d}", draw, [seed, index])
        for index, draw in enumerate(draws, start=1)
        if not (directory / "cases" / f"case-{index:04d}" / "case.json").is_file()
    ]
    told = {"count": count, "seed": seed, "composition": composition, "generator": generator}
    _keep_to_one(made_folder(directory / "truth") / "campaign.json", told)
    work = partial(_make_case, directory)
    for done, _ in enumerate((map if executor is None else executor.map)(work, waiting), start=1):
        progress(done / len(waiting))
    return len(waiting)


def _keep_to_one(path: Path, told: dict[str, Any]) -> None:
    """Refuse to go on with a campaign of another count, seed, composition or generator: it would be a mixture.

    With the truths, since whoever knows the seed can make them again.
    """
    if path.is_file():
        found = _begun(path)
        if any(found.get(key) != value for key, value in told.items()):
            kinds = found.get("composition")
            of = ", ".join(f"{kind}={share}" for kind, share in kinds.items()) if isinstance(kinds, dict) else "?"
            raise SetupError(
                f"{path.parents[1]}: was begun with count {found.get('count')}, seed {found.get('seed')}, generator "
                f"{found['generator']!s:.60} and kinds {of:.200}; go on with those, or take another folder"
            )
    else:
        write_json(path, {"format": CAMPAIGN_FORMAT, **told})


def generator_in(directory: Path) -> str | None:
    """Name of the generator that made a campaign, which its truths tell; None of cases of one's own."""
    path = directory / "truth" / "campaign.json"
    return str(_begun(path)["generator"]) if path.is_file() else None


def _begun(path: Path) -> dict[str, Any]:
    # There was one generator when campaigns didn't name theirs.
    return {"generator": "chains", **read_json(path, CAMPAIGN_FORMAT)}


@in_one_thread()
def _make_case(directory: Path, task: tuple[str, Callable[[], WithheldCase], list[int]]) -> None:
    """Draw, simulate, write and seal one case."""
    name, draw, seed = task
    case = draw()
    folder = made_folder(directory / "cases" / name)
    for path, text in {case.model_file: case.model, **case.beside}.items():
        with atomic_write(folder / path) as file:
            file.write(text.encode())
    if case.topics:
        write_mcap(case.topics, folder / "log.mcap")
    else:
        write_mcap(_log_of(case), folder / "log.mcap", layout="batches")
    seal_case(directory, name, {**truth_of(case), "seed": seed}, leave_out=case.leave_out)


def _log_of(case: WithheldCase) -> TimeSeries:
    return TimeSeries(
        values=np.vstack([one.samples for one in case.channels]), sample_rate_hz=case.sample_rate_hz,
        start_time_ns=case.start_time_ns,
        channels=tuple(
            Channel(name=one.name, unit=one.unit, role="reference" if one.drives else "response")
            for one in case.channels
        ),
    )  # fmt: skip


def truth_of(case: WithheldCase) -> dict[str, Any]:
    """Give all that is true of a case, ready for JSON."""
    return {
        "kind": case.kind,
        "effects": [
            {"effect": one.effect, "site": one.site, "law": one.law, "parameters": dict(one.parameters),
             "from": one.source, "severity": one.severity, "severity_tuned": one.severity_tuned,
             **({"also": [{"effect": word, "site": site} for word, site in one.also]} if one.also else {})}
            for one in case.effects
        ],
        "off": dict(case.off),
        "parameters": dict(case.parameters),
        "noise": dict(case.noise),
        "coloured": case.coloured,
        "change": case.change,
        "ratio": case.ratio,
        "ratio_tuned": case.ratio_tuned,
        "ideal": case.ideal,
        "noise_share": case.noise_share,
        "excitation": list(case.excitation),
        "starts_in_motion": case.starts_in_motion,
        "modes_hz": list(case.modes_hz),
        **case.further,
        "leave_out": sorted(case.leave_out),
    }  # fmt: skip


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
