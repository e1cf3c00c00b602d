import json
import shutil
from concurrent.futures import ThreadPoolExecutor

import pytest

from chladni.gap.blind.run import run_cases
from chladni.gap.blind.score import score_cases
from chladni.gap.blind.seal import seal_case
from chladni.signals.errors import EstimateError, SetupError

HIDDEN = {"effect": "delay", "site": "motor"}


def answer(model, logs, *, leave_out, seed):
    """A diagnosis that always says the same; one model is too much for it."""
    if model.parent.name == "c":
        raise EstimateError("log.mcap: 3 samples are too few; give 100")
    named = "lag" if "delay" in leave_out else "delay"
    return {
        "format": "chladni.gap/1", "verdict": "effect",
        "causes": [{"effect": named, "site": "motor", "probability": 0.9, "group": ["motor"]}],
        "ranking": [{"effect": "delay", "site": "motor", "gap": 0.02}], "gap": {"closed": 0.97}, "seed": seed,
        "logs": [log.name for log in logs],
    }  # fmt: skip


@pytest.fixture
def campaign(tmp_path):
    for name in "abc":
        folder = tmp_path / "cases" / name
        folder.mkdir(parents=True)
        (folder / "model.toml").write_text("")
        (folder / "log.mcap").write_bytes(b"")
        leave_out = ("delay",) if name == "b" else ()
        kind = "leave_out" if name == "b" else "effect"
        seal_case(tmp_path, name, {"kind": kind, "effects": [HIDDEN], "ratio": 5.0}, leave_out=leave_out)
    return tmp_path


def test_a_run_needs_no_truth(campaign):
    shutil.rmtree(campaign / "truth")
    report = run_cases(campaign, answer, seed=4)
    assert (report.done, report.there, report.failed) == (3, 0, ("c",))
    told = json.loads((campaign / "results" / "a.json").read_text())
    assert told["seed"] == 4
    assert told["logs"] == ["log.mcap"]
    assert "too few" in json.loads((campaign / "results" / "c.json").read_text())["error"]


def test_a_mistake_of_the_diagnosis_says_in_which_case(campaign):
    def mistaken(model, logs, *, leave_out, seed):
        if model.parent.name == "b":
            raise ZeroDivisionError
        return answer(model, logs, leave_out=leave_out, seed=seed)

    with pytest.raises(ZeroDivisionError) as raised:
        run_cases(campaign, mistaken)
    (said,) = raised.value.__notes__
    assert "case b" in said
    assert str(campaign / "cases" / "b") in said


def test_a_run_goes_on_where_it_ended(campaign):
    (campaign / "results").mkdir()
    (campaign / "results" / "a.json").write_text("{}")
    report = run_cases(campaign, answer)
    assert (report.done, report.there) == (2, 1)
    assert (campaign / "results" / "a.json").read_text() == "{}"
    assert [json.loads(line)["case"] for line in (campaign / "times.jsonl").read_text().splitlines()] == ["b", "c"]


def test_words_that_are_left_out_reach_the_diagnosis(campaign):
    run_cases(campaign, answer)
    assert json.loads((campaign / "results" / "b.json").read_text())["causes"][0]["effect"] == "lag"


def test_results_are_the_same_side_by_side_as_one_after_the_other(campaign, tmp_path):
    run_cases(campaign, answer)
    alone = {path.name: path.read_bytes() for path in (campaign / "results").iterdir()}
    shutil.rmtree(campaign / "results")
    shares = []
    with ThreadPoolExecutor(2) as executor:
        run_cases(campaign, answer, executor=executor, progress=shares.append)
    assert {path.name: path.read_bytes() for path in (campaign / "results").iterdir()} == alone
    assert shares == pytest.approx([1 / 3, 2 / 3, 1.0])


def test_the_score_of_a_run(campaign):
    run_cases(campaign, answer)
    score = score_cases(campaign)
    assert (score["effect"]["right"], score["effect"]["count"]) == (1, 2)
    # A lag for a delay that was left out is a sibling.
    assert score["strange_recognised"]["share"] == 1.0
    assert score["failed"] == ["c"]
    assert json.loads((campaign / "score.json").read_text()) == score


def test_cases_without_an_answer_are_told_apart(campaign):
    run_cases(campaign, answer)
    (campaign / "results" / "a.json").unlink()
    score = score_cases(campaign)
    assert score["missing"] == ["a"]
    assert score["cases"] == 2


def test_one_tampered_truth_spoils_the_score(campaign):
    run_cases(campaign, answer)
    path = campaign / "truth" / "b.json"
    path.write_text(path.read_text().replace("motor", "other"))
    with pytest.raises(SetupError, match="doesn't fit the seal of b"):
        score_cases(campaign)


def test_nothing_to_score_is_told(campaign):
    with pytest.raises(SetupError, match="holds no result"):
        score_cases(campaign)
