"""Marks and figures on answers made up for the purpose."""

import json
from copy import deepcopy
from functools import reduce

import pytest

from chladni.signals.errors import SetupError
from chladni_withheld.folders import read_json, seal_case
from chladni_withheld.marking import mark
from chladni_withheld.score import Share, calibration_error, reliability, score_cases, scored
from chladni_withheld.score_table import HEADER, confusion_rows, detection_rows, markdown, missed_rows, score_rows


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
    assert [row[:2] for row in score_rows(score)[-3:]] == [
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


@pytest.mark.parametrize(("count", "met"), [(9, "too few"), (10, "yes")])
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


def test_wilsons_interval_has_its_published_values():
    # Newcombe, Statistics in Medicine 17 (1998), table I: 81 of 263 and 15 of 148.
    for right, count, low, high in ((81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605)):
        share = Share(right=right, count=count)
        assert (share.low, share.high) == pytest.approx((low, high), abs=5e-5)
    assert (Share(right=0, count=5).low, Share(right=5, count=5).high) == (0.0, 1.0)


def test_calibration_error_is_the_weighted_distance():
    table = reliability([0.9, 0.9, 0.9, 0.9, 0.3], [True, True, True, False, True])
    assert calibration_error(table) == pytest.approx((4 * abs(0.9 - 0.75) + 0.7) / 5)
    assert calibration_error([]) is None


@pytest.mark.parametrize(("count", "median", "tenth", "calibration"), [
    (1, "too few", "too few", "too few"), (2, "yes", "too few", "too few"), (10, "yes", "yes", "too few"),
    (15, "yes", "yes", "no"),
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
    assert rows["right effect, first place"][1:] == ["90.0 % (9)", "59.6 to 98.2 %", "10", "at least 92%", "no"]
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
        folder = tmp_path / "cases" / name
        folder.mkdir(parents=True)
        (folder / "model.toml").write_text("")
        (folder / "log.mcap").write_bytes(b"")
        seal_case(tmp_path, name, {"kind": "effect", "effects": TRUTH["effects"]})
        (tmp_path / "results").mkdir(exist_ok=True)
        (tmp_path / "results" / f"{name}.json").write_text(
            json.dumps(RESULT | ({key: value} if name == "two" else {}))
        )
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
