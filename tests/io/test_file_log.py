"""Data files as logs: every kind through the one opener, with windows, names, grids, setup and soundness."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import feather, parquet
from scipy.io import savemat, wavfile

import chladni
from chladni.io.convert import convert
from chladni.io.file_log import FileLog
from chladni.io.files.npz import write_npz
from chladni.io.files.uff import write_uff
from chladni.io.mcap.writer import write_mcap
from chladni.io.mcap_log import McapLog
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

RATE_HZ, SAMPLES = 200.0, 400
NAMES = ("force", "tip")
UNITS = {"force": "N", "tip": "m/s^2"}


def truth() -> np.ndarray:
    """Force, and a tip that follows it: exact in single precision, so that every kind can hold it."""
    force = np.round(64 * np.random.default_rng(3).standard_normal(SAMPLES)) / 64
    return np.stack([force, 2 * np.roll(force, 3)])


def series(**fields: object) -> TimeSeries:
    channels = tuple(Channel(name=name, unit=UNITS[name]) for name in NAMES)
    known = {"values": truth(), "sample_rate_hz": RATE_HZ, "channels": channels}
    return TimeSeries(**(known | fields))


def table(path: Path, *, times: bool = True, header: str = "force [N],tip [m/s^2]") -> Path:
    columns = truth().T
    if times:
        columns, header = np.column_stack([np.arange(SAMPLES) / RATE_HZ, columns]), f"time [s],{header}"
    np.savetxt(path, columns, delimiter=",", header=header, comments="", fmt="%.17g")
    return path


def _wav(path: Path) -> None:
    wavfile.write(path, int(RATE_HZ), truth().T.astype(np.float32))


def _mat(path: Path) -> None:
    savemat(path, {"fs": RATE_HZ, "force": truth()[0], "tip": truth()[1]})


def _npz(path: Path) -> None:
    np.savez(path, t=np.arange(SAMPLES) / RATE_HZ, force=truth()[0], tip=truth()[1])


def _uff(path: Path) -> None:
    write_uff(series(), path)


def _npy(path: Path) -> None:
    structured = np.zeros(SAMPLES, dtype=[("force", float), ("tip", float)])
    structured["force"], structured["tip"] = truth()
    np.save(path, structured)


def _parquet(path: Path) -> None:
    stamps = (np.arange(SAMPLES) * 5_000_000).astype("datetime64[ns]")
    parquet.write_table(pa.table({"time": stamps, "force": truth()[0], "tip": truth()[1]}), path)


def _feather(path: Path) -> None:
    table = pa.table({"time": np.arange(SAMPLES) / RATE_HZ, "force [N]": truth()[0], "tip [m/s^2]": truth()[1]})
    feather.write_feather(table, str(path))


def _tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="TDMS files are read with the extra 'io'")
    rate = {"wf_increment": 1 / RATE_HZ, "wf_samples": SAMPLES}
    channels = [
        nptdms.ChannelObject("run", name, row, properties=rate | {"unit_string": UNITS[name]})
        for name, row in zip(NAMES, truth(), strict=True)
    ]
    with nptdms.TdmsWriter(str(path)) as writer:
        writer.write_segment(channels)


def _lvm(path: Path) -> None:
    head = "LabVIEW Measurement\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tOne\n***End_of_Header***\n\n"
    head += f"Channels\t2\nSamples\t{SAMPLES}\t{SAMPLES}\nY_Unit_Label\tN\tm/s^2\nX0\t0\t0\nDelta_X\t0.005\t0.005\n"
    rows = zip(np.arange(SAMPLES) / RATE_HZ, *truth(), strict=True)
    body = "".join(f"{time!r}\t{force!r}\t{tip!r}\n" for time, force, tip in np.array(list(rows)).tolist())
    path.write_text(f"{head}***End_of_Header***\nX_Value\tforce\ttip\tComment\n{body}")


#: Kind, what makes one, options that it takes for it to be read, whether its times are a column.
KINDS: list[tuple[str, Callable[[Path], object], dict[str, object], bool]] = [
    ("csv", table, {}, True),
    ("csv", lambda path: table(path, times=False), {"sample_rate_hz": RATE_HZ}, False),
    ("wav", _wav, {"names": NAMES, "units": UNITS}, False),
    ("mat", _mat, {"units": UNITS}, False),
    ("npz", _npz, {"units": UNITS}, True),
    ("npz", lambda path: write_npz(series(), path), {}, False),
    ("uff", _uff, {}, False),
    ("npy", _npy, {"units": UNITS, "sample_rate_hz": RATE_HZ}, False),
    ("parquet", _parquet, {"units": UNITS}, True),
    ("feather", _feather, {}, True),
    ("tdms", _tdms, {}, False),
    ("lvm", _lvm, {}, True),
]


@pytest.mark.parametrize(("kind", "make", "options", "by_column"), KINDS)
def test_every_kind_is_a_log(
    tmp_path: Path, kind: str, make: Callable[[Path], object], options: dict[str, object], by_column: bool
) -> None:
    make(tmp_path / f"a.{kind}")
    with chladni.open(tmp_path / f"a.{kind}", **options) as log:
        assert [(one.name, one.unit) for one in log.channels] == list(UNITS.items())
        # A force excites, as in a log of messages.
        assert [one.role for one in log.channels] == ["reference", "response"]
        read, info = log.read(), log.info()
    np.testing.assert_array_equal(read.values, truth())
    assert read.sample_rate_hz == pytest.approx(RATE_HZ, rel=1e-9)
    document = info.to_json()
    assert document["duration_s"] == pytest.approx(2.0, rel=1e-9)
    assert (document["damage"], document["unread"], document.get("functions")) == ([], [], None)
    for channel in document["channels"]:
        assert channel["encoding"] == kind
        assert channel["stamp"] == ("column" if by_column else "rate")
        assert channel["samples"] == SAMPLES
        assert channel["rate_hz"] == pytest.approx(RATE_HZ, rel=1e-9)
        assert (channel["gaps"], channel["duplicates"], channel["clipped"]) == ([], 0, 0)
        assert channel["jitter_s"] == (pytest.approx(0, abs=1e-9) if by_column else None)


@pytest.mark.parametrize(("kind", "make", "options", "by_column"), KINDS)
def test_a_log_made_of_it_gives_the_same(
    tmp_path: Path, kind: str, make: Callable[[Path], object], options: dict[str, object], by_column: bool
) -> None:
    make(tmp_path / f"a.{kind}")
    convert(tmp_path / f"a.{kind}", tmp_path / "a.mcap", reading=options)
    with chladni.open(tmp_path / f"a.{kind}", **options) as file, chladni.open(tmp_path / "a.mcap") as log:
        assert (type(file), type(log)) == (FileLog, McapLog)
        ours, theirs = file.read(start_s=0.5, end_s=1.25), log.read(start_s=0.5, end_s=1.25)
    np.testing.assert_array_equal(ours.values, theirs.values)
    assert ours.start_time_ns == theirs.start_time_ns
    assert [one.role for one in ours.channels] == [one.role for one in theirs.channels]


# --- what a file is ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "make", "options", "by_column"), KINDS)
@pytest.mark.parametrize("name", ["a.bag", "noname", "a.mcap", "a.csv", "a.mat", "a.wav"])
def test_the_content_tells_the_kind(
    tmp_path: Path, kind: str, make: Callable[[Path], object], options: dict[str, object], by_column: bool, name: str
) -> None:
    make(tmp_path / f"true.{kind}")
    shutil.copy(tmp_path / f"true.{kind}", tmp_path / name)
    with chladni.open(tmp_path / name, **options) as log:
        np.testing.assert_array_equal(log.read().values, truth())
        told = [note for note in log.notes if "by its content" in note]
    lies = Path(name).suffix != f".{kind}"
    found = {"csv": "txt", "feather": "arrow"}.get(kind, kind)
    note = f"read as a .{found} file by its content; its suffix is {Path(name).suffix!r}."
    assert told == ([note] if lies else [])


@pytest.mark.parametrize("name", ["a.bag", "a.csv", "a.wav", "a.log", "noname"])
def test_an_mcap_log_is_one_under_any_name(tmp_path: Path, name: str) -> None:
    write_mcap([series()], tmp_path / "a.mcap")
    shutil.copy(tmp_path / "a.mcap", tmp_path / name)
    with chladni.open(tmp_path / name) as log:
        assert isinstance(log, McapLog)
        np.testing.assert_array_equal(log.read().values, truth())
        told = [note for note in log.notes if "by its content" in note]
    suffix = Path(name).suffix
    assert told == ([f"read as a .mcap file by its content; its suffix is {suffix!r}."] if suffix else [])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "the file is empty"),
        (b"#ROSBAG V2.0\n" + bytes(50), "a ROS 1 bag"),
        (b"\x1f\x8b" + bytes(50), "compressed with gzip"),
        (b"PK\x03\x04" + bytes(50), "save the other as CSV"),
        (b"\xd0\xcf\x11\xe0" + bytes(50), "save it as CSV"),
        (b"\x89HDF\r\n\x1a\n" + bytes(50), "an HDF5 file"),
        (b"nothing to see\nin these lines\n", "not an MCAP log"),
        (bytes(range(256)) * 4, "not an MCAP log"),
    ],
)
def test_what_is_no_kind_that_is_read_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    for name in ("a.dat", "a.csv") if content.startswith(b"P") else ("a.dat",):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(LogError, match=words):
            chladni.open(tmp_path / name)
    with pytest.raises(LogError, match="No such file"):
        chladni.open(tmp_path / "none.dat")


def test_the_older_name_opens_the_same(tmp_path: Path) -> None:
    with chladni.open_log(table(tmp_path / "a.csv")) as log:
        np.testing.assert_array_equal(log.read().values, truth())


# --- parts -------------------------------------------------------------------------------------------------------


def test_seconds_count_from_the_earliest_sample(tmp_path: Path) -> None:
    late = series(values=truth()[:1], channels=(Channel(name="late"),), start_time_ns=10**9)
    write_npz([late, series(values=truth()[:1, :100], channels=(Channel(name="early"),), sample_rate_hz=50.0)],
              tmp_path / "a.npz")  # fmt: skip
    with chladni.open(tmp_path / "a.npz") as log:
        assert log.start_time_ns == 0
        read = log.read(["late"], start_s=1.5, end_s=2.0)
        np.testing.assert_array_equal(read.values, truth()[:1, 100:200])
        assert read.start_time_ns == 1_500_000_000
        groups = log.read_groups(start_s=0.5, end_s=1.25)
        assert [part.samples for part in groups] == [50, 38]
        with pytest.raises(LogError, match=r"a\.npz: channels have 2 different sampling grids"):
            log.read()
        both = log.read(["early", "late"], sample_rate_hz=50.0)
        assert [one.name for one in both.channels] == ["early", "late"]


@pytest.mark.parametrize(
    ("start_s", "end_s", "words"),
    [
        (
            3.0,
            None,
            r"force, tip has no sample between 3\.0 s and its end \(the log ends at 1\.9\d+ s; begin before that\)",
        ),
        (None, -1.0, r"no sample between 0\.0 s and -1\.0 s \(the log begins at 0 s; end after that\)"),
        (1.0, 1.0, "the window from 1.0 s to 1.0 s is empty"),
        (float("nan"), None, "time nan s must be finite"),
    ],
)
def test_windows_without_samples_are_told(tmp_path: Path, start_s: float, end_s: float, words: str) -> None:
    with chladni.open(table(tmp_path / "a.csv")) as log, pytest.raises(LogError, match=words):
        log.read(["force", "tip"], start_s=start_s, end_s=end_s)


def test_a_single_sample_is_no_signal(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time [s],x\n0.0,1.0\n")
    with pytest.raises(LogError, match=r"a\.csv: one row alone has a time, .* record longer"):
        chladni.open(tmp_path / "a.csv")


def test_channels_come_in_the_order_asked_for(tmp_path: Path) -> None:
    with chladni.open(table(tmp_path / "a.csv")) as log:
        assert [one.name for one in log.read(["tip", "force", "tip"]).channels] == ["tip", "force"]
        assert log.names(["tip"]) == ("tip",)
        with pytest.raises(LogError, match=r"a\.csv: no channel 'ti'; did you mean tip\?"):
            log.read(["ti"])
        with pytest.raises(LogError, match="no channel is asked for"):
            log.read([])


@pytest.mark.parametrize("seconds", [0.3, 0.005, 50.0])
def test_blocks_are_the_whole(tmp_path: Path, seconds: float) -> None:
    with chladni.open(table(tmp_path / "a.csv")) as log:
        blocks = list(log.blocks(seconds=seconds, start_s=0.25))
        whole = log.read(start_s=0.25)
        (grid,) = log.grids(start_s=0.25)
        with pytest.raises(LogError, match="must be finite and positive"):
            log.blocks(seconds=0)
    np.testing.assert_array_equal(np.concatenate([one.values for one in blocks], axis=1), whole.values)
    assert blocks[-1].times_ns()[-1] == whole.times_ns()[-1]
    assert (grid.names, grid.samples, grid.start_time_ns) == (NAMES, whole.samples, whole.start_time_ns)


def test_records_of_one_clock_share_a_grid(tmp_path: Path) -> None:
    # The tip began three samples later and ended earlier, as when each record is trimmed by itself.
    force = series(values=truth()[:1], channels=(Channel(name="force", unit="N"),))
    tip = series(values=truth()[1:, 3:390], channels=(Channel(name="tip"),), start_time_ns=15_000_000)
    write_uff([force, tip], tmp_path / "a.uff")
    with chladni.open(tmp_path / "a.uff") as log:
        read = log.read()
        np.testing.assert_array_equal(read.values[0], truth()[0])
        np.testing.assert_array_equal(read.values[1, 3:390], truth()[1, 3:390])
        assert read.valid is not None
        assert read.valid[1].sum() == 387
        # Alone it is whole.
        assert log.read(["tip"]).samples == 387


def test_records_between_the_samples_of_others_do_not(tmp_path: Path) -> None:
    between = series(values=truth()[:1], channels=(Channel(name="b"),), start_time_ns=2_500_000)
    write_npz([series(values=truth()[:1], channels=(Channel(name="a"),)), between], tmp_path / "a.npz")
    with chladni.open(tmp_path / "a.npz") as log, pytest.raises(LogError, match=r"2\.5 ms after those of the first"):
        log.read()


# --- soundness ---------------------------------------------------------------------------------------------------


def test_gaps_and_missing_samples_of_a_table_are_told(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv")
    lines = path.read_text().splitlines()
    lines[301] = lines[301].rpartition(",")[0] + ","
    path.write_text("\n".join(lines[:101] + lines[121:]) + "\n")
    with chladni.open(path) as log:
        document = log.info().to_json()
    force, tip = document["channels"]
    assert (force["samples"], tip["samples"]) == (380, 379)
    assert force["gaps"] == [[pytest.approx(0.495), pytest.approx(0.6)]]
    assert any("tip: 1 of 400 samples not a number" in finding for finding in document["findings"])


def test_a_gap_of_a_file_without_times_is_told(tmp_path: Path) -> None:
    valid = np.ones((2, SAMPLES), dtype=bool)
    valid[:, 100:120] = False
    write_npz(series(valid=valid), tmp_path / "a.npz")
    with chladni.open(tmp_path / "a.npz") as log:
        (force, _) = log.info().to_json()["channels"]
    assert (force["stamp"], force["samples"]) == ("rate", 380)
    assert force["gaps"] == [[pytest.approx(0.495), pytest.approx(0.6)]]


def test_a_clipped_channel_is_told(tmp_path: Path) -> None:
    time_s = np.arange(2000) / 200
    wave = np.clip(np.sin(2 * np.pi * 3 * time_s), -0.7, 0.7)
    np.savez(tmp_path / "a.npz", fs=200.0, wave=wave)
    with chladni.open(tmp_path / "a.npz", units={"wave": "V"}) as log:
        info = log.info()
    assert info.channels[0].clipped == int((np.abs(wave) == 0.7).sum())
    assert any(finding.startswith("wave: ") for finding in info.findings)
    assert log.info() is info


def test_a_channel_without_unit_is_told(tmp_path: Path) -> None:
    with chladni.open(table(tmp_path / "a.csv", header="force,tip [V]")) as log:
        assert log.info().findings[-1] == "the log gives no unit for force; a setup file can"


# --- options and setup -------------------------------------------------------------------------------------------

SETUP = """format = "chladni.setup/1"
[[point]]
name = "end"
position = [1.0, 0.0, 0.0]
[[point]]
name = "root"
position = [0.0, 0.0, 0.0]
[[line]]
points = ["root", "end"]
[[channel]]
path = "tip"
point = "end"
direction = "-z"
unit = "g"
range = "50 g"
"""
MISSPELT = SETUP.replace('"tip"', '"tipp"')


def setup_file(folder: Path, text: str = SETUP) -> Path:
    (folder / "setup.toml").write_text(text)
    return folder / "setup.toml"


@pytest.mark.parametrize(("kind", "make", "options", "by_column"), [KINDS[0], *KINDS[2:]])
def test_a_setup_file_refines_channels(
    tmp_path: Path, kind: str, make: Callable[[Path], object], options: dict[str, object], by_column: bool
) -> None:
    make(tmp_path / f"a.{kind}")
    known = {name: option for name, option in options.items() if name != "units"}
    with chladni.open(tmp_path / f"a.{kind}", setup=setup_file(tmp_path), **known) as log:
        tip = log.channels[1]
        read = log.read(["tip"])
        geometry = log.geometry
    assert (tip.unit, tip.point, tip.direction, tip.overload) == ("m/s^2", "end", (0, 0, -1), pytest.approx(490.3325))
    # The numbers in the file are in g, whatever its title says.
    np.testing.assert_allclose(read.values[0], 9.80665 * truth()[1], rtol=np.finfo(read.values.dtype).eps)
    assert [point.name for point in geometry.points] == ["end", "root"]
    assert geometry.lines == (("root", "end"),)


def test_a_sensitivity_turns_volts_into_what_was_measured(tmp_path: Path) -> None:
    text = SETUP.replace('unit = "g"\n', 'sensitivity = "100 mV/g"\n').replace('range = "50 g"\n', "")
    path = table(tmp_path / "a.csv", header="force [N],tip [mV]")
    with chladni.open(path, setup=setup_file(tmp_path, text)) as log:
        (tip,) = log.read(["tip"]).channels
        np.testing.assert_allclose(log.read(["tip"]).values[0], 9.80665e-2 * truth()[1], rtol=1e-12)
    assert tip.unit == "m/s^2"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MISSPELT, r"setup\.toml:\d+: \[\[channel\]\] path: a\.csv has no channel 'tipp'; did you mean tip\?"),
        (MISSPELT.replace('unit = "g"', "").replace('range = "50 g"', ""), r"'tipp'; did you mean tip\?"),
        (SETUP.replace('"50 g"', '"50 V"'), "tip range: it is in V"),
        (SETUP + '[[batch]]\ntopic = "/x"\nsamples = "s"\nrate = "r"\nnames = ["a"]\n', "a.csv holds no messages"),
    ],
)
def test_a_setup_file_that_does_not_fit_is_told(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(SetupError, match=words):
        chladni.open(table(tmp_path / "a.csv"), setup=setup_file(tmp_path, text))


def test_options_that_mean_nothing_are_refused(tmp_path: Path) -> None:
    write_mcap([series()], tmp_path / "a.mcap")
    with pytest.raises(SetupError, match=r"--stamp\) chooses among the times of messages"):
        chladni.open(table(tmp_path / "a.csv"), stamp="log")
    with pytest.raises(SetupError, match="has no option 'colour'"):
        chladni.open(tmp_path / "a.csv", colour=1)
    with pytest.raises(SetupError, match=r"a\.mcap: time_unit is for data files"):
        chladni.open(tmp_path / "a.mcap", time_unit="ms")
