"""CSV tables as people write them, real ones, and round trips."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from chladni.io.files.csv import read_csv, write_csv
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries
from chladni.signals.visible import visible

START_NS = 1_700_000_000_123_456_789
RISING = "time [s],a\n" + "".join(f"{index / 100},2\n" for index in range(60))


def file_of(folder: Path, text: str | bytes, name: str = "a.csv") -> Path:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def only(path: Path, **options: object) -> TimeSeries:
    (series,) = read_csv(path, **options).series
    return series


@pytest.mark.parametrize(
    "text",
    [
        "a [N],b (V)\n1.5,2\n-3e2,4\n",
        "a [N];b (V)\r\n1.5;2\r\n-3e2;4\r\n",
        "a [N];b (V)\n1,5;2\n-3e2;4\n",
        "a [N]\tb (V)\n1,5\t2\n-3e2\t4\n",
        '"a [N]","b (V)"\n"1.5","2"\n"-3e2","4"\n',
        "\ufeffa [N],b (V)\n1.5,2\n-3e2,4\n",
        "# measured on a Friday\n# a [N], b (V)\n1.5,2\n\n-3e2,4\n",
        "a,b\nN,V\n1.5,2\n-3e2,4",
        "a[N],b(V)\n 1.5 , 2 \n-3e2,4\n",
    ],
)
def test_the_ways_people_write_a_table(tmp_path: Path, text: str) -> None:
    series = only(file_of(tmp_path, text), sample_rate_hz=100.0)
    np.testing.assert_array_equal(series.values, [[1.5, -300.0], [2.0, 4.0]])
    assert series.channels == (Channel(name="a", unit="N"), Channel(name="b", unit="V"))
    assert series.sample_rate_hz == 100.0


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("1.5 2\n 3  4\n", [[1.5, 3.0], [2.0, 4.0]]),
        ("1\n2\n3\n", [[1.0, 2.0, 3.0]]),
        ("1,2\n3,4\n", [[1.0, 3.0], [2.0, 4.0]]),
        ("1,5;2,25\n3,5;4\n", [[1.5, 3.5], [2.25, 4.0]]),
    ],
)
def test_tables_without_names(tmp_path: Path, text: str, values: list[list[float]]) -> None:
    series = only(file_of(tmp_path, text), sample_rate_hz=10.0)
    np.testing.assert_array_equal(series.values, values)
    assert [channel.name for channel in series.channels] == [f"column_{n + 1}" for n in range(len(values))]


def test_units_become_si(tmp_path: Path) -> None:
    series = only(file_of(tmp_path, "a [g],b [mm/s],c [m/s²]\n1,2,3\n"), sample_rate_hz=1.0)
    np.testing.assert_allclose(series.values[:, 0], [9.80665, 0.002, 3.0], rtol=1e-15)
    assert [channel.unit for channel in series.channels] == ["m/s^2", "m/s", "m/s^2"]


def test_other_encodings(tmp_path: Path) -> None:
    text = "a [m/s²],b [µm]\n1,2\n"
    for codec in ("cp1252", "utf-16"):
        series = only(file_of(tmp_path, text.encode(codec)), sample_rate_hz=1.0)
        assert [channel.unit for channel in series.channels] == ["m/s^2", "m"]


def test_remarks_and_indices_are_no_units(tmp_path: Path) -> None:
    text = "Force 1 (hammer),/axis.position[0],/axis.position[1] [m],(x)\n1,2,3,4\n"
    channels = only(file_of(tmp_path, text), sample_rate_hz=1.0).channels
    assert [(channel.name, channel.unit) for channel in channels] == [
        ("Force 1 (hammer)", "1"),
        ("/axis.position[0]", "1"),
        ("/axis.position[1]", "m"),
        ("(x)", "1"),
    ]


@pytest.mark.parametrize(
    ("title", "times", "options"),
    [
        ("time [s]", "0.00", {}),
        ("t", "0.00", {}),
        ("Time (ms)", "0", {}),
        ("timestamp [us]", "0", {}),
        ("timestamp", "0", {"time_unit": "ns"}),
    ],
)
def test_time_columns(tmp_path: Path, title: str, times: str, options: dict[str, str]) -> None:
    scale = {"time [s]": 0.01, "t": 0.01, "Time (ms)": 10, "timestamp [us]": 10_000, "timestamp": 10_000_000}[title]
    rows = "".join(f"{index},{index * scale:.10g}\n" for index in range(60))
    series = only(file_of(tmp_path, f"a,{title}\n{rows}"), **options)
    assert series.sample_rate_hz == pytest.approx(100.0, rel=1e-9)
    np.testing.assert_array_equal(series.values, [np.arange(60)])


def test_a_first_column_that_rises_is_a_time_if_its_unit_is_said(tmp_path: Path) -> None:
    path = file_of(tmp_path, "".join(f"{10 * index}\t{index % 3}\n" for index in range(60)))
    with pytest.raises(SetupError, match=r"'column_1' rises like a time but has no unit.*--rate HZ.*--time NAME"):
        read_csv(path)
    assert only(path, time_unit="ms").sample_rate_hz == pytest.approx(100.0, rel=1e-9)
    assert only(path, sample_rate_hz=5.0).values.shape == (2, 60)


def test_real_tables_without_header(shared_data: Path) -> None:
    names = ["time", "laser", "pressure", "force", "position", "pressure_bar", "force_N"]
    units = {"laser": "V", "pressure": "V", "force": "V", "position": "mm", "pressure_bar": "bar", "force_N": "N"}
    path = shared_data / "pneumatic_seal_1bar.csv"
    contents = read_csv(path, names=names, units=units | {"time": "ms"})
    (series,) = contents.series
    table = np.loadtxt(path)
    # Rows come 10 ms apart, a tenth of them later.
    assert "jittered" in contents.notes[0]
    assert [channel.unit for channel in series.channels] == ["V", "V", "V", "m", "Pa", "N"]
    assert 95.0 < series.sample_rate_hz < 101.0
    # Every value of the force is found again, in its order, wherever its sample came to lie.
    found = series.values[5][np.isfinite(series.values[5])]
    assert len(found) >= 0.95 * len(table)
    assert set(found) <= set(table[:, 6])


def test_empty_cells_are_gaps(tmp_path: Path) -> None:
    series = only(file_of(tmp_path, "a,b\n1,2\n,3\n4,nan\n"), sample_rate_hz=1.0)
    np.testing.assert_array_equal(series.valid, [[True, False, True], [True, True, False]])


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("a;b\n1,5;2\n3;1.234,5\n", r"line 3: '1.234,5' has a sign between thousands"),
        ('a,b\n1,"1,234.5"\n3,2.5\n', r"line 2: '1,234.5' has a sign between thousands"),
        ('a,b\n1,"1,234"\n3,"2,345"\n', r"column 2: '1,234' can be read .* \(--read decimal=,\)"),
        ("a;b\n1,5;1.234\n2,5;2.345\n", r"column 2: '1.234' can be read"),
        ("a;b\n1,5;2\n2.5;3\n", r"column 1: '1,5' can be read"),
        ("a,b\n1,2\n3\n", "line 3 has 1 cells where the table has 2"),
        ("a,b\n1,2\n1,2\n1,2\n3,4,5\n", "line 5 has 3 cells where the table has 2"),
        ("", "the file is empty"),
        ("time,a\n", "no line of numbers in its only line"),
        ("all text\nand more\n", "no line of numbers"),
        ("a,b,c\n1,2\n3,4\n", "line 2 has 2 columns, but none of the lines above it has as many names"),
        ("a,b\n1,\0\n", "bytes that are no text"),
    ],
)
def test_mistakes_name_line_and_column(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(LogError, match=match):
        read_csv(file_of(tmp_path, text), sample_rate_hz=1.0)


@pytest.mark.parametrize(
    ("text", "options", "error", "match"),
    [
        ("a\n3\n2\n", {}, SetupError, "give the sample rate"),
        (
            RISING,
            {"sample_rate_hz": 2.0},
            SetupError,
            "times run at 100 Hz, 2 Hz was given; leave the sample rate out",
        ),
        ("time [years],a\n1,2\n", {}, SetupError, "'time' is a time in 'years'"),
        ("a\n1\n", {"sample_rate_hz": 2.0, "units": {"a": "furlongs"}}, SetupError, "channel 'a'.*furlongs"),
        ("a\n1\n", {"sample_rate_hz": 2.0, "units": {"b": "N"}}, SetupError, "no channel 'b'"),
        ("a\n1\n", {"decimal": ";"}, SetupError, r"decimal sign is \. or ,"),
        ("a\n1\n", {"time_unit": "years"}, SetupError, "the time unit 'years' is none of s, ms"),
        (RISING, {"time": "b"}, SetupError, "no column 'b' to be the time; columns: time, a"),
        ("a,b\n1,x\n2,y\n", {"time": "b"}, SetupError, "'b' holds text that is no time"),
        ("a\n1\n", {"sample_rate_hz": 2.0, "names": ["b", "c"]}, SetupError, "1 columns, but 2 names"),
        ("time [s]\n1\n2\n", {}, LogError, "no numbers besides a time column"),
        ("a,b\n2,x\n3,y\n", {"time": "a", "time_unit": "s"}, LogError, "besides a time column; b: text, such as 'x'"),
        ("time [s from 99999999999],a\n1,2\n", {}, LogError, "within 146 years"),
        ("time [s],a\n1,2\n1e300,3\n", {}, LogError, "within 146 years"),
    ],
)
def test_what_is_not_said_is_asked_for(
    tmp_path: Path, text: str, options: dict[str, object], error: type[Exception], match: str
) -> None:
    with pytest.raises(error, match=match):
        read_csv(file_of(tmp_path, text), **options)


def test_cells_that_are_no_numbers_are_gaps_and_told(tmp_path: Path) -> None:
    contents = read_csv(file_of(tmp_path, "a,b\n1,2\n3,OL\n5,6\n7,N/A\n"), sample_rate_hz=1.0)
    (series,) = contents.series
    np.testing.assert_array_equal(series.values, [[1, 3, 5, 7], [2, np.nan, 6, np.nan]])
    assert contents.notes == (
        f"{tmp_path / 'a.csv'}: column 'b': 1 cell no number, the first 'OL' in line 3; left as gaps.",
    )


def test_a_cell_far_down_is_found_at_its_line(tmp_path: Path) -> None:
    text = "a,b\n" + "1,2\n" * 70_000 + "3,oops\n"
    contents = read_csv(file_of(tmp_path, text), sample_rate_hz=1.0)
    assert contents.series[0].samples == 70_001
    assert "1 cell no number, the first 'oops' in line 70002" in contents.notes[0]


def test_text_is_left_out_and_told(tmp_path: Path) -> None:
    rows = "".join(f"{index / 100},run,{index},\n" for index in range(60))
    contents = read_csv(file_of(tmp_path, f"time [s],state,a [N],remark\n{rows}"))
    (series,) = contents.series
    np.testing.assert_array_equal(series.values, [np.arange(60)])
    assert contents.unread == (("state", "text, such as 'run'"), ("remark", "empty"))
    assert contents.notes == ()


@pytest.mark.parametrize("end", [",", ",,", ";"])
def test_delimiters_behind_the_last_cell_are_no_columns(tmp_path: Path, end: str) -> None:
    rows = "".join(f"{index / 100}{end[0]}{index}{end}\n" for index in range(60))
    contents = read_csv(file_of(tmp_path, f"time [s]{end[0]}a [N]{end}\n{rows}"))
    assert contents.series[0].channels == (Channel(name="a", unit="N"),)
    assert (contents.notes, contents.unread) == ((), ())
    # Only the rows end so, or only the titles.
    for titles, tail in ((f"time [s]{end[0]}a [N]", end), (f"time [s]{end[0]}a [N]{end}", "")):
        rows = "".join(f"{index / 100}{end[0]}{index}{tail}\n" for index in range(60))
        assert only(file_of(tmp_path, f"{titles}\n{rows}")).samples == 60


@pytest.mark.parametrize(
    ("head", "names", "units"),
    [
        ("time,a\ns,g\n", ["a"], ["m/s^2"]),
        ("Time,a\n(ms),(mV)\n\n", ["a"], ["V"]),
        ("Run 5,\nOperator,Jo\ntime [s],a\n", ["a"], ["1"]),
        ("Rate,100\nGain,2\nChannels,1\ntime [s],a\n", ["a"], ["1"]),
        ("t / s,F / kN\n", ["F"], ["N"]),
        ("t [s],hammer / N\n", ["hammer / N"], ["1"]),
        ("# made by hand\n# time [s], a\n", ["a"], ["1"]),
        ("sep=,\ntime [s],a\n", ["a"], ["1"]),
        ("X,a\nSequence,Volt,0,5e-3\ntime [s],a\n", ["a"], ["1"]),
    ],
)
def test_lines_above_the_rows(tmp_path: Path, head: str, names: list[str], units: list[str]) -> None:
    scale = 10 if "ms" in head else 0.01
    rows = "".join(f"{index * scale:.10g},{index}\n" for index in range(60))
    series = only(file_of(tmp_path, head + rows))
    assert series.sample_rate_hz == pytest.approx(100.0, rel=1e-9)
    assert series.samples == 60
    assert [channel.name for channel in series.channels] == names
    assert [channel.unit for channel in series.channels] == units


def test_a_table_that_is_padded_and_whose_head_is_repeated(tmp_path: Path) -> None:
    head = "time [s],a,b\n"
    rows = [f"{index / 100},{index},1\n" for index in range(60)]
    text = "Run 5,,\nDate,2024-05-01,\nRate,100,\n" + head + "".join(rows[:20]) + head + "".join(rows[20:]) + "End\n"
    contents = read_csv(file_of(tmp_path, text))
    np.testing.assert_array_equal(contents.series[0].values[0], np.arange(60))
    assert contents.series[0].valid is None
    assert contents.notes == (f"{tmp_path / 'a.csv'}: 2 lines without numbers left out, the first is line 25.",)


def test_rows_that_are_cut_are_gaps(tmp_path: Path) -> None:
    rows = [f"{index},1\n" for index in range(60)]
    rows[30] = "3\n"
    contents = read_csv(file_of(tmp_path, "a,b\n" + "".join(rows)), sample_rate_hz=100.0)
    (series,) = contents.series
    # The row keeps its place, so that those after it keep their time.
    np.testing.assert_array_equal(series.values[0], np.where(np.arange(60) == 30, np.nan, np.arange(60)))
    assert "1 row cut short, the first in line 32" in contents.notes[0]


@pytest.mark.parametrize(("place", "time"), [(700, "0.0"), (0, "0.0"), (1999, "3000000000.0"), (3, "12.5")])
def test_a_row_whose_time_is_no_time_is_left_out_and_told(tmp_path: Path, place: int, time: str) -> None:
    times = [f"{1_700_000_000 + index / 200:.3f}" for index in range(2000)]
    times[place] = time
    contents = read_csv(file_of(tmp_path, "time [s],a\n" + "".join(f"{one},{n}\n" for n, one in enumerate(times))))
    (series,) = contents.series
    assert series.sample_rate_hz == 200.0
    assert any(note.endswith("1 row left out, whose time is no time.") for note in contents.notes)
    kept = np.delete(np.arange(2000.0), place)
    np.testing.assert_array_equal(series.values[np.isfinite(series.values)], kept)


def test_rows_without_a_time_are_left_out(tmp_path: Path) -> None:
    rows = "".join(f"{index / 100 if index != 30 else ''},{index}\n" for index in range(60))
    contents = read_csv(file_of(tmp_path, f"time [s],a\n{rows}"))
    np.testing.assert_array_equal(contents.series[0].valid, [np.arange(60) != 30])
    assert contents.notes[0].endswith("1 row without a time left out.")


def test_columns_without_a_name_and_names_twice(tmp_path: Path) -> None:
    contents = read_csv(file_of(tmp_path, ",a,a,\n0,1,2,3\n1,4,5,6\n2,7,8,9\n"), sample_rate_hz=1.0)
    assert [channel.name for channel in contents.series[0].channels] == ["a", "a (2)", "column_4"]
    assert contents.unread == (("unnamed", "it numbers the rows"),)
    assert "a further column 'a' is called 'a (2)'" in contents.notes[0]


def test_numbers_of_fortran_and_quoted_ones(tmp_path: Path) -> None:
    series = only(file_of(tmp_path, 'a,b\n1.5D+00,"2,5"\n-1.0d-02,"0,25"\n'), sample_rate_hz=1.0)
    np.testing.assert_array_equal(series.values, [[1.5, -0.01], [2.5, 0.25]])


def test_three_decimals_behind_a_comma(tmp_path: Path) -> None:
    series = only(file_of(tmp_path, "a;b\n1,234;0,500\n2,345;10,125\n"), sample_rate_hz=1.0)
    np.testing.assert_array_equal(series.values, [[1.234, 2.345], [0.5, 10.125]])
    doubtful = file_of(tmp_path, "a;b\n1,234;3\n2,345;4\n")
    with pytest.raises(LogError, match="decimal=,"):
        read_csv(doubtful, sample_rate_hz=1.0)
    assert only(doubtful, sample_rate_hz=1.0, decimal=",").values[0, 0] == 1.234


def test_addresses_and_numbers_of_parts_are_text(tmp_path: Path) -> None:
    rows = "".join(f"{index};192.168.100.{index % 9};123 456;{index % 7}\n" for index in range(60))
    contents = read_csv(file_of(tmp_path, f"n;address;part;a\n{rows}"), sample_rate_hz=100.0)
    assert [channel.name for channel in contents.series[0].channels] == ["a"]
    assert dict(contents.unread)["address"] == "text, such as '192.168.100.0'"


@pytest.mark.parametrize("cell", ["1 234,5", "1'234,5", "1.234,5"])
def test_thousands_that_are_set_apart_are_refused(tmp_path: Path, cell: str) -> None:
    with pytest.raises(LogError, match="has a sign between thousands"):
        read_csv(file_of(tmp_path, f"a;b\n1;{cell}\n2;{cell}\n"), sample_rate_hz=1.0)


@pytest.mark.nightly
def test_a_table_of_thousands_of_columns(tmp_path: Path) -> None:
    names = [f"a long name of channel {number}" for number in range(4000)]
    row = ",".join(map(str, range(4000)))
    series = only(file_of(tmp_path, ",".join(names) + f"\n{row}\n{row}\n"), sample_rate_hz=1.0)
    assert [channel.name for channel in series.channels] == names
    np.testing.assert_array_equal(series.values[:, 1], np.arange(4000))


def test_an_unknown_unit_costs_only_the_unit(tmp_path: Path) -> None:
    contents = read_csv(file_of(tmp_path, "a [g],b [furlongs]\n1,2\n3,4\n"), sample_rate_hz=1.0)
    (series,) = contents.series
    np.testing.assert_allclose(series.values, [[9.80665, 3 * 9.80665], [2, 4]])
    assert [channel.unit for channel in series.channels] == ["m/s^2", "1"]
    assert (
        "channel 'b': its unit can't be read, and its numbers are taken without one: unit 'furlongs': not known"
        in contents.notes[0]
    )


def series_of(values: np.ndarray, valid: np.ndarray | None = None, **fields: object) -> TimeSeries:
    channels = tuple(Channel(name=f'/a.x, "{row}"', unit="(m/s^2)/N") for row in range(len(values)))
    options = {"values": values, "valid": valid, "sample_rate_hz": 1e3 / 3, "channels": channels}
    return TimeSeries(**(options | fields))


@given(values=arrays(np.float64, (2, 40), elements=st.floats(-1e300, 1e300)), start_ns=st.sampled_from([0, START_NS]))
def test_every_digit_comes_back(tmp_path_factory: pytest.TempPathFactory, values: np.ndarray, start_ns: int) -> None:
    series = series_of(values, start_time_ns=start_ns)
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    assert write_csv(series, path) == ()
    again = only(path)
    np.testing.assert_array_equal(again.values, values)
    assert again.channels == series.channels
    # The times are rounded to a nanosecond, so the rate is known to that over the duration.
    assert again.sample_rate_hz == pytest.approx(1e3 / 3, rel=1e-9 / series.duration_s)
    assert abs(again.start_time_ns - start_ns) <= 1


def test_gaps_come_back(tmp_path: Path) -> None:
    valid = np.ones((2, 100), dtype=bool)
    valid[:, 30:40] = False
    valid[1, 70] = False
    series = series_of(np.random.default_rng(2).standard_normal((2, 100)), valid)
    write_csv(series, tmp_path / "a.csv")
    again = only(tmp_path / "a.csv")
    np.testing.assert_array_equal(again.valid, valid)
    np.testing.assert_array_equal(again.values[valid], series.values[valid])
    assert len((tmp_path / "a.csv").read_text().splitlines()) == 91


def test_losses_are_told(tmp_path: Path) -> None:
    channel = Channel(name="a", point="wrist")
    valid = np.array([[False, True, True]])
    series = TimeSeries(values=np.zeros((1, 3)), sample_rate_hz=1.0, channels=(channel,), valid=valid)
    losses = write_csv(series, tmp_path / "a.csv")
    assert "no points" in losses[0]
    assert "at the start or end are left out" in losses[1]


def test_the_start_is_in_the_title(tmp_path: Path) -> None:
    write_csv(series_of(np.zeros((1, 2)), start_time_ns=START_NS), tmp_path / "a.csv")
    title = (tmp_path / "a.csv").read_text().splitlines()[0]
    assert title == 'time [s from 1700000000.123456789],"/a.x, ""0"" [(m/s^2)/N]"'


@pytest.mark.parametrize(
    "name",
    [
        "=cmd()",
        "+1",
        "-x",
        "@x",
        "\tx",
        "\rx",
        "a\nb",
        "a\r\nb",
        "'=x",
        "''x",
        "'plain",
        "C:\\new",
        "a\\nb",
        "\u202ea",
    ],
)
def test_a_name_that_a_spreadsheet_would_run_is_text_and_comes_back(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.csv"
    channels = (Channel(name=name, unit="N"), Channel(name="other", unit="m"))
    write_csv(TimeSeries(values=np.ones((2, 4)), sample_rate_hz=1.0, channels=channels), path)
    head, *rows = path.read_bytes().decode().split("\r\n")
    assert (len(rows), visible(head)) == (5, head)
    assert not re.search(r'(^|,)"?[=+@\t\r-]', head)
    assert [channel.name for channel in read_csv(path).series[0].channels] == [name, "other"]


@pytest.mark.parametrize(("unit", "step"), [("s", 0.01), ("ms", 10), ("us", 1e4), ("µs", 1e4), ("μs", 1e4)])
def test_a_title_may_say_the_start_of_times_in_any_unit(tmp_path: Path, unit: str, step: float) -> None:
    rows = "".join(f"{n * step},{n}\n" for n in range(50))
    (series,) = read_csv(file_of(tmp_path, f"time [{unit} from 1700000000.5],a\n{rows}".encode())).series
    assert (series.sample_rate_hz, series.start_time_ns) == (100.0, 1_700_000_000_500_000_000)


def test_columns_that_are_shown_alike_are_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time [s],a\u200b,a\\u200b\n0,1,2\n1,3,4\n2,5,6\n", encoding="utf-8")
    names = [channel.name for channel in read_csv(path).series[0].channels]
    assert names == ["a\u200b", "a\\u200b (2)"]
    assert len({visible(name) for name in names}) == 2


SEPARATORS = "\v\f\x1c\x1d\x1e\x1f\x85\u2028\u2029"


@given(
    remark=st.lists(st.text(st.sampled_from(f'ab #"{SEPARATORS}'), max_size=6), max_size=4),
    mark=st.sampled_from(SEPARATORS),
)
def test_no_mark_above_the_data_costs_a_row(
    tmp_path_factory: pytest.TempPathFactory, remark: list[str], mark: str
) -> None:
    head = "".join(f"# {line}\n" for line in remark)
    text = f"{head}time [s],a{mark}b [N],remark\n" + "".join(f"{n / 8},{n + 0.5},x{mark}y\n" for n in range(40))
    contents = read_csv(file_of(tmp_path_factory.mktemp("csv"), text.encode()))
    (series,) = contents.series
    np.testing.assert_array_equal(series.values, [np.arange(40) + 0.5])
    assert contents.unread[0][0] == "remark"


@pytest.mark.parametrize("cell", ["1_0", "١٠", "１０", "0x10", "1e1_0"])
def test_what_is_no_number_elsewhere_is_none_here(tmp_path: Path, cell: str) -> None:
    rows = "".join(f"{n},{n}\n" for n in range(20))
    contents = read_csv(file_of(tmp_path, f"a,b\n{rows}{cell},3\n"), sample_rate_hz=1.0, time="none")
    assert np.isnan(contents.series[0].values[0, -1])
    assert f"first {cell!r} in line 22" in contents.notes[0]


def test_numbers_above_the_first_row_are_never_passed_over(tmp_path: Path) -> None:
    rows = [f"{n / 100},{n}\n" for n in range(60)]
    with pytest.raises(LogError, match="line 3 has 4 cells where the table has 2 columns"):
        read_csv(file_of(tmp_path, f"time [s],a\n{rows[0]}0.01,1,2,3\n{''.join(rows[1:])}"))
    contents = read_csv(file_of(tmp_path, f"{''.join(rows[:15])}time [s],a\n{''.join(rows[15:])}"))
    np.testing.assert_array_equal(contents.series[0].values, [np.arange(15, 60)])
    assert "15 lines of numbers above the titles left out, the first is line 1." in contents.notes[-1]


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("rows", [["-0."], ["1.5", "2.5", "-3"]])
def test_names_of_several_columns_are_not_the_name_of_one(tmp_path: Path, delimiter: str, rows: list[str]) -> None:
    path = tmp_path / "a.csv"
    path.write_text("\n".join([delimiter.join(["a [N]", "b [m/s^2]", "c"]), *rows]) + "\n")
    with pytest.raises(LogError, match=r"line 2 has 1 column, but none .* \(in quotes where it holds a delimiter\)"):
        read_csv(path, sample_rate_hz=100.0)
    # Both remedies work.
    path.write_text(path.read_text().replace(path.read_text().split("\n")[0], f'"a{delimiter}filtered [N]"'))
    (channel,) = read_csv(path, sample_rate_hz=100.0).series[0].channels
    assert (channel.name, channel.unit) == (f"a{delimiter}filtered", "N")
    path.write_text("\n".join(rows) + "\n")
    assert read_csv(path, sample_rate_hz=100.0).series[0].samples == len(rows)


@pytest.mark.parametrize("title", ["F", "F, filtered", "F;", "# F"])
def test_one_column_may_be_called_so(tmp_path: Path, title: str) -> None:
    (tmp_path / "a.csv").write_text(f"made by; x\n{title}\n1.5\n2.5\n")
    np.testing.assert_array_equal(read_csv(tmp_path / "a.csv", sample_rate_hz=100.0).series[0].values, [[1.5, 2.5]])


def test_a_table_that_joins_topics_of_several_rates_gives_each_its_own(tmp_path: Path) -> None:
    # As PlotJuggler writes them: a row for each message of any topic, blank in the columns of the others.
    fast, slow = np.arange(400) / 100, np.arange(200) / 50 + 0.0013
    rows = [(t, f"{np.sin(t)}", "", "") for t in fast] + [(t, "", f"{np.cos(t)}", "") for t in slow]
    # Events come when they like: they stay beside the others.
    at = sorted(np.random.default_rng(1).choice(rows[:400], 9, replace=False), key=lambda row: float(row[0]))
    events = {float(row[0]) for row in at}
    text = "".join(f"{t:.6f},{x},{y},{1 if t in events else z}\n" for t, x, y, z in sorted(rows))
    (tmp_path / "a.csv").write_text("__time [s],/a/x,/b/y,/event\n" + text)
    first, second = sorted(read_csv(tmp_path / "a.csv").series, key=lambda one: one.samples, reverse=True)
    assert [one.name for one in first.channels] == ["/a/x", "/event"]
    assert [one.name for one in second.channels] == ["/b/y"]
    assert (first.sample_rate_hz, second.sample_rate_hz) == (pytest.approx(100), pytest.approx(50))
    np.testing.assert_allclose(first.values[0], np.sin(fast))
    np.testing.assert_allclose(second.values[0], np.cos(slow))
    assert np.isfinite(first.values[1]).sum() == 9
    assert second.valid is None


@pytest.mark.parametrize("time", ["{:.2f}", "2024-03-05 10:00:{:05.2f}"])
def test_rows_in_falling_order_of_time_are_put_in_order(tmp_path: Path, time: str) -> None:
    values = np.random.default_rng(1).standard_normal(300)
    rows = [f"{time.format(place / 50)},{value}\n" for place, value in enumerate(values.tolist())]
    (tmp_path / "a.csv").write_text("t [s],a\n" + "".join(reversed(rows)))
    found = read_csv(tmp_path / "a.csv")
    assert found.series[0].sample_rate_hz == pytest.approx(50)
    np.testing.assert_allclose(found.series[0].values[0], values)
    assert any("in falling order of time" in note for note in found.notes)
