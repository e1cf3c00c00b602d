"""CSV tables as people write them, real ones, and round trips."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from chladni.io.files.csv import read_csv, write_csv
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.time_series import TimeSeries

START_NS = 1_700_000_000_123_456_789


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
    with pytest.raises(SetupError, match="'column_1' rises like a time but has no unit"):
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
        ("a,b\n1,2\n3,x4\n", r"line 3, column 'b': 'x4' is no number"),
        ("a;b\n1,5;2\n3;1,2,3\n", r"line 3, column 'b': '1,2,3' is no number"),
        ("a,b\n1,2\n3\n", "line 3 has 1 cells where the table has 2"),
        ("a,b\n1,2\n1,2\n1,2\n3,4,5\n", "line 5 has 3 cells where the table has 2"),
        ("", "no line of numbers"),
        ("all text\nand more\n", "no line of numbers"),
        ("a,b,c\n1,2\n3,4\n", "line 2 has 2 columns, but none of the lines above it has as many names"),
        ("a,a\n1,2\n", "column 2 has the name 'a' again"),
        ("a,\n1,2\n", "column 2 has no name"),
    ],
)
def test_mistakes_name_line_and_column(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(LogError, match=match):
        read_csv(file_of(tmp_path, text), sample_rate_hz=1.0)


@pytest.mark.parametrize(
    ("text", "options", "error", "match"),
    [
        ("a\n3\n2\n", {}, SetupError, "give the sample rate"),
        ("time,a\n1,2\n", {"sample_rate_hz": 2.0}, SetupError, "leave the sample rate out"),
        ("time [years],a\n1,2\n", {}, SetupError, "the unit 'years'"),
        ("a [furlongs]\n1\n", {"sample_rate_hz": 2.0}, SetupError, "channel 'a'.*furlongs"),
        ("a\n1\n", {"sample_rate_hz": 2.0, "units": {"b": "N"}}, SetupError, "no column 'b'"),
        ("a\n1\n", {"sample_rate_hz": 2.0, "names": ["b", "c"]}, SetupError, "1 columns, but 2 names"),
        ("time\n1\n2\n", {}, LogError, "a time column and nothing else"),
        (
            "time,a\n" + "".join(f"{n},2\n" for n in range(50)) + "1e9,3\n",
            {},
            LogError,
            "don't make a sampled signal",
        ),
        ("time [s from 99999999999],a\n1,2\n", {}, LogError, "within 146 years"),
        ("time,a\n1,2\n,3\n", {}, LogError, "row 2 has no time"),
        ("time,a\n1,2\n1e300,3\n", {}, LogError, "within 146 years"),
    ],
)
def test_what_is_not_said_is_asked_for(
    tmp_path: Path, text: str, options: dict[str, object], error: type[Exception], match: str
) -> None:
    with pytest.raises(error, match=match):
        read_csv(file_of(tmp_path, text), **options)


def test_a_mistake_far_down_is_found_at_its_line(tmp_path: Path) -> None:
    text = "a,b\n" + "1,2\n" * 70_000 + "3,oops\n"
    with pytest.raises(LogError, match="line 70002, column 'b'"):
        read_csv(file_of(tmp_path, text), sample_rate_hz=1.0)


def series_of(values: np.ndarray, valid: np.ndarray | None = None, **fields: object) -> TimeSeries:
    channels = tuple(Channel(name=f'/a.x, "{row}"', unit="(m/s^2)/N") for row in range(len(values)))
    options = {"values": values, "valid": valid, "sample_rate_hz": 1e3 / 3, "channels": channels}
    return TimeSeries(**(options | fields))


@settings(max_examples=30, deadline=None)
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
