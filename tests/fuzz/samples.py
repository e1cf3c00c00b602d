"""The rule of all formats of samples: what is read was recorded, at its time, or something is said."""

import json
import random
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from damage import BYTES, Damage, damaged
from harness import TOLD, WHOLE, BrokenRuleError, Case

import chladni

START_NS = 1_700_000_000_000_000_000
_NOTHING: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """What a file holds.

    Attributes
    ----------
    channels
        Samples by name, row by row, in SI; NaN where there's none. None: nothing is known but that it mustn't fail.
    rate_hz, start_ns
        Of the rows.
    intact
        ``[row]``, rows that the damage left as they were. They are read, unless something is said.
    foreign
        How many samples of a channel the damage may have made; without checksum nobody can tell.
    usual
        Sentences that are said of the sound file.
    options
        With which it is opened.
    least
        How many samples are read, unless something is said, where nothing else is known.
    sure
        What is read whatever is said: of parts of the file that weren't damaged.
    """

    channels: Mapping[str, np.ndarray[Any, np.dtype[np.float64]]] | None = None
    rate_hz: float = 100.0
    start_ns: int = START_NS
    intact: np.ndarray[Any, np.dtype[np.bool_]] | None = None
    foreign: int = 0
    usual: frozenset[str] = _NOTHING
    options: Mapping[str, Any] = field(default_factory=dict)
    least: int = 0
    sure: "Truth | None" = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reading:
    """What was read: sentences, and times and samples by name."""

    said: frozenset[str]
    samples: Mapping[str, tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]]


def read_log(path: Path, options: Mapping[str, Any]) -> Reading:
    """Read all that a file holds, the way the commands do."""
    with chladni.open(path, **options) as log:
        info = log.info()
        json.dumps(info.to_json(), allow_nan=False)
        samples = {}
        for series in log.read_groups() if log.channels else ():
            times_ns = series.start_time_ns + np.rint(np.arange(series.samples) * (1e9 / series.sample_rate_hz))
            for row, channel in enumerate(series.channels):
                # A damaged number may be a signalling NaN.
                with np.errstate(invalid="ignore"):
                    values = series.values[row].astype(np.float64)
                good = np.isfinite(values) if series.valid is None else series.valid[row]
                samples[channel.name] = times_ns[good], values[good]
        said = {*(loss.what for loss in log.damage), *log.notes, *info.findings}
        said |= {f"{one.name}: {one.reason}" for one in log.unread}
        for one in info.channels:
            base = one.time_base
            trouble = {"breaks": len(one.breaks_s), "gaps": base.gap_count, "duplicates": base.duplicates}
            said |= {f"{count} {what}" for what, count in trouble.items() if count}
        _ = log.functions, log.modes, log.geometry
    # That a unit is unknown says nothing of the samples.
    said = {one for one in said if not one.startswith("the log gives no unit for")}
    return Reading(said=frozenset(said), samples=samples)


def proven(name: str, content: bytes, truth: Truth) -> Truth:
    """Read a sound file, which has to give the truth to the last sample, and note what is said of it."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        reading = read_log(path, truth.options)
    for channel, recorded in (truth.channels or {}).items():
        _check_channel(channel, recorded, reading, truth)
    return replace(truth, usual=reading.said)


def check_log(path: Path, truth: Truth) -> str:
    """Read a file and hold it against the truth."""
    reading = read_log(path, truth.options)
    if truth.sure is not None:
        for name, recorded in (truth.sure.channels or {}).items():
            _check_channel(name, recorded, reading, truth.sure)
    if reading.said - truth.usual:
        return TOLD
    most = max((len(values) for _, values in reading.samples.values()), default=0)
    if most < truth.least:
        raise BrokenRuleError("a lost row", f"{most} of {truth.least} are read")
    for name, recorded in (truth.channels or {}).items():
        _check_channel(name, recorded, reading, truth)
    return WHOLE


def _check_channel(name: str, recorded: np.ndarray[Any, Any], reading: Reading, truth: Truth) -> None:
    if name not in reading.samples:
        raise BrokenRuleError("a channel is lost", f"{name}; read: {', '.join(reading.samples)[:200]}")
    times_ns, values = reading.samples[name]
    rows = np.rint((times_ns - truth.start_ns) * (truth.rate_hz / 1e9))
    inside = (rows >= 0) & (rows < len(recorded))
    index = rows[inside].astype(np.int64)
    on_time = np.abs(times_ns[inside] - truth.start_ns - index * (1e9 / truth.rate_hz)) < 0.3e9 / truth.rate_hz
    right = np.isclose(values[inside], recorded[index], rtol=1e-6, atol=1e-30) & on_time
    wrong = len(values) - int(np.count_nonzero(right))
    if wrong > truth.foreign:
        at = int(np.argmin(right)) if not right.all() else 0
        raise BrokenRuleError(
            "a wrong sample", f"{wrong} of {name}, {truth.foreign} were damaged; {at}: {values[:3]}"
        )
    there = np.zeros(len(recorded), np.bool_)
    there[index[right]] = True
    due = np.isfinite(recorded) if truth.intact is None else np.isfinite(recorded) & truth.intact
    lost = due & ~there
    if lost.any():
        raise BrokenRuleError("a lost sample", f"{np.count_nonzero(lost)} of {name}, first row {np.argmax(lost)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """Where numbers of the rows lie in a file: row after row of so many items, or column after column.

    An item may be a line of several samples. The first row may be a later one of the file's.
    """

    start: int
    item: int
    rows: int
    columns: int
    by_column: bool = False
    samples: int = 1
    first: int = 0

    @property
    def stop(self) -> int:
        """Where it ends."""
        return self.start + self.item * self.rows * self.columns

    def touched(self, places: np.ndarray[Any, Any]) -> tuple[np.ndarray[Any, Any], int]:
        """Give the rows that damaged bytes belong to, and how many items that are."""
        inside = places[(places >= self.start) & (places < self.stop)]
        items = np.unique((inside - self.start) // self.item)
        rows = items % self.rows if self.by_column else items // self.columns
        samples = (rows[:, np.newaxis] * self.samples + np.arange(self.samples)).ravel()
        return samples + self.first, len(items) * self.samples


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sound:
    """A sound file of binary numbers.

    Attributes
    ----------
    how
        What it's called.
    name, content
        The file.
    truth
        What it holds.
    blocks
        Where numbers lie that no checksum protects: a damaged one can't be told from a right one.
    vague
        Parts (start, stop) whose damage makes another sound file: names, a rate that stands but once.
    """

    how: str
    name: str
    content: bytes
    truth: Truth
    blocks: tuple[Block, ...] = ()
    vague: tuple[tuple[int, int], ...] = ()

    def judged(self, damaged: bytes, *, once: bool) -> Truth:
        """Give what may be read of the file after damage, once or several times."""
        size = min(len(damaged), len(self.content))
        places = np.flatnonzero(np.frombuffer(damaged, np.uint8, size) != np.frombuffer(self.content, np.uint8, size))
        if any(np.any((places >= start) & (places < stop)) for start, stop in self.vague):
            return replace(self.truth, channels=None)
        if once and len(damaged) != len(self.content):
            # A piece is missing or too much, and every number that was recorded is where it was or has moved.
            return self.truth
        rows = len(next(iter((self.truth.channels or {"": np.empty(0)}).values())))
        intact, foreign = np.ones(rows, np.bool_), 0
        for block in self.blocks:
            touched, items = block.touched(places)
            intact[touched] = False
            foreign += items
        return replace(self.truth, intact=intact, foreign=foreign)


def block_of(array: np.ndarray[Any, Any], content: bytes, *, first: int = 0) -> Block:
    """Find an array ``[row, column]`` in a file, row after row or column after column."""
    found = {order: content.find(array.tobytes(order)) for order in ("C", "F")}
    order = max(found, key=lambda one: found[one] >= 0)
    if found[order] < 0:
        raise AssertionError("the array isn't in the file as it is")
    rows, columns = array.shape[0], array[0].size
    return Block(
        start=found[order], item=array.itemsize, rows=rows, columns=columns, by_column=order == "F", first=first
    )


def sound_file(
    how: str,
    name: str,
    content: bytes,
    truth: Truth,
    *,
    unprotected: Sequence[np.ndarray[Any, Any]] = (),
    blocks: Sequence[Block] = (),
    vague: Sequence[bytes] = (),
    vague_outside: bool = False,
) -> Sound:
    """Note a sound file, after a look whether it's read rightly.

    Parameters
    ----------
    unprotected, blocks
        Arrays ``[row, column]`` as they lie in it, and blocks.
    vague
        Bytes whose damage makes another sound file.
    vague_outside
        Whether all but the blocks is such.
    """
    own = (*blocks, *(block_of(array, content) for array in unprotected))
    parts = [(place, place + len(part)) for part in vague for place in _places(content, part)]
    if vague_outside:
        edges = [0, *(edge for one in sorted(own, key=lambda one: one.start) for edge in (one.start, one.stop))]
        parts += zip(edges[::2], [*edges[1::2], len(content)], strict=True)
    return Sound(
        how=how, name=name, content=content, truth=proven(name, content, truth), blocks=own, vague=tuple(parts)
    )


def _places(content: bytes, part: bytes) -> Iterator[int]:
    place = content.find(part)
    while place >= 0:
        yield place
        place = content.find(part, place + 1)


def damaged_case(sound: Sound, rng: random.Random, kinds: Sequence[Damage] = BYTES) -> Case:
    """Damage a sound file."""
    content, how = damaged(sound.content, rng, kinds)
    return Case(
        files={sound.name: content}, how=f"{sound.how}: {how}", truth=sound.judged(content, once=" " not in how)
    )


def odd_case(name: str, content: bytes, how: str, **options: Any) -> Case:
    """Make a case of an odd file, of which nothing is known but that it mustn't fail."""
    return Case(files={name: content}, how=how, truth=Truth(options=options))


def read_case(path: Path, case: Case) -> str:
    """Read the file of a case and hold it against its truth."""
    return check_log(path, case.truth)


def log_command(path: Path, rng: random.Random) -> list[str]:
    """Any command that takes a log or a data file."""
    rate = ["--rate", "100"] if path.suffix == ".npy" else []
    measured = ("levels", "psd", "octaves", "envelope", "cepstrum")
    name = rng.choice((*measured, "info", "modes", "compare", "convert"))
    json_file = ["--json", str(path.with_name("out.json"))] if rng.random() < 0.5 else []
    more = {
        "modes": ["--operational"],
        "compare": [str(path)],
        "convert": [str(path.with_name(rng.choice(("out.mcap", "out.csv", "out.uff", "out.mat"))))],
    }
    return [name, str(path), *more.get(name, []), *json_file, *rate]
