import sys

import pytest

from chladni.viewers.display import DISPLAYS, has_display


@pytest.fixture(scope="module")
def tour(tmp_path_factory):
    """Run the tour once."""
    import json
    import subprocess

    folder = tmp_path_factory.mktemp("tour")
    command = [sys.executable, "-m", "chladni", "demo", "--out", str(folder / "demo"), "--no-open", "--json", "-"]
    finished = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    assert finished.returncode == 0, finished.stderr
    return folder / "demo", json.loads(finished.stdout), finished.stderr


@pytest.mark.nightly
def test_everything_found_is_true_within_its_uncertainty(tour):
    _, document, _ = tour
    assert len(document["comparisons"]) == 2 * 5 + 2 * 5 + 2
    for one in document["comparisons"]:
        assert one["found"] is not None, one
        # Four sigma: of twenty numbers none should be further off. The lost stretch is known to a sample.
        assert abs(one["found"] - one["truth"]) <= max(4 * one["std"], 0.0011), one


@pytest.mark.nightly
def test_log_setup_recording_report_and_figures_are_written(tour):
    folder, document, _ = tour
    names = {path.name for path in folder.iterdir()}
    assert {"arm.mcap", "setup.toml", "arm.rrd", "report.html", "figures"} <= names
    assert len(list((folder / "figures").glob("*.png"))) >= 4
    assert len(document["files"]) >= 8


@pytest.mark.nightly
def test_people_read_what_was_found_beside_the_truth(tour):
    _, _, said = tour
    assert "Found beside the truth" in said
    assert "samples missing" in said


def test_a_folder_that_cannot_be_made_is_told(run, tmp_path):
    (tmp_path / "file").write_text("")
    outcome = run("demo", "--out", tmp_path / "file" / "demo", "--no-open")
    assert outcome.code == 2
    assert "--out" in outcome.err


@pytest.mark.skipif(sys.platform != "linux", reason="displays are told by the environment on Linux only")
def test_a_display_is_told_by_the_environment(monkeypatch):
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    assert not has_display()
    monkeypatch.setenv("DISPLAY", ":0")
    assert has_display()


def test_the_viewer_opens_where_there_is_a_display(run, monkeypatch, tmp_path):
    from types import SimpleNamespace

    import chladni.apps.demo
    import chladni.viewers.rerun

    shown = []
    monkeypatch.setattr(chladni.viewers.rerun, "spawn", shown.append)
    monkeypatch.setattr("chladni.cli.demo.has_display", lambda: True)
    made = SimpleNamespace(study=SimpleNamespace(findings=()), comparisons=(), files=())
    monkeypatch.setattr(chladni.apps.demo, "run_tour", lambda *_, **__: made)
    assert run("demo", "--out", tmp_path).code == 0
    assert shown == [made.study]
