import hashlib
import json

import pytest

from chladni.signals.errors import SetupError
from chladni_withheld.folders import canonical, case_folders, seal_case, seal_of, truth_of_case

TRUTH = {"kind": "effect", "effects": [{"effect": "delay", "site": "motor"}]}


@pytest.fixture
def own_case(tmp_path):
    """A case of one's own: any model and log."""
    folder = tmp_path / "cases" / "mine"
    folder.mkdir(parents=True)
    (folder / "model.toml").write_text("")
    (folder / "log.mcap").write_bytes(b"")
    return tmp_path


def test_the_seal_is_sha256_of_salt_and_canonical_truth(own_case):
    seal = seal_case(own_case, "mine", TRUTH)
    sealed = json.loads((own_case / "truth" / "mine.json").read_text())
    salt = sealed.pop("salt")
    text = json.dumps(sealed, sort_keys=True, separators=(",", ":"))
    assert seal == hashlib.sha256(f"{salt}{text}".encode()).hexdigest()
    assert json.loads((own_case / "cases" / "mine" / "case.json").read_text())["seal"] == seal
    nothing = hashlib.sha256(b"").hexdigest()
    files = {"model.toml": nothing, "log.mcap": nothing}
    assert sealed == {**TRUTH, "files": files, "format": "chladni.blind-truth/1"}


def test_the_order_of_keys_is_no_part_of_a_truth():
    assert canonical({"a": 1, "b": {"c": 2, "d": 3}}) == canonical({"b": {"d": 3, "c": 2}, "a": 1})


def test_equal_truths_have_different_seals(own_case):
    assert seal_case(own_case, "mine", TRUTH) != seal_case(own_case, "mine", TRUTH)


@pytest.mark.parametrize("change", [{"kind": "none"}, {"salt": "0" * 64}, {"effects": []}, {"more": 1}])
def test_a_truth_that_was_changed_is_refused(own_case, change):
    seal_case(own_case, "mine", TRUTH)
    path = own_case / "truth" / "mine.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    (case,) = case_folders(own_case)
    with pytest.raises(SetupError, match="doesn't fit the seal of mine"):
        truth_of_case(own_case, case)


@pytest.mark.parametrize("file", ["model.toml", "log.mcap"])
def test_a_case_whose_model_or_log_was_changed_is_refused(own_case, file):
    seal_case(own_case, "mine", TRUTH)
    (own_case / "cases" / "mine" / file).write_text("# another")
    (case,) = case_folders(own_case)
    with pytest.raises(SetupError, match=rf"{file}: isn't what was sealed"):
        truth_of_case(own_case, case)


def test_a_truth_of_an_earlier_version_knows_no_files(own_case):
    seal_case(own_case, "mine", TRUTH)
    truth, told = own_case / "truth" / "mine.json", own_case / "cases" / "mine" / "case.json"
    former = {key: value for key, value in json.loads(truth.read_text()).items() if key != "files"}
    truth.write_text(json.dumps(former))
    told.write_text(json.dumps(json.loads(told.read_text()) | {"seal": seal_of(former)}))
    (case,) = case_folders(own_case)
    assert truth_of_case(own_case, case)["kind"] == "effect"


def test_a_truth_that_was_moved_away_is_asked_for(own_case):
    seal_case(own_case, "mine", TRUTH)
    (own_case / "truth").rename(own_case / "elsewhere")
    (case,) = case_folders(own_case)
    with pytest.raises(SetupError, match=r"mine\.json: isn't there; move the truths back to .*truth"):
        truth_of_case(own_case, case)


def test_a_truth_that_is_whole_is_given(own_case):
    seal_case(own_case, "mine", TRUTH, leave_out=("delay", "lag"))
    (case,) = case_folders(own_case)
    assert case.leave_out == {"delay", "lag"}
    assert truth_of_case(own_case, case)["effects"] == TRUTH["effects"]


def test_a_truth_without_salt_has_no_seal():
    with pytest.raises(SetupError, match="no salt"):
        seal_of(TRUTH)


@pytest.mark.parametrize("missing", ["kind", "effects"])
def test_a_truth_needs_kind_and_effects(own_case, missing):
    with pytest.raises(SetupError, match=missing):
        seal_case(own_case, "mine", {key: value for key, value in TRUTH.items() if key != missing})


def test_a_case_needs_model_and_log(tmp_path):
    with pytest.raises(SetupError, match=r"model\.toml"):
        seal_case(tmp_path, "mine", TRUTH)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("{", "isn't JSON"),
        ('{"format": "chladni.blind-case/1", "seal": NaN}', "isn't JSON"),
        ("[1]", "format is 'list'"),
        ('{"format": "else/1"}', "must be 'chladni.blind-case/1'"),
        ('{"format": "chladni.blind-case/1", "seal": 3}', "64 hexadecimal"),
        ('{"format": "chladni.blind-case/1", "seal": "%s", "leave_out": ["rust"]}' % ("0" * 64), "leave_out"),
        ("[" * 100_000, "isn't JSON"),
    ],
)
def test_a_case_file_that_is_wrong_is_told_in_one_line(own_case, content, told):
    (own_case / "cases" / "mine" / "case.json").write_text(content)
    with pytest.raises(SetupError, match=told) as caught:
        case_folders(own_case)
    assert "\n" not in str(caught.value)
    assert "case.json" in str(caught.value)


def test_an_empty_campaign_is_told(tmp_path):
    with pytest.raises(SetupError, match="holds no case"):
        case_folders(tmp_path)
