import json
import subprocess
import sys

import pytest

from chladni import __version__
from chladni.cli.main import DEFECT, INTERRUPTED, SUCCESS, UNUSABLE
from chladni.io.mcap_log import McapLog


def test_help_names_every_command(run):
    outcome = run("--help")
    assert outcome.code == SUCCESS
    for command in (
        "info",
        "levels",
        "psd",
        "octaves",
        "envelope",
        "cepstrum",
        "frf",
        "view",
        "compare",
        "convert",
        "demo",
    ):
        assert f"\n  {command} " in outcome.out


def test_version(run):
    assert run("--version").out == f"chladni {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nonsense"], "No such command 'nonsense'"),
        (["info"], "Missing argument 'LOG'"),
        (["info", "a.mcap", "--bogus"], "No such option: --bogus"),
        (["psd", "a.mcap", "--stamp", "foo"], "Invalid value for '--stamp': 'foo' is not one of"),
        (["psd", "a.mcap", "--resolution", "fine"], "Invalid value for '--resolution'"),
        (["info", "not-there.mcap"], "not-there.mcap: can't be opened: No such file or directory"),
    ],
)
def test_unusable_input_is_one_line_and_code_2(run, arguments, words):
    outcome = run(*arguments)
    assert outcome.code == UNUSABLE
    assert outcome.out == ""
    assert words in outcome.err
    assert outcome.err.startswith("chladni: ")
    assert outcome.err.count("\n") == 1


def test_several_mistakes_of_a_setup_file_are_told_apart_in_one_line(run, arm_log, tmp_path):
    setup = tmp_path / "setup.toml"
    tables = "".join(f'[[channel]]\npath = "/x{n}"\nunti = "V"\n' for n in range(5))
    setup.write_text(f'format = "chladni.setup/1"\n{tables}')
    outcome = run("info", arm_log, "--setup", setup)
    assert outcome.code == UNUSABLE
    assert outcome.err == (
        f"chladni: {setup}:4: [[channel]] 1 unti: unknown key; did you mean unit?; "
        "line 7: [[channel]] 2 unti: unknown key; did you mean unit?; "
        "line 10: [[channel]] 3 unti: unknown key; did you mean unit?; and 2 more mistakes\n"
    )


def test_a_defect_is_one_line_and_code_1(run, arm_log, monkeypatch):
    def broken(self):
        raise ZeroDivisionError("two\nlines")

    monkeypatch.setattr(McapLog, "info", broken)
    outcome = run("info", arm_log)
    assert outcome.code == DEFECT
    assert outcome.err == (
        "chladni: defect of chladni (ZeroDivisionError): two lines; CHLADNI_TRACEBACK=1 shows where\n"
    )


def test_a_traceback_is_shown_when_asked_for(run, monkeypatch):
    monkeypatch.setenv("CHLADNI_TRACEBACK", "1")
    outcome = run("info", "not-there.mcap")
    assert outcome.code == UNUSABLE
    assert "Traceback (most recent call last)" in outcome.err
    assert outcome.err.endswith("No such file or directory; give the path of a log\n")


def test_interrupting_gives_130_and_leaves_nothing_behind(run, arm_log, tmp_path, monkeypatch):
    import chladni.apps.documents

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(chladni.apps.documents, "psd_document", interrupted)
    outcome = run("psd", arm_log, "--json", tmp_path / "psd.json")
    assert outcome.code == INTERRUPTED
    # The levels were printed before: whoever sees them must know that the rest won't come.
    assert outcome.err == "chladni: interrupted; every file is whole, or as it was before\n"
    assert list(tmp_path.iterdir()) == []


def test_a_reader_that_goes_away_is_no_error(arm_log):
    # `head -0` closes the pipe before anything is written.
    command = f"{sys.executable} -m chladni psd {arm_log} --json - | head -c 0"
    finished = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False)
    assert finished.returncode == SUCCESS
    assert "Traceback" not in finished.stderr
    assert "defect" not in finished.stderr


@pytest.mark.nightly
def test_files_are_written_for_a_reader_that_goes_away(arm_log, tmp_path):
    # The summary ends what `head` wants; the document comes last.
    document = tmp_path / "psd.json"
    command = f"{sys.executable} -m chladni psd {arm_log} --json {document} | head -c 0"
    finished = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False)
    assert finished.returncode == SUCCESS
    assert finished.stderr == ""
    assert json.loads(document.read_text())["format"].startswith("chladni.psd/")


def test_help_is_completed_by_the_shell(monkeypatch):
    monkeypatch.setenv("_CHLADNI_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "chladni co")
    monkeypatch.setenv("COMP_CWORD", "1")
    finished = subprocess.run([sys.executable, "-m", "chladni"], capture_output=True, text=True, check=False)
    assert finished.stdout.split() == ["compare", "convert"]
