"""Parquet, Feather and Arrow files: round trips, metadata, files cut short, and what is left out."""

import json
from decimal import Decimal
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import feather, ipc, parquet

from chladni.io.files.parquet import read_arrow, write_arrow
from chladni.signals.channel import Channel
from chladni.signals.errors import ChladniError, LogError, SetupError
from chladni.signals.testing import assert_close
from chladni.signals.time_series import TimeSeries

SUFFIXES = (".parquet", ".feather", ".arrow")
CHANNELS = (
    Channel(name="/wrist.accel.linear.z", unit="m/s^2", point="wrist", direction=(0.0, 0.6, 0.8), overload=500.0),
    Channel(name="time", unit="N", role="reference"),
)
SAMPLES = 60
SIGNAL = np.sin(np.arange(SAMPLES))


def series_of(samples: int = 20, **fields: object) -> TimeSeries:
    values = np.random.default_rng(5).standard_normal((2, samples))
    options = {"values": values, "sample_rate_hz": 1e3 / 3, "start_time_ns": 1_700_000_000_123_456_789}
    return TimeSeries(**(options | {"channels": CHANNELS} | fields))


@given(
    suffix=st.sampled_from(SUFFIXES),
    samples=st.integers(1, 30),
    dtype=st.sampled_from([np.float32, np.float64]),
    gaps=st.booleans(),
    seed=st.integers(0, 99),
)
def test_all_comes_back(
    tmp_path_factory: pytest.TempPathFactory, suffix: str, samples: int, dtype: type, gaps: bool, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.standard_normal((2, samples)).astype(dtype)
    valid = rng.random((2, samples)) > 0.3 if gaps else None
    if valid is not None:
        values[~valid] = np.nan
    series = series_of(samples, values=values, valid=None if valid is None or valid.all() else valid)
    path = tmp_path_factory.mktemp("arrow") / f"a{suffix}"
    assert write_arrow(series, path) == ()
    (again,) = read_arrow(path).series
    assert again.values.dtype == dtype
    assert_close(again, series, rtol=0.0)


def test_others_find_times_and_units(tmp_path: Path) -> None:
    series = series_of()
    write_arrow(series, tmp_path / "a.parquet")
    table = parquet.ParquetFile(tmp_path / "a.parquet").read()
    np.testing.assert_array_equal(table.column(0).to_numpy().astype(np.int64), series.times_ns())
    assert table.schema.field(1).metadata == {b"unit": b"m/s^2"}


def test_several_rates_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="an Arrow table holds channels of one rate"):
        write_arrow([series_of(), series_of(sample_rate_hz=5.0)], tmp_path / "a.parquet")


def written(path: Path, table: pa.Table) -> Path:
    if path.suffix == ".parquet":
        parquet.write_table(table, path)
    else:
        feather.write_feather(table, str(path), compression="uncompressed" if path.suffix == ".arrow" else "zstd")
    return path


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_units_and_rate_from_the_metadata(tmp_path: Path, suffix: str) -> None:
    schema = pa.schema(
        [
            pa.field("a", pa.float64(), metadata={"unit": "g"}),
            pa.field("b [mm]", pa.float32()),
            pa.field("c", pa.int16()),
        ],
        metadata={"sample_rate_hz": "200", "units": json.dumps({"c": "kN"})},
    )
    table = pa.table([SIGNAL, SIGNAL.astype(np.float32), np.arange(SAMPLES, dtype=np.int16)], schema=schema)
    path = written(tmp_path / f"a{suffix}", table)
    (series,) = read_arrow(path).series
    assert [(channel.name, channel.unit) for channel in series.channels] == [("a", "m/s^2"), ("b", "m"), ("c", "N")]
    np.testing.assert_allclose(series.values[0], SIGNAL * 9.80665, rtol=1e-15)
    assert series.sample_rate_hz == 200.0
    (series,) = read_arrow(path, units={"a": "V"}).series
    assert series.channels[0].unit == "V"


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_no_number_costs_nothing_else(tmp_path: Path, suffix: str) -> None:
    table = pa.table(
        {
            "x": SIGNAL,
            "state": pa.array(["on"] * SAMPLES).dictionary_encode(),
            "shape": pa.array([[1.0, 2.0]] * SAMPLES),
            "nothing": pa.nulls(SAMPLES, pa.float64()),
            "flag": np.arange(SAMPLES) % 2 == 0,
            "money": pa.array([Decimal("1.50")] * SAMPLES, pa.decimal128(10, 2)),
            "gappy": pa.array([None if index == 3 else index for index in range(SAMPLES)], pa.int32()),
        }
    )
    contents = read_arrow(written(tmp_path / f"a{suffix}", table), sample_rate_hz=200.0)
    (series,) = contents.series
    assert [channel.name for channel in series.channels] == ["x", "flag", "money", "gappy"]
    np.testing.assert_array_equal(series.values[3], np.where(np.arange(SAMPLES) == 3, np.nan, np.arange(SAMPLES)))
    np.testing.assert_array_equal(series.values[1:3, :2], [[1, 0], [1.5, 1.5]])
    reasons = dict(contents.unread)
    assert reasons["state"] == "text, such as 'on'"
    assert reasons["nothing"] == "empty"
    assert "no column of numbers" in reasons["shape"]


def test_an_index_that_pandas_left_is_no_signal(tmp_path: Path) -> None:
    table = pa.table({"x": SIGNAL, "__index_level_0__": np.arange(SAMPLES)})
    contents = read_arrow(written(tmp_path / "a.parquet", table), sample_rate_hz=200.0)
    assert [channel.name for channel in contents.series[0].channels] == ["x"]
    assert contents.unread == (("__index_level_0__", "it numbers the rows"),)


def test_without_rate_or_times_it_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match="give the sample rate"):
        read_arrow(written(tmp_path / "a.parquet", pa.table({"x": SIGNAL})))


def batches_of(path: Path, count: int, *, stream: bool) -> bytes:
    table = pa.table({"t_s": np.arange(SAMPLES * count) / 200, "x": np.arange(SAMPLES * count, dtype=float)})
    with (ipc.new_stream if stream else ipc.new_file)(path, table.schema) as writer:
        writer.write_table(table, max_chunksize=SAMPLES)
    return path.read_bytes()


@pytest.mark.parametrize("stream", [True, False])
def test_what_was_never_closed_is_read_as_far_as_it_goes(tmp_path: Path, stream: bool) -> None:
    path = tmp_path / "a.arrow"
    raw = batches_of(path, 5, stream=stream)
    np.testing.assert_array_equal(read_arrow(path).series[0].values, [np.arange(5 * SAMPLES)])
    path.write_bytes(raw[: 7 * len(raw) // 10])
    contents = read_arrow(path)
    (series,) = contents.series
    assert 0 < series.samples < 5 * SAMPLES
    assert series.samples % SAMPLES == 0
    np.testing.assert_array_equal(series.values, [np.arange(series.samples)])
    assert f"cut short or damaged: {series.samples} rows are read" in contents.notes[0]


def test_the_size_is_checked_before_memory_is_taken(tmp_path: Path) -> None:
    # Equal numbers pack to a few bytes, whatever their count.
    path = written(tmp_path / "a.parquet", pa.table({"x": np.zeros(2_000_000)}))
    assert path.stat().st_size < 50_000
    with pytest.raises(LogError, match="its content takes 16000000 bytes in memory or more, 1000000 are allowed"):
        read_arrow(path, sample_rate_hz=1.0, max_bytes=1_000_000)
    path = written(tmp_path / "a.arrow", pa.table({"x": np.zeros(200_000)}))
    with pytest.raises(LogError, match="raise max_bytes"):
        read_arrow(path, sample_rate_hz=1.0, max_bytes=1_000_000)


def test_a_page_of_parquet_whose_checksum_is_wrong_costs_its_column(tmp_path: Path) -> None:
    table = pa.table({"x": SIGNAL, "y": SIGNAL + 2})
    path = tmp_path / "a.parquet"
    parquet.write_table(
        table, path, write_page_checksum=True, compression="none", use_dictionary=False, write_statistics=False
    )
    raw = bytearray(path.read_bytes())
    raw[raw.index(SIGNAL.tobytes()) + 8] ^= 1
    path.write_bytes(raw)
    contents = read_arrow(path, sample_rate_hz=1.0)
    np.testing.assert_array_equal(contents.series[0].values, [SIGNAL + 2])
    assert [name for name, _ in contents.unread] == ["x"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_garbage_is_one_line(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"a{suffix}").write_bytes(b"not at all " * 30)
    with pytest.raises(LogError, match="can't be read"):
        read_arrow(tmp_path / f"a{suffix}")


def test_a_damaged_description_of_our_own_is_told(tmp_path: Path) -> None:
    for text in ("", "[1]", '{"names": ["x"]}', "{"):
        table = pa.table({"time": np.arange(3), "x": np.arange(3.0)})
        table = table.replace_schema_metadata({"format": "chladni.series/1", "series": text})
        with pytest.raises(LogError):
            read_arrow(written(tmp_path / "a.parquet", table))


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_wrong_bytes_never_crash(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    table = pa.table({"t_s": np.arange(SAMPLES) / 200, "x": SIGNAL, "state": ["on"] * SAMPLES})
    raw = written(path, table).read_bytes()
    rng = np.random.default_rng(2)
    refused = 0
    for _ in range(150):
        changed = bytearray(raw)
        for place in rng.integers(0, len(raw), 3):
            changed[place] = rng.integers(256)
        path.write_bytes(changed)
        try:
            read_arrow(path)
        except ChladniError:
            refused += 1
    assert refused > 10
