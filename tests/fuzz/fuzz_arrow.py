"""Damaged and odd Parquet, Feather and Arrow files: ``python tests/fuzz/fuzz_arrow.py --inputs 20000 --seed 1``.

Parquet's pages may have checksums: a wrong number of such a page is never read. Nothing else has any; damage among
plain numbers changes no others.
"""

import random
import sys
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pyarrow as pa
from damage import ODD_TEXTS
from harness import Case, Format, main
from pyarrow import feather, ipc, parquet
from samples import Sound, Truth, damaged_case, log_command, odd_case, read_case, sound_file

ROWS = 64


def content_of(table: pa.Table, kind: str, **options: Any) -> bytes:
    sink = pa.BufferOutputStream()
    if kind == "parquet":
        parquet.write_table(table, sink, **options)
    elif kind == "stream":
        with ipc.new_stream(sink, table.schema) as stream:
            stream.write_table(table)
    else:
        feather.write_feather(table, sink, **options)
    return bytes(sink.getvalue())


@cache
def sounds() -> tuple[Sound, ...]:
    """Write one file of each kind."""
    rng = np.random.default_rng(1)
    first, second, times = (
        rng.normal(size=(ROWS, 1)),
        rng.normal(size=(ROWS, 1)),
        np.arange(ROWS)[:, np.newaxis] / 100,
    )
    table = pa.table({"time [s]": times[:, 0], "ax [N]": first[:, 0], "ay [N]": second[:, 0]})
    truth = Truth(channels={"ax": first[:, 0], "ay": second[:, 0]}, start_ns=0)
    arrays = [times, first, second]
    found = []
    for how, options in (("packed", {}), ("old", {"version": "1.0"})):
        found.append(sound_file(how, "a.parquet", content_of(table, "parquet", **options), truth, vague_outside=True))
    for compression in ("lz4", "zstd"):
        content = content_of(table, "feather", compression=compression)
        found.append(sound_file(compression, "a.feather", content, truth, vague_outside=True))
    for kind, options in (("feather", {"compression": "uncompressed"}), ("stream", {})):
        content = content_of(table, kind, **options)
        plain = sound_file(f"plain {kind}", "a.arrow", content, truth, unprotected=arrays, vague_outside=True)
        found.append(plain)
    return (*found, checked(table, truth))


def checked(table: pa.Table, truth: Truth) -> Sound:
    """Write Parquet with checksums: of pages, not of what describes them."""
    content = content_of(table, "parquet", write_page_checksum=True, use_dictionary=False)
    group = parquet.ParquetFile(pa.BufferReader(content)).metadata.row_group(0)
    columns = [group.column(number) for number in range(3)]
    ends = [column.data_page_offset + column.total_compressed_size for column in columns]
    numbers = [len(table) * 8 // 2 for _ in columns]
    starts = [end - size for end, size in zip(ends, numbers, strict=True)]
    edges = [0, *(edge for pair in zip(starts, ends, strict=True) for edge in pair), len(content)]
    sound = sound_file("checked", "a.parquet", content, truth)
    return replace(sound, vague=tuple(zip(edges[::2], edges[1::2], strict=True)))


def odd(rng: random.Random) -> Case:
    """Write columns of odd types and names."""
    size = rng.choice((0, 1, 2, 50))
    numbers = np.arange(size)
    columns = [
        pa.array(numbers.astype(float)), pa.array(numbers), pa.array(numbers.astype("M8[ns]")), pa.nulls(size),
        pa.array([rng.choice(ODD_TEXTS) for _ in range(size)]), pa.array([{"a": one} for one in range(size)]),
        pa.array([[1.0, 2.0]] * size, pa.list_(pa.float64())), pa.array(numbers.astype(np.float16)),
        pa.array([b"\xff"] * size), pa.array([None, *[1.5] * (size - 1)][:size], pa.float64()),
        pa.array([str(one) for one in range(size)]).dictionary_encode(), pa.array(numbers.astype("m8[s]")),
        pa.array([2**63] * size, pa.uint64()), pa.array([rng.choice((1e308, float("nan"), -0.0))] * size),
    ]  # fmt: skip
    chosen = rng.choices(columns, k=rng.choice((0, 1, 3, 9)))
    names = [rng.choice(("time", "t [s]", "ax [g]", "ax", *ODD_TEXTS))[:99] for _ in chosen]
    metadata = {rng.choice(("fs", "sample_rate", "units", "format")): rng.choice((*ODD_TEXTS, "100", "{}"))[:99]}
    table = pa.Table.from_arrays(chosen, names=names).replace_schema_metadata(metadata)
    kind = rng.choice(("parquet", "feather", "stream"))
    try:
        content = content_of(table, kind)
    except (pa.ArrowException, ValueError):
        # The writer refuses some types.
        kind, content = "stream", content_of(table, "stream")
    return odd_case(f"a.{'parquet' if kind == 'parquet' else 'arrow'}", content, f"odd {kind}")


def make(rng: random.Random) -> Case:
    """Damage a file, or write an odd one."""
    return odd(rng) if rng.random() < 0.25 else damaged_case(rng.choice(sounds()), rng)


FORMAT = Format(name="arrow", make=make, read=read_case, command=log_command)

if __name__ == "__main__":
    sys.exit(main(["arrow"]))
