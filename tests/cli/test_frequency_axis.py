"""Where the frequency axis ends, and how spectra are divided in pictures: --fmax, --log-frequency, --db."""

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

import chladni
from chladni.apps.modal_study import modal_study
from chladni.io.mcap.writer import write_mcap
from chladni.signals.channel import Channel
from chladni.signals.study import Study
from chladni.signals.time_series import TimeSeries
from chladni.viewers import figures
from chladni.viewers.figures import Album, density_figures, response_figures
from chladni.viewers.figures.log_axis import Scales
from chladni.viewers.overlays import overlay_pages
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


@pytest.mark.parametrize("command", ["psd", "frf"])
@pytest.mark.parametrize(
    ("options", "scales"),
    [((), Scales()), (("--db",), Scales(decibels=True)), (("--log-frequency",), Scales(log_frequency=True))],
)
def test_pictures_are_divided_as_asked_for(
    run: Run,
    log: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    options: tuple[str, ...],
    scales: Scales,
) -> None:
    asked = []

    def draw(study: Study, *, scales: Scales) -> Album:
        asked.append(scales)
        return Album({"one": response_figures(study, scales=scales) | density_figures(study, scales=scales)})

    monkeypatch.setattr(Album, "of", draw)
    monkeypatch.setattr(figures, "save_album", lambda album, folder: [folder / one for one in album.figures])
    outcome = run(command, log, *options, "--figures", tmp_path)
    assert outcome.code == 0, outcome.err
    assert "figure: " in outcome.out
    assert asked == [scales]


@pytest.mark.parametrize(
    ("command", "option"),
    [*product(["psd", "frf", "modes"], ["--db", "--log-frequency"]), ("waterfall", "--log-frequency")],
)
def test_how_pictures_look_is_refused_without_any(run: Run, log: Path, command: str, option: str) -> None:
    refused = run(command, log, option)
    assert (refused.code, refused.out, refused.err.count("\n")) == (2, "", 1)
    assert f"{option} says how pictures look; ask for some (--figures FOLDER or --report FILE.html)" in refused.err


def test_fmax_is_the_upper_end_of_the_band(run: Run, log: Path) -> None:
    told = run("modes", log, "--fmax", 100, "--json", "-").document
    assert told == run("modes", log, "--band", "0-100", "--json", "-").document
    assert told["modes"]
    refused = run("modes", log, "--band", "20-100", "--fmax", 10)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "--fmax 10 leaves no frequency; give one above 20 Hz" in refused.err


@pytest.mark.nightly
def test_functions_and_their_synthesis_are_drawn_in_the_unit_asked_for(run: Run, log: Path) -> None:
    found = modal_study(chladni.open(log))
    shown = found.drawn_in(["g"])
    response, modes = shown.study.response, shown.study.modes
    assert response is not None
    assert modes is not None
    assert modes.fit is not None
    assert response.unit(0, 0) == "g/N"
    assert found.study.response is not None
    assert found.modes.fit is not None
    np.testing.assert_allclose(response.values * 9.80665, found.study.response.values, rtol=1e-12)
    np.testing.assert_allclose(modes.fit.synthesised * 9.80665, found.modes.fit.synthesised, rtol=1e-12)
    (page,) = overlay_pages(modes, response)
    assert page.unit == "g/N"
    np.testing.assert_array_equal(shown.modes.shapes, found.modes.shapes)
    assert "g, m/s^2" in run("modes", log, "--unit", "mm").err
    assert "responses alone" in run("modes", log, "--operational", "--unit", "g").err
