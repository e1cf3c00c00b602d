"""What only MATLAB reads costs nothing else; structs, cells and version 7.3."""

import struct
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from chladni.io.files.mat import read_mat
from chladni.signals.errors import ChladniError, LogError, SetupError
from tests.io.files.mat_bytes import element, mat_file, matrix

SAMPLES = 60
SIGNAL = np.sin(np.arange(SAMPLES))


def numbers(name: str, values: np.ndarray) -> bytes:
    return matrix(6, element(9, values.astype("<f8").tobytes()), shape=(len(values), 1), name=name.encode())


def opaque(name: str, kind: str) -> bytes:
    """An object of a class of MATLAB's own: no shape, but the class in words."""
    flags = element(6, struct.pack("<II", 17, 0))
    reference = matrix(13, element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1)), shape=(6, 1), name=b"")
    return element(
        14, flags + element(1, name.encode()) + element(1, b"MCOS") + element(1, kind.encode()) + reference
    )


def test_objects_of_matlab_cost_nothing_else(tmp_path: Path) -> None:
    kinds = ("string", "datetime", "timetable", "containers.Map")
    objects = [opaque(f"o{number}", kind) for number, kind in enumerate(kinds)]
    (tmp_path / "a.mat").write_bytes(
        mat_file(objects[0], numbers("fs", np.array([200.0])), *objects[1:], numbers("x", SIGNAL))
    )
    contents = read_mat(tmp_path / "a.mat")
    (series,) = contents.series
    assert (series.sample_rate_hz, series.channels[0].name) == (200.0, "x")
    np.testing.assert_array_equal(series.values[0], SIGNAL)
    expected = [(f"o{number}", f"a {kind} of MATLAB, which only MATLAB reads") for number, kind in enumerate(kinds)]
    assert contents.unread == tuple(expected)


def test_an_object_that_may_have_held_the_times_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_bytes(mat_file(opaque("when", "datetime"), numbers("x", SIGNAL)))
    with pytest.raises(SetupError, match=r"give the sample rate .*'when' isn't read: a datetime of MATLAB"):
        read_mat(tmp_path / "a.mat")


def test_a_damaged_variable_costs_nothing_else(tmp_path: Path) -> None:
    bad = matrix(6, element(99, bytes(8)), name=b"bad")
    (tmp_path / "a.mat").write_bytes(mat_file(numbers("fs", np.array([200.0])), bad, numbers("x", SIGNAL)))
    contents = read_mat(tmp_path / "a.mat")
    assert contents.series[0].samples == SAMPLES
    assert contents.unread == (("variable 2", "numbers have the type 99, which is none"),)
    # The last one is cut off, as by a full disk.
    whole = mat_file(numbers("fs", np.array([200.0])), numbers("x", SIGNAL), numbers("y", SIGNAL))
    (tmp_path / "a.mat").write_bytes(whole[:-100])
    contents = read_mat(tmp_path / "a.mat")
    assert [channel.name for channel in contents.series[0].channels] == ["x"]
    assert "it's cut short" in contents.unread[0][1]


def hdf5(path: Path, content: dict[str, object]) -> None:
    """Write a file as MATLAB's version 7.3 does."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            put(file, file, name, value)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + struct.pack("<H", 0x0200) + b"IM")


def put(file: h5py.File, group: h5py.Group, name: str, value: object) -> None:
    if isinstance(value, dict):
        member = group.create_group(name)
        member.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, part in value.items():
            put(file, member, field, part)
    elif isinstance(value, list):
        references = file.require_group("#refs#")
        places = []
        for part in value:
            own = f"r{len(references)}"
            put(file, references, own, part)
            places.append(references[own].ref)
        member = group.create_dataset(name, data=np.array(places, dtype=h5py.ref_dtype).reshape(1, -1))
        member.attrs["MATLAB_class"] = np.bytes_("cell")
    elif isinstance(value, str):
        codes = np.array([[ord(letter)] for letter in value], dtype=np.uint16)
        member = group.create_dataset(name, data=codes)
        member.attrs["MATLAB_class"] = np.bytes_("char")
    elif isinstance(value, bytes):
        member = group.create_dataset(name, data=np.array([[0xDD000000, 2, 1, 1, 1, 1]], dtype=np.uint32))
        member.attrs["MATLAB_class"] = np.bytes_(value)
        member.attrs["MATLAB_object_decode"] = 3
    else:
        # MATLAB's columns are HDF5's rows.
        array = np.atleast_2d(np.asarray(value, dtype=float))
        chunks = {"chunks": True, "compression": "gzip"} if array.size > 1 else {}
        member = group.create_dataset(name, data=array.T, **chunks)
        member.attrs["MATLAB_class"] = np.bytes_("double")


WRITERS: dict[str, Callable[[Path, dict[str, object]], None]] = {"5": savemat, "7.3": hdf5}


@pytest.mark.parametrize("version", WRITERS)
def test_both_versions_hold_the_same(tmp_path: Path, version: str) -> None:
    content = {"fs": 200.0, "x": SIGNAL.reshape(-1, 1), "run": {"force": SIGNAL * 2}, "who": "me", "m": np.eye(4)}
    WRITERS[version](tmp_path / "a.mat", content)
    contents = read_mat(tmp_path / "a.mat", units={"run.force": "kN"})
    series = contents.series[0].select(["x", "run.force"])
    assert [channel.unit for channel in series.channels] == ["1", "N"]
    np.testing.assert_allclose(series.values, [SIGNAL, SIGNAL * 2000], rtol=1e-15)
    assert contents.unread == (("m", "of 16 numbers beside 60 samples"),)


@pytest.mark.parametrize("version", WRITERS)
def test_each_struct_has_its_own_times(tmp_path: Path, version: str) -> None:
    fast, slow = np.arange(100) / 100, np.arange(40) / 10
    content = {
        "acc": {"time": fast, "x": np.sin(fast), "bias": np.arange(3.0)},
        "temp": {"time": slow, "x": np.cos(slow)},
        "daq": {"fs": 50.0, "x": SIGNAL},
        "outside": np.arange(40.0),
    }
    WRITERS[version](tmp_path / "a.mat", content)
    contents = read_mat(tmp_path / "a.mat")
    found = {channel.name: one.sample_rate_hz for one in contents.series for channel in one.channels}
    assert found == {
        "acc.x": pytest.approx(100.0, rel=1e-9),
        "temp.x": pytest.approx(10.0, rel=1e-9),
        "outside": pytest.approx(10.0, rel=1e-9),
        "daq.x": 50.0,
    }
    assert len(contents.series) == 3
    assert contents.unread == (("acc.bias", "of 3 numbers beside 100 samples"),)


@pytest.mark.parametrize("version", WRITERS)
def test_structs_without_times_cost_nothing_else(tmp_path: Path, version: str) -> None:
    WRITERS[version](tmp_path / "a.mat", {"a": {"t": np.arange(60) * 5, "x": SIGNAL}, "b": {"fs": 50.0, "x": SIGNAL}})
    contents = read_mat(tmp_path / "a.mat")
    assert [channel.name for series in contents.series for channel in series.channels] == ["b.x"]
    assert [name for name, _ in contents.unread] == ["a.t", "a.x"]
    assert "0.2 Hz if they count seconds" in contents.unread[0][1]


@pytest.mark.parametrize("version", WRITERS)
def test_cells_of_vectors(tmp_path: Path, version: str) -> None:
    cell = np.empty(2, dtype=object)
    cell[:] = [SIGNAL, SIGNAL * 2]
    WRITERS[version](tmp_path / "a.mat", {"fs": 200.0, "c": cell if version == "5" else list(cell), "names": "a"})
    (series,) = read_mat(tmp_path / "a.mat").series
    assert [channel.name for channel in series.channels] == ["c[0]", "c[1]"]
    np.testing.assert_array_equal(series.values, [SIGNAL, SIGNAL * 2])


def test_a_cell_of_unlike_members(tmp_path: Path) -> None:
    cell = np.empty(4, dtype=object)
    cell[:] = [SIGNAL, "text", np.eye(3), 1.0]
    savemat(tmp_path / "a.mat", {"c": cell})
    with pytest.raises(SetupError, match="give the sample rate"):
        read_mat(tmp_path / "a.mat")
    contents = read_mat(tmp_path / "a.mat", sample_rate_hz=200.0)
    assert [channel.name for channel in contents.series[0].channels] == ["c[0]"]
    assert contents.unread == (("c[2]", "of 9 numbers beside 60 samples"),)


def test_arrays_of_structs_as_simulink_logs_them(tmp_path: Path) -> None:
    signals = np.empty(2, dtype=[("values", object), ("label", object)])
    signals[0], signals[1] = (SIGNAL, "a"), (SIGNAL * 2, "b")
    savemat(tmp_path / "a.mat", {"data": {"time": np.arange(SAMPLES) / 200, "signals": signals}})
    (series,) = read_mat(tmp_path / "a.mat").series
    assert [channel.name for channel in series.channels] == ["data.signals[0].values", "data.signals[1].values"]
    assert series.sample_rate_hz == pytest.approx(200.0, rel=1e-9)


def test_version_73_leaves_out_what_only_matlab_reads(tmp_path: Path) -> None:
    hdf5(tmp_path / "a.mat", {"fs": 200.0, "label": b"string", "x": SIGNAL, "when": b"datetime"})
    with h5py.File(tmp_path / "a.mat", "r+") as file:
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "/")
        file["loop"] = h5py.SoftLink("/")
        file.create_dataset("z", data=np.zeros(SAMPLES, dtype=[("real", "<f8"), ("imag", "<f8")]))
        file.create_dataset(
            "far", shape=(SAMPLES,), dtype="<f8", external=[(str(tmp_path / "b.raw"), 0, 8 * SAMPLES)]
        )
        file.create_dataset("huge", shape=(10**9,), dtype="<f8", chunks=(10**6,))
        file["self"] = file["/"]
    contents = read_mat(tmp_path / "a.mat")
    assert [channel.name for series in contents.series for channel in series.channels] == ["x"]
    reasons = dict(contents.unread)
    assert reasons["label"] == "a string of MATLAB, which only MATLAB reads"
    assert reasons["when"].startswith("a datetime of MATLAB")
    assert "isn't followed" in reasons["elsewhere"]
    assert "isn't followed" in reasons["loop"]
    assert "complex" in reasons["z"]
    assert "another file" in reasons["far"]
    assert "in itself" in reasons["self"]
    assert "announces 8000000000 bytes and holds 0" in reasons["huge"]


def test_version_73_is_bounded(tmp_path: Path) -> None:
    hdf5(tmp_path / "a.mat", {"fs": 200.0, "x": np.zeros(100_000)})
    with pytest.raises(
        LogError, match=r"takes 800008 bytes in memory or more, 100000 are allowed; .*raise max_bytes"
    ):
        read_mat(tmp_path / "a.mat", max_bytes=100_000)
    assert read_mat(tmp_path / "a.mat", max_bytes=1_000_000).series[0].samples == 100_000


def test_version_73_without_h5py_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hdf5(tmp_path / "a.mat", {"fs": 200.0, "x": SIGNAL})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(
        LogError, match=r"pip install 'chladni\[io\]', or save the file in MATLAB with save\('a.mat', '-v7'\)"
    ):
        read_mat(tmp_path / "a.mat")


@pytest.mark.nightly
def test_wrong_bytes_in_version_73_never_crash(tmp_path: Path) -> None:
    hdf5(tmp_path / "a.mat", {"fs": 200.0, "x": SIGNAL, "s": {"t": "x", "c": [SIGNAL, "a"]}})
    raw = (tmp_path / "a.mat").read_bytes()
    rng = np.random.default_rng(1)
    refused = 0
    for _ in range(150):
        changed = bytearray(raw)
        for place in rng.integers(0, len(raw), 8):
            changed[place] = rng.integers(256)
        (tmp_path / "b.mat").write_bytes(changed)
        try:
            read_mat(tmp_path / "b.mat")
        except ChladniError:
            refused += 1
    assert refused > 10


@pytest.mark.parametrize("version", WRITERS)
def test_rates_of_several_structs_that_differ_are_asked_about(tmp_path: Path, version: str) -> None:
    WRITERS[version](tmp_path / "a.mat", {"a": {"fs": 100.0}, "b": {"fs": 200.0}, "x": SIGNAL})
    with pytest.raises(SetupError, match=r"several sample rates, a.fs 100 Hz, b.fs 200 Hz; give the right one"):
        read_mat(tmp_path / "a.mat")
    assert read_mat(tmp_path / "a.mat", sample_rate_hz=100.0).series[0].sample_rate_hz == 100.0
