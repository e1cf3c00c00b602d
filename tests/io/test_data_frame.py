"""Data frames as logs: times in a column or the index, of pandas, of polars, and of whatever Arrow takes."""

import numpy as np
import pyarrow as pa
import pytest

import chladni
from chladni.signals.errors import EstimateError, LogError, SetupError

RATE_HZ, SAMPLES = 256.0, 4096
T = np.arange(SAMPLES) / RATE_HZ
COLUMNS = {"a": np.sin(2 * np.pi * 25 * T), "b": np.random.default_rng(1).standard_normal(SAMPLES)}
START_NS = 1_700_000_000_000_000_000


class LikePolars:
    """Names of columns, columns by name, and a stream of Arrow: what polars has, and no index."""

    def __init__(self, columns):
        self._table = pa.table(columns)
        self.columns = self._table.column_names

    def __getitem__(self, name):
        return self._table[name].to_numpy()

    def __arrow_c_stream__(self, requested_schema=None):
        return self._table.__arrow_c_stream__(requested_schema)


def of_pandas(columns):
    return pytest.importorskip("pandas").DataFrame(columns)


def of_polars(columns):
    return pytest.importorskip("polars").DataFrame(columns)


MAKERS = pytest.mark.parametrize("make", [of_pandas, of_polars, LikePolars, pa.table])


@MAKERS
@pytest.mark.parametrize(
    "times",
    [
        {"time": T},
        {"t_ms": 1e3 * T},
        {"when": np.round(T * 1e9).astype(np.int64).astype("datetime64[ns]")},
        {"stamp_ns": START_NS + np.round(T * 1e9).astype(np.int64)},
    ],
    ids=lambda times: next(iter(times)),
)
def test_a_column_of_times_tells_the_rate(make, times):
    expected = chladni.psd(COLUMNS, sample_rate_hz=RATE_HZ)
    found = chladni.psd(make(times | COLUMNS))
    assert [channel.name for channel in found.channels] == ["a", "b"]
    np.testing.assert_allclose(found.frequency_hz, expected.frequency_hz, rtol=1e-9)
    np.testing.assert_allclose(found.values, expected.values, rtol=1e-9, atol=1e-12)


@MAKERS
def test_without_times_the_rate_is_asked_for(make):
    with pytest.raises(SetupError, match=r"no column of the data frame holds times; give sample_rate_hz="):
        chladni.psd(make(COLUMNS))
    found = chladni.psd(make(COLUMNS), sample_rate_hz=RATE_HZ)
    assert found.frequency_hz[found.values[0].argmax()] == 25
    np.testing.assert_array_equal(found.values, chladni.psd(COLUMNS, sample_rate_hz=RATE_HZ).values)
    with pytest.raises(EstimateError, match="'s' holds text, but samples are real numbers; leave it out"):
        chladni.psd(make(COLUMNS | {"s": ["x"] * SAMPLES}), sample_rate_hz=RATE_HZ)


@MAKERS
def test_what_is_missing_is_no_sample(make):
    values = [1.0, None, 3.0, -1.0] * 8
    log = chladni.open(make({"time": T[:32], "a": values}))
    series = log.read()
    assert series.sample_rate_hz == pytest.approx(RATE_HZ)
    np.testing.assert_array_equal(series.valid[0], [one is not None for one in values])
    np.testing.assert_array_equal(series.values[0, ::4], 1.0)


@MAKERS
def test_options_of_the_reader_are_those_of_files(make):
    frame = make({"n": np.arange(SAMPLES), "clock": 1e3 * T, "s": ["x"] * SAMPLES} | COLUMNS)
    log = chladni.open(frame, time="clock", time_unit="ms", units={"a": "g"})
    assert [(one.name, one.unit) for one in log.channels] == [("a", "m/s^2"), ("b", "1")]
    assert log.read(["a"]).values[0] == pytest.approx(9.80665 * COLUMNS["a"])
    assert [one.reason for one in log.unread if one.topic == "s"] == ["not read: text, such as 'x'"]
    with pytest.raises(SetupError, match="the data frame: has no column 'clok'"):
        chladni.open(frame, time="clok")
    with pytest.raises(SetupError, match="setup, stamp and limits are for files"):
        chladni.open(frame, stamp="log")
    with pytest.raises(SetupError, match="its times run at 256 Hz, 100 Hz was given"):
        chladni.psd(make({"time": T} | COLUMNS), sample_rate_hz=100.0)
    with pytest.raises(LogError, match="holds no numbers besides a time column"):
        chladni.open(make({"time": T}))


def test_an_index_of_times_tells_the_rate():
    pandas = pytest.importorskip("pandas")
    series = chladni.TimeSeries.from_arrays(COLUMNS, sample_rate_hz=RATE_HZ)
    dated = pandas.DataFrame(COLUMNS, index=pandas.to_datetime(START_NS + np.round(T * 1e9).astype(np.int64)))
    for frame in (dated, series.to_pandas(), pandas.DataFrame(COLUMNS | {"time": T}).set_index("time")):
        assert chladni.open(frame).read().sample_rate_hz == pytest.approx(RATE_HZ)
    assert chladni.open(dated).start_time_ns == START_NS
    # Rows that were chosen keep their numbers: neither times nor samples.
    chosen = pandas.DataFrame({"time": T} | COLUMNS)[100:3000:2]
    assert [one.name for one in chladni.open(chosen).channels] == ["a", "b"]
    with pytest.raises(SetupError, match="no column of the data frame holds times"):
        chladni.psd(pandas.DataFrame(COLUMNS)[::2])


def test_a_frame_that_holds_no_numbers_yet_is_told():
    class Lazy:
        columns = ("a",)

        def __getitem__(self, name):
            raise TypeError("not subscriptable")

    with pytest.raises(EstimateError, match=r"a Lazy holds no numbers yet; give what \.collect\(\) makes of it"):
        chladni.psd(Lazy(), sample_rate_hz=RATE_HZ)


def test_a_channel_by_its_name_is_one_row():
    with pytest.raises(EstimateError, match=r"a: values have shape \(8, 2\), but a channel by its name must be"):
        chladni.TimeSeries.from_arrays({"a": np.ones((8, 2))}, sample_rate_hz=1.0)
    assert chladni.TimeSeries.from_arrays({"a": np.ones((8, 1))}, sample_rate_hz=1.0).samples == 8
