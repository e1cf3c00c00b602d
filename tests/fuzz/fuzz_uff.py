"""Damaged and odd universal files: ``python tests/fuzz/fuzz_uff.py --inputs 20000 --seed 1``.

A function tells how many values it has, and its lines have columns of fixed width: a line too few or too many shows,
damage inside a line changes no number of another. Of bytes (58b) the length is told, too.
"""

import random
import sys
import tempfile
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pyuff
from damage import BYTES, ODD_TEXTS, TEXTS, damaged
from harness import Case, Format, main
from samples import Block, Sound, Truth, damaged_case, log_command, odd_case, proven, read_case

from tests.io.files.uff_makers import function_set, ibm, response_set, vax_f

ROWS = 60
ODD_FIELDS: dict[str, tuple[Any, ...]] = {
    "id1": ODD_TEXTS, "label": ODD_TEXTS, "kind": (0, 1, 2, 4, 12, 99, -1), "node": (0, 3, -1, 2**31),
    "dir": (-6, 0, 7), "form": (2, 4, 5, 6), "count": (0, 1, -1, 61, 10**9), "even": (0, 1, 2),
    "step": (0.0, -1.0, 1e300, 1e-300),
    "least": (1e300, -5.0), "x_type": (17, 18, 0, 99), "type": (8, 12, 13, 0, -1), "axis": ODD_TEXTS,
    "powers": ((9, -9), (0, 0)), "exponent": ("D", "E", "e"), "newline": (b"\r\n", b"\r", b"\n"),
}  # fmt: skip


def text_sound(how: str, values: np.ndarray[Any, Any], form: int, **fields: Any) -> Sound:
    """Write a record as text; its lines hold six or four numbers of fixed width."""
    content = function_set(values, form=form, **fields)
    width, a_line = (13, 6) if form == 2 else (20, 4)
    start = content.index(f"{values[0]:{width}.{5 if width == 13 else 11}e}".encode())
    lines = ROWS // a_line
    block = Block(start=start, item=width * a_line + 1, rows=lines, columns=1, samples=a_line)
    channels = {"acc": np.array([float(f"{value:{width}.{5 if width == 13 else 11}e}") for value in values])}
    truth = proven("a.uff", content, Truth(channels=channels, rate_hz=200.0, start_ns=0))
    head, tail = (0, start), (start + block.item * lines, len(content))
    return Sound(how=how, name="a.uff", content=content, truth=truth, blocks=(block,), vague=(head, tail))


def raw_sound(how: str, raw: bytes, values: np.ndarray[Any, Any], item: int, **fields: Any) -> Sound:
    """Write a record as bytes."""
    content = function_set(values, raw=raw, **fields)
    start = content.index(raw)
    truth = proven("a.uff", content, Truth(channels={"acc": values.astype(float)}, rate_hz=200.0, start_ns=0))
    block = Block(start=start, item=item, rows=ROWS, columns=1)
    ends = (0, start), (start + len(raw), len(content))
    return Sound(how=how, name="a.uff", content=content, truth=truth, blocks=(block,), vague=ends)


@cache
def sounds() -> tuple[Sound, ...]:
    """Write one file of each kind."""
    values = np.random.default_rng(1).normal(size=ROWS)
    singles = values.astype(np.float32)
    # Twelve binary digits are whole digits of sixteen, too.
    rounded = np.ldexp(np.round(np.ldexp(singles, 12)), -12)
    return (
        text_sound("text", values, 2),
        text_sound("doubles", values, 4),
        raw_sound("bytes", singles.tobytes(), singles, 4),
        raw_sound("big", values.astype(">f8").tobytes(), values, 8, form=4, order=2),
        raw_sound("dec", vax_f(singles), singles, 4, format=1),
        raw_sound("ibm", ibm(rounded), rounded, 4, format=3, order=2),
    )


@cache
def modal() -> tuple[bytes, ...]:
    """Write sets of points, lines, units, modes and responses."""
    nodes = {"node_nums": np.array([1, 2]), "x": np.arange(2.0), "y": np.zeros(2), "z": np.zeros(2)}
    same = {key: np.ones(2, int) for key in ("def_cs", "disp_cs", "color")}
    ids = {f"id{number}": "NONE" for number in range(1, 6)}
    sets = [
        pyuff.prepare_15(**nodes, **same),
        pyuff.prepare_2411(**nodes, **same),
        pyuff.prepare_82(trace_num=1, n_nodes=3, color=1, id="line", nodes=np.array([1, 2, 0])),
        pyuff.prepare_164(
            units_code=1, units_description="SI", temp_mode=1, length=1.0, force=1.0, temp=1.0, temp_offset=273.15
        ),
        pyuff.prepare_55(
            **ids, model_type=1, analysis_type=2, data_ch=2, spec_data_type=8, data_type=2, n_data_per_node=3,
            r1=np.array([1.0, 2.0]), r2=np.array([0.0, 1.0]), r3=np.array([3.0, 1.0]), load_case=1, mode_n=1,
            freq=10.0, modal_m=1.0, modal_damp_vis=0.01, modal_damp_his=0.0, node_nums=np.array([1, 2]),
        ),
    ]  # fmt: skip
    found = [response_set(np.exp(1j * np.arange(40.0)))]
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        for number, one in enumerate(sets):
            path = Path(folder) / f"{number}.uff"
            pyuff.UFF(str(path)).write_sets(one, mode="overwrite")
            found.append(path.read_bytes())
    return tuple(found)


def odd(rng: random.Random) -> Case:
    """Write sets together, damaged or with odd fields."""
    parts, hows = [], []
    for _ in range(rng.randrange(1, 6)):
        if rng.random() < 0.4:
            fields = {key: rng.choice(ODD_FIELDS[key]) for key in rng.sample(list(ODD_FIELDS), rng.choice((1, 2, 4)))}
            fields = {
                key: one[:60].replace("\n", " ") if isinstance(one, str) and key != "exponent" else one
                for key, one in fields.items()
            }
            maker = rng.choice((function_set, response_set, partial(function_set, raw=rng.randbytes(240))))
            parts.append(
                maker(np.exp(1j * np.arange(ROWS)) if maker is response_set else np.arange(float(ROWS)), **fields)
            )
            hows.append(str(fields)[:80])
        else:
            content, how = damaged(rng.choice(modal()), rng, TEXTS)
            parts.append(content)
            hows.append(how)
    return odd_case("a.uff", b"".join(parts), ", ".join(hows))


def make(rng: random.Random) -> Case:
    """Damage a file, or write an odd one."""
    if rng.random() < 0.4:
        return odd(rng)
    sound = rng.choice(sounds())
    return damaged_case(
        sound, rng, TEXTS if sound.how in ("text", "doubles", "units") and rng.random() < 0.6 else BYTES
    )


FORMAT = Format(name="uff", make=make, read=read_case, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["uff"]))
