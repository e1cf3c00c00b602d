"""The search: relatives of what leads, details of its law, sites that can't be told from its own, small causes."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.gap.diagnosis.diagnose import diagnose
from chladni.gap.diagnosis.search import Search, _polished
from chladni.gap.diagnosis.study import study_of
from chladni.gap.diagnosis.verdict import searched
from chladni.gap.explanation.hypotheses import hypothesis_of, siblings, twins
from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE, taking_part
from tests.gap.arm import all_but, arm, measured, with_outputs
from tests.gap.diagnosis.test_told_holds import made as driven
from tests.gap.made_log import RATE_HZ, band_noise, chain
from tests.gap.made_log import measured as made


@pytest.mark.nightly
def test_a_stribeck_curve_that_falls_slowly_isnt_lost_to_coulombs() -> None:
    # It falls over four times the speed that is usual there: from a curve that falls at once the search ends at
    # Coulomb's friction, with static and sliding force alike.
    curve = {"coulomb": 3.0, "static": 9.0, "speed": 1.0}
    log = measured((chladni.attached("stribeck_friction", "elbow", curve),), noise=0.005)
    study = study_of(arm(), log, leave_out=frozenset(), own={})
    plain = hypothesis_of((chladni.attached("coulomb_friction", "elbow", {"force": 5.0}),), study.location.tuned.z)
    coulomb = study.contest.enter(plain)
    assert coulomb is not None
    found = study.contest.enter_all(siblings(coulomb, study.contest.run))
    best = min(found, key=lambda one: one.chi)
    assert best.chi < coulomb.chi - 0.03
    assert best.fit.effects[0].values["speed"] == pytest.approx(1.0, rel=0.2)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_stribeck_curve_hands_on_to_the_coulomb_friction_that_it_ends_at() -> None:
    log = measured((chladni.attached("coulomb_friction", "elbow", {"force": 5.0}),), noise=0.005)
    study = study_of(arm(), log, leave_out=frozenset(), own={})
    curve = chladni.attached("stribeck_friction", "elbow", {"coulomb": 4.5, "static": 5.5, "speed": 0.1})
    stribeck = study.contest.enter(hypothesis_of((curve,), study.location.tuned.z))
    assert stribeck is not None
    (plain,) = study.contest.enter_all(siblings(stribeck, study.contest.run))
    assert plain.hypothesis.named[0].effect == "coulomb_friction"
    assert plain.fit.effects[0].values["force"] == pytest.approx(5.0, rel=0.02)
    search = Search(replace(study, kinds=taking_part({"coulomb_friction"}, ())))
    search.found = [search.nothing, stribeck]
    assert search.best is stribeck
    assert search._relatives() == []


@pytest.mark.nightly
@pytest.mark.slow
def test_a_ripple_of_the_joint_that_an_input_acts_across_may_be_the_inputs() -> None:
    # An unknown force is band-limited: only an input that is, too, prints the same between samples.
    machine = chain([2.0, 2.5], [2.6e4, 1.7e4], [5.0, 4.0]).with_holds({"hammer": "band_limited"})
    cogging = chladni.attached("ripple", "j0", {"amplitude": 30.0, "period": 0.01, "phase": 0.3})
    log, _ = made(machine.with_effects((cogging,)), band_noise(3000), noise=0.005)
    study = study_of(machine, log, leave_out=frozenset(CATALOGUE) - {"ripple"}, own={})
    joint = study.contest.enter(hypothesis_of((cogging,), study.location.tuned.z), max_iterations=40)
    assert joint is not None
    moved = study.contest.enter_all(twins(joint, study.location.places))
    assert {one.hypothesis.named[0].site for one in moved} == {"hammer"}
    best = min(moved, key=lambda one: one.chi)
    # At a joint the force resists, at an input it pushes: but for half a turn both are one and the same.
    assert best.chi == pytest.approx(joint.chi, rel=1e-3)
    assert best.fit.effects[0].values["phase"] == pytest.approx(0.3 - 3.141592653589793, abs=0.05)


@pytest.mark.nightly
def test_details_of_a_first_effect_dont_cost_the_second_its_name() -> None:
    mount = {"frequency": 120.0, "damping_ratio": 0.1, "carried": 0.6}
    soft, load = attached("mounting_resonance", "acc_wrist", mount), attached("added_mass", "column", {"mass": 2.0})
    study = study_of(arm(), measured((soft, load), seconds=4.0, seed=2), leave_out=frozenset(), own={})
    plain = attached("mounting_resonance", "acc_wrist", {**mount, "carried": 0.0})
    hung = attached("extra_mode", "column", {"mass": 2.0, "frequency": 200.0, "damping_ratio": 0.5})
    pairs = [hypothesis_of((plain, second), study.location.tuned.z) for second in (load, hung)]
    search = Search(study)
    assert search.enter(pairs)
    ranked = search._forms()
    assert all(one.chi > 1.3 for one in ranked)
    finer = [each for one in ranked for each in _polished(study, one)]
    finer.sort(key=search.belief.nats, reverse=True)
    # Of both, not of the one that led: with the details the load leaves far less.
    assert {one.hypothesis.named for one in finer} == {one.hypothesis.named for one in ranked}
    assert finer[0].hypothesis.effects[1].effect == "added_mass"
    assert finer[0].held.max() < 0.2 * ranked[0].held.max()


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("gain", [1.015, 1.4])
def test_a_second_cause_is_named_where_it_is_a_share_of_the_gap_that_a_model_is_not_rounded_by(gain: float) -> None:
    machine = chain([2.0, 2.5], [2.6e4, 1.7e4], [5.0, 4.0])
    spring = chladni.attached("hardening_stiffness", "j0", {"cubic": 3e9})
    scaled = chladni.attached("gain_error", "a1", {"gain": gain})
    log, _ = made(machine.with_effects((spring, scaled)), band_noise(3000, rms=60.0), noise=0.002)
    # Both are seven times the noise of their sensor and more, and the first is far larger.
    first, _ = made(machine.with_effects((spring,)), band_noise(3000, rms=60.0), noise=0.0)
    plain, _ = made(machine, band_noise(3000, rms=60.0), noise=0.0)
    share = np.var((gain - 1.0) * first.outputs[1]) / np.var(log.outputs[1])
    assert np.var(first.outputs[1] - plain.outputs[1]) > 0.2 * np.var(plain.outputs[1])
    assert (share < 0.001) == (gain < 1.1)
    out = frozenset(CATALOGUE) - {"hardening_stiffness", "gain_error", "delay", "coulomb_friction"}
    found = diagnose(machine, [log], leave_out=out)
    expected = {("hardening_stiffness", "j0")} | ({("gain_error", "a1")} if gain > 1.1 else set())
    assert {(one.effect, one.site) for one in found.causes} == expected


# Of two sensors forces at two places leave nothing, whatever they are.
@pytest.mark.nightly
@pytest.mark.parametrize(
    "outputs",
    [("acc_column", "acc_arm", "acc_wrist"), ("acc_arm", "acc_wrist")],
)
def test_a_load_and_a_late_sensor_are_named_together_and_pass_for_no_hold(outputs: tuple[str, ...]) -> None:
    # Half a sample is what another hold of the input shifts all by: with the load alone it left a tenth less.
    late = attached("time_offset", "acc_arm", {"offset": 8e-4})
    load = attached("added_mass", "wrist", {"mass": 1.5})
    log = with_outputs(measured((late, load)), outputs)
    search = Search(study_of(arm(), log, leave_out=all_but("added_mass", "mounting_resonance"), own={}))
    search.run(lambda _: None)
    named = {(one.effect, one.site): one.values for one in search.best.fit.effects}
    assert set(named) == {("time_offset", "acc_arm"), ("added_mass", "wrist")}
    assert named["time_offset", "acc_arm"]["offset"] == pytest.approx(8e-4, rel=0.01)
    assert search.study.model.compile().holds == arm().compile().holds


@pytest.mark.nightly
def test_each_word_that_leads_is_tried_at_all_parts_of_its_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    # At two of three joints friction and hysteresis are close, whichever acts at all of them; both lead at the same
    # sites. A word for each of two joints is a worse guess than either.
    words = {"coulomb_friction": {"force": 4.0}, "hysteresis": {"force": 4.0, "yield": 1e-5}}
    frictions = [attached("coulomb_friction", joint, {"force": 4.0}) for joint in ("shoulder", "elbow", "hand")]
    study = study_of(arm(), measured(frictions, seconds=2.0, noise=0.005), leave_out=all_but("hysteresis"), own={})
    search = Search(study)
    z = study.location.tuned.z
    for first in words:
        for second in words:
            both = attached(first, "elbow", words[first]), attached(second, "hand", words[second])
            search.found.append(study.contest.enter(hypothesis_of(both, z), max_iterations=1))
    search.__dict__.pop("belief", None)
    monkeypatch.setattr(Search, "is_open", True)
    tried: list[set[str]] = []
    monkeypatch.setattr(
        "chladni.gap.diagnosis.search.shared",
        lambda _, lead: tried.append({one.effect for one in lead.hypothesis.effects}) or [],
    )
    search._share()
    assert sorted(tried, key=str) == [{"coulomb_friction"}, {"hysteresis"}]


@pytest.mark.nightly
def test_a_hold_is_told_behind_a_cause_that_hid_it() -> None:
    # An unknown force at the input is any hold: only with the delay known the log tells which.
    late = attached("delay", "hammer", {"delay": 3.0 / RATE_HZ})
    nominal, log, _ = driven("zoh", "low-passed", 0.01, 3, effects=[late])
    out = frozenset(CATALOGUE) - {"delay", "gain_error", "lag"}
    search = Search(study_of(nominal, log, leave_out=out, own={}))
    search.run(lambda _: None)
    assert [(one.effect, one.site) for one in search.best.fit.effects] == [("delay", "hammer")]
    assert search.best.fit.effects[0].values["delay"] == pytest.approx(3.0 / RATE_HZ, abs=0.1 / RATE_HZ)
    assert search.study.model.compile().holds == ("zoh",)


@pytest.mark.nightly
def test_a_wrong_hold_is_doubted_however_little_of_the_gap_it_leaves(monkeypatch: pytest.MonkeyPatch) -> None:
    # No hold was told at first, and the search is closed: nothing is left that is worth the name of a cause.
    monkeypatch.setattr("chladni.gap.diagnosis.study.with_told_holds", lambda model, _: model)
    late = attached("delay", "hammer", {"delay": 3.0 / RATE_HZ})
    nominal, log, _ = driven("zoh", "low-passed", 0.01, 3, effects=[late])
    study = study_of(nominal, log, leave_out=frozenset(CATALOGUE) - {"delay"}, own={})
    monkeypatch.setattr(Search, "is_open", False)
    search = Search(study)
    search.enter([hypothesis_of((late,), study.location.tuned.z)])
    search._other_holds()
    assert study.model.compile().holds == ("foh",)
    assert search.study.model.compile().holds == ("zoh",)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("variant", "time_s"),
    [("first_order", 3e-4), pytest.param("second_order", 3e-4, marks=pytest.mark.nightly)],
)
def test_a_hold_that_was_told_beside_an_unknown_force_gives_way_to_one_that_a_cause_explains(
    variant: str, time_s: float
) -> None:
    # Straight lines behind a lag are smooth: beside an unknown force at the input the log was band-limited.
    machine = chain([2.0, 2.5, 1.0], [5e5, 6e5, 2e6], [40.0, 60.0, 30.0], at=2)
    machine = replace(machine, outputs=(machine.outputs[0], machine.outputs[2]))
    values = {"time_constant": time_s, **({"damping_ratio": 1.0} if variant == "second_order" else {})}
    slow = attached("lag", "hammer", values, variant=variant)
    lines = np.fft.rfft(100.0 * np.random.default_rng(0).standard_normal((1, 4000)))
    lines[:, 1600:] = 0.0
    log, _ = made(machine.with_effects((slow,)), np.fft.irfft(lines, 4000), noise=0.01)
    study = study_of(machine, log, leave_out=frozenset(CATALOGUE) - {"delay", "lag"}, own={})
    assert study.model.compile().holds == ("band_limited",)
    search = searched(study, lambda _: None)
    assert [(one.effect, one.site, one.variant) for one in search.best.fit.effects] == [("lag", "hammer", variant)]
    assert search.best.fit.effects[0].values["time_constant"] == pytest.approx(time_s, rel=0.02)
    assert search.study.model.compile().holds == ("foh",)
    assert search.belief.probability(*search.best.hypothesis.named) > 0.9


@pytest.mark.nightly
def test_a_delay_is_named_in_a_log_that_begins_in_motion() -> None:
    # The force of the first samples lies before the record, and an accelerometer beside it feels it at once.
    late = attached("delay", "shaker", {"delay": 0.003})
    log = measured((late,), seconds=5.0, noise=0.003)
    cut = replace(log, inputs=log.inputs[:, 1000:], outputs=log.outputs[:, 1000:])
    study = study_of(arm(), cut, leave_out=frozenset(CATALOGUE) - {"delay", "lag"}, own={})
    search = Search(study)
    search.run(lambda _: None)
    assert [(one.effect, one.site) for one in search.best.fit.effects] == [("delay", "shaker")]
    assert search.best.fit.effects[0].values["delay"] == pytest.approx(0.003, rel=1e-3)
    assert search.belief.probability(*search.best.hypothesis.named) > 0.9
    assert study.contest.run.unknown_at_start(search.best.fit.z, search.best.fit.effects) in (3, 4)
