"""Universal files: real ones, a reader written from the format's text, and round trips."""

import struct
from pathlib import Path

import numpy as np
import pytest

from chladni.io.files.uff import read_uff, write_uff
from chladni.io.files.uff_header import rate_of_header
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

START_NS = 1_700_000_000_123_456_789


def series_of(channels: list[Channel], samples: int = 50, **fields: object) -> TimeSeries:
    values = np.random.default_rng(3).standard_normal((len(channels), samples))
    options = {"values": values, "sample_rate_hz": 1e4 / 3, "start_time_ns": START_NS, "channels": tuple(channels)}
    return TimeSeries(**(options | fields))


def text_set(**fields: object) -> str:
    """A dataset 58 as text, columns as the format lays them down."""
    given = {
        "id1": "acc", "id3": "NONE", "kind": 1, "node": 3, "dir": -2, "form": 2, "spacing": 1, "least": 0.0,
        "step": 1e-3, "quantity": 12, "unit": "g", "values": [1.0, 2.0, -0.5], "count": None,
    } | fields  # fmt: skip
    count = len(given["values"]) if given["count"] is None else given["count"]
    lines = [
        "    -1", "    58", given["id1"], "NONE", given["id3"], "NONE", "NONE",
        f"{given['kind']:5d}{0:10d}{0:5d}{0:10d} {'NONE':10s}{given['node']:10d}{given['dir']:4d} NONE      {0:14d}",
        f"{given['form']:10d}{count:10d}{given['spacing']:10d}{given['least']:13.5e}{given['step']:13.5e}{0:13.5e}",
        f"{17:10d}{0:5d}{0:5d}{0:5d} {'Time':20s} {'s':20s}",
        f"{given['quantity']:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {given['unit']:20s}",
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}",
        f"{0:10d}{0:5d}{0:5d}{0:5d} {'NONE':20s} {'NONE':20s}",
    ]  # fmt: skip
    values = given["values"]
    if given["spacing"] == 0:
        values = [number for pair in zip(given["x"], values, strict=True) for number in pair]
    lines += [
        "".join(f"{number:13.5e}" for number in values[first : first + 6]) for first in range(0, len(values), 6)
    ]
    return "\n".join([*lines, "    -1", ""])


def units_set(length: float, force: float) -> str:
    head = f"    -1\n   164\n{9:10d}{'own units':20s}{1:10d}\n"
    return head + f"{length:25.16e}{force:25.16e}{1:25.16e}\n{0:25.16e}\n    -1\n".replace("e", "D")


def test_text_and_binary_of_one_record_agree(shared_data: Path) -> None:
    (text,) = read_uff(shared_data / "Sample_UFF58_ascii.uff").series
    (binary,) = read_uff(shared_data / "Sample_UFF58b_bin.uff").series
    assert text.channels == binary.channels
    assert text.channels[0] == Channel(
        name="Mic 01.0Scalar", unit="Pa", point="Mic 01", direction=(1.0, 0.0, 0.0), role="response"
    )
    assert (text.sample_rate_hz, text.start_time_ns) == (binary.sample_rate_hz, binary.start_time_ns)
    # The text has six digits: half a unit in the last of them.
    np.testing.assert_allclose(text.values, binary.values, rtol=5.1e-6)


def test_an_analyser_export(shared_data: Path) -> None:
    contents = read_uff(shared_data / "BK_4_channels.uff")
    (series,) = contents.series
    assert series.values.shape == (4, 288768)
    assert series.sample_rate_hz == 65536.0
    assert "65536 Hz was taken for the rounded increment" in contents.notes[0]
    assert [channel.unit for channel in series.channels] == ["V"] * 4
    assert [channel.point for channel in series.channels] == ["1", "2", "3", "4"]
    raw = (shared_data / "BK_4_channels.uff").read_bytes()
    start = raw.index(b"\n", raw.rindex(b"NONE", 0, 1400)) + 1
    np.testing.assert_array_equal(series.values[0, :8], struct.unpack("<8f", raw[start : start + 32]))


def test_a_spectrum_is_no_log(shared_data: Path) -> None:
    with pytest.raises(LogError, match=r"no time record .*but power spectral density \(1\)"):
        read_uff(shared_data / "sample_dataset58_psd.uff")


def test_a_text_record_by_the_format(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text(text_set(id3="02-SEP-18 07:42:53", least=0.25))
    (series,) = read_uff(tmp_path / "a.uff").series
    np.testing.assert_allclose(series.values, [[9.80665, 19.6133, -4.903325]], rtol=1e-15)
    assert series.channels == (Channel(name="acc", unit="m/s^2", point="3", direction=(0.0, -1.0, 0.0)),)
    assert series.sample_rate_hz == 1000.0
    assert series.start_time_ns == 1_535_874_173_250_000_000


def test_units_without_a_label_follow_dataset_164(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text(
        units_set(1000.0, 0.001) + text_set(unit="NONE") + text_set(quantity=13, id1="f", unit="")
    )
    (series,) = read_uff(tmp_path / "a.uff").series
    assert [(channel.unit, channel.role) for channel in series.channels] == [
        ("m/s^2", "response"),
        ("N", "reference"),
    ]
    np.testing.assert_allclose(series.values[:, 0], [1e-3, 1e3], rtol=1e-15)


def test_an_unknown_label_costs_its_channel_the_unit(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text(text_set(unit="furlongs") + text_set(id1="b"))
    contents = read_uff(tmp_path / "a.uff")
    (series,) = contents.series
    assert [channel.unit for channel in series.channels] == ["1", "m/s^2"]
    np.testing.assert_array_equal(series.values[0], [1.0, 2.0, -0.5])
    (note,) = contents.notes
    assert all(words in note for words in ("acc: ", "'furlongs'", "--read units=NAME:UNIT"))


def test_units_can_be_stated(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text(text_set(unit="furlongs"))
    contents = read_uff(tmp_path / "a.uff", units={"acc": "mm"})
    assert contents.series[0].channels[0].unit == "m"
    assert contents.notes == ()
    with pytest.raises(SetupError, match="no channel 'x' to give a unit"):
        read_uff(tmp_path / "a.uff", units={"x": "mm"})
    with pytest.raises(SetupError, match=r"\(acc\): unit 'fathoms'"):
        read_uff(tmp_path / "a.uff", units={"acc": "fathoms"})
    # The type says that it's a force, whose pound is one of force.
    (tmp_path / "b.uff").write_text(text_set(quantity=13))
    (series,) = read_uff(tmp_path / "b.uff", units={"acc": "lb"}).series
    np.testing.assert_allclose(series.values[0], 4.4482216152605 * np.array([1.0, 2.0, -0.5]), rtol=1e-15)


def test_one_record_that_cannot_be_read_costs_no_other(tmp_path: Path) -> None:
    broken = text_set(id1="broken").replace("2.00000e+00", "2.0000ze+00")
    header = text_set(id1="header").replace("         2         3         1", "         x         3         1")
    (tmp_path / "a.uff").write_text(broken + text_set(id1="whole") + header + text_set(id1="nodes", kind=4))
    contents = read_uff(tmp_path / "a.uff")
    assert [channel.name for series in contents.series for channel in series.channels] == ["whole"]
    told = "\n".join(contents.notes)
    for words in (
        "dataset 1 has '2.0000ze+00' where a number is due",
        "dataset 3 (type 58) can't be read",
        "frequency response",
    ):
        assert words in told


def test_other_functions_are_left_out_with_a_word(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text(text_set() + text_set(kind=4) + text_set(kind=6))
    contents = read_uff(tmp_path / "a.uff")
    assert len(contents.series) == 1
    assert contents.notes == (
        f"{tmp_path / 'a.uff'}: left out, being no time records: frequency response function (1), coherence (1).",
    )


def test_records_of_several_rates_are_several_series(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text(text_set() + text_set(id1="b", step=2e-3) + text_set(id1="c"))
    series = read_uff(tmp_path / "a.uff").series
    assert [[channel.name for channel in part.channels] for part in series] == [["acc", "c"], ["b"]]


def test_equal_names_get_their_place(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text(text_set() + text_set(dir=3) + text_set(dir=3) + text_set(id1="NONE"))
    (series,) = read_uff(tmp_path / "a.uff").series
    assert [channel.name for channel in series.channels] == ["acc 3:-2", "acc 3:+3", "acc 3:+3 3", "record 3:-2"]


def test_uneven_times_find_their_rate(tmp_path: Path) -> None:
    times, values = np.arange(40) * 0.01, np.arange(40.0)
    (tmp_path / "a.uff").write_text(text_set(spacing=0, x=times.tolist(), values=values.tolist(), unit="N"))
    (series,) = read_uff(tmp_path / "a.uff").series
    assert series.sample_rate_hz == pytest.approx(100.0, rel=1e-6)
    np.testing.assert_array_equal(series.values[0], values)


@pytest.mark.parametrize("binary", [True, False])
def test_what_is_written_comes_back(tmp_path: Path, binary: bool) -> None:
    series = series_of(
        [
            Channel(name="/wrist.accel.linear.z", unit="m/s^2", point="wrist", direction=(0.0, 0.0, -1.0)),
            Channel(name="force", unit="N", point="12", direction=(1.0, 0.0, 0.0), role="reference"),
            Channel(name="turn", unit="rad/s", direction=(0.0, 1.0, 0.0)),
            Channel(name="plain"),
            # Labels of other programs leave open whether C is charge or temperature, ours don't.
            Channel(name="charge", unit="C"),
        ]
    )
    losses = write_uff(series, tmp_path / "a.uff", binary=binary)
    contents = read_uff(tmp_path / "a.uff")
    (again,) = contents.series
    assert again.channels == series.channels
    assert (again.sample_rate_hz, again.start_time_ns) == (series.sample_rate_hz, START_NS)
    assert contents.notes == ()
    if binary:
        np.testing.assert_array_equal(again.values, series.values)
        assert losses == ()
    else:
        np.testing.assert_allclose(again.values, series.values, rtol=5.1e-12)  # twelve digits
        assert losses == ("A text universal file rounds values to twelve digits.",)


def test_what_does_not_fit_is_told(tmp_path: Path) -> None:
    channel = Channel(
        name="température",
        unit="((m/s^2)/N)/(rad/s^2)",
        point="left front upper",
        direction=(0.6, 0.8, 0.0),
        overload=5.0,
    )
    losses = write_uff(series_of([channel]), tmp_path / "a.uff")
    assert [
        word
        for word, loss in zip(("name", "point", "direction", "overload", "unit"), losses, strict=True)
        if word in loss
    ]
    (again,) = read_uff(tmp_path / "a.uff").series
    assert again.channels == (Channel(name="temp?rature", point="left front"),)


def test_gaps_are_refused(tmp_path: Path) -> None:
    valid = np.ones((1, 50), dtype=bool)
    valid[0, 7] = False
    with pytest.raises(LogError, match="1 samples are missing"):
        write_uff(series_of([Channel(name="a")], valid=valid), tmp_path / "a.uff")


def test_one_sample_is_no_record(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="at least two"):
        write_uff(series_of([Channel(name="a")], samples=1), tmp_path / "a.uff")


@pytest.mark.parametrize("rate", [50.0, 400.0, 610.35, 1000.0, 25600.0, 51200.0, 65536.0, 131072.0, 1e6])
def test_the_rate_is_restored_from_six_digits(rate: float) -> None:
    assert rate_of_header({"abscissa_inc": float(f"{1 / rate:.5e}"), "id5": "NONE"}) == rate


@pytest.mark.parametrize("increment", [0.3, 0.7, 1.1e-3, 1e-2 / 3 * 3])
def test_an_increment_of_few_digits_is_meant_as_it_stands(increment: float) -> None:
    assert rate_of_header({"abscissa_inc": increment, "id5": "NONE"}) == pytest.approx(1 / increment, rel=1e-15)


def test_a_rate_that_contradicts_the_record_is_not_believed() -> None:
    header = {"abscissa_inc": 0.001, "id5": "start_time_ns=0 sample_rate_hz=2000.0"}
    assert rate_of_header(header) == 1000.0


@pytest.mark.parametrize(
    ("content", "match"),
    [
        ("hello", "holds no whole dataset"),
        (text_set()[:300], "or was it cut off"),
        ("    -1\n    15\n    -1\n", r"datasets 15 \(1\)"),
        (text_set(count=10**9), "announces 1000000000 values"),
        (text_set(count=9), "announces 9 values and holds 3"),
        (text_set(form=3), "of type 3"),
        (text_set(form=5), "complex values|holds 1"),
        (text_set(step=0.0), "is no sample interval"),
        (text_set().replace("2.00000e+00", "2.0000ze+00"), "dataset 1 has '2.0000ze.00' where a number"),
        (text_set().replace("         2         3", "         x         3"), "can't be read"),
    ],
)
def test_damaged_files_are_told_in_one_line(tmp_path: Path, content: str, match: str) -> None:
    (tmp_path / "a.uff").write_text(content)
    with pytest.raises(LogError, match=match):
        read_uff(tmp_path / "a.uff")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no such file"):
        read_uff(tmp_path / "a.uff")


def test_a_file_that_was_cut_off_gives_its_whole_datasets_and_says_so(tmp_path: Path) -> None:
    whole = text_set(id1="first") + text_set(id1="second")
    for name, content in (("whole", whole), ("padded", whole + "\n \0"), ("cut", whole[: -len(text_set()) // 3])):
        (tmp_path / f"{name}.uff").write_text(content)
    for name in ("whole", "padded"):
        found = read_uff(tmp_path / f"{name}.uff")
        assert [channel.name for series in found.series for channel in series.channels] == ["first", "second"]
        assert not [note for note in found.notes if "cut off" in note]
    found = read_uff(tmp_path / "cut.uff")
    assert [channel.name for series in found.series for channel in series.channels] == ["first"]
    assert "cut.uff: doesn't end with the line -1" in found.notes[0]
