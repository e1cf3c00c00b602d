import json
import re
import shutil
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import chladni
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.catalogue import FAMILIES as CATALOGUE_FAMILIES
from chladni.signals.errors import EstimateError, SetupError
from chladni_withheld.campaign import GENERATORS, composition_of, counts_of, make_cases, one_by_one, run_cases
from chladni_withheld.case import PARAMETER, START_TIME_NS, Generator, HiddenEffect, LoggedChannel, WithheldCase
from chladni_withheld.folders import case_folders, seal_case, truth_of_case
from chladni_withheld.score import score_cases
from chladni_withheld.vocabulary import FAMILIES, OUTSIDE, WORDS

ONE_OF_EACH = ["effect=1", "none=1", "parameters=1"]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    directory = tmp_path_factory.mktemp("campaign")
    made = make_cases(directory, count=3, seed=7, kinds=ONE_OF_EACH)
    assert made == 3
    return directory


def test_a_case_tells_nothing_of_what_it_hides(campaign):
    for case in case_folders(campaign):
        folder = campaign / "cases" / case.name
        assert sorted(path.name for path in folder.iterdir()) == ["case.json", "log.mcap", "model.toml"]
        truth = truth_of_case(campaign, case)
        model = (folder / "model.toml").read_text()
        log = (folder / "log.mcap").read_bytes()
        assert "[[effect]]" not in model
        for hidden in truth["effects"]:
            assert hidden["effect"] not in model
            assert hidden["effect"].encode() not in log
        assert b"truth" not in log
        assert sorted(json.loads((folder / "case.json").read_text())) == ["format", "leave_out", "seal"]


def test_model_and_log_fit_each_other(campaign):
    for case in case_folders(campaign):
        model = chladni.load_model(case.model)
        with chladni.open_log(case.log) as log:
            series = log.read()
        names = {channel.name for channel in series.channels}
        compiled = model.compile()
        assert {terminal.channel for terminal in (*compiled.inputs, *compiled.outputs)} == names
        units = {terminal.channel: terminal.unit for terminal in (*compiled.inputs, *compiled.outputs)}
        assert {channel.name: channel.unit for channel in series.channels} == units
        assert 8000 <= series.samples <= 25000
        assert np.isfinite(series.values).all()


def test_true_numbers_are_as_near_as_the_tolerances_say(campaign):
    for case in case_folders(campaign):
        truth, model = truth_of_case(campaign, case), chladni.load_model(case.model)
        for name, value in truth["parameters"].items():
            nominal = model.parameters[name]
            if nominal.value * nominal.tolerance == 0:
                assert value == nominal.value
                continue
            sigmas = (value / nominal.value - 1) / nominal.tolerance
            if name in truth["off"]:
                assert sigmas == pytest.approx(truth["off"][name])
                assert 4 <= abs(sigmas) <= 8
            else:
                assert abs(sigmas) < 2 + 1e-9


def test_a_campaign_is_resumed_and_made_again_the_same(campaign, tmp_path):
    assert make_cases(campaign, count=3, seed=7, kinds=ONE_OF_EACH) == 0
    again = tmp_path / "again"
    for name in ("case-0001", "case-0002"):
        (again / "cases" / name).mkdir(parents=True)
        (again / "cases" / name / "case.json").write_text("{}")
    assert make_cases(again, count=3, seed=7, kinds=ONE_OF_EACH) == 1
    for file in ("model.toml", "log.mcap"):
        path = f"cases/case-0003/{file}"
        assert (again / path).read_bytes() == (campaign / path).read_bytes()
    truths = [json.loads((one / "truth" / "case-0003.json").read_text()) for one in (again, campaign)]
    salts = [truth.pop("salt") for truth in truths]
    assert truths[0] == truths[1]
    assert salts[0] != salts[1]


def test_a_campaign_is_not_mixed_with_another(campaign, monkeypatch):
    begun = "begun with count 3, seed 7, generator chains and kinds effect=1, none=1, parameters=1;"
    for count, kinds in ((4, ONE_OF_EACH), (3, ["three=1"])):
        with pytest.raises(SetupError, match=begun):
            make_cases(campaign, count=count, seed=7, kinds=kinds)
    monkeypatch.setitem(GENERATORS, "tables", lambda: TABLES)
    with pytest.raises(SetupError, match=begun):
        make_cases(campaign, count=3, seed=7, generator="tables", kinds=["none=1"])


def test_a_campaign_of_before_generators_had_names_goes_on(campaign, tmp_path):
    (tmp_path / "truth").mkdir()
    told = json.loads((campaign / "truth" / "campaign.json").read_text())
    assert told.pop("generator") == "chains"
    (tmp_path / "truth" / "campaign.json").write_text(json.dumps(told))
    for name in ("case-0001", "case-0002", "case-0003"):
        (tmp_path / "cases" / name).mkdir(parents=True)
        (tmp_path / "cases" / name / "case.json").write_text("{}")
    assert make_cases(tmp_path, count=3, seed=7, kinds=ONE_OF_EACH) == 0


def draw_table(seed, index, kind):
    """A case of another generator: nothing moves, and that is logged."""
    rng = np.random.default_rng((seed, index))
    hidden = HiddenEffect(effect=PARAMETER, site="leg.stiffness", parameters={"nominal": 1.0, "true": 10.0})
    return WithheldCase(
        kind=kind, model=f"# {index}\n", sample_rate_hz=100.0, effects=(hidden,) if kind == "value" else (),
        channels=(LoggedChannel(name="/daq.f", unit="N", samples=rng.standard_normal(50), drives=True),
                  LoggedChannel(name="/daq.a", unit="m/s^2", samples=np.zeros(50))),
        leave_out=("lag", "delay"), further={"legs": 4},
    )  # fmt: skip


TABLES = Generator(composition={"value": 2, "none": 1, "topology": 0}, draws=partial(one_by_one, draw_table))


def test_cases_of_another_generator_are_written_and_sealed_alike(tmp_path, monkeypatch):
    monkeypatch.setitem(GENERATORS, "tables", lambda: TABLES)
    assert make_cases(tmp_path, count=6, seed=5, generator="tables") == 6
    cases = case_folders(tmp_path)
    truths = [truth_of_case(tmp_path, case) for case in cases]
    assert Counter(truth["kind"] for truth in truths) == {"value": 4, "none": 2}
    assert [case.model.read_text() for case in cases] == [f"# {index}\n" for index in range(1, 7)]
    assert [truth["seed"] for truth in truths] == [[5, index] for index in range(1, 7)]
    assert all(truth["legs"] == 4 and truth["leave_out"] == ["delay", "lag"] for truth in truths)
    (hidden,) = next(truth["effects"] for truth in truths if truth["kind"] == "value")
    assert (hidden["effect"], hidden["site"]) == ("parameter", "leg.stiffness")
    with chladni.open_log(cases[2].log) as log:
        series = log.read()
    assert [(one.name, one.unit) for one in series.channels] == [("/daq.f", "N"), ("/daq.a", "m/s^2")]
    assert_array_equal(series.values[0], np.random.default_rng((5, 3)).standard_normal(50))
    assert (series.sample_rate_hz, series.start_time_ns) == (100.0, START_TIME_NS)


def test_a_generator_that_there_is_not_is_one_line(tmp_path):
    with pytest.raises(SetupError, match="'rust' is no generator of cases; there are chains, networks"):
        make_cases(tmp_path, count=1, seed=0, generator="rust")


@pytest.mark.parametrize(("count", "seed", "told"), [(0, 1, "count 0"), (3, -1, "seed -1")])
def test_impossible_campaigns_are_refused(tmp_path, count, seed, told):
    with pytest.raises(SetupError, match=told):
        make_cases(tmp_path, count=count, seed=seed)


def test_the_vocabulary_is_the_catalogues():
    assert set(CATALOGUE) <= set(WORDS)
    assert {family: set(words) for family, words in CATALOGUE_FAMILIES.items()} == {
        family: set(words) for family, words in FAMILIES.items()
    }
    assert not set(OUTSIDE) & set(WORDS)


def test_a_composition_is_read_from_words():
    usual = {"none": 3, "three": 0, "two": 5}
    assert composition_of([], usual) == {"none": 3, "two": 5}
    # In whatever order: what is drawn follows it.
    assert list(composition_of(["three=2", " two = 1"], usual).items()) == [("two", 1), ("three", 2)]


@pytest.mark.parametrize(
    ("text", "told"),
    [("four=4", "'four=4' names no kind of case; there are none, two"),
     ("effect=4", "'effect=4' names no kind of case; there are none, two"), ("two", "of the form two=N"),
     ("two=0", "with N from 1"), ("two=-1", "of the form two=N"), ("two=x", "of the form two=N")],
)  # fmt: skip
def test_what_is_no_composition_is_one_line(text, told):
    with pytest.raises(SetupError, match=re.escape(told)):
        composition_of([text], {"two": 1, "none": 1})


@pytest.mark.parametrize("count", [1, 7, 80, 199])
def test_all_cases_are_shared_out(count):
    assert sum(counts_of(count, {"effect": 78, "none": 52, "parameters": 8, "two": 20}).values()) == count


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
def sealed(tmp_path):
    for name in "abc":
        folder = tmp_path / "cases" / name
        folder.mkdir(parents=True)
        (folder / "model.toml").write_text("")
        (folder / "log.mcap").write_bytes(b"")
        leave_out = ("delay",) if name == "b" else ()
        kind = "leave_out" if name == "b" else "effect"
        seal_case(tmp_path, name, {"kind": kind, "effects": [HIDDEN], "ratio": 5.0}, leave_out=leave_out)
    return tmp_path


def test_a_run_needs_no_truth(sealed):
    shutil.rmtree(sealed / "truth")
    report = run_cases(sealed, answer, seed=4)
    assert (report.done, report.there, report.failed) == (3, 0, ("c",))
    told = json.loads((sealed / "results" / "a.json").read_text())
    assert told["seed"] == 4
    assert told["logs"] == ["log.mcap"]
    assert "too few" in json.loads((sealed / "results" / "c.json").read_text())["error"]


def test_a_mistake_of_the_diagnosis_says_in_which_case(sealed):
    def mistaken(model, logs, *, leave_out, seed):
        if model.parent.name == "b":
            raise ZeroDivisionError
        return answer(model, logs, leave_out=leave_out, seed=seed)

    with pytest.raises(ZeroDivisionError) as raised:
        run_cases(sealed, mistaken)
    (said,) = raised.value.__notes__
    assert "case b" in said
    assert str(sealed / "cases" / "b") in said


def test_a_run_goes_on_where_it_ended(sealed):
    (sealed / "results").mkdir()
    (sealed / "results" / "a.json").write_text("{}")
    report = run_cases(sealed, answer)
    assert (report.done, report.there) == (2, 1)
    assert (sealed / "results" / "a.json").read_text() == "{}"
    assert [json.loads(line)["case"] for line in (sealed / "times.jsonl").read_text().splitlines()] == ["b", "c"]


def test_words_that_are_left_out_reach_the_diagnosis(sealed):
    run_cases(sealed, answer)
    assert json.loads((sealed / "results" / "b.json").read_text())["causes"][0]["effect"] == "lag"


def test_results_are_the_same_side_by_side_as_one_after_the_other(sealed, tmp_path):
    run_cases(sealed, answer)
    alone = {path.name: path.read_bytes() for path in (sealed / "results").iterdir()}
    shutil.rmtree(sealed / "results")
    shares = []
    with ThreadPoolExecutor(2) as executor:
        run_cases(sealed, answer, executor=executor, progress=shares.append)
    assert {path.name: path.read_bytes() for path in (sealed / "results").iterdir()} == alone
    assert shares == pytest.approx([1 / 3, 2 / 3, 1.0])


def test_the_score_of_a_run(sealed):
    run_cases(sealed, answer)
    score = score_cases(sealed)
    assert (score["effect"]["right"], score["effect"]["count"]) == (1, 2)
    # A lag for a delay that was left out is a sibling.
    assert score["strange_recognised"]["share"] == 1.0
    assert score["failed"] == ["c"]
    assert json.loads((sealed / "score.json").read_text()) == score


def test_cases_without_an_answer_are_told_apart(sealed):
    run_cases(sealed, answer)
    (sealed / "results" / "a.json").unlink()
    score = score_cases(sealed)
    assert score["missing"] == ["a"]
    assert score["cases"] == 2


def test_one_tampered_truth_spoils_the_score(sealed):
    run_cases(sealed, answer)
    path = sealed / "truth" / "b.json"
    path.write_text(path.read_text().replace("motor", "other"))
    with pytest.raises(SetupError, match="doesn't fit the seal of b"):
        score_cases(sealed)


def test_nothing_to_score_is_told(sealed):
    with pytest.raises(SetupError, match="holds no result"):
        score_cases(sealed)
