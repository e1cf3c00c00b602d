"""All that a universal file holds, through one door: time records, functions, modes, points; one damaged part."""

from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.io.files.uff import write_uff
from chladni.io.files.uff_contents import read_universal_file
from chladni.io.files.uff_modes import write_uff_modes
from chladni.signals.channel import Channel
from chladni.signals.errors import LogError, SetupError
from chladni.signals.frequency_response import FrequencyResponse
from chladni.signals.provenance import Provenance
from chladni.signals.testing import assert_close
from chladni.signals.time_series import TimeSeries
from tests.io.files.test_uff import text_set
from tests.modal.shapes.test_joint_treatment import GEOMETRY, scaled_modes

TIP = Channel(name="2:+3", unit="m/s^2", point="2", direction=(0.0, 0.0, 1.0))
HAMMER = Channel(name="1:+3 (reference)", unit="N", point="1", direction=(0.0, 0.0, 1.0), role="reference")


def functions(unit: str = "m/s^2") -> FrequencyResponse:
    """Accelerance of 2 kg on a spring at 40 Hz, 1 % damping."""
    frequency_hz = np.arange(1.0, 201.0)
    ratio = frequency_hz / 40.0
    values = (-(ratio**2) / (1 - ratio**2 + 0.02j * ratio) / 2.0)[np.newaxis, np.newaxis]
    return FrequencyResponse(
        frequency_hz=frequency_hz,
        values=values,
        std=np.full(values.shape, np.inf),
        coherence=np.full((1, 200), np.nan),
        excited=np.ones(200, dtype=bool),
        responses=(Channel(name=TIP.name, unit=unit, point=TIP.point, direction=TIP.direction),),
        references=(HAMMER,),
        provenance=Provenance(estimator="as in the file"),
    )


def write_functions(path: Path, unit: str = "m/s^2") -> Path:
    write_uff_modes(path, scaled_modes(), geometry=GEOMETRY, response=functions(unit))
    return path


def write_records(path: Path) -> TimeSeries:
    values = np.random.default_rng(5).standard_normal((1, 64))
    series = TimeSeries(values=values, sample_rate_hz=128.0, channels=(Channel(name="acc", unit="m/s^2", point="7"),))
    write_uff(series, path)
    return series


def test_everything_is_read_at_once(tmp_path: Path) -> None:
    series = write_records(tmp_path / "records.uff")
    whole = tmp_path / "whole.uff"
    whole.write_bytes(
        write_functions(tmp_path / "functions.uff").read_bytes() + (tmp_path / "records.uff").read_bytes()
    )
    found = read_universal_file(whole)
    np.testing.assert_array_equal(found.series[0].values, series.values)
    assert found.functions is not None
    np.testing.assert_allclose(found.functions.values, functions().values, rtol=1e-12)
    assert found.modes is not None
    np.testing.assert_allclose(found.modes.frequency_hz, scaled_modes().frequency_hz, rtol=1e-5)
    assert {point.name for point in GEOMETRY.points} <= {point.name for point in found.geometry.points}
    assert found.unread == ()


def test_functions_are_listed(tmp_path: Path) -> None:
    with chladni.open(write_functions(tmp_path / "a.uff")) as log:
        document = log.info().to_json()
        assert log.channels == ()
    assert document["channels"] == []
    assert document["functions"] == [
        {"response": "2:+3", "reference": "1:+3 (reference)", "unit": "(m/s^2)/N", "lines": 200, "low_hz": 1.0,
         "high_hz": 200.0}
    ]  # fmt: skip


def test_a_file_of_functions_says_so_when_samples_are_asked_for(tmp_path: Path) -> None:
    with chladni.open(write_functions(tmp_path / "a.uff")) as log:
        count = scaled_modes().frequency_hz.size
        words = rf"a\.uff: holds 1 frequency response and {count} modes, but no samples over time; chladni frf a\.uff"
        with pytest.raises(LogError, match=words):
            log.read()
        with pytest.raises(LogError, match=words):
            chladni.psd(log)


def test_one_damaged_part_costs_no_other(tmp_path: Path) -> None:
    series = write_records(tmp_path / "records.uff")
    torn = text_set(kind=4, values=[1.0, 2.0, 3.0, 4.0]).replace("1.00000e+00", "1.00e+zz00")
    whole = tmp_path / "whole.uff"
    whole.write_bytes((tmp_path / "records.uff").read_bytes() + torn.encode())
    found = read_universal_file(whole)
    np.testing.assert_array_equal(found.series[0].values, series.values)
    ((part, reason),) = found.unread
    assert part == "dataset 3"
    assert "where a number is due" in reason
    assert str(whole) not in reason


def test_functions_of_other_types_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text(text_set() + text_set(kind=9) + text_set(kind=9))
    found = read_universal_file(tmp_path / "a.uff")
    assert len(found.series) == 1
    assert [part for part, _ in found.unread] == ["power spectral density (2)"]
    (tmp_path / "b.uff").write_text(text_set(kind=9))
    with chladni.open(tmp_path / "b.uff") as log:
        assert log.info().to_json()["unread"][0]["name"] == "power spectral density (1)"
        with pytest.raises(LogError, match=r"b\.uff: holds no samples over time; power spectral density \(1\): not"):
            log.read()


def test_a_file_of_nothing_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.uff").write_text("    -1\n   151\nname\n    -1\n")
    with pytest.raises(LogError, match=r"holds no function, mode or measurement point, but datasets 151 \(1\)"):
        read_universal_file(tmp_path / "a.uff")


@pytest.mark.parametrize(("label", "stated", "factor"), [("1", "g", 9.80665), ("m/s^2", "mm/s^2", 1e-3)])
def test_the_unit_of_a_function_can_be_stated(tmp_path: Path, label: str, stated: str, factor: float) -> None:
    path = write_functions(tmp_path / "a.uff", label)
    (tmp_path / "setup.toml").write_text(
        f'format = "chladni.setup/1"\n[[channel]]\npath = "2:+3"\nunit = "{stated}"\n'
    )
    for options in ({"units": {"2:+3": stated}}, {"setup": tmp_path / "setup.toml"}):
        with chladni.open(path, **options) as log:
            assert log.functions is not None
            assert log.functions.unit(0, 0) == "(m/s^2)/N"
            np.testing.assert_allclose(log.functions.values, factor * functions().values, rtol=1e-12)


def test_points_of_functions_come_from_the_setup_file(tmp_path: Path) -> None:
    (tmp_path / "setup.toml").write_text(
        'format = "chladni.setup/1"\n[[point]]\nname = "tip"\nposition = [0, 0, 1]\n'
        '[[channel]]\npath = "2:+3"\npoint = "tip"\ndirection = "-z"\n'
    )
    with chladni.open(write_functions(tmp_path / "a.uff"), setup=tmp_path / "setup.toml") as log:
        assert log.functions is not None
        assert (log.functions.responses[0].point, log.functions.responses[0].direction) == ("tip", (0, 0, -1))
        assert [point.name for point in log.geometry.points][-1] == "tip"
        np.testing.assert_allclose(log.functions.values, functions().values, rtol=1e-12)


def test_an_unknown_channel_is_told(tmp_path: Path) -> None:
    path = write_functions(tmp_path / "a.uff")
    with pytest.raises(SetupError, match=r"has no channel '9:\+3' to give a unit"):
        chladni.open(path, units={"9:+3": "g"})
    (tmp_path / "setup.toml").write_text('format = "chladni.setup/1"\n[[channel]]\npath = "2:+2"\nunit = "g"\n')
    with pytest.raises(SetupError, match=r"a\.uff has no channel '2:\+2'; did you mean 2:\+3"):
        chladni.open(path, setup=tmp_path / "setup.toml")


# --- what the functions give -------------------------------------------------------------------------------------


def test_functions_that_a_file_holds_are_the_transfer_functions(tmp_path: Path) -> None:
    with chladni.open(write_functions(tmp_path / "a.uff")) as log:
        found = chladni.frf(log)
        assert_close(found, log.functions, rtol=0)
        assert_close(chladni.frf(log, references=HAMMER.name, responses=TIP.name), log.functions, rtol=0)
        modes = chladni.identify_modes(log, band_hz=(20, 80))
        study = chladni.analyse(log)
    assert modes.frequency_hz == pytest.approx([40.0], rel=1e-6)
    assert modes.damping_ratio == pytest.approx([0.01], rel=1e-4)
    assert study.findings[0].startswith("1 frequency response.")
    assert study.response is not None
    # The magnitude of an accelerance peaks at f0/sqrt(1 - 2 zeta^2); lines are 1 Hz apart.
    peaks = chladni.find_response_peaks(found)
    assert [peak.frequency_hz for peak in peaks] == pytest.approx([40.0 / np.sqrt(1 - 2e-4)], abs=0.05)


def test_a_file_of_modes_gives_its_modes(tmp_path: Path) -> None:
    write_uff_modes(tmp_path / "a.uff", scaled_modes(), geometry=GEOMETRY)
    with chladni.open(tmp_path / "a.uff") as log:
        assert chladni.identify_modes(log).frequency_hz == pytest.approx(scaled_modes().frequency_hz, rel=1e-5)
        with pytest.raises(LogError, match=r"modes, but no samples over time; chladni modes a\.uff"):
            chladni.frf(log)


@pytest.mark.parametrize("binary", [True, False])
def test_values_go_out_and_come_back_by_one_verb_each(tmp_path, binary):
    rtol = 0 if binary else 1e-11
    response = chladni.FrequencyResponse.from_arrays(
        np.arange(1.0, 5.0), np.arange(8.0).reshape(2, 1, 4) * (1 + 2j), responses=["a", "b"], references="f",
        response_units="m/s^2", reference_units="N",
    )  # fmt: skip
    modes = chladni.ModeSet.from_arrays([2.0, 3.0], [[1.0, 0.5], [0.25, 1.0]], damping_ratio=0.01, rows="modes")
    chladni.write_uff([response, modes], tmp_path / "both.uff", binary=binary)
    chladni.write_uff(response, tmp_path / "functions.uff", binary=binary)
    for name in ("both.uff", "functions.uff"):
        with chladni.open(tmp_path / name) as log:
            back = chladni.frf(log)
            found = log.modes
        np.testing.assert_allclose(back.values, response.values, rtol=rtol)
        assert [channel.unit for channel in back.responses] == ["m/s^2", "m/s^2"]
        assert (found is None) == (name == "functions.uff")
        if found is not None:
            np.testing.assert_allclose(found.frequency_hz, modes.frequency_hz, rtol=1e-15)
            np.testing.assert_allclose(chladni.mac(found.shapes, modes.shapes, rows="modes").values.diagonal(), 1.0)
    series = chladni.TimeSeries.from_arrays([1.0, 2.0, 3.0], sample_rate_hz=10.0)
    chladni.write_uff(series, tmp_path / "series.uff", binary=binary)
    assert chladni.open(tmp_path / "series.uff").read().values.tolist() == [[1.0, 2.0, 3.0]]
    with pytest.raises(chladni.LogError, match="write a file for each"):
        chladni.write_uff([series, modes], tmp_path / "none.uff")
