"""What decides between a cause and an unknown one."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.gap.diagnosis.causes import _as_likely, _best, _detailed, _is_plausible, _leaves_another
from chladni.gap.diagnosis.completeness import completeness as completeness_over
from chladni.gap.diagnosis.completeness import completeness_among, known_share
from chladni.gap.diagnosis.search import plausible_places
from chladni.gap.diagnosis.study import study_of
from chladni.gap.explanation.contest import weighed
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.gap.location.locate import located_pairs
from chladni.models.effects.attached_effect import attached
from tests.gap.arm import arm, measured


def completeness(gap: Contestant, found: Contestant) -> float:
    """Over the noise as it was estimated."""
    return completeness_over(gap, found, np.ones(2))


def left(chi: float) -> Contestant:
    """A contestant that leaves this mean square, in units of the noise, on two outputs."""
    return Contestant(hypothesis=Hypothesis(start_z=np.zeros(0)), fit=None, held=np.full(2, chi), gap=0.0, prior=0.0)


def test_what_leaves_noise_is_complete_and_what_leaves_half_is_not() -> None:
    gap = left(100.0)
    assert completeness(gap, left(1.0)) > 0.99
    assert completeness(gap, left(36.0)) < 0.1


def test_details_of_a_law_are_forgiven_where_the_gap_is_large() -> None:
    # Twice the noise left is little of a gap of fifty times the noise, and a lot of one of three times the noise.
    assert completeness(left(2500.0), left(4.0)) > 0.98
    assert completeness(left(9.0), left(4.0)) < 0.5


def test_more_left_is_never_more_complete() -> None:
    gap = left(40.0)
    found = [completeness(gap, left(chi)) for chi in np.linspace(0.5, 60.0, 40)]
    assert np.all(np.diff(found) <= 0)
    assert completeness(left(1.0), left(1.0)) == pytest.approx(0.99, abs=0.01)


def test_a_factor_has_no_details_that_could_be_left() -> None:
    gain = attached("gain_error", "a", {"gain": 2.0})
    factor = replace(left(400.0), hypothesis=Hypothesis(effects=(gain,), fitted=((),), start_z=np.zeros(0)))
    drag = attached("quadratic_damping", "a", {"coefficient": 2.0})
    law = replace(left(400.0), hypothesis=Hypothesis(effects=(drag,), fitted=((),), start_z=np.zeros(0)))
    # A fifth of the gap's RMS.
    assert completeness(left(1e4), factor) < 0.5 < completeness(left(1e4), law)


def test_a_second_mode_of_what_is_attached_is_a_detail_of_it() -> None:
    def hanging(chi: float, *sites: str, effect: str = "extra_mode") -> Contestant:
        numbers = {"mass": 1.0} if effect == "added_mass" else {"mass": 1.0, "frequency": 9.0, "damping_ratio": 0.01}
        added = tuple(attached(effect, site, numbers) for site in sites)
        hypothesis = Hypothesis(effects=added, fitted=((),) * len(added), start_z=np.zeros(0))
        return replace(left(chi), hypothesis=hypothesis)

    tuned, found, floor = left(1e4), hanging(400.0, "b1"), np.ones(2)
    assert completeness_among(tuned, found, [hanging(1.0, "b2", "b1")], floor) > 0.9
    # Not elsewhere, nor another effect, nor fewer of them.
    for other in (hanging(1.0, "b2", "b3"), hanging(1.0, "b1", "b2", effect="added_mass"), hanging(1.0, "b1")):
        assert completeness_among(tuned, found, [other], floor) < 0.5


def test_one_sensor_that_is_not_explained_is_not_hidden_by_many_that_are() -> None:
    quiet = np.ones(5)
    gap, rest = quiet.copy(), quiet.copy()
    gap[1], rest[1] = 2.9, 2.5
    assert completeness_over(replace(left(1.0), held=gap), replace(left(1.0), held=rest), quiet) < 0.2


def test_a_name_for_a_faint_gap_is_less_sure() -> None:
    sure = [known_share(left(chi).held, np.ones(2)) for chi in (1.0, 1.5, 4.0, 1e4)]
    assert np.all(np.diff(sure) > 0)
    assert sure[0] < 0.78 < 0.94 < sure[-1] < 0.96


def test_a_sensor_that_holds_its_samples_is_noticed_and_a_clipped_one_is_not() -> None:
    log = measured(seconds=2.0)
    outputs = log.outputs.copy()
    outputs[1] = np.repeat(outputs[1, ::2], 2)[: outputs.shape[1]]
    outputs[2] = np.clip(outputs[2], -0.5 * outputs[2].std(), 0.5 * outputs[2].std())
    study = study_of(arm(), replace(log, outputs=outputs), leave_out=frozenset(), own={})
    assert study.repeating == (log.output_names[1],)


def test_a_few_long_holds_are_noticed() -> None:
    log = measured(seconds=2.0)
    outputs = log.outputs.copy()
    for start in (300, 700, 1100):
        outputs[1, start : start + 12] = outputs[1, start]
    study = study_of(arm(), replace(log, outputs=outputs), leave_out=frozenset(), own={})
    assert study.repeating == (log.output_names[1],)


def test_a_place_that_explains_less_than_another_one_is_left_out() -> None:
    log = measured(seconds=4.0)
    study = study_of(arm(), log, leave_out=frozenset(), own={})
    location = study.location
    first = replace(
        location.ranked[0], profile=replace(location.ranked[0].profile, misfit=location.ranked[0].profile.expected)
    )
    second = replace(first, profile=replace(first.profile, misfit=1.5 * first.profile.expected))
    assert plausible_places(replace(location, ranked=(first, second))) == [first]
    # Beside a large gap that little more tells nothing: the ground and the joint on it print nearly one pattern.
    large = replace(location.tuned, misfit=500.0 * location.tuned.expected)
    assert plausible_places(replace(location, tuned=large, ranked=(first, second))) == [first, second]
    # Where even the best place leaves something, the force between samples is taken for straight: all may be.
    first = replace(first, profile=replace(first.profile, misfit=1.4 * first.profile.expected))
    assert len(plausible_places(replace(location, ranked=(first, second)))) == 2


def test_the_leading_place_is_paired_with_those_that_were_not_followed() -> None:
    study = study_of(arm(), measured(seconds=2.0), leave_out=frozenset(), own={})
    first = study.location.ranked[0]
    pairs = located_pairs(replace(study.location, ranked=(first,)))
    assert {pair.places[1] for pair in pairs} == set(study.location.places) - {first.places[0]}


def test_a_place_that_explains_as_much_as_the_leading_ones_is_paired_with_all_too() -> None:
    study = study_of(arm(), measured(seconds=2.0), leave_out=frozenset(), own={})
    first, second, third = study.location.ranked[:3]
    followed = {one.places[0] for one in (first, second, third)}
    far = next(place for place in study.location.places if place not in followed)

    def paired(misfit: float) -> bool:
        """Whether the third place is, when it leaves so many times what the first does."""
        again = replace(third, profile=replace(third.profile, misfit=misfit * first.profile.misfit))
        pairs = located_pairs(replace(study.location, ranked=(first, second, again)))
        return any(set(pair.places) == {far, third.places[0]} for pair in pairs)

    assert paired(1.05)
    assert not paired(2.0)


@pytest.fixture(scope="module")
def explained_by_one_force():
    """A study whose best place is said to leave nothing to an unknown force, and one where it leaves a third."""
    study = study_of(arm(), measured(seconds=2.0), leave_out=frozenset(), own={})
    first = study.location.ranked[0]

    def leaving(chi: float):
        profile = replace(first.profile, misfit=chi * first.profile.expected)
        return replace(study, location=replace(study.location, ranked=(replace(first, profile=profile),)))

    return leaving(1.0), leaving(1.3)


def test_where_one_force_explains_all_another_cause_is_looked_for_only_when_no_law_follows_it(
    explained_by_one_force,
) -> None:
    one, several = explained_by_one_force
    nothing, floor = left(100.0), np.ones(2)
    assert [_leaves_another(one, left(chi), nothing, floor) for chi in (1.2, 2.0, 5.0)] == [False, False, True]
    assert [_leaves_another(several, left(chi), nothing, floor) for chi in (1.2, 2.0, 5.0)] == [False, True, True]


def test_one_sensor_that_hears_more_is_not_hidden_by_floors_that_are_too_high(explained_by_one_force) -> None:
    _, several = explained_by_one_force
    heard = replace(left(1.0), held=np.array([0.07, 2.4]))
    assert heard.chi < 1.3
    assert _leaves_another(several, heard, left(100.0), np.ones(2))


def test_beside_a_factor_that_leaves_more_than_noise_another_cause_is_looked_for(explained_by_one_force) -> None:
    one, _ = explained_by_one_force
    assert _leaves_another(one, pair(1.5, "a"), left(100.0), np.ones(2))


def test_another_cause_is_looked_for_where_a_small_gap_is_half_explained(explained_by_one_force) -> None:
    for study in explained_by_one_force:
        assert _leaves_another(study, left(1.25), left(1.6), np.ones(2))
        nothing = left(1.25)
        assert not _leaves_another(study, nothing, nothing, np.ones(2))


def pair(chi: float, *sites: str) -> Contestant:
    """Gains that leave this mean square, in units of the noise."""
    gains = tuple(attached("gain_error", site, {"gain": 2.0}) for site in sites)
    hypothesis = Hypothesis(effects=gains, fitted=((),) * len(gains), start_z=np.zeros(0))
    return replace(left(chi), hypothesis=hypothesis)


def test_two_causes_instead_of_one_force_must_explain_all(explained_by_one_force) -> None:
    one, several = explained_by_one_force
    nothing = left(100.0)
    assert [_is_plausible(one, nothing, pair(chi, "a", "b")) for chi in (1.2, 1.5)] == [True, False]
    assert _is_plausible(several, nothing, pair(1.5, "a", "b"))
    assert _is_plausible(one, nothing, left(5.0))


def test_two_causes_where_either_s_force_explains_all_need_only_come_near(explained_by_one_force) -> None:
    one, _ = explained_by_one_force
    first, second = (replace(one.location.ranked[0], places=(place,)) for place in one.location.places[:2])
    other = one.location.places[2].names[0]
    alike = replace(one, location=replace(one.location, ranked=(first, second)))
    sites = first.places[0].names[0], second.places[0].names[0]
    nothing = left(100.0)
    assert [_is_plausible(alike, nothing, pair(chi, *sites)) for chi in (1.2, 2.5, 4.0)] == [True, True, False]
    # A place whose force leaves more isn't one of them.
    assert not _is_plausible(alike, nothing, pair(2.5, sites[0], other))


def weighed_form(log_evidence: float, word: str = "", site: str = "motor", variant: str | None = None) -> Contestant:
    """A contestant with one effect, or none, of this log evidence."""
    numbers = {"delay": {"delay": 0.1}, "lag": {"time_constant": 0.1}, "saturation": {"limit": 1.0}}
    effects = (attached(word, site, numbers[word], variant=variant),) if word else ()
    hypothesis = Hypothesis(effects=effects, fitted=((),) * len(effects), start_z=np.zeros(0))
    return replace(left(1.0), hypothesis=hypothesis, log_evidence=log_evidence)


def test_a_word_s_forms_speak_for_it_together() -> None:
    nothing = weighed_form(-60.0)
    delay, lag = weighed_form(-3.3, "delay"), weighed_form(-3.4, "lag", variant="first_order")
    other = weighed_form(-3.5, "lag", variant="second_order")
    assert _best([delay, lag, nothing], nothing, 12.0) is delay
    # e^-3.4 + e^-3.5 is more than e^-3.3; of the two the likelier one is shown.
    assert _best([delay, lag, other, nothing], nothing, 12.0) is lag
    # Two searches that ended at one fit are one form.
    again = weighed_form(-3.45, "lag", variant="first_order")
    assert _best([delay, lag, again, nothing], nothing, 12.0) is delay


def test_forms_of_a_word_together_do_not_make_it_pay() -> None:
    # Each brings 5.9 nats of the 6 that an effect must.
    nothing = weighed_form(-60.0)
    forms = [weighed_form(-54.1, "lag", variant=variant) for variant in ("first_order", "second_order")]
    assert _best([nothing, *forms], nothing, 12.0) is nothing


def test_as_likely_are_the_same_words_elsewhere_that_fit_as_well() -> None:
    best = weighed_form(-3.0, "delay")
    twin, worse = weighed_form(-3.9, "delay", "brake"), weighed_form(-9.0, "delay", "fan")
    other = weighed_form(-3.1, "lag", "brake", variant="first_order")
    assert _as_likely([best, twin, worse, other], best) == [best, twin]


@pytest.mark.slow
def test_details_of_a_first_effect_dont_cost_the_second_its_name() -> None:
    mount = {"frequency": 120.0, "damping_ratio": 0.1, "carried": 0.6}
    soft, load = attached("mounting_resonance", "acc_wrist", mount), attached("added_mass", "column", {"mass": 2.0})
    study = study_of(arm(), measured((soft, load), seconds=4.0, seed=2), leave_out=frozenset(), own={})
    plain = attached("mounting_resonance", "acc_wrist", {**mount, "carried": 0.0})
    hung = attached("extra_mode", "column", {"mass": 2.0, "frequency": 200.0, "damping_ratio": 0.5})
    pairs = [hypothesis_of((plain, second), study.location.tuned.z) for second in (load, hung)]
    ranked = weighed(study.contest.enter_all(pairs))
    assert all(one.chi > 1.3 for one in ranked)
    finer = weighed(_detailed(study, ranked, ranked[0]))
    # Of both, not of the one that led: with the details the load leaves far less.
    assert {one.hypothesis.named for one in finer} == {one.hypothesis.named for one in ranked}
    assert finer[0].hypothesis.effects[1].effect == "added_mass"
    assert finer[0].most_left < 0.2 * ranked[0].most_left
