"""Damaged and odd LVM files: ``python tests/fuzz/fuzz_lvm.py --inputs 20000 --seed 1``.

The rule is that of tables: a line that stands as it was recorded is read, at its time.
"""

import random
import sys
from dataclasses import replace
from functools import cache

import numpy as np
from damage import ODD_TEXTS, TEXTS, damaged
from fuzz_csv import ROWS, Table, expected
from harness import Case, Format, main
from samples import Truth, log_command, odd_case, proven, read_case

START_NS = int(np.datetime64("2024-01-01", "ns").astype(np.int64))


HEAD = f"""LabVIEW Measurement\t
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t.
Multi_Headings\tNo
X_Columns\tCOLUMNS
Time_Pref\tAbsolute
Date\t2024/01/01
Time\t00:00:00.0
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t{ROWS}\t{ROWS}
Date\t2024/01/01\t2024/01/01
Time\t00:00:00\t00:00:00
Y_Unit_Label\tN\tV
X_Dimension\tTime\tTime
X0\t0.0\t0.0
Delta_X\t0.010000\t0.010000
***End_of_Header***\t\t\t
X_Value\ta\tb\tComment"""


@cache
def tables() -> tuple[Table, ...]:
    """Write a file with a column of times, and one without."""
    values = np.round(np.random.default_rng(1).normal(size=(ROWS, 2)), 6)
    truth = Truth(channels={"a": values[:, 0], "b": values[:, 1]}, start_ns=START_NS)
    found = []
    for columns in ("One", "No"):
        times = [f"{row / 100:.6f}" if columns == "One" else "" for row in range(ROWS)]
        rows = tuple(f"{times[row]}\t{values[row, 0]:.6f}\t{values[row, 1]:.6f}" for row in range(ROWS))
        made = Table(
            name=f"X {columns}",
            head=tuple(HEAD.replace("COLUMNS", columns).split("\n")),
            rows=rows,
            end="\n",
            truth=truth,
        )
        found.append(replace(made, truth=proven("a.lvm", made.content, truth)))
    return tuple(found)


def odd(rng: random.Random) -> Case:
    """Give one line of the head an odd word, or several segments."""
    table = rng.choice(tables())
    head = [line for line in table.head if rng.random() < 0.97]
    at = rng.randrange(len(head))
    words = head[at].split("\t")
    words[rng.randrange(len(words))] = rng.choice((*ODD_TEXTS, "0", "-1", "1e9", "Multi", ",", "Dec"))
    head[at] = "\t".join(words)
    body = "\n".join((*head, *table.rows)) + "\n"
    return odd_case("a.lvm", (body * rng.choice((1, 1, 2))).encode(), f"{words[:3]}"[:60])


def make(rng: random.Random) -> Case:
    """Damage a file, mostly in its rows, or write an odd one."""
    if rng.random() < 0.25:
        return odd(rng)
    table = rng.choice(tables())
    head = "".join(line + table.end for line in table.head).encode()
    content, how = damaged(table.content[len(head) :], rng, TEXTS)
    truth = expected(table, head, head + content) if table.name == "X One" else replace(table.truth, channels=None)
    return Case(files={"a.lvm": head + content}, how=f"{table.name}: {how}", truth=truth)


FORMAT = Format(name="lvm", make=make, read=read_case, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["lvm"]))
