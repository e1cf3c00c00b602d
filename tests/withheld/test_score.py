"""Marks and figures on answers made up for the purpose."""

import json
import shutil
from copy import deepcopy
from functools import reduce

import pytest

from chladni.gap.robots.remarks import of_a_pulled_mass
from chladni.gap.robots.tuned import Pulled
from chladni.signals.errors import SetupError
from chladni_withheld.folders import read_json, seal_case
from chladni_withheld.marking import mark
from chladni_withheld.score import Share, calibration_error, paired, reliability, score_cases, scored
from chladni_withheld.score_table import (
    HEADER,
    changed_rows,
    confusion_rows,
    detection_rows,
    markdown,
    missed_rows,
    paired_rows,
    score_rows,
)


def answered(kind, hidden, named, *, verdict="effect", p=0.9, ratio=10.0, closed=0.99, coloured=False, off=None,
             naive=None):  # fmt: skip
    """Mark of one case; `hidden` and `named` are ``word@site``, `named` with a group as ``word@site,other``."""
    truth = {
        "kind": kind, "ratio": ratio if hidden or off else None, "coloured": coloured,
        "off": {off: 5.0} if off else {},
        "effects": [dict(zip(("effect", "site"), one.split("@"), strict=True)) for one in hidden.split()],
    }  # fmt: skip
    causes = []
    for one in named.split():
        effect, sites = one.split("@")
        causes.append({"effect": effect, "site": sites.split(",")[0], "group": sites.split(","), "probability": p})
    result = {
        "format": "chladni.gap/1",
        "verdict": verdict,
        "causes": causes,
        "gap": {"closed": closed},
        "ranking": [{"effect": "lag", "site": "m", "gap": 0.2}, {"effect": "delay", "site": "m", "gap": 0.1}],
    }
    if naive:
        result["naive"] = dict(zip(("effect", "site"), naive.split("@"), strict=True))
    return mark("x", truth, result)


def test_first_place_counts():
    marks = [
        answered("effect", "delay@m", "delay@m"),
        answered("effect", "delay@m", "lag@m delay@m"),
        answered("effect", "delay@m", "saturation@other,m"),
        answered("effect", "delay@m", "clipping@y"),
        answered("effect", "delay@m", "", verdict="unknown"),
        # Too faint to be asked for.
        answered("effect", "delay@m", "", verdict="none", ratio=2.0),
    ]
    score = scored(marks)
    assert (score["effect"]["right"], score["effect"]["count"]) == (1, 5)
    assert score["family"]["right"] == 3
    assert score["site"]["right"] == 3
    assert score["effect_naive"]["right"] == 5
    assert score["unknown_in_catalogue"]["right"] == 1
    assert score["group_sizes"] == {"1": 3, "2": 1}
    assert score["confusion"] == {"delay": {"clipping": 1, "delay": 1, "lag": 1, "saturation": 1, "unknown": 1}}
    assert score["confusion_family"] == {"actuator": {"actuator": 3, "sensor": 1, "unknown": 1}}


def test_an_alternative_that_the_answer_tells_is_counted_apart():
    truth = {"kind": "effect", "ratio": 9.0, "effects": [{"effect": "delay", "site": "m"}]}
    cause = {"effect": "lag", "site": "m", "probability": 0.6, "alternatives": [{"effect": "delay", "site": "m"}]}
    one = mark("x", truth, {"format": "chladni.gap/1", "verdict": "effect", "causes": [cause]})
    score = scored([one, answered("effect", "delay@m", "lag@m")])
    assert score["effect"]["right"] == 0
    assert (score["effect_or_alternative"]["right"], score["effect_or_alternative"]["count"]) == (1, 2)


def test_the_naive_pick_may_be_told():
    marks = [answered("effect", "delay@m", "delay@m", naive="lag@m")]
    assert scored(marks)["effect_naive"]["right"] == 0


def test_false_alarms_are_effects_named_where_there_are_none():
    marks = [
        answered("none", "", "", verdict="none"),
        answered("none", "", "delay@m", coloured=True),
        answered("none", "", "", verdict="unknown", coloured=True),
        answered("parameters", "", "parameter@k", verdict="parameters", off="k"),
        answered("parameters", "", "added_mass@b", off="k"),
    ]
    score = scored(marks)
    assert (score["false_alarm"]["right"], score["false_alarm"]["count"]) == (2, 5)
    assert (score["false_alarm_coloured"]["right"], score["false_alarm_coloured"]["count"]) == (1, 2)
    assert score["false_unknown"]["right"] == 1
    assert (score["parameter_named"]["right"], score["parameter_named"]["count"]) == (1, 2)


def test_what_is_strange_is_unknown_or_a_sibling():
    marks = [
        answered("leave_out", "delay@m", "lag@m"),
        answered("leave_out", "delay@m", "clipping@y"),
        answered("leave_out", "delay@m", "", verdict="none"),
        answered("outside", "viscoelastic@j", "", verdict="unknown"),
        answered("outside", "viscoelastic@j", "hysteresis@j"),
        answered("outside", "periodic_stiffness@j", "varying_stiffness@j"),
    ]
    score = scored(marks)
    assert (score["left_out_recognised"]["right"], score["left_out_recognised"]["count"]) == (1, 3)
    assert (score["outside_recognised"]["right"], score["outside_recognised"]["count"]) == (2, 3)


def test_two_effects_are_found_in_any_order_at_their_sites():
    marks = [
        answered("two", "delay@m clipping@y", "clipping@y delay@m"),
        answered("two", "delay@m clipping@y", "clipping@z delay@m"),
        answered("two", "delay@m clipping@y", "lag@m"),
    ]
    two = scored(marks)["two"]
    assert (two["both"]["right"], two["at_least_one"]["right"]) == (1, 2)


def test_of_three_effects_it_is_told_how_many_are_found():
    hidden = "delay@m clipping@y backlash@j"
    marks = [
        answered("three", hidden, "backlash@j clipping@y delay@m"),
        answered("three", hidden, "clipping@y backlash@j"),
        answered("three", hidden, "clipping@z delay@m lag@m"),
    ]
    score = scored(marks)
    three = score["three"]
    assert [three[key]["right"] for key in ("all", "at_least_two", "at_least_one")] == [1, 2, 3]
    # Only where there are such machines: a campaign in the default composition has none.
    assert [row[:2] for row in score_rows(score) if row[0].startswith("three")] == [
        ["three effects: all named", "33.3 % (1)"],
        ["three effects: at least two", "66.7 % (2)"],
        ["three effects: at least one", "100.0 % (3)"],
    ]
    assert not any("three" in row[0] for row in score_rows(scored([answered("two", hidden, "lag@m")])))
    assert [one["right"] for one in score["marks"]] == [True, False, False]


def test_faint_effects_make_a_detection_curve():
    marks = [
        answered("faint", "delay@m", "", verdict="none", ratio=0.4),
        answered("faint", "delay@m", "delay@m", ratio=1.2),
        answered("faint", "delay@m", "lag@m", ratio=1.3, p=0.85),
        answered("faint", "delay@m", "lag@m", ratio=2.9, p=0.5),
    ]
    faint = scored(marks)["faint"]
    assert [one["noticed"]["right"] for one in faint["curve"]] == [0, 0, 2, 1]
    assert [one["named"]["right"] for one in faint["curve"]] == [0, 0, 1, 0]
    assert (faint["confidently_wrong"]["right"], faint["confidently_wrong"]["count"]) == (1, 4)


def test_the_share_closed_is_that_of_the_true_law():
    marks = [answered("effect", "delay@m", "delay@m", closed=one) for one in (0.5, 0.98, 1.0, None)]
    closed = scored(marks)["closed"]
    assert closed["median"] == pytest.approx(0.98)
    # Linear between the order statistics 0.5 and 0.98, a fifth of the way.
    assert closed["tenth_percentile"] == pytest.approx(0.5 + 0.2 * 0.48)
    assert (closed["count"], closed["without"]) == (3, 1)


@pytest.mark.parametrize(("count", "met"), [(14, "too few"), (15, "yes")])
def test_a_share_that_may_miss_one_is_of_enough(count, met):
    marks = [answered("leave_out", "delay@m", "lag@m") for _ in range(count)]
    rows = {row[0]: row for row in score_rows(scored(marks))}
    assert rows["left out or outside: unknown, or a sibling"][5] == met


def test_cases_that_were_missed_are_listed():
    marks = [
        answered("effect", "delay@m", "delay@m"),
        answered("effect", "delay@m", "clipping@y lag@m", p=0.734),
        answered("none", "", "", verdict="unknown"),
        answered("parameters", "", "", verdict="none", off="k"),
    ]
    header, rows = missed_rows(scored(marks))
    assert header == ["case", "kind", "hidden", "named", "probability"]
    assert rows == [
        ["x", "effect", "delay at m", "clipping at y, lag at m", "0.73"],
        ["x", "none", "nothing", "unknown", "-"],
        ["x", "parameters", "k", "none", "-"],
    ]


def counted(score, key):
    """``right, count`` of a share, wherever it stands."""
    outer, _, inner = key.partition(".")
    told = score[outer][inner] if inner else score[outer]
    return told["right"], told["count"]


def test_a_wrong_value_among_the_causes_of_an_effect_is_a_cause():
    hidden = "parameter@tool.mass coulomb_friction@elbow"
    marks = [
        answered("value_and_effect", hidden, "coulomb_friction@elbow parameter@tool.mass"),
        answered("value_and_effect", hidden, "parameter@tool.mass coulomb_friction@wrist,elbow"),
        answered("value_and_effect", hidden, "coulomb_friction@elbow"),
        answered("value_and_effect", hidden, "parameter@tool.mass", verdict="parameters"),
        answered("value_and_effect", hidden, "coulomb_friction@elbow parameter@arm.mass"),
    ]
    score = scored(marks)
    assert counted(score, "model_wrong.value_and_effect") == (2, 5)
    assert [one["right"] for one in score["marks"]] == [True, True, False, False, False]
    # A value that isn't wrong is a wrong name.
    assert counted(score, "model_wrong.wrong") == (1, 5)
    assert score["marks"][3]["named"] == [["parameter", "tool.mass"]]


def test_each_of_several_wrong_values_must_be_named():
    hidden = "parameter@elbow.stiffness parameter@tool.mass"
    marks = [
        answered("value", hidden, "parameter@tool.mass parameter@elbow.stiffness", verdict="parameters"),
        answered("value", hidden, "parameter@tool.mass", verdict="parameters"),
        answered("value", "parameter@elbow.stiffness", "parameter@elbow.stiffness", verdict="parameters"),
        answered("value", "parameter@elbow.stiffness", "added_mass@tool", p=0.7),
        answered("value", "parameter@elbow.stiffness", "", verdict="unknown"),
    ]
    score = scored(marks)
    assert counted(score, "model_wrong.value") == counted(score, "model_wrong.named") == (2, 5)
    assert counted(score, "model_wrong.wrong") == (1, 5)
    assert (counted(score, "named_rightly"), counted(score, "unknown_nameable")) == ((2, 5), (1, 5))
    rows = {row[0]: row[1] for row in score_rows(score)}
    assert rows["of those, wrong values"] == "40.0 % (2)"
    assert "of those, a missing link" not in rows
    assert not any("wrong model" in row[0] for row in score_rows(scored([answered("none", "", "", verdict="none")])))


@pytest.mark.parametrize("named", ["missing_link@wrist~ground", "missing_link@arm~wrist,wrist~ground"])
def test_a_pair_is_a_site_in_any_order(named):
    score = scored([answered("topology", "missing_link@ground~wrist", named)])
    assert counted(score, "model_wrong.topology") == (1, 1)
    swapped = answered("effect", "swapped_channels@y2~y1", "swapped_channels@y1~y2")
    assert swapped.is_right
    assert not answered("topology", "missing_link@ground~wrist", "missing_link@ground~arm").is_right


def test_what_is_named_with_confidence_and_isn_t_true_is_counted():
    marks = [
        answered("effect", "delay@m", "delay@m clipping@y", p=0.95),
        answered("effect", "delay@m", "lag@m", p=0.7),
        answered("effect", "delay@m", "delay@other", p=0.89),
        answered("effect", "delay@m", "delay@m", p=0.99),
        answered("faint", "delay@m", "lag@m", p=0.9, ratio=1.0),
        answered("none", "", "delay@m", p=0.92),
        answered("parameters", "", "parameter@k", verdict="parameters", off="k", p=1.0),
        answered("parameters", "", "parameter@c", verdict="parameters", off="k", p=1.0),
        # No word was right; a sibling is no wrong name, and what isn't named isn't either.
        answered("leave_out", "delay@m", "lag@m", p=0.95),
        answered("outside", "viscoelastic@j", "lag@m", p=0.95),
        answered("none", "", "delay@m", verdict="unknown", p=0.99),
    ]
    score = scored(marks)
    assert counted(score, "wrong.0.9") == (5, 11)
    assert counted(score, "wrong.0.6") == (7, 11)


def test_of_what_words_can_name_all_must_be_named_and_nothing_else():
    marks = [
        answered("effect", "delay@m", "delay@m", p=0.6),
        answered("effect", "delay@m", "delay@m", p=0.59),
        answered("effect", "delay@m", "delay@m lag@m", p=0.7),
        answered("two", "delay@m clipping@y", "clipping@y delay@m", p=0.7),
        answered("two", "delay@m clipping@y", "clipping@y", p=0.7),
        answered("parameters", "", "parameter@k", verdict="parameters", off="k"),
        answered("effect", "delay@m", "", verdict="unknown"),
    ]
    # What is faint, missing, or has no word isn't asked.
    others = [
        answered("effect", "delay@m", "", verdict="unknown", ratio=2.0),
        answered("faint", "delay@m", "", verdict="unknown", ratio=2.0),
        answered("none", "", "", verdict="unknown"),
        answered("outside", "viscoelastic@j", "", verdict="unknown"),
    ]
    score = scored([*marks, *others])
    assert counted(score, "named_rightly") == (3, 7)
    assert counted(score, "unknown_nameable") == (1, 7)


def test_bins_of_the_reliability_diagram_have_wilsons_interval():
    right = [answered("effect", "delay@m", "delay@m", p=0.95) for _ in range(50)]
    half = [answered("effect", "delay@m", "delay@m" if place % 2 else "lag@m", p=0.55) for place in range(10)]
    first, last = scored([*right, *half])["calibration"]["bins"]
    # Of 5 of 10 and of 50 of 50, from tables.
    assert first["interval"] == pytest.approx((0.2366, 0.7634), abs=1e-4)
    assert last["interval"] == pytest.approx((0.9287, 1.0), abs=1e-4)
    assert (first["count"], first["right"], last["count"], last["right"]) == (10, 0.5, 50, 1.0)


@pytest.mark.parametrize(("generator", "must"), [
    ("chains", ["at least 95%", "at least 97%", "at most 1.5%"]),
    ("networks", ["at least 90%", "at least 95%", "at most 2%"]),
    (None, ["at least 95%", "at least 97%", "at most 1.5%"]),
])  # fmt: skip
def test_what_must_be_is_the_generators_own(generator, must):
    score = scored([answered("effect", "delay@m", "delay@m")]) | {"generator": generator}
    rows = {row[0].partition(":")[0]: row[4] for row in score_rows(score)}
    assert [rows[what] for what in ("right effect, first place", "right site, or a group that holds it",
                                    "false alarm")] == must  # fmt: skip


def row_of(compared, key):
    return next(row for row in compared["rows"] if row["key"] == key)


def test_versions_are_told_apart_by_the_pairs_that_differ():
    right, wrong = answered("effect", "delay@m", "delay@m"), answered("effect", "delay@m", "saturation@m")
    faint = answered("faint", "delay@m", "", verdict="none", ratio=1.0)
    pairs = [*[(right, right)] * 30, *[(right, wrong)] * 6, *[(wrong, right)], *[(wrong, wrong)] * 2, (faint, faint)]
    compared = paired(pairs)
    row = row_of(compared, "effect")
    assert {key: row[key] for key in ("count", "here", "there", "only_here", "only_there")} == {
        "count": 39, "here": 36, "there": 31, "only_here": 6, "only_there": 1
    }  # fmt: skip
    # Seven throws of a coin that give one head or none, or as many tails.
    assert row["p"] == pytest.approx(2 * (1 + 7) / 2**7)
    # Of the same family: nothing differs, and nothing can be said.
    assert (row_of(compared, "family")["only_here"], row_of(compared, "family")["p"]) == (0, None)
    assert compared["pairs"] == 40
    assert [one["here"]["right"] for one in compared["changed"]] == [True] * 6 + [False]
    told = {row[0]: row[1:] for row in paired_rows(compared)}
    assert told["right effect, first place"] == ["39", "36", "31", "6", "1", "0.125"]
    assert "right family" in told
    assert "left out or outside: unknown, or a sibling" not in told
    header, rows = changed_rows(compared)
    assert header == ["case", "kind", "hidden", "here", "there", "right"]
    assert rows[-1] == ["x", "effect", "delay at m", "saturation at m", "delay at m", "there"]


def test_wilsons_interval_has_its_published_values():
    # Newcombe, Statistics in Medicine 17 (1998), table I: 81 of 263 and 15 of 148.
    for right, count, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605)):
        share = Share(right=right, count=count)
        assert share.interval == pytest.approx((low, high), abs=5e-5)
    assert (Share(right=0, count=5).interval[0], Share(right=5, count=5).interval[1]) == (0.0, 1.0)
    assert Share(right=0, count=0).interval == (0.0, 1.0)


def test_calibration_error_is_the_weighted_distance():
    table = reliability([0.9, 0.9, 0.9, 0.9, 0.3], [True, True, True, False, True])
    assert calibration_error(table) == pytest.approx((4 * abs(0.9 - 0.75) + 0.7) / 5)
    assert calibration_error([]) is None


@pytest.mark.parametrize(("count", "median", "tenth", "calibration"), [
    (1, "too few", "too few", "too few"), (2, "yes", "too few", "too few"), (10, "yes", "yes", "too few"),
    (19, "yes", "yes", "too few"), (20, "yes", "yes", "no"),
])  # fmt: skip
def test_numbers_of_few_cases_meet_and_miss_nothing(count, median, tenth, calibration):
    marks = [answered("effect", "delay@m", "delay@m") for _ in range(count)]
    rows = {row[0]: row for row in score_rows(scored(marks))}
    assert rows["gap closed over the true law's, median"][5] == median
    assert rows["gap closed, 10th percentile"][5] == tenth
    assert rows["expected calibration error"][5] == calibration


@pytest.mark.parametrize(
    ("result", "told"),
    [
        ({"verdict": "perhaps"}, "x: verdict: found 'perhaps'; must be 'none'"),
        ({"verdict": "effect", "causes": [{"site": "m"}]}, r"x: causes\[0\]\.effect: is missing"),
        ({"verdict": "effect", "causes": [3]}, r"x: causes\[0\]: found 3; must be a table"),
    ],
)
def test_an_answer_that_breaks_its_format_is_told(result, told):
    with pytest.raises(SetupError, match=told):
        mark("x", {"kind": "none", "effects": []}, {"format": "chladni.gap/1", **result})


def test_tables_say_what_must_be_met():
    marks = [answered("effect", "delay@m", "delay@m") for _ in range(9)] + [answered("effect", "delay@m", "lag@m")]
    score = scored(marks)
    rows = {row[0]: row for row in score_rows(score)}
    assert all(len(row) == len(HEADER) for row in rows.values())
    assert rows["right effect, first place"][1:] == ["90.0 % (9)", "59.6 to 98.2 %", "10", "at least 95%", "no"]
    # One wrong family of ten would be one too many: all ten tell little.
    assert rows["right family"][5] == "too few"
    enough = {row[0]: row for row in score_rows(scored(3 * marks))}
    assert (enough["right family"][5], enough["right effect, first place"][5]) == ("yes", "no")
    assert rows["two effects: both named"][1] == "-"
    header, confusion = confusion_rows(score["confusion"])
    assert markdown(header, confusion).splitlines()[2] == "| delay | 9 | 1 |"
    assert len(detection_rows(score)[1]) == 4


TRUTH = {"format": "chladni.blind-truth/1", "kind": "effect", "effects": [{"effect": "delay", "site": "m"}],
         "off": {"k": 5.0}, "ratio": 9.0, "ratio_tuned": None, "ideal": 1.0, "coloured": False}  # fmt: skip
RESULT = {
    "format": "chladni.gap/1", "verdict": "effect",
    "causes": [{"effect": "delay", "site": "m", "group": ["m"], "probability": 0.9,
                "alternatives": [{"effect": "lag", "site": "m"}]}],
    "ranking": [{"effect": "delay", "site": "m", "gap": 0.1}], "naive": {"effect": "lag", "site": "m"},
    "gap": {"closed": 0.9},
}  # fmt: skip
WRONG = [
    None,
    True,
    0,
    -1,
    3.5,
    10**400,
    1e308,
    "",
    "delay",
    "\ud800",
    "x" * 5000,
    [],
    [1.5],
    {},
    {"a": 1},
    [[]],
    [{}],
]


def places_in(content, path=()):
    """Place of every value, at any depth."""
    keys = range(len(content)) if isinstance(content, list) else content if isinstance(content, dict) else ()
    return [place for key in keys for place in [(*path, key), *places_in(content[key], (*path, key))]]


def changed(content, place, value):
    """Content with another value at a place; without it where the value is `...`."""
    again = deepcopy(content)
    *parents, key = place
    inner = reduce(lambda outer, one: outer[one], parents, again)
    if value is ...:
        del inner[key]
    else:
        inner[key] = value
    return again


@pytest.mark.parametrize("whole", [TRUTH, RESULT], ids=["truth", "result"])
def test_any_value_at_any_key_is_marked_or_told_by_its_key(whole):
    told = {}
    for place in places_in(whole):
        for value in [*WRONG, ...]:
            wrong = changed(whole, place, value)
            try:
                one = mark("x", wrong if whole is TRUTH else TRUTH, wrong if whole is RESULT else RESULT)
            except SetupError as error:
                told[place, str(value)] = str(error)
            else:
                json.dumps(scored([one]), allow_nan=False)
    assert len(told) > 100
    for (place, _), text in told.items():
        assert text.startswith("x: ")
        assert str(place[0]) in text
        assert len(text) < 600


CAUSE = {"effect": "delay", "site": "m"}


def put(directory, name, named="delay"):
    """A sealed case, and the answer to it."""
    folder = directory / "cases" / name
    folder.mkdir(parents=True)
    (folder / "model.toml").write_text(f"# {name}")
    (folder / "log.mcap").write_bytes(b"")
    seal_case(directory, name, {"kind": "effect", "effects": TRUTH["effects"]})
    answer(directory, name, named)


def answer(directory, name, named):
    (directory / "results").mkdir(exist_ok=True)
    cause = RESULT["causes"][0] | {"effect": named}
    (directory / "results" / f"{name}.json").write_text(json.dumps(RESULT | {"causes": [cause]}))


def test_answers_of_two_versions_are_held_against_each_other(tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    for name in ("one", "two", "three"):
        put(here, name)
    shutil.copytree(here, there)
    # Only the cases and the answers of the other campaign are read.
    shutil.rmtree(there / "truth")
    answer(there, "one", "lag")
    (there / "results" / "two.json").unlink()
    score = score_cases(here, against=there)
    row = row_of(score["against"], "effect")
    assert (score["against"]["pairs"], row["here"], row["there"], row["only_here"], row["p"]) == (2, 2, 1, 1, 1.0)
    assert [(one["here"]["case"], one["there"]["named"]) for one in score["against"]["changed"]] == [
        ("one", [["lag", "m"]])
    ]
    assert "against" not in json.loads((here / "score.json").read_text())


def test_answers_to_other_cases_are_refused(tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    put(here, "one")
    put(there, "one")
    (there / "cases" / "one" / "model.toml").write_text("# another")
    with pytest.raises(SetupError, match=r"there/cases/one/model\.toml: isn't what was sealed"):
        score_cases(here, against=there)
    put(tmp_path / "else", "two")
    with pytest.raises(SetupError, match="else/results: answers none of the cases that are answered here"):
        score_cases(here, against=tmp_path / "else")


@pytest.mark.parametrize(("key", "value", "named"), [
    ("causes", [CAUSE | {"probability": "0.9"}], r"causes\[0\]\.probability: found '0\.9'; must be a number"),
    ("causes", [CAUSE | {"probability": 1.5}], r"causes\[0\]\.probability: found 1\.5; must be less"),
    ("ranking", [CAUSE | {"gap": -1.0}], r"ranking\[0\]\.gap: found -1\.0; must be greater"),
    ("gap", [], r"gap: found \[\]; must be a table"),
    ("gap", {"closed": [1]}, r"gap\.closed: found \[1\]; must be a number"),
    ("naive", {"effect": "lag"}, r"naive\.site: is missing"),
])  # fmt: skip
def test_a_result_on_disk_is_refused_with_its_file_and_key(tmp_path, key, value, named):
    for name in ("one", "two"):
        put(tmp_path, name)
    (tmp_path / "results" / "two.json").write_text(json.dumps(RESULT | {key: value}))
    with pytest.raises(
        SetupError, match=rf"results/two\.json: {named}.*; remove this result, and run the case again"
    ):
        score_cases(tmp_path)
    (tmp_path / "results" / "two.json").unlink()
    assert score_cases(tmp_path)["missing"] == ["two"]


@pytest.mark.parametrize(
    "text", ['{"x": 1e999}', '{"x": NaN}', '{"x": "\\ud800"}', "[" * 990, "1" * 5000, "{", "\x00", "3"]
)
def test_what_is_no_json_is_told_with_its_file(tmp_path, text):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(SetupError, match=r"a\.json: (isn't JSON|format is)"):
        read_json(path, "chladni.gap/1")


def test_a_truth_that_hides_nothing_though_its_kind_does_is_refused():
    with pytest.raises(SetupError, match="x: kind is two, and effects holds none"):
        mark("x", {"kind": "two", "effects": []}, RESULT)


@pytest.mark.parametrize(
    ("pulled", "told"),
    [
        ({}, True),
        ({"links": ("tool", "hand")}, True),
        ({"links": ("arm",), "instead": ("hand",)}, True),
        ({"change": -0.1}, False),
        ({"links": ("arm",)}, False),
        ({"links": ("hand_left",)}, False),
    ],
)
def test_a_heavier_link_is_told_by_a_remark_too(pulled, told):
    numbers = {"nominal": 1.0, "true": 1.04}
    truth = {"kind": "ordinary", "effects": [
        {"effect": "delay", "site": "all commands"},
        {"effect": "parameter", "site": "hand.mass", "parameters": numbers},
    ]}  # fmt: skip
    own = {"links": ("hand",), "instead": (), "change": 0.04, "std": 0.01, "over_tolerance": 4.0}
    cause = {"effect": "delay", "site": "all commands", "probability": 0.9}
    result = {"format": "chladni.gap/1", "verdict": "effect", "causes": [cause],
              "remarks": [of_a_pulled_mass(Pulled(**(own | pulled)))]}  # fmt: skip
    score = scored([mark("x", truth, result)])["robots"]
    assert score["ordinary_told"]["right"] == told
    assert score["ordinary"]["right"] == 0
