"""Damaged and odd tables of text: ``python tests/fuzz/fuzz_csv.py --inputs 20000 --seed 1``.

The rule is by line. A line of the damaged file that stands so in the sound one is a row that was recorded: its
numbers are read at its time. A sample that no such row holds needs a foreign line to come from. Where the lines above
the rows were damaged too, names and units may be others; still as many rows are read as there are.
"""

import random
import sys
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from damage import BYTES, ODD_TEXTS, TEXTS, damaged
from harness import Case, Format, main
from samples import START_NS, Truth, log_command, proven, read_case

ROWS = 60


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Table:
    """A sound table: its first lines, its rows, and what they hold."""

    name: str
    head: tuple[str, ...]
    rows: tuple[str, ...]
    end: str
    truth: Truth

    @property
    def content(self) -> bytes:
        """The file."""
        return "".join(line + self.end for line in (*self.head, *self.rows)).encode()


def table(
    name: str, separator: str, comma: str, time: str, *, head: tuple[str, ...] = (), end: str = "\n", count: int = 3
) -> Table:
    """Write a table of some columns, with times of a kind or a rate."""
    rng = np.random.default_rng(len(name))
    rate_hz = 100.0
    values = np.round(rng.normal(size=(ROWS, count)) * 10.0 ** rng.integers(-3, 4, count), 6)
    times = {
        "s": [f"{row / rate_hz:.4f}" for row in range(ROWS)],
        "ms": [f"{row * 1e3 / rate_hz:.1f}" for row in range(ROWS)],
        "epoch": [f"{START_NS // 10**9 + row / rate_hz:.3f}" for row in range(ROWS)],
        "iso": [str(np.datetime64(START_NS, "ns") + np.timedelta64(row * 10, "ms")) for row in range(ROWS)],
        "none": [],
    }[time]
    titles = {"s": "t [s]", "ms": "time [ms]", "epoch": "time [s]", "iso": "timestamp", "none": ""}[time]
    names = [f"a{column}" for column in range(count)]
    cells = [[*times[row : row + 1], *(repr(float(value)) for value in values[row])] for row in range(ROWS)]
    units = ["N", "m/s^2", "V", "1"]
    shown = [f"{one} [{units[column % 4]}]" for column, one in enumerate(names)]
    header = separator.join([*filter(None, [titles]), *shown])
    truth = Truth(
        channels={one: values[:, column] for column, one in enumerate(names)},
        rate_hz=rate_hz,
        start_ns=START_NS if time in ("epoch", "iso") else 0,
        options={"sample_rate_hz": rate_hz} if time == "none" else {},
    )
    rows = tuple(separator.join(cell.replace(".", comma) for cell in row) for row in cells)
    made = Table(name=name, head=(*head, header), rows=rows, end=end, truth=truth)
    return replace(made, truth=proven("sound.csv", made.content, truth))


@cache
def tables() -> tuple[Table, ...]:
    """Write one table of each kind."""
    return (
        table("comma", ",", ".", "s"),
        table("semicolon", ";", ",", "s", end="\r\n"),
        table("tab", "\t", ".", "ms"),
        table("epoch", ",", ".", "epoch"),
        table("iso", ",", ".", "iso", count=2),
        table("rate", ",", ".", "none"),
        table("wide", ",", ".", "s", count=40),
        table("preamble", ",", ".", "s", head=("Instrument: A", "Serial: 7", "")),
    )


def make(rng: random.Random) -> Case:
    """Damage a table, mostly in its rows, or put an odd line above it."""
    sound = rng.choice(tables())
    what = rng.random()
    head = "".join(line + sound.end for line in sound.head).encode()
    if what < 0.1:
        # Whatever a remark holds, it's one line.
        odd = rng.choice(ODD_TEXTS).replace("\r", " ")
        remark = f"{rng.choice(('# made', '; made', 'made', '%'))} {odd} by{sound.end}".encode()
        return Case(
            files={"a.csv": remark + sound.content}, how=f"{sound.name}: remark {odd[:40]!r}", truth=sound.truth
        )
    if what < 0.7:
        rows, how = damaged(sound.content[len(head) :], rng, TEXTS if rng.random() < 0.7 else BYTES)
        content = head + rows
    else:
        content, how = damaged(sound.content, rng, TEXTS)
    return Case(files={"a.csv": content}, how=f"{sound.name}: {how}", truth=expected(sound, head, content))


def expected(sound: Table, head: bytes, content: bytes) -> Truth:
    """Give what may be read of a damaged table."""
    recorded = {row.encode(): number for number, row in enumerate(sound.rows)}
    if not content.startswith(head):
        lines = content.split(sound.end.encode())
        return replace(sound.truth, channels=None, least=len({line for line in lines if line in recorded}))
    lines = content[len(head) :].split(sound.end.encode())
    whole = [recorded[line] for line in lines if line in recorded]
    intact = np.zeros(ROWS, np.bool_)
    intact[whole] = True
    foreign = sum(1 + len(line.splitlines()) for line in lines if line and line not in recorded)
    if "sample_rate_hz" in sound.truth.options:
        # Rows have no times of their own: where they stand is when they were.
        return _by_place(sound, lines, recorded)
    return replace(sound.truth, intact=intact, foreign=foreign)


def _by_place(sound: Table, lines: list[bytes], recorded: dict[bytes, int]) -> Truth:
    lines = lines[:-1] if lines and not lines[-1] else lines
    known = np.array([recorded.get(line, -1) for line in lines], np.int64)
    if not len(known) or any(len(line.splitlines()) != 1 for line in lines):
        return replace(sound.truth, channels=None)
    channels = {
        name: np.where(known < 0, np.nan, values[known]) for name, values in (sound.truth.channels or {}).items()
    }
    return replace(sound.truth, channels=channels, foreign=int(np.count_nonzero(known < 0)))


FORMAT = Format(name="csv", make=make, read=read_case, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["csv"]))
