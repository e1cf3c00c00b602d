"""Values as tables: names, units, numbers; and what stands in a file is what was in memory."""

import csv
import sys

import numpy as np
import pytest

import chladni
from chladni.signals.modal_scale import ModalScale

LINES = np.array([1.0, 2.0, 4.0])


def series():
    return chladni.TimeSeries.from_arrays(
        {"f": [1.0, 2.0, 3.0], "a": [0.0, np.nan, 0.5]}, sample_rate_hz=10.0, units={"f": "N", "a": "m/s^2"}
    )


def response():
    values = np.arange(12.0).reshape(2, 2, 3) * (1 + 2j)
    return chladni.FrequencyResponse.from_arrays(
        LINES, values, responses=["a", "b"], references=["f", "g"], response_units="m/s^2", reference_units="N"
    )


def modes():
    return chladni.ModeSet.from_arrays([1.0, 2.0], [[1.0, 0.5j, 0.2], [1.0, -0.5, 0.1]], names=["a", "b", "c"])


def test_a_series_is_a_column_for_each_channel_over_seconds():
    pytest.importorskip("pandas", reason="needs the extra [pandas]")
    frame = series().to_pandas()
    assert frame.index.name == "time_s"
    np.testing.assert_allclose(frame.index, [0.0, 0.1, 0.2], rtol=1e-15)
    assert list(frame.columns) == ["f", "a"]
    assert frame.attrs["units"] == {"f": "N", "a": "m/s^2"}
    np.testing.assert_array_equal(frame["a"], [0.0, np.nan, 0.5])


def test_a_response_has_its_pairs_and_what_stands_beside_them():
    pytest.importorskip("pandas", reason="needs the extra [pandas]")
    frame = response().to_pandas()
    assert list(frame.columns)[:4] == ["a / f", "a / g", "b / f", "b / g"]
    assert list(frame.columns)[-3:] == ["a coherence", "b coherence", "excited"]
    np.testing.assert_array_equal(frame["b / f"], response().values[1, 0])
    assert frame.attrs["units"]["b / f std"] == "(m/s^2)/N"
    assert frame.attrs["units"]["a coherence"] == ""


def test_modes_are_a_row_each():
    pytest.importorskip("pandas", reason="needs the extra [pandas]")
    frame = modes().to_pandas()
    assert frame.index.tolist() == [1, 2]
    assert frame["frequency_hz"].tolist() == [1.0, 2.0]
    assert frame["b shapes"].tolist() == [0.5j, -0.5]


def test_a_dataset_has_the_axes_and_one_unit_where_there_is_one():
    pytest.importorskip("xarray", reason="needs the extra [xarray]")
    dataset = response().to_xarray()
    assert dict(dataset.sizes) == {"responses": 2, "references": 2, "frequency_hz": 3}
    assert dataset["values"].attrs["units"] == "(m/s^2)/N"
    np.testing.assert_array_equal(dataset["std"].sel(responses="a", references="g"), np.broadcast_to(np.inf, 3))
    assert "units" not in series().to_xarray()["values"].attrs
    assert chladni.cross_spectra(np.random.default_rng(1).standard_normal((2, 512)), sample_rate_hz=1.0).to_xarray()


def test_a_series_comes_back_from_its_table(tmp_path):
    series().to_csv(tmp_path / "a.csv")
    with chladni.open(tmp_path / "a.csv") as log:
        back = log.read(["f", "a"])
    assert [channel.unit for channel in back.channels] == ["N", "m/s^2"]
    np.testing.assert_allclose(back.values, series().values, rtol=1e-15)


def test_a_table_holds_both_parts_and_leaves_what_is_unknown_empty(tmp_path):
    response().to_csv(tmp_path / "h.csv")
    with (tmp_path / "h.csv").open(newline="", encoding="utf-8") as file:
        titles, *rows = csv.reader(file)
    table = dict(zip(titles, zip(*rows, strict=True), strict=True))
    assert [float(one) for one in table["frequency_hz"]] == LINES.tolist()
    real, imag = (np.array(table[f"b / g {part} [(m/s^2)/N]"], float) for part in ("real", "imag"))
    np.testing.assert_array_equal(real + 1j * imag, response().values[1, 1])
    assert set(table["a / f std [(m/s^2)/N]"]) == {""}
    assert table["excited"] == ("True",) * 3


def test_without_the_extra_the_remedy_is_named(monkeypatch):
    for name, convert in (("pandas", series().to_pandas), ("xarray", series().to_xarray)):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(chladni.SetupError, match=rf"install chladni\[{name}\]"):
            convert()


def test_what_is_no_table_is_refused(tmp_path):
    scale = ModalScale(
        response="a", reference="f", modal_a=np.ones(1) * 1j, modal_mass=np.ones(1), modal_mass_std=np.ones(1)
    )
    with pytest.raises(chladni.SetupError, match="a ModalScale is no table"):
        scale.to_csv(tmp_path / "scale.csv")


def test_levels_and_bands_are_tables_of_their_channels():
    pytest.importorskip("pandas", reason="needs the extra [pandas]")
    time_s = np.arange(20_000) / 1000
    both = chladni.TimeSeries.from_arrays(
        {"f": np.sin(300 * time_s), "a": 2 * np.sin(500 * time_s)},
        sample_rate_hz=1000.0,
        units={"f": "N", "a": "m/s^2"},
    )
    found = chladni.levels(both, bands_hz=[(20.0, 60.0), (60.0, 200.0)])
    frame = found.to_pandas()
    assert list(frame.index) == ["f", "a"]
    assert frame.columns[0] == "20 to 60 Hz rms"
    np.testing.assert_array_equal(frame["60 to 200 Hz rms"], found.rms[:, 1])
    np.testing.assert_array_equal(frame["60 to 200 Hz kurtosis"], found.kurtosis[:, 1])
    running = found.running.to_pandas()
    assert running.attrs["units"]["a / 20 to 60 Hz"] == "m/s^2"
    np.testing.assert_array_equal(running["a / 20 to 60 Hz"], found.running.rms[1, 0])
    octaves = chladni.octaves(both, fraction=1)
    np.testing.assert_array_equal(octaves.to_pandas()["a std"], octaves.bands.std[1])
    (envelope, _) = chladni.envelope(both, band_hz=(50.0, 200.0))
    assert envelope.to_pandas().attrs["units"] == {"amplitude": "N^2"}
