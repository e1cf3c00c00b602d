import numpy as np
import pytest

import chladni
import chladni.viewers.rerun
from chladni.apps.show import gather, show
from chladni.signals.errors import SetupError
from chladni.signals.study import Study
from tests.arm import FORCE, TOOL, write_arm


def test_items_are_gathered_side_by_side(tmp_path):
    with chladni.open_log(write_arm(tmp_path), setup=tmp_path / "setup.toml") as log:
        series = log.read([FORCE, TOOL])
        density, fall = chladni.psd(series), chladni.waterfall(series)
        response = chladni.frf(series, references=FORCE)
        study = gather(series, density, fall, response)
        both = gather(log, Study(title="other", findings=("later",)))
    assert study.series == (series,)
    assert study.densities == (density,)
    assert study.waterfalls == (fall,)
    assert study.response is response
    assert study.response_peaks
    assert both.title == "arm.mcap, other"
    assert both.geometry.points
    assert both.findings[-1] == "other: later"
    assert all(finding.startswith("arm.mcap: ") for finding in both.findings[:-1])
    assert both.response is not None


def test_nothing_to_show_is_refused():
    with pytest.raises(SetupError, match="nothing to show"):
        show()


def test_the_viewer_gets_the_study(monkeypatch):
    shown = []
    monkeypatch.setattr(chladni.viewers.rerun, "spawn", shown.append)
    chladni.show(Study(title="a"))
    assert [study.title for study in shown] == ["a"]


def test_every_value_has_a_page_in_a_file(tmp_path):
    series = chladni.TimeSeries.from_arrays(np.random.default_rng(1).standard_normal((2, 4096)), sample_rate_hz=100.0)
    response = chladni.frf(series, references="ch1")
    modes = chladni.ModeSet.from_arrays([1.0, 2.0], [[1.0, 0.5, 0.2], [1.0, -0.5, 0.1]])
    values = [
        series, chladni.psd(series), chladni.cross_spectra(series), response, chladni.waterfall(series), modes,
        chladni.coherence(series, references="ch1"), chladni.mac(modes),
    ]  # fmt: skip
    for value in values:
        chladni.show(value, save=tmp_path / "one.rrd")
        assert (tmp_path / "one.rrd").stat().st_size > 1000
    assert [title for title, _ in gather(*values).pictures] == ["Coherence", "Modal assurance"]
    with pytest.raises(SetupError, match="a float can't be shown"):
        chladni.show(1.0, save=tmp_path / "two.rrd")
    assert not (tmp_path / "two.rrd").exists()


def test_transfer_functions_that_are_not_shown_are_told(tmp_path):
    with chladni.open_log(write_arm(tmp_path)) as log:
        response = chladni.frf(log, references=FORCE)
    first = Study(title="first.mcap", response=response, findings=("sound",))
    alone, both = gather(first), gather(first, Study(title="second.mcap", response=response))
    assert alone.findings == ("sound",)
    assert both.findings[0] == "first.mcap: sound"
    assert "those of second.mcap" in both.findings[-1]


@pytest.mark.parametrize("last", ["modes", pytest.param("log", marks=pytest.mark.nightly)])
def test_modes_are_checked_with_the_geometry_whichever_comes_first(tmp_path, last):
    with chladni.open_log(write_arm(tmp_path), setup=tmp_path / "setup.toml") as log:
        modes = chladni.identify_modes(log, references=FORCE)
        study = gather(log, modes) if last == "modes" else gather(modes, log)
    assert study.modes is modes
    assert study.validation is not None
    assert study.validation.mpc.size == modes.frequency_hz.size
    assert ("base", "column") in {tuple(sorted(one.between)) for one in study.relative_motion}
    assert any("mode" in finding for finding in study.findings)


def test_modes_that_are_not_shown_are_told(tmp_path):
    with chladni.open_log(write_arm(tmp_path)) as log:
        modes = chladni.identify_modes(log, references=FORCE)
    first, second = (gather(Study(title=name), modes) for name in ("first.mcap", "second.mcap"))
    both = gather(first, second)
    assert both.modes is modes
    assert "The modes shown are those of second.mcap" in both.findings[-1]
