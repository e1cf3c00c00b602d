"""What lies above --fmax is left out of tables, documents and figures."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.time_series import TimeSeries
from tests.cli.conftest import Run

RATE_HZ = 500.0
#: Resonances of the tip.
LOW_HZ, HIGH_HZ = 40.0, 120.0


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Noise through two resonances of 2 % damping."""
    force = np.random.default_rng(3).standard_normal(40_000)
    tip = np.zeros(force.size)
    for natural_hz in (LOW_HZ, HIGH_HZ):
        pole = np.exp((-0.02 + 1j * np.sqrt(1 - 0.02**2)) * 2 * np.pi * natural_hz / RATE_HZ)
        tip += lfilter([1.0, -2.0, 1.0], [1.0, -2 * pole.real, abs(pole) ** 2], force)
    channels = (Channel(name="/rig.force", unit="N"), Channel(name="/rig.tip", unit="m/s^2"))
    path = tmp_path_factory.mktemp("fmax") / "rig.mcap"
    write_mcap([TimeSeries(values=np.stack([force, tip]), sample_rate_hz=RATE_HZ, channels=channels)], path)
    return path


def peaks(document: Any) -> list[float]:
    (one,) = [one for one in document.get("channels", document.get("functions")) if "/rig.tip" in one.values()]
    return [peak["frequency_hz"] for peak in one["peaks"]]


@pytest.mark.parametrize(("command", "values"), [("psd", "psd"), ("frf", "real")])
def test_lines_and_peaks_end_there(run: Run, log: Path, command: str, values: str) -> None:
    whole = run(command, log, "--json", "-").document
    outcome = run(command, log, "--fmax", 80, "--json", "-")
    assert outcome.code == 0, outcome.err
    cut = outcome.document
    lines = sum(hz <= 80 for hz in whole["frequency_hz"])
    assert cut["frequency_hz"] == whole["frequency_hz"][:lines]
    for one, other in zip(*(found.get("channels") or found["functions"] for found in (cut, whole)), strict=True):
        assert one[values] == other[values][:lines]
    assert peaks(cut) == [hz for hz in peaks(whole) if hz <= 80]
    assert sorted(peaks(whole)) == pytest.approx([LOW_HZ, HIGH_HZ], rel=0.01)
    assert "lines above 80 Hz are left out, of levels and peaks as well" in cut["notes"]
    assert "lines above 80 Hz are left out" in outcome.err


def test_the_level_is_that_of_the_lines_that_are_left(run: Run, log: Path) -> None:
    cut = run("psd", log, "--channel", "/rig.force", "--fmax", 80, "--json", "-").document
    (force,) = cut["channels"]
    assert force["rms"] == pytest.approx(np.sqrt(np.sum(force["psd"]) * cut["frequency_hz"][1]), rel=1e-9)


@pytest.mark.parametrize("command", ["psd", "frf"])
def test_a_flank_that_is_cut_is_no_peak(run: Run, log: Path, command: str) -> None:
    document = run(command, log, "--fmax", HIGH_HZ - 1, "--json", "-").document
    assert peaks(document) == pytest.approx([LOW_HZ], rel=0.01)


@pytest.mark.parametrize("command", ["psd", "frf"])
def test_all_is_left_where_nothing_lies_above(run: Run, log: Path, command: str) -> None:
    assert run(command, log, "--fmax", 1e4, "--json", "-").document == run(command, log, "--json", "-").document


@pytest.mark.parametrize("command", ["psd", "frf"])
@pytest.mark.parametrize("highest", [0, -1, 1e-9, "nan"])
def test_what_leaves_nothing_is_told_in_one_line(run: Run, log: Path, command: str, highest: object) -> None:
    outcome = run(command, log, "--fmax", highest)
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert "--fmax " in outcome.err
    assert "apart; ask for more" in outcome.err
