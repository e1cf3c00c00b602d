"""``.mat`` and ``.npz`` files: round trips, foreign layouts, and files meant to harm."""

import io
import pickle
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import loadmat, savemat

from chladni.io.files.bounds import Budget
from chladni.io.files.formats import read_file
from chladni.io.files.mat import read_mat, write_mat
from chladni.io.files.mat_elements import read_mat_elements
from chladni.io.files.npz import read_npz, write_npz
from chladni.signals.channel import Channel
from chladni.signals.errors import ChladniError, LogError, SetupError
from chladni.signals.testing import assert_close
from chladni.signals.time_series import TimeSeries
from tests.io.files.mat_bytes import element, mat_file, matrix

KINDS = {"mat": (read_mat, write_mat), "npz": (read_npz, write_npz)}
CHANNELS = (
    Channel(name="/wrist.accel.linear.z", unit="m/s^2", point="wrist", direction=(0.0, 0.6, 0.8), overload=500.0),
    Channel(name="Kraft µ", unit="N", role="reference"),
    Channel(name="x"),
)


def series_of(count: int = 3, samples: int = 20, **fields: object) -> TimeSeries:
    values = np.random.default_rng(5).standard_normal((count, samples))
    options = {"values": values, "sample_rate_hz": 1e3 / 3, "start_time_ns": 1_700_000_000_123_456_789}
    return TimeSeries(**(options | {"channels": CHANNELS[:count]} | fields))


def save(path: Path, **arrays: object) -> Path:
    if path.suffix == ".mat":
        savemat(path, arrays)
    else:
        np.savez(path, **arrays)
    return path


@given(
    kind=st.sampled_from(list(KINDS)),
    shape=st.tuples(st.integers(1, 3), st.integers(1, 5)),
    dtype=st.sampled_from([np.float32, np.float64]),
    gaps=st.booleans(),
    seed=st.integers(0, 99),
)
def test_all_comes_back(
    tmp_path_factory: pytest.TempPathFactory, kind: str, shape: tuple[int, int], dtype: type, gaps: bool, seed: int
) -> None:
    read, write = KINDS[kind]
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(shape).astype(dtype)
    series = series_of(*shape, values=values, valid=rng.random(shape) > 0.3 if gaps else None)
    path = tmp_path_factory.mktemp(kind) / f"a.{kind}"
    assert write(series, path) == ()
    (again,) = read(path).series
    if values.size > 1:  # a lone number has no precision of its own in a mat file
        assert again.values.dtype == dtype
    assert_close(again, series, rtol=0.0)


@pytest.mark.parametrize("kind", KINDS)
def test_several_rates(tmp_path: Path, kind: str) -> None:
    read, write = KINDS[kind]
    parts = [series_of(), series_of(count=1, sample_rate_hz=50.0, samples=7)]
    write(parts, tmp_path / f"a.{kind}")
    for found, expected in zip(read(tmp_path / f"a.{kind}").series, parts, strict=True):
        assert_close(found, expected, rtol=0.0)


def test_the_layout_is_what_the_manual_says(tmp_path: Path) -> None:
    series = series_of()
    write_mat(series, tmp_path / "a.mat")
    found = loadmat(tmp_path / "a.mat", simplify_cells=True)["series_1"]
    assert (found["fs"], list(found["units"])) == (1e3 / 3, ["m/s^2", "N", "1"])
    np.testing.assert_array_equal(found["values"], series.values.T)
    write_npz(series, tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as arrays:
        assert str(arrays["format"]) == "chladni.series/1"
        np.testing.assert_array_equal(arrays["series_1.values"], series.values.T)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("rate", [{"fs": 200.0}, {"Sample_Rate": np.int32(200)}, {"dt": 0.005}])
def test_foreign_arrays_with_a_rate(tmp_path: Path, kind: str, rate: dict[str, object]) -> None:
    matrix = np.arange(80.0).reshape(40, 2)
    path = save(tmp_path / f"a.{kind}", acc=matrix, force=np.arange(40), cal=np.arange(3.0), **rate)
    contents = KINDS[kind][0](path, units={"force": "kN"})
    (series,) = contents.series
    assert series.sample_rate_hz == pytest.approx(200.0, rel=1e-15)
    assert [channel.name for channel in series.channels] == ["acc[0]", "acc[1]", "force"]
    np.testing.assert_array_equal(series.values, [*matrix.T, np.arange(40) * 1000.0])
    assert series.channels[2].unit == "N"
    assert contents.unread == (("cal", "of 3 numbers beside 40 samples"),)
    assert contents.notes == (f"{path}: the sample rate is 200 Hz by {next(iter(rate))!r}.",)


@pytest.mark.parametrize("kind", KINDS)
def test_foreign_arrays_with_times(tmp_path: Path, kind: str) -> None:
    path = save(tmp_path / f"a.{kind}", t=np.arange(60) * 0.01, acc=np.arange(60.0))
    (series,) = KINDS[kind][0](path).series
    assert series.sample_rate_hz == pytest.approx(100.0, rel=1e-9)
    np.testing.assert_array_equal(series.values, [np.arange(60.0)])
    with pytest.raises(SetupError, match="its times run at 100 Hz, 3 Hz was given"):
        KINDS[kind][0](path, sample_rate_hz=3.0)


def test_foreign_structs(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"run": {"fs": 100.0, "sensor": {"acc": np.arange(5.0)}, "who": "me"}})
    (series,) = read_mat(tmp_path / "a.mat").series
    assert (series.channels[0].name, series.sample_rate_hz) == ("run.sensor.acc", 100.0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("arrays", "options", "error", "match"),
    [
        ({"acc": np.arange(9.0)}, {}, SetupError, r"nothing says the sample rate.*acc"),
        ({"acc": np.arange(9.0), "fs": -5.0}, {}, SetupError, "nothing says the sample rate"),
        ({"acc": np.arange(9.0), "fs": 5.0}, {"sample_rate_hz": 6.0}, SetupError, "says 5 Hz, 6 Hz was given"),
        ({"acc": np.arange(9.0), "fs": 5.0}, {"units": {"b": "N"}}, SetupError, "no channel 'b'"),
        ({"fs": 5.0}, {}, LogError, "no vector of numbers"),
        ({"t_s": np.array([0.0, 1e300]), "a": np.zeros(2)}, {}, LogError, "within 146 years"),
        ({"acc": np.arange(9.0), "fs": 5.0, "dt": 0.1}, {}, SetupError, "several sample rates, fs 5 Hz, dt 10 Hz"),
        ({"acc": np.arange(9.0), "dt": 5.0}, {}, SetupError, "nothing says the sample rate"),
    ],
)
def test_what_is_missing_is_said(
    tmp_path: Path,
    kind: str,
    arrays: dict[str, object],
    options: dict[str, object],
    error: type[Exception],
    match: str,
) -> None:
    path = save(tmp_path / f"a.{kind}", **arrays)
    with pytest.raises(error, match=match):
        KINDS[kind][0](path, **options)


def edited(path: Path, change: Callable[[dict[str, object]], object]) -> Path:
    write_npz(series_of(), path)
    with np.load(path) as arrays:
        content = dict(arrays)
    change(content)
    np.savez(path, **content)
    return path


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda c: c.pop("series_1.fs"), "has no 'fs'"),
        (lambda c: c.update({"series_1.fs": np.arange(2.0)}), "'fs' must be one number"),
        (lambda c: c.update({"series_1.fs": np.array(-1.0)}), "must be finite and positive"),
        (lambda c: c.update({"series_1.start_time_ns": np.array(np.nan)}), "146 years"),
        (lambda c: c.update({"series_1.units": np.array(["N"])}), "1 units for 3 channels"),
        (lambda c: c.update({"series_1.values": np.zeros(7)}), "'values' is float64"),
        (lambda c: c.update({"series_1.directions": np.zeros((2, 3))}), "directions of 2 channels"),
        (lambda c: c.update({"series_1.roles": np.array(["king"] * 3)}), "role 'king'"),
        (lambda c: c.update({"series_1.valid": np.zeros((3, 3))}), "valid has shape"),
    ],
)
def test_a_broken_layout_names_the_field(tmp_path: Path, change: Callable[..., object], match: str) -> None:
    with pytest.raises(LogError, match=match):
        read_npz(edited(tmp_path / "a.npz", change))


def test_objects_are_never_unpickled(tmp_path: Path) -> None:
    raw = io.BytesIO()
    np.lib.format.write_array_header_1_0(raw, {"descr": "|O", "fortran_order": False, "shape": (1,)})
    raw.write(pickle.dumps([1]))
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("a.npy", raw.getvalue())
    with pytest.raises(LogError, match="holds Python objects"):
        read_npz(tmp_path / "a.npz")


def test_an_array_that_announces_more_than_it_holds(tmp_path: Path) -> None:
    raw = io.BytesIO()
    np.lib.format.write_array_header_1_0(raw, {"descr": "<f8", "fortran_order": False, "shape": (10**15,)})
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("a.npy", raw.getvalue())
    with pytest.raises(LogError, match="announces 8000000000000000 bytes"):
        read_npz(tmp_path / "a.npz")


@pytest.mark.parametrize("kind", KINDS)
def test_bombs_are_refused_before_they_unpack(tmp_path: Path, kind: str) -> None:
    read, write = KINDS[kind]
    write(series_of(1, 200_000, values=np.zeros((1, 200_000))), tmp_path / f"a.{kind}")
    assert (tmp_path / f"a.{kind}").stat().st_size < 20_000
    with pytest.raises(LogError, match="raise max_bytes"):
        read(tmp_path / f"a.{kind}", max_bytes=1_000_000)
    assert read(tmp_path / f"a.{kind}", max_bytes=2_000_000).series[0].samples == 200_000


@pytest.mark.parametrize("kind", KINDS)
def test_garbage_is_one_line(tmp_path: Path, kind: str) -> None:
    (tmp_path / f"a.{kind}").write_bytes(b"not at all " * 30)
    with pytest.raises(LogError, match=r"can't be read|no mat file"):
        KINDS[kind][0](tmp_path / f"a.{kind}")


@pytest.mark.parametrize("kind", KINDS)
def test_every_cut_is_told_or_harmless(tmp_path: Path, kind: str) -> None:
    read, write = KINDS[kind]
    write(series_of(), tmp_path / f"a.{kind}")
    raw = (tmp_path / f"a.{kind}").read_bytes()
    for length in range(0, len(raw) - 1, 37):
        (tmp_path / f"cut.{kind}").write_bytes(raw[:length])
        with pytest.raises(LogError):
            read(tmp_path / f"cut.{kind}")


def nested(depth: int) -> bytes:
    inner = matrix(6, element(9, bytes(8)))
    for _ in range(depth):
        inner = matrix(1, inner)
    return inner


ONE = element(9, struct.pack("<d", 1.5))


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b"MATLAB 7.3 MAT-file".ljust(600), "HDF5 structure is damaged"),
        (mat_file(struct.pack("<II", 14, 10**6)), "claims 1000000 bytes"),
        (mat_file(struct.pack("<II", 15, 4) + b"junk"), "is damaged"),
        (mat_file(element(15, zlib.compress(bytes(1000))[:-8])), "ends too early"),
        (mat_file(element(14, bytes(8))), "numbers have the type 0"),
        (mat_file(matrix(6)), "an element is missing"),
        (mat_file(matrix(6, element(99, bytes(8)))), "numbers have the type 99"),
        (mat_file(matrix(6, element(9, bytes(7)))), "7 bytes are no whole count"),
        (mat_file(matrix(6, ONE, shape=(3, 1))), r"shape \(3, 1\) holds 1 numbers"),
        (mat_file(matrix(6, ONE, shape=(1,))), r"the shape \(1,\)"),
        (mat_file(matrix(6, ONE, shape=(-1, 1))), r"the shape \(-1, 1\)"),
        (mat_file(matrix(6, struct.pack("<II", 9, 2**31))), "an element claims 2147483648 bytes"),
        (mat_file(matrix(6, struct.pack("<HHI", 9, 8, 0))), "a small element claims 8 bytes"),
        (mat_file(matrix(1, shape=(2**30, 1))), "announces 1073741824 members"),
        (mat_file(matrix(1, ONE)), "has the type 9, which is no array"),
        (mat_file(matrix(2, element(5, struct.pack("<i", 0)), element(1, b"ab"))), "in pieces of 0"),
        (mat_file(matrix(4, element(99, b"abcd"))), "text has the type 99"),
        (mat_file(nested(40)), "more than 16 deep"),
    ],
)
def test_bad_mat_files(tmp_path: Path, content: bytes, match: str) -> None:
    (tmp_path / "a.mat").write_bytes(content)
    with pytest.raises(LogError, match=match):
        read_mat(tmp_path / "a.mat")


NUMBERS = element(9, np.arange(20.0).tobytes())
WHOLE = mat_file(matrix(6, NUMBERS, shape=(1, 20)))
NPY = (
    np.lib.format.magic(1, 0)
    + struct.pack("<H", 118)
    + (b"{'descr': '<f8', 'fortran_order': False, 'shape': (20,), }".ljust(117) + b"\n" + np.arange(20.0).tobytes())
)


@pytest.mark.parametrize(
    ("suffix", "content", "told"),
    [
        (".npy", NPY, None),
        (".npy", NPY + b"\x00", "1 byte at the end"),
        (".npy", NPY + b"\x01" * 9, "9 bytes at the end"),
        (".mat", WHOLE, None),
        (".mat", WHOLE + bytes(5), None),
        (".mat", WHOLE + b"\x00\x01\x00", "3 bytes at the end"),
        (".mat", WHOLE + element(1, b"\x00"), None),
        (".mat", WHOLE + element(1, b"\x00\x01"), "element 2"),
        (".mat", WHOLE + matrix(6, NUMBERS, bytes(8), shape=(1, 20)), None),
        (".mat", WHOLE + matrix(6, NUMBERS, element(9, b"\x01"), shape=(1, 20)), "variable 2"),
    ],
)
def test_bytes_that_belong_to_no_array_are_told(
    tmp_path: Path, suffix: str, content: bytes, told: str | None
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(content)
    contents = read_file(path, sample_rate_hz=1.0)
    np.testing.assert_array_equal(contents.series[0].values, [np.arange(20.0)])
    assert [name for name, _ in contents.unread] == ([] if told is None else [told])


def test_mat_elements_agree_with_scipy(tmp_path: Path) -> None:
    variables = {
        "whole": np.arange(6, dtype=np.int16).reshape(2, 3),
        "single": np.arange(3, dtype=np.float32),
        "cube": np.arange(24.0).reshape(2, 3, 4),
        "complex": np.array([1 + 2j, 3 - 1j]),
        "text": "Kraft µ",
        "cell": np.array(["a", "", "bcd"], dtype=object),
        "struct": {"a": 1.0, "b": {"c": np.arange(3.0)}},
        "flags": np.array([True, False]),
        "empty": np.empty((0, 0)),
    }
    for compressed in (False, True):
        savemat(tmp_path / "a.mat", variables, do_compression=compressed)
        found = read_mat_elements((tmp_path / "a.mat").read_bytes(), Budget(path=tmp_path, most=10**6))
        expected = loadmat(tmp_path / "a.mat", simplify_cells=True)
        assert list(found) == list(variables)
        for name in ("whole", "single", "cube", "complex", "flags"):
            np.testing.assert_array_equal(found[name], expected[name])
        assert (found["text"], found["cell"][2]) == (expected["text"], "bcd")
        np.testing.assert_array_equal(found["struct"]["b"]["c"], expected["struct"]["b"]["c"])
        assert found["empty"].size == 0


def test_big_endian_files_and_struct_arrays() -> None:
    budget = Budget(path=Path("a.mat"), most=100)
    dimensions = struct.pack(">II2i", 5, 8, 1, 2)
    body = struct.pack(">IIII", 6, 8, 7, 0) + dimensions + struct.pack(">HH4s", 1, 1, b"y\0\0\0")
    body += struct.pack(">II2f", 7, 8, 1.5, -2.0)
    big = b"MATLAB".ljust(124) + b"\x01\x00MI" + struct.pack(">II", 14, len(body)) + body
    np.testing.assert_array_equal(read_mat_elements(big, budget)["y"], [1.5, -2.0])
    rows = mat_file(
        matrix(
            2, element(5, struct.pack("<i", 4)), element(1, b"a\0\0\0"), matrix(6, ONE), matrix(6, ONE), shape=(1, 2)
        )
    )
    assert read_mat_elements(rows, budget) == {"x": [{"a": 1.5}, {"a": 1.5}]}


@pytest.mark.parametrize("kind", KINDS)
def test_wrong_bytes_never_crash(tmp_path: Path, kind: str) -> None:
    # Flipped bytes are refused in one line, or read as what they say; scipy's reader crashes Python on some.
    read, write = KINDS[kind]
    write(series_of(), tmp_path / f"a.{kind}")
    raw = (tmp_path / f"a.{kind}").read_bytes()
    if kind == "mat":
        savemat(tmp_path / "plain.mat", {"fs": 9.0, "acc": np.arange(9.0), "s": {"t": "x", "c": [1, "a"]}})
        raw = (tmp_path / "plain.mat").read_bytes()
    rng = np.random.default_rng(1)
    refused = 0
    for _ in range(150):
        changed = bytearray(raw)
        for place in rng.integers(0, len(raw), 2):
            changed[place] = rng.integers(256)
        (tmp_path / f"b.{kind}").write_bytes(changed)
        try:
            read(tmp_path / f"b.{kind}")
        except ChladniError:
            refused += 1
    assert refused > 25


def test_a_unit_beside_an_array_is_its_own(tmp_path: Path) -> None:
    path = tmp_path / "units.mat"
    rows = np.arange(20.0).reshape(10, 2)
    units = np.array(["g", "N"], dtype=object)
    tip, both = {"data": rows[:, 0], "fs": 50.0, "unit": "g"}, {"x": rows, "fs": 50.0, "units": units}
    savemat(path, {"tip": tip, "both": both})
    found = {
        channel.name: (channel.unit, values)
        for series in read_mat(path).series
        for channel, values in zip(series.channels, series.values, strict=True)
    }
    assert {name: unit for name, (unit, _) in found.items()} == {
        "tip.data": "m/s^2", "both.x[0]": "m/s^2", "both.x[1]": "N"
    }  # fmt: skip
    np.testing.assert_allclose(found["tip.data"][1], 9.80665 * rows[:, 0])
    np.testing.assert_array_equal(found["both.x[1]"][1], rows[:, 1])


def test_a_unit_that_is_none_or_nobodys_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "strange.mat"
    row = np.arange(10.0)
    two = {"a": row, "b": row, "fs": 50.0, "unit": "g"}
    savemat(path, {"run": {"data": row, "fs": 50.0, "unit": "volts-ish"}, "two": two})
    contents = read_mat(path)
    assert {channel.unit for series in contents.series for channel in series.channels} == {"1"}
    assert contents.unread == (("run.unit", "'volts-ish' is no unit that is known"),)
