"""Conversion: every kind to a log and back, and what is refused."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.io.convert import convert
from chladni.io.files.formats import WRITTEN_SUFFIXES
from chladni.io.files.npz import read_npz, write_npz
from chladni.io.log import open_log
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

START_NS = 1_700_000_000_123_456_789
PATHS = ("/wrist.accel.linear.z", "/hammer.wrench.force.x")


def series_of(names: tuple[str, ...] = PATHS, samples: int = 400, **fields: object) -> TimeSeries:
    values = np.random.default_rng(11).standard_normal((len(names), samples))
    units = ("m/s^2", "N", "V")
    channels = tuple(Channel(name=name, unit=unit) for name, unit in zip(names, units, strict=False))
    options = {"values": values, "sample_rate_hz": 250.0, "start_time_ns": START_NS, "channels": channels}
    return TimeSeries(**(options | fields))


def log_of(folder: Path, *parts: TimeSeries, **options: object) -> Path:
    write_mcap(list(parts), folder / "in.mcap", **options)
    return folder / "in.mcap"


def read_log(path: Path) -> TimeSeries:
    with open_log(path) as log:
        return log.read()


NO_START = {".wav"}


@pytest.mark.parametrize("suffix", WRITTEN_SUFFIXES)
def test_log_to_file_and_back(tmp_path: Path, suffix: str) -> None:
    series = series_of()
    source = log_of(tmp_path, series)
    there = convert(source, tmp_path / f"out{suffix}", channels=list(PATHS))
    assert (there.channels, there.samples, there.duration_s) == (PATHS, 800, pytest.approx(1.6, rel=1e-9))
    names = {"names": PATHS, "units": {PATHS[0]: "m/s^2", PATHS[1]: "N"}} if suffix == ".wav" else {}
    back = convert(there.target, tmp_path / "back.mcap", reading=names)
    assert back.losses == ()
    again = read_log(back.target).select(PATHS)
    np.testing.assert_array_equal(again.values, series.values)
    assert again.sample_rate_hz == pytest.approx(250.0, rel=1e-9)
    assert [channel.unit for channel in again.channels] == ["m/s^2", "N"]
    assert abs(again.start_time_ns - (0 if suffix in NO_START else START_NS)) <= 1


@settings(max_examples=12, deadline=None)
@given(
    suffix=st.sampled_from([".csv", ".mat", ".npz"]),
    rate=st.sampled_from([100.0, 610.35, 51200.0]),
    gaps=st.lists(st.tuples(st.integers(20, 280), st.integers(1, 30)), max_size=3),
    layout=st.sampled_from(["messages", "batches"]),
)
def test_gaps_survive_the_way_to_a_log_and_back(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, rate: float, gaps: list[tuple[int, int]], layout: str
) -> None:
    valid = np.ones((2, 330), dtype=bool)
    for first, length in gaps:
        valid[:, first : first + length] = False
    series = series_of(("/rig.a", "/rig.b"), 330, sample_rate_hz=rate, valid=valid)
    folder = tmp_path_factory.mktemp("gaps")
    convert(log_of(folder, series, layout=layout), folder / f"out{suffix}")
    convert(folder / f"out{suffix}", folder / "back.mcap", layout=layout)
    again = read_log(folder / "back.mcap").select(["/rig.a", "/rig.b"])
    np.testing.assert_array_equal(again.values, np.where(valid, series.values, np.nan))
    assert again.sample_rate_hz == pytest.approx(rate, rel=1e-7)
    found = np.ones_like(valid) if again.valid is None else again.valid
    np.testing.assert_array_equal(found, valid)


def test_names_that_are_no_paths_go_to_batches(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("force 1 [N],b [V]\n" + "1,2\n" * 100)
    done = convert(tmp_path / "a.csv", tmp_path / "a.mcap", sample_rate_hz=100.0)
    assert done.channels == ('/daq."force 1"', "/daq.b")
    assert done.losses == ('force 1: called /daq."force 1" in the log.', "b: called /daq.b in the log.")
    assert {channel.name for channel in read_log(done.target).channels} == set(done.channels)


def test_times_before_zero_are_shifted_with_a_word(tmp_path: Path) -> None:
    rows = "".join(f"{(index - 25) / 100},{index}\n" for index in range(100))
    (tmp_path / "a.csv").write_text(f"time [s],a [N]\n{rows}")
    done = convert(tmp_path / "a.csv", tmp_path / "a.mcap")
    assert done.losses[0] == "All times are 0.25 s later in the log, which holds none before 0."
    again = read_log(done.target)
    assert again.start_time_ns == 0
    np.testing.assert_array_equal(again.values, [np.arange(100)])


def test_part_of_a_file(tmp_path: Path) -> None:
    write_npz([series_of(), series_of(("c",), 40, sample_rate_hz=25.0)], tmp_path / "a.npz")
    done = convert(tmp_path / "a.npz", tmp_path / "b.npz", channels=[PATHS[1]], start_s=0.4, end_s=1.0)
    (series,) = read_npz(tmp_path / "b.npz").series
    assert done.channels == (PATHS[1],)
    np.testing.assert_array_equal(series.values, series_of().values[1:, 100:250])
    assert series.start_time_ns == START_NS + 400_000_000


def test_notes_of_the_reader_are_passed_on(shared_data: Path, tmp_path: Path) -> None:
    done = convert(shared_data / "Sample_UFF58b_bin.uff", tmp_path / "a.mcap")
    assert "65536 Hz was taken" in done.notes[0]
    with open_log(tmp_path / "a.mcap") as log:
        (channel,) = log.channels
        series = log.read()
    assert (channel.unit, channel.point, channel.direction) == ("Pa", "Mic 01", (1.0, 0.0, 0.0))
    raw = (shared_data / "Sample_UFF58b_bin.uff").read_bytes()
    start = raw.rindex(b"NONE", 0, 1200)
    start = raw.index(b"\n", start) + 1
    expected = struct.unpack("<79292f", raw[start : start + 4 * 79292])
    np.testing.assert_array_equal(series.values[0], expected)


def test_a_damaged_log_is_told(tmp_path: Path) -> None:
    source = log_of(tmp_path, series_of())
    source.write_bytes(source.read_bytes()[:-200])
    done = convert(source, tmp_path / "a.npz")
    assert done.notes
    assert all(note.startswith(str(source)) for note in done.notes)


def test_several_rates_need_one_for_a_table(tmp_path: Path) -> None:
    source = log_of(tmp_path, series_of(), series_of(("/slow.value",), 200, sample_rate_hz=100.0))
    with pytest.raises(LogError, match="a CSV table holds channels of one rate"):
        convert(source, tmp_path / "a.csv")
    assert not (tmp_path / "a.csv").exists()
    done = convert(source, tmp_path / "a.csv", resample_hz=100.0)
    assert len(done.channels) == 3
    # 0.8 of the lower Nyquist frequency, as the resampler promises; its kernel needs samples on both sides.
    (note,) = done.notes
    assert "brought to 100 Hz by band-limited resampling" in note
    assert "up to 40 Hz" in note
    assert "s of a channel are left out" in note
    # In the order asked for.
    picked = convert(source, tmp_path / "b.csv", channels=["/slow.value", PATHS[0]], resample_hz=100.0)
    assert picked.channels == ("/slow.value", PATHS[0])


@pytest.mark.parametrize(
    ("target", "options", "error", "match"),
    [
        (
            "a.xlsx",
            {},
            SetupError,
            r"'.xlsx' isn't written; supported are .mcap, .csv, .txt, .tsv, .wav, .mat, .npz, .uff, .unv, .parquet",
        ),
        ("a", {}, SetupError, "the suffix '' isn't written"),
        ("there.csv", {}, LogError, "exists already"),
        ("in.npz", {"overwrite": True}, SetupError, "is the source itself"),
        ("a.csv", {"channels": ["/x.y"]}, LogError, "no channel '/x.y'; there are: /hammer.wrench"),
        ("a.csv", {"reading": {"colour": 1}}, SetupError, "read_npz has no option 'colour'; it has sample_rate_hz"),
        ("a.csv", {"layout": "batches"}, SetupError, "write_csv has no option 'layout'"),
    ],
)
def test_what_is_refused(
    tmp_path: Path, target: str, options: dict[str, object], error: type[Exception], match: str
) -> None:
    write_npz(series_of(), tmp_path / "in.npz")
    (tmp_path / "there.csv").write_text("precious")
    with pytest.raises(error, match=match):
        convert(tmp_path / "in.npz", tmp_path / target, **options)
    assert (tmp_path / "there.csv").read_text() == "precious"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.npz", "there.csv"]


def test_a_missing_source_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no such file"):
        convert(tmp_path / "none.csv", tmp_path / "a.mcap")


def test_an_existing_target_is_replaced_when_told(tmp_path: Path) -> None:
    write_npz(series_of(), tmp_path / "in.npz")
    (tmp_path / "out.csv").write_text("old")
    convert(tmp_path / "in.npz", tmp_path / "out.csv", overwrite=True)
    assert (tmp_path / "out.csv").read_text().startswith("time [s from")
