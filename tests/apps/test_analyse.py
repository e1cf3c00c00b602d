import numpy as np
import pytest

import chladni
from chladni.apps import analyse as analyse_module
from chladni.io import source
from chladni.signals.channel import Channel
from chladni.signals.errors import EstimateError, LogError
from chladni.signals.time_series import TimeSeries
from tests.arm import FORCE, TOOL, WRIST, short_arm, write_arm


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = write_arm(tmp_path_factory.mktemp("arm"))
    with chladni.open_log(path, setup=path.with_name("setup.toml")) as log:
        return chladni.analyse(log, resolution_hz=0.5)


def test_everything_is_in_the_study(study):
    (series,), (density,), (fall,) = study.series, study.densities, study.waterfalls
    assert series.samples == 25_000
    assert len(series.channels) == len(density.channels) == len(fall.channels) == 6
    assert study.response.references[0].name == FORCE
    assert len(study.response.responses) == 5
    assert [point.name for point in study.geometry.points] == ["base", "column", "arm", "wrist", "tool"]


def test_peaks_lie_at_the_natural_frequencies(study):
    highest = study.response_peaks[0]
    natural_hz = short_arm().modes.frequency_hz
    assert np.min(np.abs(natural_hz / highest.frequency_hz - 1)) < 0.01
    assert study.peaks


def test_findings_tell_length_gap_and_peaks(study):
    told = " ".join(study.findings)
    assert study.findings[0].startswith("25 s, 6 channels at 1000 Hz")
    assert "250 samples missing in 1 gap" in told
    assert "Strongest frequencies" in told
    assert f"Highest peaks over {FORCE}" in told
    assert len(study.findings) == len(set(study.findings))


def test_a_log_without_force_has_no_response(tmp_path):
    rng = np.random.default_rng(1)
    channels = tuple(Channel(name=f"/imu.linear_acceleration.{axis}", unit="m/s^2") for axis in "xyz")
    chladni.write_mcap(
        TimeSeries(values=rng.standard_normal((3, 5000)), sample_rate_hz=100.0, channels=channels),
        tmp_path / "imu.mcap",
    )
    with chladni.open_log(tmp_path / "imu.mcap") as log:
        study = chladni.analyse(log)
        assert study.response is None
        assert any("No peak stands out" in finding for finding in study.findings)
        chosen = chladni.analyse(log, references=[channels[0].name])
        assert len(chosen.response.responses) == 2
        with pytest.raises(LogError, match="did you mean"):
            chladni.analyse(log, references=["/imu.linear_acceleration.q"])
        with pytest.raises(EstimateError):
            chladni.analyse(log, end_s=0.02)


def test_only_the_channels_asked_for(tmp_path):
    with chladni.open_log(write_arm(tmp_path)) as log:
        alone = chladni.analyse(log, channels=[FORCE])
        pair = chladni.analyse(log, channels=[FORCE, WRIST], start_s=1.0, end_s=11.0)
    assert alone.response is None
    assert [channel.name for channel in pair.response.responses] == [WRIST]
    assert pair.series[0].duration_s == pytest.approx(10.0)


def test_a_log_too_large_to_draw_is_drawn_in_part_and_said_so(tmp_path, monkeypatch):
    monkeypatch.setattr(source, "IN_MEMORY_BYTES", 0)
    with chladni.open_log(write_arm(tmp_path)) as log:
        whole = chladni.analyse(log, channels=[TOOL])
        monkeypatch.setattr(analyse_module, "MOST_VALUES_DRAWN", 10_000)
        part = chladni.analyse(log, channels=[TOOL])
    assert whole.series[0].duration_s == pytest.approx(25.0)
    assert part.series[0].duration_s == pytest.approx(10.0)
    assert any("show 10 s from 0 s on, of 25 s" in finding for finding in part.findings)
    np.testing.assert_array_equal(part.densities[0].values, whole.densities[0].values)
