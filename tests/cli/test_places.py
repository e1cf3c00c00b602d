"""Where commands may write."""

from pathlib import Path

import pytest

from chladni.cli.places import require_places
from chladni.signals.errors import LogError, SetupError
from tests.cli.conftest import Run


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "arm.mcap"
    path.write_bytes(b"log")
    return path


@pytest.mark.parametrize("option", ["--html", "--report", "--save", "--write-model", "--figure"])
def test_a_file_called_otherwise_than_what_it_would_hold_is_refused(log: Path, option: str) -> None:
    with pytest.raises(SetupError, match=f"arm.mcap: {option} writes .*; give such a name"):
        require_places(reads=(), writes={option: log})


def test_what_is_read_is_not_replaced_under_any_of_its_names(log: Path, tmp_path: Path) -> None:
    (tmp_path / "link.rrd").symlink_to(log)
    (tmp_path / "folder").mkdir()
    for name in ("link.rrd", "folder/../link.rrd"):
        with pytest.raises(SetupError, match="is read by this command, and --save would replace it"):
            require_places(reads=[None, log], writes={"--save": tmp_path / name})


def test_two_outputs_are_two_files(tmp_path: Path) -> None:
    (tmp_path / "same.json").symlink_to(tmp_path / "same.html")
    with pytest.raises(SetupError, match="--json and --html name the same file; give each its own"):
        require_places(reads=(), writes={"--json": str(tmp_path / "same.json"), "--html": tmp_path / "same.html"})


def test_folders_and_files_are_not_confused(log: Path, tmp_path: Path) -> None:
    (tmp_path / "page.html").mkdir()
    with pytest.raises(LogError, match=r"page\.html: is a folder; name a file in it"):
        require_places(reads=(), writes={"--html": tmp_path / "page.html"})
    with pytest.raises(LogError, match="there is no folder"):
        require_places(reads=(), writes={"--json": str(tmp_path / "none" / "x.json")})
    for folder in (log, log / "figures" / "all"):
        with pytest.raises(LogError, match=r"arm\.mcap is no folder; --figures takes a folder"):
            require_places(reads=(), writes={}, folders={"--figures": folder})


def test_a_folder_that_refuses_is_told_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Not by taking the rights away: root writes where it likes.
    monkeypatch.setattr("os.access", lambda *_: False)
    with pytest.raises(LogError, match=r"x\.json: the folder .* can't be written to"):
        require_places(reads=(), writes={"--json": str(tmp_path / "x.json")})


def test_standard_output_and_what_was_not_given_are_no_files(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    # As a file, it would be refused: a folder has its name.
    (tmp_path / "-").mkdir()
    require_places(reads=[log], writes={"--json": "-", "--html": None}, folders={"--figures": None})


@pytest.mark.parametrize(
    "arguments",
    [
        ["info", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["levels", "{log}", "--setup", "{other}", "--csv", "{other}"],
        ["psd", "{log}", "--setup", "{other}", "--csv", "{other}"],
        ["frf", "{log}", "--setup", "{other}", "--csv", "{other}"],
        ["octaves", "{log}", "--setup", "{other}", "--csv", "{other}"],
        ["cepstrum", "{log}", "--setup", "{other}", "--csv", "{other}"],
        ["srs", "{log}", "--setup", "{other}", "--csv", "{other}"],
        ["cepstrum", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["envelope", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["octaves", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["psd", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["orders", "{log}", "--speed", "/x", "--setup", "{other}", "--json", "{other}"],
        ["ods", "{log}", "--reference", "/x", "--setup", "{other}", "--json", "{other}"],
        ["delay", "{log}", "--reference", "/x", "--setup", "{other}", "--json", "{other}"],
        ["tolerance", "{log}", "1:1", "2:1", "--setup", "{other}", "--json", "{other}"],
        ["zoom", "{log}", "--band", "1", "2", "--setup", "{other}", "--json", "{other}"],
        ["srs", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["frf", "{log}", "--reference", "/x", "--setup", "{other}", "--json", "{other}"],
        ["modes", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["view", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["compare", "{log}", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["gap", "{log}", "--setup", "{other}", "--json", "{other}"],
        ["influence", "{other}", "--json", "{other}"],
        ["simulate", "{other}", "--out", "{log}", "--json", "{other}"],
        ["simulate", "servo", "--out", "{log}", "--json", "{folder}/arm.truth.json"],
        ["simulate", "servo", "--log", "{log}", "--out", "{log}"],
        ["convert", "{log}", "{folder}/x.csv", "--json", "{log}"],
    ],
)
def test_every_command_keeps_what_it_reads(run: Run, log: Path, tmp_path: Path, arguments: list[str]) -> None:
    other = tmp_path / "other.json"
    other.write_text("kept")
    outcome = run(*(one.format(log=log, other=other, folder=tmp_path) for one in arguments))
    assert (outcome.code, outcome.err.count("\n")) == (2, 1)
    assert any(words in outcome.err for words in ("would replace it", "name the same file"))
    assert (log.read_bytes(), other.read_text()) == (b"log", "kept")


@pytest.mark.parametrize("word", ["make", "run", "score"])
def test_the_withheld_check_asks_for_its_document_first(run: Run, tmp_path: Path, word: str) -> None:
    outcome = run("blind", word, tmp_path / "campaign", "--json", tmp_path / "none" / "x.json")
    assert (outcome.code, "there is no folder" in outcome.err) == (2, True)
    assert not (tmp_path / "campaign").exists()
