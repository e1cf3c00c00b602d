"""TDMS files as LabVIEW writes them, made by nptdms."""

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from chladni.io.files.tdms import read_tdms
from chladni.signals.errors import ChladniError, LogError, SetupError

SAMPLES = 60
SIGNAL = np.sin(np.arange(SAMPLES))
START = np.datetime64("2024-05-01T12:00:00.250000")
START_NS = 1_714_564_800_250_000_000


def waveform(step: float = 0.005, **properties: object) -> dict[str, object]:
    return {"wf_increment": step, "wf_start_time": START, "wf_start_offset": 0.0, "wf_samples": SAMPLES} | properties


def written(path: Path, *channels: tuple[str, str, np.ndarray, dict[str, object]], segments: int = 1) -> Path:
    with TdmsWriter(path) as writer:
        for _ in range(segments):
            writer.write_segment([ChannelObject(*channel) for channel in channels])
    return path


def test_waveforms_with_unit_rate_and_start(tmp_path: Path) -> None:
    path = written(
        tmp_path / "a.tdms",
        ("daq", "acc", SIGNAL, waveform(1 / 51200, unit_string="g")),
        ("daq", "force", SIGNAL * 2, waveform(1 / 51200, unit_string="kN", wf_start_offset=0.5)),
        ("daq", "slow", SIGNAL, waveform(0.1, wf_start_time=np.datetime64("1904-01-01T00:00:00"))),
        segments=3,
    )
    contents = read_tdms(path)
    found = {channel.name: (series, channel) for series in contents.series for channel in series.channels}
    series, channel = found["acc"]
    assert (series.sample_rate_hz, series.start_time_ns, series.samples) == (51200.0, START_NS, 3 * SAMPLES)
    assert channel.unit == "m/s^2"
    np.testing.assert_allclose(series.values[0], np.tile(SIGNAL, 3) * 9.80665, rtol=1e-15)
    assert found["force"][0].start_time_ns == START_NS + 500_000_000
    # LabVIEW's clock begins in 1904: a start there is none.
    assert (found["slow"][0].sample_rate_hz, found["slow"][0].start_time_ns) == (10.0, 0)
    assert (contents.notes, contents.unread) == ((), ())


def test_channels_beside_a_clock(tmp_path: Path) -> None:
    stamps = START + np.arange(SAMPLES) * np.timedelta64(5, "ms")
    path = written(tmp_path / "a.tdms", ("daq", "when", stamps, {}), ("daq", "acc", SIGNAL, {"unit_string": "g"}))
    contents = read_tdms(path)
    (series,) = contents.series
    assert [channel.name for channel in series.channels] == ["acc"]
    assert series.sample_rate_hz == pytest.approx(200.0, rel=1e-9)
    assert series.start_time_ns == pytest.approx(START_NS, abs=1000)
    path = written(tmp_path / "b.tdms", ("daq", "Time_ms", np.arange(SAMPLES) * 5, {}), ("daq", "acc", SIGNAL, {}))
    assert read_tdms(path).series[0].sample_rate_hz == pytest.approx(200.0, rel=1e-9)


def test_a_clock_beats_an_increment_that_nobody_set(tmp_path: Path) -> None:
    stamps = START + np.arange(SAMPLES) * np.timedelta64(5, "ms")
    path = written(tmp_path / "a.tdms", ("daq", "when", stamps, {}), ("daq", "acc", SIGNAL, waveform(1.0)))
    contents = read_tdms(path)
    assert contents.series[0].sample_rate_hz == pytest.approx(200.0, rel=1e-9)
    assert contents.notes == (f"{path}: states 1 Hz, its times run at 200 Hz, which is taken.",)


def test_what_is_no_signal_costs_nothing_else(tmp_path: Path) -> None:
    path = written(
        tmp_path / "a.tdms",
        ("daq", "acc", SIGNAL, waveform()),
        ("daq", "remark", np.array(["a"] * SAMPLES), {}),
        ("daq", "spectrum", SIGNAL, waveform(1.0, wf_xunit_string="Hz")),
        ("daq", "complex", SIGNAL.astype(np.complex128), waveform()),
        ("daq", "nothing", np.empty(0), {}),
        ("daq", "unit", SIGNAL, waveform(unit_string="furlongs")),
    )
    contents = read_tdms(path)
    assert [channel.name for series in contents.series for channel in series.channels] == ["acc", "unit"]
    reasons = dict(contents.unread)
    assert reasons["remark"] == "text"
    assert reasons["spectrum"] == "against an axis in 'hz', not time"
    assert reasons["complex"] == "complex128 numbers"
    assert reasons["nothing"] == "empty"
    assert (
        "'unit': its unit can't be read, and its numbers are taken without one: unit 'furlongs': not known"
        in contents.notes[0]
    )


def test_one_name_in_several_groups(tmp_path: Path) -> None:
    path = written(tmp_path / "a.tdms", ("a", "x", SIGNAL, waveform()), ("b", "x", SIGNAL, waveform()))
    (series,) = read_tdms(path).series
    assert [channel.name for channel in series.channels] == ["a/x", "b/x"]


def test_a_rate_that_nothing_says_is_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path / "a.tdms", ("daq", "x", SIGNAL, {}))
    with pytest.raises(SetupError, match="give the sample rate"):
        read_tdms(path)
    assert read_tdms(path, sample_rate_hz=200.0).series[0].sample_rate_hz == 200.0
    # It is that of the channels that say none.
    path = written(tmp_path / "a.tdms", ("daq", "x", SIGNAL, {}), ("daq", "y", SIGNAL, waveform(0.01)))
    contents = read_tdms(path, sample_rate_hz=200.0)
    assert sorted(series.sample_rate_hz for series in contents.series) == [100.0, 200.0]
    # Without it the waveform is read.
    contents = read_tdms(path)
    assert [series.sample_rate_hz for series in contents.series] == [100.0]
    assert contents.unread[0][0] == "x"
    path = written(tmp_path / "a.tdms", ("daq", "x", SIGNAL, waveform(0.01)))
    with pytest.raises(SetupError, match="says 100 Hz, 200 Hz was given"):
        read_tdms(path, sample_rate_hz=200.0)


def test_units_may_be_stated(tmp_path: Path) -> None:
    path = written(tmp_path / "a.tdms", ("daq", "x", SIGNAL, waveform(unit_string="g")))
    assert read_tdms(path, units={"x": "V"}).series[0].channels[0].unit == "V"
    with pytest.raises(SetupError, match="no channel 'y' to give a unit; channels: x"):
        read_tdms(path, units={"y": "V"})


def test_without_nptdms_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path / "a.tdms", ("daq", "x", SIGNAL, waveform()))
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(LogError, match=r"TDMS files are read by nptdms.*pip install 'chladni\[io\]'"):
        read_tdms(path)


@pytest.mark.parametrize("content", [b"", b"not at all " * 30, b"TDSm" + bytes(100)])
def test_garbage_is_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.tdms").write_bytes(content)
    with pytest.raises(LogError):
        read_tdms(tmp_path / "a.tdms")


def test_sizes_are_checked(tmp_path: Path) -> None:
    path = written(tmp_path / "a.tdms", ("daq", "x", np.zeros(10_000), waveform()))
    with pytest.raises(LogError, match="its content takes 80000 bytes in memory or more, 1000 are allowed"):
        read_tdms(path, max_bytes=1000)


def test_a_file_that_was_never_closed_is_read_as_far_as_it_goes(tmp_path: Path) -> None:
    path = written(tmp_path / "a.tdms", ("daq", "x", SIGNAL, waveform()), segments=4)
    raw = path.read_bytes()
    path.write_bytes(raw[:-200])
    (series,) = read_tdms(path).series
    np.testing.assert_array_equal(series.values[0][: 3 * SAMPLES], np.tile(SIGNAL, 3))


def test_wrong_bytes_never_crash(tmp_path: Path) -> None:
    path = written(
        tmp_path / "a.tdms", ("daq", "x", SIGNAL, waveform()), ("daq", "s", np.array(["a", "b"]), {}), segments=2
    )
    raw = path.read_bytes()
    rng = np.random.default_rng(2)
    refused = 0
    for number in range(200):
        changed = bytearray(raw)
        for place in rng.integers(0, len(raw) if number % 2 else 300, 2):
            changed[place] = rng.integers(256)
        path.write_bytes(changed)
        try:
            read_tdms(path)
        except ChladniError:
            refused += 1
    assert refused > 20


def big_endian() -> bytes:
    """One segment as LabVIEW writes it on machines whose numbers have their high byte first."""

    def text(written: str) -> bytes:
        return struct.pack(">I", len(written)) + written.encode()

    data = SIGNAL.astype(">f8").tobytes()
    channel = text("/'daq'/'x'") + struct.pack(">IIIQ", 20, 10, 1, SAMPLES)
    described = struct.pack(">I", 1) + channel + struct.pack(">I", 1) + text("wf_increment")
    described += struct.pack(">Id", 10, 0.005)
    # New objects, metadata and raw data in it; all numbers from here on are big endian.
    flags = struct.pack("<I", 2 | 4 | 8 | 64)
    lengths = struct.pack(">IQQ", 4713, len(described) + len(data), len(described))
    return b"TDSm" + flags + lengths + described + data


@pytest.mark.parametrize(
    "behind", [b"\x00" * 9, b"TDSm", b"TDSm" + bytes(16), b"TDSm" + bytes([14, 0, 0, 0, 105, 18, 0, 0] + [9] * 15)]
)
def test_bytes_behind_the_last_segment_are_told(tmp_path: Path, behind: bytes) -> None:
    sound = written(tmp_path / "a.tdms", ("daq", "x", SIGNAL, waveform())).read_bytes()
    for whole in (sound, sound * 2, big_endian(), big_endian() * 2):
        (tmp_path / "a.tdms").write_bytes(whole)
        assert read_tdms(tmp_path / "a.tdms").unread == ()
        (tmp_path / "a.tdms").write_bytes(whole + behind)
        assert f"{len(behind)} bytes at the end" in dict(read_tdms(tmp_path / "a.tdms").unread)


@pytest.mark.parametrize(
    "wrong",
    [{"wf_increment": step} for step in (0.0, -1.0, 5e-324, 1e308, 1e12, float("nan"), float("inf"))]
    + [{"wf_start_offset": offset} for offset in (1e300, -1e300, float("nan"), 1e11)]
    + [{"wf_start_time": np.datetime64(year, "Y").astype("M8[us]")} for year in (30_000, 200_000)],
)
def test_a_waveform_at_no_time_costs_its_channel_alone(tmp_path: Path, wrong: dict[str, object]) -> None:
    sound = ("daq", "sound", SIGNAL, waveform())
    contents = read_tdms(written(tmp_path / "a.tdms", sound, ("daq", "odd", SIGNAL, waveform(**wrong))))
    (series,) = contents.series
    assert [channel.name for channel in series.channels] == ["sound"]
    assert (series.sample_rate_hz, series.start_time_ns) == (200.0, START_NS)
    ((name, reason),) = contents.unread
    assert name == "odd"
    assert ("sample rate" if "wf_increment" in wrong else "isn't within 146 years") in reason
