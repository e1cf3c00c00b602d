"""The document of a diagnosis, held against the format that programs rely on, key by key."""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chladni.apps.gap_document import gap_document
from chladni.gap.records.diagnosis import (
    AnyLaw,
    Candidate,
    ChannelGap,
    Correlation,
    Diagnosis,
    FittedNumber,
    PairShare,
)
from tests import made_diagnosis as made

# Of each key: what its value may be. A list holds things of one kind, a mapping of str any names.
NUMBER, OPTIONAL = (float,), (float, type(None))
CANDIDATE = {"effect": (str,), "site": (str,)}
SCHEMA: Mapping[str, Any] = {
    "format": (str,),
    "model": (str,),
    "logs": [(str,)],
    "verdict": (str,),
    "causes": [
        {
            "effect": (str,),
            "site": (str,),
            "probability": NUMBER,
            "group": [(str,)],
            "alternatives": [CANDIDATE],
            "parameters": {str: {"value": NUMBER, "std": OPTIONAL, "unit": (str,)}},
        }
    ],
    "ranking": [{"effect": (str,), "site": (str,), "probability": NUMBER, "gap": OPTIONAL, "log_evidence": OPTIONAL}],
    "where": {
        "channels": [{"name": (str,), "gap": NUMBER, "noise": NUMBER}],
        "bands": [{"low_hz": NUMBER, "high_hz": NUMBER, "share": NUMBER}],
        "sites": [{"name": (str,), "share": NUMBER}],
        "regimes": [{"variable": (str,), "low": NUMBER, "high": NUMBER, "share": NUMBER}],
        "times": [{"start_s": NUMBER, "end_s": NUMBER, "share": NUMBER}],
    },
    "gap": {
        "before": NUMBER,
        "tuned": NUMBER,
        "after": NUMBER,
        "noise": NUMBER,
        "closed": OPTIONAL,
        "interval": (list, type(None)),
        "held_out": [{"log": (str,), "start_s": NUMBER, "end_s": NUMBER}],
    },
    "tuned_parameters": {str: {"nominal": OPTIONAL, "value": NUMBER, "std": OPTIONAL, "unit": (str,)}},
    "next_measurement": (str, type(None)),
}
# What may stand beside the agreed keys, by the place it stands in.
MORE = {
    "": {
        "naive",
        "advice",
        "remarks",
        "distortion",
        "levels",
        "elsewhere",
        "left",
        "correlation",
        "any_law",
        "set",
        "coverage",
    },
    ".causes": {"variant", "from", "share", "probability_of"},
    ".ranking": {"beside"},
    ".where.channels": {"noise_from", "noise_at_most"},
    ".where.bands": {"noise"},
    ".where": {"pair"},
    ".where.sites": {"group"},
    ".where.regimes": {"time"},
    ".gap": {"by", "horizon_s", "explained", "after_over_noise", "noise_at_most"},
}
# Of some of these: what their values may be.
KINDS_OF_MORE: Mapping[str, Any] = {
    ".set": [CANDIDATE],
    ".coverage": NUMBER,
    ".gap.after_over_noise": NUMBER,
    ".gap.noise_at_most": (bool,),
    ".where.channels.noise_at_most": (bool,),
    ".causes.probability_of": [(str,)],
}
KINDS = made.every_kind()


def strays(value: Any, schema: Any, place: str = "") -> list[str]:
    """Places of a value that aren't as in a schema: keys that lack or that nobody knows, values of another kind."""
    if isinstance(schema, tuple):
        return [] if isinstance(value, schema) else [f"{place}: {value!r}"]
    if isinstance(schema, list):
        if not isinstance(value, list):
            return [f"{place}: {value!r}"]
        return [stray for one in value for stray in strays(one, schema[0], place)]
    if str in schema:
        return [stray for one in value.values() for stray in strays(one, schema[str], place)]
    if not set(schema) <= set(value) <= set(schema) | MORE.get(place, set()):
        return [f"{place}: keys {sorted(set(value) ^ set(schema))}"]
    more = {key: KINDS_OF_MORE[f"{place}.{key}"] for key in value if f"{place}.{key}" in KINDS_OF_MORE}
    return [stray for key, one in {**schema, **more}.items() for stray in strays(value[key], one, f"{place}.{key}")]


def written(found: Diagnosis) -> Any:
    return json.loads(json.dumps(gap_document(found), allow_nan=False))


@pytest.mark.parametrize("kind", KINDS)
def test_every_document_has_the_agreed_keys_and_kinds_of_values(kind: str) -> None:
    assert strays(written(KINDS[kind]), SCHEMA) == []


def test_the_numbers_are_those_of_the_diagnosis() -> None:
    document = written(made.diagnosis())
    assert document["format"] == "chladni.gap/1"
    assert (document["model"], document["logs"], document["verdict"]) == ("arm", ["arm.mcap"], "effect")
    (cause,) = document["causes"]
    assert (cause["effect"], cause["site"], cause["probability"]) == ("coulomb_friction", "elbow", 0.97)
    assert cause["parameters"]["force"] == {"value": 8.1, "std": 0.2, "unit": "N"}
    assert cause["parameters"]["creep_speed"]["std"] is None
    assert (cause["variant"], cause["share"]) == ("regularised", 0.93)
    assert document["ranking"][1] == {
        "effect": "hysteresis", "site": "elbow", "probability": 0.02, "gap": 0.031, "log_evidence": -130.2
    }  # fmt: skip
    assert document["where"]["regimes"] == [
        {"variable": "elbow.velocity", "low": -0.01, "high": 0.01, "share": 0.6, "time": 0.2}
    ]
    assert "group" not in document["where"]["sites"][0]
    assert document["where"]["channels"][0]["noise_from"] == "periods"
    assert document["where"]["bands"][0] == {"low_hz": 0.5, "high_hz": 8.0, "share": 0.12, "noise": 0.4}
    assert "noise" not in document["where"]["bands"][2]
    assert document["where"]["times"][0] == {"start_s": 2.0, "end_s": 2.5, "share": 0.31}
    assert document["gap"]["interval"] == [0.99, 0.998]
    assert document["gap"]["held_out"][0] == {"log": "arm.mcap", "start_s": 2.0, "end_s": 4.0}
    assert document["tuned_parameters"]["elbow.stiffness"] == {
        "nominal": 20000.0, "value": 20400.0, "std": 80.0, "unit": "N/m"
    }  # fmt: skip
    assert document["naive"] == {"effect": "hysteresis", "site": "elbow"}


def test_which_parameters_are_told_together_only_stands_there_as_a_matrix() -> None:
    names = ("shoulder.stiffness", "elbow.stiffness")
    known = Correlation(names=names, matrix=np.array([[1.0, -0.9], [-0.9, 1.0]]))
    document = written(replace(made.diagnosis(), correlation=known))
    assert strays(document, SCHEMA) == []
    assert document["correlation"] == {"names": list(names), "matrix": [[1.0, -0.9], [-0.9, 1.0]]}
    assert "correlation" not in written(made.diagnosis())


def test_what_any_law_explains_is_there_where_it_was_asked_for() -> None:
    law = AnyLaw(site="elbow", group=("wrist",), force=0.98, law=0.4, named=None)
    document = written(replace(made.unknown(), any_law=law))
    assert strays(document, SCHEMA) == []
    assert document["any_law"] == {"site": "elbow", "group": ["wrist"], "force": 0.98, "law": 0.4, "named": None}
    assert "any_law" not in written(made.unknown())


def test_a_pair_of_sites_is_there_where_two_forces_explain_more_than_one() -> None:
    found = made.diagnosis()
    pair = PairShare(groups=(("elbow", "wrist"), ("shaker",)), share=0.99)
    first, *others = found.where.sites
    where = replace(found.where, pair=pair, sites=(replace(first, group=("wrist",)), *others))
    document = written(replace(found, where=where))
    assert strays(document, SCHEMA) == []
    assert document["where"]["pair"] == {"groups": [["elbow", "wrist"], ["shaker"]], "share": 0.99}
    assert document["where"]["sites"][0] == {"name": "elbow", "share": 0.93, "group": ["wrist"]}
    assert "pair" not in written(found)["where"]


def test_a_row_of_the_ranking_says_beside_what_its_numbers_are() -> None:
    found = made.diagnosis()
    half = replace(found.ranking[0], beside=(Candidate(effect="time_offset", site="acc_wrist"),))
    document = written(replace(found, ranking=(half, *found.ranking[1:])))
    assert strays(document, SCHEMA) == []
    assert document["ranking"][0]["beside"] == [{"effect": "time_offset", "site": "acc_wrist"}]
    assert "beside" not in document["ranking"][1]


def test_groups_and_alternatives_are_lists_of_names_and_candidates() -> None:
    (cause,) = written(made.indistinguishable())["causes"]
    assert cause["group"] == ["elbow", "shoulder"]
    assert cause["alternatives"] == [{"effect": "hysteresis", "site": "elbow"}]


def test_a_probability_that_a_family_shares_names_its_words() -> None:
    family = ("coulomb_friction", "hysteresis")
    (plain,) = written(made.indistinguishable())["causes"]
    assert "probability_of" not in plain
    shared = replace(made.diagnosis(), causes=(made.friction(probability=0.62, probability_of=family),))
    assert strays(written(shared), SCHEMA) == []
    (cause,) = written(shared)["causes"]
    assert (cause["effect"], cause["probability_of"]) == ("coulomb_friction", list(family))


def test_noise_that_is_a_bound_is_marked_as_one() -> None:
    found = made.diagnosis()
    assert "noise_at_most" not in written(found)["gap"]
    first, *others = found.where.channels
    where = replace(found.where, channels=(replace(first, noise_at_most=True), *others))
    document = written(replace(found, gap=replace(found.gap, noise_at_most=True), where=where))
    assert strays(document, SCHEMA) == []
    assert document["gap"]["noise_at_most"] is True
    assert [one.get("noise_at_most") for one in document["where"]["channels"]] == [True, None]


def test_how_it_was_measured_is_told_only_where_it_was_not_by_free_run() -> None:
    assert "by" not in written(made.diagnosis())["gap"]
    assert written(made.hidden_floor())["gap"]["by"] == "cross_sensor"
    windows = written(made.drifting())["gap"]
    assert (windows["by"], windows["horizon_s"]) == ("windows", 0.5)


def test_what_is_left_is_told_in_units_of_the_noise_where_that_is_known() -> None:
    found = made.unknown()
    gap = written(found)["gap"]
    assert gap["after_over_noise"] == pytest.approx(found.gap.after / found.gap.noise)
    assert "after_over_noise" not in written(replace(found, gap=replace(found.gap, noise=0.0)))["gap"]


def test_what_holds_the_truth_is_there_with_its_probability_where_something_was_weighed() -> None:
    rub, nothing = Candidate(effect="coulomb_friction", site="elbow"), Candidate(effect="none", site="")
    document = written(replace(made.diagnosis(), answer_set=(rub, nothing), coverage=0.9))
    assert strays(document, SCHEMA) == []
    assert document["set"] == [{"effect": "coulomb_friction", "site": "elbow"}, {"effect": "none", "site": ""}]
    assert document["coverage"] == 0.9
    assert {"set", "coverage"}.isdisjoint(written(made.diagnosis()))


def test_what_is_not_known_is_null_and_never_nan() -> None:
    found = made.agreeing()
    assert written(found)["gap"]["closed"] is None
    strange = replace(
        found,
        tuned_parameters={"elbow.damping": FittedNumber(value=1.0, std=float("inf"), unit="N s/m", nominal=None)},
        where=replace(found.where, channels=(ChannelGap(name="a", gap=float("nan"), noise=0.1),)),
    )
    document = written(strange)
    assert document["tuned_parameters"]["elbow.damping"]["std"] is None
    assert document["where"]["channels"][0]["gap"] is None


def test_whole_numbers_are_written_as_floats() -> None:
    found = replace(made.diagnosis(), tuned_parameters={"a.mass": FittedNumber(value=2, std=None, unit="kg")})
    assert isinstance(written(found)["tuned_parameters"]["a.mass"]["value"], float)


def test_keys_beside_the_agreed_ones_are_there_only_with_content() -> None:
    bare = replace(made.diagnosis(), naive=None, remarks=(), advice=None)
    assert set(written(bare)) == set(SCHEMA)
    naive = Candidate(effect="lag", site="shaker")
    known = Correlation(names=("a",), matrix=np.eye(1))
    full = written(
        replace(
            made.periodic(),
            advice="Measure longer.",
            naive=naive,
            left=made.unknown().left,
            correlation=known,
            any_law=AnyLaw(site="elbow", group=(), force=0.99, law=0.98, named=0.93),
            answer_set=(naive,),
        )
    )
    assert set(full) == set(SCHEMA) | MORE[""]
    assert full["distortion"][0] == {
        "output": "acc_column", "linear": 0.93, "even": 0.001, "odd": 0.068, "noise": 0.001, "nonlinear": 0.069
    }  # fmt: skip
