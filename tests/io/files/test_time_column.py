"""Which column holds the times and what its numbers count: one mechanism, whatever the file."""

from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import feather, parquet
from scipy.io import savemat

from chladni.io.files.columns import Column
from chladni.io.files.contents import FileContents
from chladni.io.files.formats import read_file
from chladni.io.files.time_column import is_row_number, is_time_name
from chladni.io.files.time_reading import TimeOptions, times_of_numbers
from chladni.signals.errors import ChladniError, SetupError

RATE_HZ = 200.0
SAMPLES = 400
INDEX = np.arange(SAMPLES)
SIGNAL = np.sin(2 * np.pi * 7.0 * INDEX / RATE_HZ)
START_S = 1_714_564_800  # 2024-05-01T12:00:00Z


def csv(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = zip(*(map(str, column.tolist()) for column in columns.values()), strict=True)
    path.write_text(",".join(columns) + "\n" + "".join(",".join(row) + "\n" for row in rows))
    return path


def npz(path: Path, columns: dict[str, np.ndarray]) -> Path:
    np.savez(path, **columns)
    return path


def npy(path: Path, columns: dict[str, np.ndarray]) -> Path:
    table = np.empty(SAMPLES, dtype=[(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    np.save(path, table)
    return path


def mat(path: Path, columns: dict[str, np.ndarray]) -> Path:
    savemat(path, columns)
    return path


def parquet_file(path: Path, columns: dict[str, np.ndarray]) -> Path:
    parquet.write_table(pa.table(columns), path)
    return path


def feather_file(path: Path, columns: dict[str, np.ndarray]) -> Path:
    feather.write_feather(pa.table(columns), str(path))
    return path


WRITERS: dict[str, Callable[[Path, dict[str, np.ndarray]], Path]] = {
    ".csv": csv,
    ".npz": npz,
    ".npy": npy,
    ".mat": mat,
    ".parquet": parquet_file,
    ".feather": feather_file,
}

# Name of the times, the times, and what is told of them; None where the unit must be asked for.
UNDERSTOOD = {
    "time_s": (INDEX / RATE_HZ, "seconds by its name"),
    "t_ms": (INDEX * 5, "milliseconds by its name"),
    "timestamp_us": (INDEX * 5000, "microseconds by its name"),
    "t": (INDEX / RATE_HZ, "taken for seconds"),
    "Zeit": (INDEX / RATE_HZ - 0.5, "taken for seconds"),
    "timestamp": (START_S * 10**9 + INDEX * 5_000_000, "nanoseconds since 1970"),
    "TimeStamp": (START_S * 10**6 + INDEX * 5000, "microseconds since 1970"),
    "stamp": (START_S * 10**3 + INDEX * 5, "milliseconds since 1970"),
    "epoch": (START_S + INDEX / RATE_HZ, "seconds since 1970"),
    "time": (45413.5 + INDEX / RATE_HZ / 86400, "days of a spreadsheet"),
    "datenum": (739373.5 + INDEX / RATE_HZ / 86400, "days of MATLAB's datenum by its name"),
    "Timestamp": (2_082_844_800 + START_S + INDEX / RATE_HZ, "seconds since 1904"),
    "elapsed_min": (INDEX / RATE_HZ / 60, "minutes by its name"),
}
# Days since year 0 leave 10 us between two numbers of double precision.
START_TOLERANCE_NS = 30_000


def only(contents: FileContents) -> tuple[float, int, np.ndarray]:
    (series,) = contents.series
    assert [channel.name for channel in series.channels] == ["x"]
    return series.sample_rate_hz, series.start_time_ns, series.values[0]


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize("name", UNDERSTOOD)
def test_times_are_understood_and_said(tmp_path: Path, suffix: str, name: str) -> None:
    times, told = UNDERSTOOD[name]
    path = WRITERS[suffix](tmp_path / f"a{suffix}", {name: times, "x": SIGNAL})
    contents = read_file(path)
    rate_hz, start_ns, values = only(contents)
    assert rate_hz == pytest.approx(RATE_HZ, rel=1e-6)
    np.testing.assert_array_equal(values, SIGNAL)
    dated = "since" in told or "days" in told
    expected_ns = START_S * 10**9 if dated else round(float(times[0]) * 1e9) if name in ("Zeit", "t") else 0
    assert abs(start_ns - expected_ns) < START_TOLERANCE_NS
    assert contents.notes == (f"{path}: times from {name!r}: {told}.",)
    assert contents.time_bases[0] is not None


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize(
    ("times", "unit", "rates"),
    [
        (INDEX * 5, "ms", "0.2 Hz if they count seconds, 200 Hz if they count milliseconds"),
        (INDEX * 5000, "us", "200 Hz if they count microseconds"),
        (INDEX * 5_000_000, "ns", "200 Hz if they count nanoseconds"),
        (INDEX / RATE_HZ / 86400, "days", "Hz if they count hours"),
        # Days of our time, or 8.5 days of a machine that is sampled at 864 kHz.
        (739373.5 + INDEX / 10.0 / 86400, "days", "10.*Hz if they count days"),
        (45413.5 + INDEX / 10.0 / 86400, "days", "10.*Hz if they count days"),
    ],
)
def test_what_can_be_read_in_two_ways_is_asked_for(
    tmp_path: Path, suffix: str, times: np.ndarray, unit: str, rates: str
) -> None:
    path = WRITERS[suffix](tmp_path / f"a{suffix}", {"time": times, "x": SIGNAL})
    rate_hz = 10.0 if rates.startswith("10") else RATE_HZ
    with pytest.raises(SetupError, match=rf"'time' has no unit.*{rates}.*--time-unit s\|ms.*--time none --rate HZ"):
        read_file(path)
    # Each of the remedies works.
    assert only(read_file(path, time_unit=unit))[0] == pytest.approx(rate_hz, rel=1e-6)
    settled = read_file(path, sample_rate_hz=rate_hz)
    assert only(settled)[0] == rate_hz
    assert f"as {rate_hz:g} Hz says" in settled.notes[0]
    left_out = read_file(path, time="none", sample_rate_hz=rate_hz)
    assert only(left_out)[0] == rate_hz
    assert left_out.unread == (("time", "times that weren't asked for"),)


@pytest.mark.parametrize("suffix", WRITERS)
def test_another_column_can_be_named(tmp_path: Path, suffix: str) -> None:
    path = WRITERS[suffix](tmp_path / f"a{suffix}", {"u": INDEX / RATE_HZ, "x": SIGNAL})
    assert only(read_file(path, time="u", time_unit="s"))[0] == pytest.approx(RATE_HZ, rel=1e-9)
    with pytest.raises(SetupError, match="no column 'y' to be the time; columns: u, x"):
        read_file(path, time="y")


@pytest.mark.parametrize("suffix", WRITERS)
def test_two_clocks_that_differ_are_asked_about(tmp_path: Path, suffix: str) -> None:
    columns = {"t": INDEX / RATE_HZ, "time": INDEX / 100.0, "x": SIGNAL}
    path = WRITERS[suffix](tmp_path / f"a{suffix}", columns)
    with pytest.raises(SetupError, match=r"two columns of times differ: 't' spans 1\.995 s, 'time' spans 3\.99 s"):
        read_file(path)
    contents = read_file(path, time="time")
    assert contents.series[0].sample_rate_hz == pytest.approx(100.0, rel=1e-9)


@pytest.mark.parametrize("suffix", WRITERS)
def test_the_finer_of_two_clocks_is_taken(tmp_path: Path, suffix: str) -> None:
    columns = {"date_s": START_S + INDEX // 200, "elapsed_s": INDEX / RATE_HZ, "x": SIGNAL}
    contents = read_file(WRITERS[suffix](tmp_path / f"a{suffix}", columns))
    assert only(contents)[0] == pytest.approx(RATE_HZ, rel=1e-9)
    assert contents.unread == (("date_s", "times as well; time=date_s (--time) takes them"),)


@pytest.mark.parametrize("suffix", WRITERS)
def test_seconds_and_what_is_left_of_them(tmp_path: Path, suffix: str) -> None:
    columns = {"stamp_sec": START_S + INDEX // 200, "stamp_nanosec": INDEX % 200 * 5_000_000, "x": SIGNAL}
    contents = read_file(WRITERS[suffix](tmp_path / f"a{suffix}", columns))
    assert only(contents)[:2] == (pytest.approx(RATE_HZ, rel=1e-9), pytest.approx(START_S * 10**9, abs=2))
    assert "times from 'stamp_sec and stamp_nanosec': seconds and nanoseconds" in contents.notes[0]


FIRST = datetime(2024, 5, 13, 23, 59, 59)  # noqa: DTZ001
FIRST_S = 1_715_644_799
CLOCKS = {
    "iso": ("timestamp", "%Y-%m-%dT%H:%M:%S.%f", FIRST_S, "without zone, taken as UTC"),
    "zulu": ("timestamp", "%Y-%m-%dT%H:%M:%S.%fZ", FIRST_S, "dates."),
    "zone": ("timestamp", "%Y-%m-%d %H:%M:%S.%f+02:00", FIRST_S - 7200, "dates."),
    "basic": ("time", "%Y%m%dT%H%M%S.%f", FIRST_S, "without zone"),
    "German": ("Datum", "%d.%m.%Y %H:%M:%S.%f", FIRST_S, "without zone"),
    "American": ("Date/Time", "%m/%d/%Y %I:%M:%S.%f %p", FIRST_S, "without zone"),
    "MATLAB": ("time", "%d-%b-%Y %H:%M:%S.%f", FIRST_S, "without zone"),
    "clock": ("Time", "%H:%M:%S.%f", 86399, "times of day."),
    "two columns": ("Date,Time", "%Y-%m-%d,%H:%M:%S.%f", FIRST_S, "without zone"),
    "clock first": ("Uhrzeit,Datum", "%H:%M:%S.%f,%d.%m.%Y", FIRST_S, "without zone"),
}


@pytest.mark.parametrize("kind", CLOCKS)
def test_dates_and_times_of_day(tmp_path: Path, kind: str) -> None:
    title, form, start_s, told = CLOCKS[kind]
    # Over midnight, in steps of 5 ms.
    stamps = [(FIRST + timedelta(milliseconds=5 * index)).strftime(form) for index in INDEX.tolist()]
    (tmp_path / "a.csv").write_text(
        f"{title},x\n" + "".join(f"{stamp},{value!r}\n" for stamp, value in zip(stamps, SIGNAL.tolist(), strict=True))
    )
    contents = read_file(tmp_path / "a.csv")
    rate_hz, start_ns, values = only(contents)
    assert rate_hz == pytest.approx(RATE_HZ, rel=1e-9)
    assert start_ns == pytest.approx(start_s * 10**9, abs=2)
    np.testing.assert_array_equal(values, SIGNAL)
    assert told in contents.notes[0]
    if "," not in title:
        parquet.write_table(pa.table({title: stamps, "x": SIGNAL}), tmp_path / "a.parquet")
        assert only(read_file(tmp_path / "a.parquet"))[:2] == (rate_hz, start_ns)


def test_a_date_that_can_be_read_in_two_ways_is_not_used(tmp_path: Path) -> None:
    rows = "".join(f"5/12/2024 10:00:{index / 100:06.3f},{index}\n" for index in range(60))
    (tmp_path / "a.csv").write_text("time,x\n" + rows)
    contents = read_file(tmp_path / "a.csv")
    assert contents.series[0].start_time_ns == 36_000 * 10**9
    assert "may have the day or the month first" in contents.notes[0]


@given(
    start=st.integers(0, 4 * 10**9),
    steps=st.lists(st.integers(0, 10**7), min_size=2, max_size=30),
    unit=st.sampled_from([("s", 9), ("ms", 6), ("us", 3), ("ns", 0)]),
)
def test_text_keeps_every_nanosecond(start: int, steps: list[int], unit: tuple[str, int]) -> None:
    name, digits = unit
    stamps_ns = start * 10**9 + np.cumsum(np.array(steps, dtype=np.int64))
    whole, below = np.divmod(stamps_ns, 10**digits)
    texts = [f"{a}.{b:0{digits}d}" if digits else str(a) for a, b in zip(whole.tolist(), below.tolist(), strict=True)]
    column = Column(name="t", numbers=np.array(texts, dtype=float), text=pa.array(texts), unit=name)
    times = times_of_numbers(column, TimeOptions(), where="a")
    np.testing.assert_array_equal(times.stamps_ns, stamps_ns)


def test_whole_numbers_keep_every_nanosecond() -> None:
    stamps_ns = START_S * 10**9 + np.cumsum(np.random.default_rng(1).integers(1, 10**7, 100))
    times = times_of_numbers(Column(name="stamp", numbers=stamps_ns), TimeOptions(), where="a")
    np.testing.assert_array_equal(times.stamps_ns, stamps_ns)


def test_types_of_time_need_no_words(tmp_path: Path) -> None:
    stamps = np.datetime64(START_S, "s") + INDEX * np.timedelta64(5, "ms")
    for table in (
        pa.table({"when": pa.array(stamps), "x": SIGNAL}),
        pa.table({"when": pa.array(stamps.astype("M8[us]"), pa.timestamp("us", "Europe/Berlin")), "x": SIGNAL}),
    ):
        parquet.write_table(table, tmp_path / "a.parquet")
        contents = read_file(tmp_path / "a.parquet")
        assert only(contents)[:2] == (pytest.approx(RATE_HZ, rel=1e-9), pytest.approx(START_S * 10**9, abs=2))
        assert contents.notes == ()
    np.savez(tmp_path / "a.npz", when=stamps, x=SIGNAL)
    assert only(read_file(tmp_path / "a.npz"))[1] == pytest.approx(START_S * 10**9, abs=2)
    parquet.write_table(pa.table({"time": pa.array(INDEX * np.timedelta64(5, "ms")), "x": SIGNAL}), tmp_path / "b.pq")
    assert only(read_file(tmp_path / "b.pq"))[0] == pytest.approx(RATE_HZ, rel=1e-9)


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_unit_beats_the_name_and_a_rise_tells_a_clock(tmp_path: Path, suffix: str) -> None:
    # A temperature is called T, a period doesn't rise, a reaction time is no clock.
    columns = {"T": np.cos(INDEX), "settling_time": SIGNAL}
    path = WRITERS[suffix](tmp_path / f"a{suffix}", columns)
    contents = read_file(path, sample_rate_hz=RATE_HZ)
    assert [channel.name for channel in contents.series[0].channels] == ["T", "settling_time"]


def test_a_clock_in_another_language_is_told_by_its_unit(tmp_path: Path) -> None:
    rows = "".join(f"{index * 5},{value!r}\n" for index, value in enumerate(SIGNAL.tolist()))
    (tmp_path / "a.csv").write_text("Temps écoulé [ms],x\n" + rows)
    assert only(read_file(tmp_path / "a.csv"))[0] == pytest.approx(RATE_HZ, rel=1e-9)


@pytest.mark.parametrize("suffix", WRITERS)
def test_a_rate_that_the_times_contradict_is_refused(tmp_path: Path, suffix: str) -> None:
    path = WRITERS[suffix](tmp_path / f"a{suffix}", {"time_s": INDEX / RATE_HZ, "x": SIGNAL})
    assert only(read_file(path, sample_rate_hz=RATE_HZ))[0] == RATE_HZ
    with pytest.raises(SetupError, match="times run at 200 Hz, 100 Hz was given"):
        read_file(path, sample_rate_hz=100.0)
    near = read_file(path, sample_rate_hz=200.5)
    assert only(near)[0] == 200.5
    assert "its times run at 200 Hz; 200.5 Hz as given is taken" in near.notes[-1]


@pytest.mark.parametrize("suffix", WRITERS)
def test_times_coarser_than_the_rows_with_the_rate(tmp_path: Path, suffix: str) -> None:
    # 1 kHz, printed to 0.01 s: ten rows of equal time.
    path = WRITERS[suffix](tmp_path / f"a{suffix}", {"time_s": np.round(INDEX / 1000.0, 2), "x": SIGNAL})
    contents = read_file(path, sample_rate_hz=1000.0)
    rate_hz, _, values = only(contents)
    assert rate_hz == 1000.0
    np.testing.assert_array_equal(values, SIGNAL)
    assert "coarser than the rows" in contents.notes[-1]


def test_numbers_of_rows_are_told_from_signals() -> None:
    counted = np.arange(5)
    assert is_row_number(Column(name="index", numbers=counted), first=True)
    assert is_row_number(Column(name="__index_level_0__", numbers=counted), first=False)
    assert not is_row_number(Column(name="index", numbers=counted), first=False)
    assert not is_row_number(Column(name="force", numbers=counted), first=True)
    assert not is_row_number(Column(name="index", numbers=counted * 2), first=True)


@pytest.mark.parametrize(
    "name", ["t", "T", "time", "Time_ms", "timestamps", "/imu.header.stamp", "%time", "tSec", "ms"]
)
def test_names_of_times(name: str) -> None:
    assert is_time_name(name)


@pytest.mark.parametrize("name", ["s", "min", "h", "tau", "time_constant", "force", "stamp_force", "x", "temp", ""])
def test_names_that_are_no_times(name: str) -> None:
    assert not is_time_name(name)


def largest(path: Path, dtype: type, name: str) -> Path:
    """Times as large as their kind of number holds."""
    numbers = np.array([-1, 0, 0.5, 1, 1], dtype) * np.finfo(dtype).max
    return npz(path, {name: numbers, "nsec": numbers * 0, "x": np.arange(5.0)})


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.longdouble])
@pytest.mark.parametrize("name", ["t", "t_ns", "date", "sec", "index"])
def test_numbers_as_large_as_their_kind_holds_are_no_time_and_no_warning(
    tmp_path: Path, dtype: type, name: str
) -> None:
    path = largest(tmp_path / "a.npz", dtype, name)
    told = "has no unit|within 146 years of 1970|don't make a sampled signal|nothing says the sample rate"
    with pytest.raises(ChladniError, match=told):
        read_file(path)


@pytest.mark.parametrize(("name", "second"), [("t_ns", 1e9), ("sec", 1.0)])
def test_the_largest_numbers_of_half_precision_are_times(tmp_path: Path, name: str, second: float) -> None:
    # Five rows over twice 65 504.
    (series,) = read_file(largest(tmp_path / "a.npz", np.float16, name)).series
    assert series.sample_rate_hz == pytest.approx(4 / (2 * 65504) * second)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_times_of_few_digits_are_times(tmp_path: Path, dtype: type) -> None:
    columns = {"t_ms": np.arange(200).astype(dtype), "x": np.arange(200.0) ** 2}
    assert only(read_file(npz(tmp_path / "a.npz", columns)))[0] == 1000.0


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 1e-320, 5e-324, float("nan"), float("inf"), 1e-10])
def test_a_rate_that_can_be_none_is_neither_taken_nor_divided_by(tmp_path: Path, rate_hz: float) -> None:
    columns = {"t": np.arange(50) * 0.01, "x": np.arange(50.0)}
    assert only(read_file(npz(tmp_path / "a.npz", columns | {"fs": np.array(rate_hz)})))[0] == 100.0
    timeless = npz(tmp_path / "b.npz", {"x": columns["x"], "fs": np.array(rate_hz)})
    with pytest.raises(SetupError, match="nothing says the sample rate"):
        read_file(timeless)
    with pytest.raises(SetupError, match="must be finite and positive, its period no centuries"):
        read_file(timeless, sample_rate_hz=rate_hz)
    assert only(read_file(timeless, sample_rate_hz=100.0))[0] == 100.0


def test_rows_that_last_longer_than_nanoseconds_count_are_refused_by_name(tmp_path: Path) -> None:
    path = npz(tmp_path / "a.npz", {"x": np.arange(50.0), "fs": np.array(1e-9)})
    with pytest.raises(ChladniError, match=r"a\.npz: .*farther from 1970 than nanoseconds") as caught:
        read_file(path)
    assert "check the rate" in str(caught.value)


@pytest.mark.parametrize("every", [1, 2, 250])
def test_rows_that_are_written_twice_are_read_once(tmp_path: Path, every: int) -> None:
    # Evenly doubled, shared times look like those of a clock that ticks more slowly than the rows come.
    values = np.random.default_rng(3).standard_normal(2000)
    lines = [f"{place / 1000:.3f},{value:.17g}\n" for place, value in enumerate(values)]
    twice = [line for place, line in enumerate(lines) for line in [line] * (2 if place % every == 0 else 1)]
    path = tmp_path / "twice.csv"
    path.write_text("t [s],a\n" + "".join(twice))
    contents = read_file(path)
    [series] = contents.series
    assert series.sample_rate_hz == 1000.0
    np.testing.assert_array_equal(series.values[0], values)
    assert f"{2000 // every} rows left out: another one has the same time and the same values." in contents.notes[-1]
    [base] = contents.time_bases
    assert base is not None
    assert base.duplicates == 2000 // every


def test_a_clock_that_was_set_back_is_told(tmp_path: Path) -> None:
    times = np.arange(4000) / 1000
    times[2000:] -= 1.0
    path = tmp_path / "back.csv"
    path.write_text("t [s],a\n" + "".join(f"{time:.3f},{place % 7}\n" for place, time in enumerate(times)))
    assert "the clock was set 1 time (-0.999 s)" in " ".join(read_file(path).notes)
