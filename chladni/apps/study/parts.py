"""One log by many workers: each sums a part of it, and the one that makes its rows has the sums of all."""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from chladni.apps.shares import Gathered, NeedsWholeError, Part, SharedGrid, right_cuts
from chladni.apps.study.engine import Engine
from chladni.apps.study.prepared import prepared
from chladni.apps.study.steps import DIVIDED, DOCUMENTS
from chladni.io.files.formats import MCAP
from chladni.io.study.logs import LogAddress, held
from chladni.signals.errors import ChladniError, EstimateError, LogError
from chladni.signals.linear_algebra import in_one_thread

if TYPE_CHECKING:
    from distributed import Client

#: A log of this size is shared: reading it takes minutes, and sharing it seconds.
LARGE_BYTES: Final = 1 << 30
#: A part is at least so large: each worker reads all stamps, and the first block.
PART_BYTES: Final = 1 << 28
MOST_PARTS: Final = 64
#: Sums of all parts of a log together; the program that runs the study holds them.
MOST_SUM_BYTES: Final = 1 << 28


@dataclass(frozen=True, slots=True)
class PartTask:
    """A part to be summed.

    Attributes
    ----------
    url
        See `LogAddress`.
    number, of, cuts
        See `Part`.
    """

    url: str
    number: int
    of: int
    cuts: Mapping[str, Sequence[int]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sums:
    """What a part gave, as it travels: `content` holds numbers and JSON, and is never unpickled.

    Attributes
    ----------
    seen
        See `HeldLog.stamp`: parts of a log that changed meanwhile don't fit together.
    told
        See `Part`.
    seconds, cpu_s
        Spent on it.
    why_whole
        Why one worker has to do all of the log; empty where that isn't so.
    content
        All of it, for `read_sums`.
    """

    seen: str
    told: Mapping[str, SharedGrid]
    seconds: float
    cpu_s: float
    why_whole: str
    content: bytes = b""

    @classmethod
    def of(cls, content: bytes) -> "Sums":
        """Read what a worker gave; `LogError` when it's nothing of the kind."""
        header, _ = _opened(content)
        return cls(**header, content=content)


def parts_of(address: LogAddress, steps: Sequence[str], threads: int) -> int:
    """Say among how many workers a log is shared; 1 for most."""
    if address.size_bytes < LARGE_BYTES or not address.url.endswith(MCAP) or not set(steps) & set(DIVIDED):
        return 1
    return max(1, min(threads, address.size_bytes // PART_BYTES, MOST_PARTS))


def sum_part(recipe: str, tasks: Sequence[PartTask]) -> bytes:
    """Sum a part of a log for all steps that are sums; `Sums.of` reads what comes out."""
    [task] = tasks
    ready = prepared(recipe)
    began_s, cpu_s = time.perf_counter(), time.process_time()
    part = Part(number=task.number, of=task.of, cuts=task.cuts)
    seen = why = ""
    try:
        with (
            in_one_thread(),
            held(LogAddress(url=task.url), hashed=False) as file,
            ready.open(file.path) as log,
        ):
            seen = file.stamp
            for part.step in set(DIVIDED) & set(ready.recipe.steps):
                asked = getattr(ready.recipe.file, part.step)
                # What is no sum, or has none, is left to the worker that does the rest.
                with suppress(EstimateError, NeedsWholeError):
                    DOCUMENTS[part.step](log, asked, None, part)
    except (ChladniError, OSError, MemoryError) as error:
        why = str(error) or type(error).__name__
    if sum(one.nbytes for one in part.sums.values()) * task.of > MOST_SUM_BYTES:
        part.sums, why = {}, "its sums are too large to be put together"
    return _packed(
        {
            "seen": seen,
            "told": {name: asdict(one) for name, one in part.told.items()},
            "seconds": time.perf_counter() - began_s,
            "cpu_s": time.process_time() - cpu_s,
            "why_whole": why,
        },
        part.sums,
    )


def share(client: "Client", work: Callable[[Sequence[PartTask]], bytes], url: str, parts: int) -> tuple[Sums, ...]:
    """Let workers sum the parts of a log; nothing where one worker has to do all of it.

    Raises
    ------
    SetupError
        When there is no worker, or the scheduler has gone.
    """
    found = _summed(client, work, [PartTask(url, number, parts) for number in range(parts)])
    if not _fit(found, parts):
        return ()
    right = {
        name: right_cuts([found[number].told[name] for number in range(parts)])
        for name in found[0].told
        if all(name in one.told for one in found.values())
    }
    again = [
        PartTask(url, number, parts, right)
        for number, one in found.items()
        if any(one.told[name].cuts[number : number + 2] != cuts[number : number + 2] for name, cuts in right.items())
    ]
    found |= _summed(client, work, again)
    return tuple(found[number] for number in range(parts)) if _fit(found, parts) else ()


def read_sums(contents: Sequence[bytes], step: str) -> Gathered:
    """Give the sums of all parts to a step; `LogError` when they are damaged."""
    opened = [_opened(content) for content in contents]
    return Gathered(
        step=step,
        sums=[sums for _, sums in opened],
        told=[header["told"] for header, _ in opened],
    )


def _summed(
    client: "Client", work: Callable[[Sequence[PartTask]], bytes], tasks: Sequence[PartTask]
) -> dict[int, Sums]:
    found: dict[int, Sums] = {}
    for answer in Engine(client, work).run(tasks):
        if answer.content is not None:
            # Without them the log is done by one worker.
            with suppress(LogError):
                found[answer.items[0].number] = Sums.of(answer.content)
    return found


def _fit(found: Mapping[int, Sums], parts: int) -> bool:
    together = len({one.seen for one in found.values()}) == 1
    return len(found) == parts and together and not any(one.why_whole for one in found.values())


def _grid(told: Mapping[str, Any]) -> SharedGrid:
    cuts, runs = told["cuts"], told["runs"]
    return SharedGrid(
        samples=told["samples"], hop=told["hop"], cuts=tuple(cuts), runs=tuple((first, last) for first, last in runs)
    )


def _packed(header: Mapping[str, Any], sums: Mapping[str, NDArray[Any]]) -> bytes:
    file = BytesIO()
    text = json.dumps({**header, "names": list(sums)}).encode()
    np.savez(file, np.frombuffer(text, np.uint8), *sums.values())
    return file.getvalue()


def _opened(content: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    try:
        with np.load(BytesIO(content), allow_pickle=False) as arrays:
            header = json.loads(arrays["arr_0"].tobytes())
            header["told"] = {name: _grid(one) for name, one in header["told"].items()}
            return header, {name: arrays[f"arr_{place}"] for place, name in enumerate(header.pop("names"), 1)}
    except (OSError, EOFError, ValueError, KeyError, TypeError, AttributeError, BadZipFile) as error:
        raise LogError(f"the sums of a part are damaged: {error}; run the study again") from error
