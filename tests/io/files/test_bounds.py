"""Memory that data files ask for: told before it is taken, whatever packs them."""

import struct
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import feather, parquet

from chladni.io.files.bounds import SMALL_BYTES, Budget, TooLargeError, memory_bytes, read_whole
from chladni.io.files.formats import read_file
from chladni.signals.errors import LogError, SetupError
from tests.io.files.mat_bytes import element, mat_file, matrix

ZEROS = 2 * SMALL_BYTES
MIB = 2**20


def npz(path: Path) -> None:
    head = np.lib.format.magic(1, 0) + struct.pack("<H", 118)
    described = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({ZEROS // 8},), }}".ljust(117) + "\n"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("a.npy", "w") as entry:
        entry.write(head + described.encode())
        for _ in range(ZEROS // MIB):
            entry.write(bytes(MIB))


def mat(path: Path) -> None:
    packer = zlib.compressobj()
    head = matrix(6, shape=(1, ZEROS // 8))[8:] + struct.pack("<II", 9, ZEROS)
    packed = packer.compress(struct.pack("<II", 14, len(head) + ZEROS) + head)
    packed += b"".join(packer.compress(bytes(MIB)) for _ in range(ZEROS // MIB)) + packer.flush()
    path.write_bytes(mat_file(struct.pack("<II", 15, len(packed)) + packed))


def hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=np.zeros(ZEROS // 8), compression="gzip")


def table_of(path: Path) -> None:
    parquet.write_table(pa.table({"x": np.zeros(ZEROS // 8)}), path)


def texts_of(path: Path) -> None:
    text = pa.DictionaryArray.from_arrays(pa.array(np.zeros(4000, dtype=np.int32)), pa.array(["x" * (ZEROS // 2000)]))
    parquet.write_table(pa.table({"x": np.arange(4000.0), "remark": text}), path)


def packed_batch(path: Path) -> None:
    feather.write_feather(pa.table({"x": np.zeros(ZEROS // 8)}), str(path), compression="zstd")


BOMBS: dict[str, tuple[str, Callable[[Path], None]]] = {
    "npz": (".npz", npz), "mat": (".mat", mat), "hdf5": (".mat", hdf5), "parquet": (".parquet", table_of),
    "texts": (".parquet", texts_of), "feather": (".feather", packed_batch),
}  # fmt: skip


@pytest.mark.parametrize(
    "bomb", [bomb if bomb == "npz" else pytest.param(bomb, marks=pytest.mark.nightly) for bomb in BOMBS]
)
def test_bombs_are_refused_before_memory_is_taken(tmp_path: Path, bomb: str) -> None:
    suffix, write = BOMBS[bomb]
    path = tmp_path / f"a{suffix}"
    write(path)
    assert path.stat().st_size < ZEROS // 64
    before = pa.total_allocated_bytes()
    tracemalloc.start()
    with pytest.raises(
        LogError, match=rf"^{path}: its content takes \d+ bytes in .*, \d+ are allowed; .*--read max_bytes="
    ):
        read_file(path, sample_rate_hz=1.0)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak + pa.total_allocated_bytes() - before < ZEROS // 8


@pytest.mark.nightly
@pytest.mark.parametrize("bomb", ["npz", pytest.param("mat", marks=pytest.mark.nightly)])
def test_the_advice_works(tmp_path: Path, bomb: str) -> None:
    suffix, write = BOMBS[bomb]
    write(tmp_path / f"a{suffix}")
    series = read_file(tmp_path / f"a{suffix}", sample_rate_hz=1.0, max_bytes=float(memory_bytes())).series
    assert series[0].samples == ZEROS // 8


def test_the_budget_follows_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"x")
    assert Budget.of_file(path).most == SMALL_BYTES
    with path.open("wb") as file:
        file.truncate(10 * MIB)
    assert Budget.of_file(path).most == 640 * MIB
    # A file with a hole takes no room on a disk, and whole memory when it's read.
    with path.open("wb") as file:
        file.truncate(memory_bytes() + 1)
    assert Budget.of_file(path).most == memory_bytes()
    with pytest.raises(LogError, match="more than half of this machine's memory"):
        read_whole(path)


@pytest.mark.parametrize("wrong", [0, -1, float("nan"), float("inf"), True, "much"])
def test_an_impossible_limit_is_refused(tmp_path: Path, wrong: object) -> None:
    with pytest.raises(SetupError, match=r"max_bytes .* must be a number of bytes"):
        Budget.of_file(tmp_path, wrong)


def test_a_budget_is_used_up() -> None:
    budget = Budget(path=Path("a.mat"), most=10)
    budget.take(10)
    with pytest.raises(TooLargeError, match=r"^a\.mat: its content takes 11 bytes in memory or more, 10 are allowed"):
        budget.take(1)


@pytest.mark.parametrize(
    "parts",
    [
        matrix(6, element(9, b""), shape=(0, 2**31 - 1, 2**31 - 1)),
        matrix(6, element(9, bytes(8)), shape=(1,) * 100),
        matrix(1, *[element(14, b"")] * 200_000, shape=(1, 200_000)),
    ],
)
def test_shapes_that_no_array_has(tmp_path: Path, parts: bytes) -> None:
    (tmp_path / "a.mat").write_bytes(mat_file(parts))
    with pytest.raises(LogError):
        read_file(tmp_path / "a.mat", sample_rate_hz=1.0)
