import shutil
from pathlib import Path

import pytest

from chladni.apps import blind
from chladni.signals.errors import EstimateError
from chladni_withheld.folders import seal_case
from tests.cli.conftest import Run


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    """Two cases whose models nobody can read."""
    for name in ("case-0001", "case-0002"):
        folder = tmp_path / "cases" / name
        folder.mkdir(parents=True)
        (folder / "model.toml").write_text("")
        (folder / "log.mcap").write_bytes(b"")
        hidden = {"effect": "delay", "site": "motor"}
        seal_case(tmp_path, name, {"kind": "effect", "effects": [hidden], "ratio": 4.0})
    return tmp_path


def diagnosis(model: Path, _logs: object, *, leave_out: frozenset[str], seed: int) -> dict[str, object]:
    """Right once, no answer once."""
    if model.parent.name == "case-0002":
        raise EstimateError("too short")
    cause = {"effect": "delay", "site": "motor", "probability": 0.9, "group": ["motor", "piston"]}
    return {"format": "chladni.gap/1", "verdict": "effect", "causes": [cause], "ranking": [], "gap": {"closed": 1.0}}


def test_run_and_score(run: Run, campaign: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blind, "diagnosis_json", diagnosis)
    done = run("blind", "run", campaign, "--jobs", 1, "--json", "-")
    assert done.code == 0
    assert done.document == {"format": "chladni.blind-run/1", "done": 2, "there": 0, "failed": ["case-0002"]}
    assert "no answer for case-0002" in done.err
    score = run("blind", "score", campaign, "--json", "-")
    assert score.code == 0
    assert score.document["effect"]["right"] == 1
    assert score.document["group_sizes"] == {"2": 1}
    assert "right effect, first place" in score.err
    assert "no" in score.err
    # Which one was missed, and what it hid.
    (row,) = [line for line in score.err.splitlines() if line.startswith("case-0002")]
    assert row.split() == ["case-0002", "effect", "delay", "at", "motor", "failed", "-"]


def test_pictures_of_a_score(run: Run, campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(blind, "diagnosis_json", diagnosis)
    assert run("blind", "run", campaign, "--jobs", 1).code == 0
    pictures = tmp_path / "pictures"
    done = run("blind", "score", campaign, "--figures", pictures)
    assert done.code == 0
    # Neither case is faint.
    assert sorted(one.name for one in pictures.iterdir()) == [
        "calibration.png", "calibration.svg", "confusion.png", "confusion.svg"
    ]  # fmt: skip
    assert f"figure: {pictures / 'confusion.png'}" in done.out


def test_a_score_against_another_version_tells_what_differs(
    run: Run, campaign: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(blind, "diagnosis_json", diagnosis)
    other = tmp_path_factory.mktemp("other") / "campaign"
    shutil.copytree(campaign, other)
    assert run("blind", "run", campaign, "--jobs", 1).code == 0

    def unsure(_model: Path, _logs: object, *, leave_out: frozenset[str], seed: int) -> dict[str, object]:
        return {"format": "chladni.gap/1", "verdict": "unknown", "causes": [], "ranking": []}

    monkeypatch.setattr(blind, "diagnosis_json", unsure)
    assert run("blind", "run", other, "--jobs", 1).code == 0
    done = run("blind", "score", campaign, "--against", other, "--json", "-")
    assert done.code == 0
    assert done.document["against"]["pairs"] == 2
    (row,) = [row for row in done.document["against"]["rows"] if row["key"] == "effect"]
    assert (row["only_here"], row["only_there"], row["p"]) == (1, 0, 1.0)
    lines = done.err.splitlines()
    start = next(place for place, line in enumerate(lines) if line.startswith("Right in one of the two only: 1"))
    (changed,) = [line for line in lines[start:] if line.startswith("case-0001")]
    assert changed.split() == [
        "case-0001",
        "effect",
        "delay",
        "at",
        "motor",
        "delay",
        "at",
        "motor",
        "unknown",
        "here",
    ]


def test_a_broken_seal_is_one_line(run: Run, campaign: Path) -> None:
    path = campaign / "truth" / "case-0001.json"
    path.write_text(path.read_text().replace("delay", "lag"))
    done = run("blind", "score", campaign)
    assert done.code == 2
    assert "doesn't fit the seal of case-0001" in done.err
    assert done.err.count("\n") == 1


def test_nothing_to_run_is_one_line(run: Run, tmp_path: Path) -> None:
    done = run("blind", "run", tmp_path)
    assert done.code == 2
    assert done.err.strip().endswith(f"holds no case; make some with chladni blind make {tmp_path}")


def test_a_kind_that_there_is_not_is_one_line(run: Run, tmp_path: Path) -> None:
    done = run("blind", "make", tmp_path / "campaign", "--kind", "four=2")
    assert done.code == 2
    assert "'four=2' names no kind of case; there are effect, none, parameters, two, three" in done.err
    assert done.err.count("\n") == 1
    assert not (tmp_path / "campaign").exists()


def test_a_generator_that_there_is_not_is_one_line(run: Run, tmp_path: Path) -> None:
    done = run("blind", "make", tmp_path / "campaign", "--generator", "rust")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "'rust' is no generator of cases; there are chains, networks" in done.err
    assert not (tmp_path / "campaign").exists()


@pytest.mark.nightly
@pytest.mark.slow
def test_make_writes_cases_and_truths(run: Run, tmp_path: Path) -> None:
    done = run("blind", "make", tmp_path, "--count", 1, "--seed", 2, "--jobs", 1, "--json", "-")
    assert done.code == 0
    assert done.document["made"] == 1
    assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()) == [
        "cases/case-0001/case.json", "cases/case-0001/log.mcap", "cases/case-0001/model.toml", "truth/campaign.json",
        "truth/case-0001.json",
    ]  # fmt: skip
    assert "made 1 case in" in done.err
    assert "there" not in done.err
    again = run("blind", "make", tmp_path, "--count", 1, "--seed", 2, "--jobs", 1)
    assert again.code == 0
    assert "made 0 cases in" in again.out
    assert "; 1 of 1 were there" in again.out


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_file_in_the_place_of_the_folder_is_one_line(run: Run, tmp_path: Path, jobs: int) -> None:
    (tmp_path / "file").write_text("")
    done = run("blind", "make", tmp_path / "file", "--count", 1, "--jobs", jobs)
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "is no folder" in done.err
