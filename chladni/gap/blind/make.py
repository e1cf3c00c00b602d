"""Makes a campaign: folders with a model and a log each, and their sealed truth elsewhere."""

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from chladni.gap.blind.case_draw import Case, Kind, Order, draw_case
from chladni.gap.blind.case_folder import read_json
from chladni.gap.blind.composition import DEFAULT, orders
from chladni.gap.blind.model_text import model_text
from chladni.gap.blind.performance import measured
from chladni.gap.blind.seal import seal_case, write_json
from chladni.io.atomic import atomic_write
from chladni.io.folder import made_folder
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.errors import SetupError
from chladni.signals.linear_algebra import in_one_thread
from chladni.signals.time_series import TimeSeries

Progress = Callable[[float], None]
CAMPAIGN_FORMAT = "chladni.blind-campaign/1"
#: The same for all cases: a log's date tells nothing.
START_TIME_NS = 1_760_000_000_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class CaseTask:
    """One case to make, for a worker process."""

    directory: Path
    name: str
    order: Order
    seed: tuple[int, int]


def make_cases(directory: Path, *, count: int, seed: int, composition: Mapping[Kind, int] = DEFAULT,
               executor: Executor | None = None, progress: Progress = lambda _share: None) -> int:  # fmt: skip
    """Make a campaign in `directory`, or what is missing of it.

    Parameters
    ----------
    directory
        Gets ``cases/case-0001/`` with ``model.toml``, ``log.mcap`` and ``case.json``, and ``truth/case-0001.json``.
    count, seed, composition
        Number of cases, where all random numbers come from, and how many cases of each kind in proportion. The same
        three give the same cases; their seals differ, since a salt that follows from the seed would hide nothing.
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
        When `count` or `seed` is impossible, or the campaign in the folder is another one.
    LogError
        When the folder can't be written.
    """
    if seed < 0:
        raise SetupError(f"seed {seed} must not be negative")
    planned = orders(count, np.random.default_rng([seed, 0]), composition)
    names = [f"case-{place:04d}" for place in range(1, count + 1)]
    tasks = [
        CaseTask(directory=directory, name=name, order=order, seed=(seed, place))
        for place, (name, order) in enumerate(zip(names, planned, strict=True), start=1)
        if not (directory / "cases" / name / "case.json").is_file()
    ]
    made_folder(directory / "truth")
    _keep_to_one(
        directory / "truth" / "campaign.json", {"count": count, "seed": seed, "composition": {**composition}}
    )
    made = map(make_case, tasks) if executor is None else executor.map(make_case, tasks)
    for done, _ in enumerate(made, start=1):
        progress(done / len(tasks))
    return len(tasks)


def _keep_to_one(path: Path, told: dict[str, Any]) -> None:
    """Refuse to go on with a campaign of another count, seed or composition: its cases would be a mixture.

    With the truths, since whoever knows the seed can make them again.
    """
    if path.is_file():
        found = read_json(path, CAMPAIGN_FORMAT)
        if any(found.get(key) != value for key, value in told.items()):
            kinds = found.get("composition")
            of = ", ".join(f"{kind}={share}" for kind, share in kinds.items()) if isinstance(kinds, dict) else "?"
            raise SetupError(
                f"{path.parents[1]}: was begun with count {found.get('count')}, seed {found.get('seed')} and kinds "
                f"{of:.200}; go on with those, or take another folder"
            )
    else:
        write_json(path, {"format": CAMPAIGN_FORMAT, **told})


@in_one_thread()
def make_case(task: CaseTask) -> str:
    """Draw, simulate, write and seal one case; give its name."""
    case = draw_case(task.order, np.random.default_rng(task.seed))
    folder = made_folder(task.directory / "cases" / task.name)
    with atomic_write(folder / "model.toml") as file:
        file.write(model_text(case.bench.plan).encode())
    write_mcap(log_of(case), folder / "log.mcap", layout="batches")
    seal_case(task.directory, task.name, truth_of(case, task.seed), leave_out=task.order.leave_out)
    return task.name


def log_of(case: Case) -> TimeSeries:
    """What the log holds: driving signals, then outputs with their noise."""
    plan, terminals = case.bench.plan, _terminals(case)
    window = slice(case.drive.before, case.drive.before + case.bench.samples)
    names = measured(case.bench)
    rows = [*case.drive.signals[:, window], *(case.recorded[name] for name in names)]
    channels = [*(replace(terminals[name], role="reference") for name in plan.driven()),
                *(terminals[name] for name in names)]  # fmt: skip
    return TimeSeries(values=np.vstack(rows), sample_rate_hz=case.bench.rate_hz, start_time_ns=START_TIME_NS,
                      channels=tuple(channels))  # fmt: skip


def _terminals(case: Case) -> dict[str, Channel]:
    """Channel of each input and output, and of a loop's reference."""
    plan = case.bench.plan
    found = {one.name: Channel(name=one.channel, unit=one.unit) for one in plan.inputs}
    found |= {one.name: Channel(name=one.channel, unit=one.unit) for one in plan.outputs}
    if plan.loop is not None:
        sensor = found[plan.loop.feedback]
        found[plan.loop.name] = Channel(name=plan.loop.reference, unit=sensor.unit)
    return found


def truth_of(case: Case, seed: tuple[int, int]) -> dict[str, Any]:
    """Give all that is true of a case, ready for JSON."""
    ratios = case.ratios or (None,) * len(case.effects)
    tuned = case.ratios_tuned or (case.ratio_tuned,) * len(case.effects)
    return {
        "kind": case.order.kind,
        "effects": [
            {"effect": one.effect, "site": one.site, "law": one.law, "parameters": dict(one.numbers),
             "from": one.source or None, "severity": ratio, "severity_tuned": left}
            for one, ratio, left in zip(case.effects, ratios, tuned, strict=True)
        ],
        "off": dict(case.off),
        "parameters": dict(case.numbers),
        "noise": {name: dict(one.told()) for name, one in case.noise.items()},
        "coloured": case.order.coloured,
        "change": case.change,
        "ratio": case.ratio,
        "ratio_tuned": case.ratio_tuned,
        # The true law at the true site leaves the noise, whatever it is: it closes all that can be closed.
        "ideal": 1.0,
        "noise_share": case.noise_share,
        "excitation": list(case.drive.words),
        "starts_in_motion": case.drive.before > 0,
        "modes_hz": list(case.bench.modes_hz),
        "steps": case.steps,
        "leave_out": sorted(case.order.leave_out),
        "seed": list(seed),
    }  # fmt: skip
