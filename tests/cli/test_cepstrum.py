"""``chladni cepstrum`` on an echo."""

import pytest

from chladni.io.mcap.writer import write_mcap
from chladni.signals.time_series import TimeSeries
from tests.spectral.made_signals import noise
from tests.spectral.test_cepstrum import RATE_HZ, echoed


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("cepstrum") / "log.mcap"
    values = {
        "echo": echoed(0.4, 50, samples=100_000),
        "noise": noise(1, 100_000, seed=8)[0],
        "still": [0.5] * 100_000,
    }
    write_mcap([TimeSeries.from_arrays(values, sample_rate_hz=RATE_HZ, units="m/s^2")], path, layout="batches")
    return path


def test_programs_get_the_cepstrum_and_its_peaks(run, log):
    outcome = run("cepstrum", log, "--resolution", 0.5, "--json", "-")
    assert outcome.code == 0, outcome.err
    document = outcome.document
    assert (document["format"], document["kind"]) == ("chladni.cepstrum/1", "real")
    echo, _ = document["channels"]
    assert len(echo["quefrency_s"]) == len(echo["cepstrum"]) == len(echo["std"])
    peak = echo["peaks"][0]
    assert (peak["quefrency_s"], peak["frequency_hz"]) == (pytest.approx(0.05), pytest.approx(20.0))
    assert peak["cepstrum"] == pytest.approx(0.2, abs=0.01)
    assert document["notes"] == ["channels that never change are left out: /daq.still"]


def test_people_get_a_table_and_a_picture(run, log, tmp_path):
    outcome = run("cepstrum", log, "--kind", "power", "--resolution", 0.5, "--figures", tmp_path)
    assert outcome.code == 0, outcome.err
    assert "Power cepstrum: 99 averages, quefrencies up to 1000 ms" in outcome.out
    (line,) = [line for line in outcome.out.splitlines() if line.startswith("/daq.echo")]
    assert line.split()[1].rstrip(",") == "50"
    assert {path.stem for path in tmp_path.glob("*.png")} == {"cepstrum-1-acceleration"}


def test_a_resolution_that_the_log_has_not_is_told(run, log):
    outcome = run("cepstrum", log, "--resolution", 0.001)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "needs segments of 1000 s" in outcome.err
