from contextlib import contextmanager
from types import SimpleNamespace

import pytest

import chladni.viewers.rerun
from chladni.viewers.display import DISPLAYS
from tests.arm import FORCE, TOOL


def test_a_recording_is_saved(run, arm_log, tmp_path):
    target = tmp_path / "arm.rrd"
    outcome = run("view", arm_log, "--setup", arm_log.with_name("setup.toml"), "--save", target, "--json", "-")
    assert outcome.code == 0, outcome.err
    assert outcome.document["path"] == str(target)
    assert target.read_bytes().startswith(b"RRF")
    assert any("Highest peaks over" in finding for finding in outcome.document["findings"])


def test_the_viewer_is_opened(run, arm_log, monkeypatch):
    shown = []
    monkeypatch.setattr(chladni.viewers.rerun, "spawn", shown.append)
    monkeypatch.setenv("DISPLAY", ":0")
    assert run("view", arm_log, "--channel", TOOL, "--channel", FORCE, "--end", 10).code == 0
    (study,) = shown
    assert [channel.name for channel in study.series[0].channels] == [TOOL, FORCE]
    assert study.response.references[0].name == FORCE


def test_a_browser_gets_an_address_on_loopback(run, arm_log, monkeypatch):
    @contextmanager
    def serve(study):
        yield SimpleNamespace(address="http://127.0.0.1:1234", wait=lambda: None)

    monkeypatch.setattr(chladni.viewers.rerun, "serve_web", serve)
    outcome = run("view", arm_log, "--channel", TOOL, "--web")
    assert "http://127.0.0.1:1234" in outcome.out


def test_file_and_server_at_once_are_refused(run, arm_log, tmp_path):
    outcome = run("view", arm_log, "--web", "--save", tmp_path / "a.rrd")
    assert outcome.code == 2
    assert "give one of them" in outcome.err


@pytest.mark.parametrize("option", [["--reference", "/no.such"], ["--channel", "/no.such"]])
def test_an_unknown_channel_is_told(run, arm_log, option, tmp_path):
    outcome = run("view", arm_log, *option, "--save", tmp_path / "a.rrd")
    assert outcome.code == 2
    assert "/no.such" in outcome.err
    assert list(tmp_path.iterdir()) == []


def test_without_a_screen_the_report_is_written_and_the_window_is_told_of(run, arm_log, monkeypatch, tmp_path):
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    outcome = run(
        "view", arm_log, "--channel", TOOL, "--report", tmp_path / "page.html", "--json", tmp_path / "view.json"
    )
    assert outcome.code == 0
    assert (tmp_path / "page.html").is_file()
    assert (tmp_path / "view.json").is_file()
    assert "No window can be opened here" in outcome.out


def test_without_a_screen_and_a_file_no_work_is_done(run, arm_log, monkeypatch):
    for name in DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    outcome = run("view", arm_log)
    assert outcome.code != 0
    assert "--save OUT.rrd" in outcome.err
