"""In which order several causes are named, and how sure each is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.gap.diagnosis.naming import causes_named, correlation_of, ranking_of
from chladni.gap.diagnosis.verdict import Causes
from chladni.gap.explanation.hypothesis import Contestant
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.records.diagnosis import PARAMETER
from chladni.gap.tuning.output_error import fit_output_error
from chladni.models.effects.attached_effect import attached
from tests.gap.fitted import SURE, as_probable, causes, contestant
from tests.gap.made_log import band_noise, chain, measured
from tests.made_diagnosis import arm_model

LAG = attached("lag", "shaker", {"time_constant": 1e-3})
MOUNT = attached("mounting_resonance", "acc_wrist", {"frequency": 200.0, "damping_ratio": 0.02})
#: Of the arm, none of whose sensors steps.
NO_STEPS = SimpleNamespace(model=arm_model(), stepping=None)


def weighed_causes(*weighed: tuple[Contestant, float]) -> Causes:
    """What is said of contestants with these probabilities; what is missing to one is that of no cause."""
    ranked = [replace(one, log_evidence=as_probable(one, share)) for one, share in weighed]
    nothing = contestant(chi=100.0)
    rest = 1.0 - sum(share for _, share in weighed)
    return causes(*ranked, tuned=replace(nothing, log_evidence=as_probable(nothing, rest)))


@pytest.mark.parametrize(("lag", "mount", "first"), [(5.0, 50.0, "lag"), (50.0, 5.0, "mounting_resonance")])
def test_the_cause_that_alone_leaves_least_comes_first(lag: float, mount: float, first: str) -> None:
    pair = (contestant(MOUNT, LAG), 0.9)
    found = weighed_causes(pair, (contestant(LAG, chi=lag), 0.04), (contestant(MOUNT, chi=mount), 0.03))
    named = causes_named(NO_STEPS, found)
    assert named[0].effect == first
    assert len(named) == 2
    # Each is as probable as all that it stands in.
    assert {one.effect: one.probability for one in named} == pytest.approx(
        {"lag": 0.94 * SURE, "mounting_resonance": 0.93 * SURE}, abs=1e-3
    )


def test_of_two_causes_only_that_is_named_which_is_more_probable_than_not() -> None:
    found = weighed_causes((contestant(MOUNT, LAG), 0.48), (contestant(LAG, chi=2.0), 0.45))
    (named,) = causes_named(NO_STEPS, found)
    assert named.effect == "lag"
    assert named.probability == pytest.approx(0.93 * SURE, abs=1e-3)


def test_a_value_that_is_wrong_beside_an_effect_is_named_with_it() -> None:
    found = weighed_causes((contestant(LAG, freed=("j1.stiffness",)), 0.9), (contestant(LAG, chi=9.0), 0.05))
    named = {(one.effect, one.site): one.probability for one in causes_named(NO_STEPS, found)}
    assert named == pytest.approx({("lag", "shaker"): 0.95 * SURE, (PARAMETER, "j1.stiffness"): 0.9 * SURE}, abs=1e-3)


def test_a_word_at_sites_that_look_the_same_is_as_probable_as_all_of_them_together() -> None:
    joint = attached("ripple", "elbow", {"amplitude": 3.0, "period": 0.01})
    drag = attached("quadratic_damping", "elbow", {"coefficient": 30.0})
    found = weighed_causes(
        (contestant(joint), 0.4),
        (contestant(replace(joint, site="shaker")), 0.35),
        (contestant(drag), 0.15),
        # By evidence it's no rival: it is for its share alone that it stands in the ranking.
        (contestant(replace(joint, site="shoulder"), chi=9.0), 0.05),
    )
    (named,) = causes_named(NO_STEPS, found)
    assert named.group == ("elbow", "shaker")
    assert {one.effect for one in named.alternatives} == {"quadratic_damping"}
    assert named.probability == pytest.approx(0.75 * SURE, abs=1e-3)
    rows = {(one.effect, one.site): one.probability for one in ranking_of(found, (named,))}
    assert rows["ripple", "elbow"] == pytest.approx(0.4 * SURE, abs=1e-3)
    assert rows["ripple", "shaker"] == pytest.approx(0.35 * SURE, abs=1e-3)


def test_a_probability_that_words_of_a_family_share_is_told_as_theirs() -> None:
    late = attached("delay", "shaker", {"delay": 1e-3})
    (shared,) = causes_named(NO_STEPS, weighed_causes((contestant(LAG), 0.4), (contestant(late), 0.35)))
    assert shared.probability_of == ("lag", "delay")
    assert shared.probability == pytest.approx(0.75 * SURE, abs=1e-3)
    (alone,) = causes_named(NO_STEPS, weighed_causes((contestant(LAG), 0.6), (contestant(late), 0.35)))
    assert alone.probability_of == ()


def test_a_word_that_is_best_as_half_of_a_pair_says_beside_what() -> None:
    # By falling evidence: the mount's best fit is the pair's, the lag's is its own.
    found = weighed_causes((contestant(LAG), 0.9), (contestant(MOUNT, LAG), 0.06), (contestant(MOUNT, chi=9.0), 0.03))
    rows = {one.effect: one for one in ranking_of(found, causes_named(NO_STEPS, found))}
    assert rows["lag"].beside == ()
    assert [(one.effect, one.site) for one in rows["mounting_resonance"].beside] == [("lag", "shaker")]


def test_of_two_springs_side_by_side_only_the_sum_is_told() -> None:
    one = chain([2.0], [5e5], [40.0])
    spring = replace(one.structure.joints[0], stiffness=2.5e5, damping=20.0)
    twice = (spring, replace(spring, name="other"))
    model = replace(one, structure=replace(one.structure, joints=twice))
    log, floor = measured(model, band_noise(3000), noise=0.02)
    run = FreeRun(model, log)
    found = correlation_of(run.tunables, fit_output_error(run, floor))
    assert found is not None
    place = [found.names.index(f"{name}.stiffness") for name in ("j0", "other")]
    # Each tolerance alone is 1, their difference is as uncertain as before: the covariance is (1 -1; -1 1)/2.
    assert found.matrix[place[0], place[1]] == pytest.approx(-1.0, abs=0.02)
    np.testing.assert_array_equal(np.diag(found.matrix), 1.0)
    np.testing.assert_allclose(found.matrix, found.matrix.T, atol=1e-9)
    assert np.linalg.eigvalsh(found.matrix).min() > -1e-9


def test_nothing_tuned_has_none() -> None:
    model = chain([2.0], [5e5], [40.0])
    log, floor = measured(model, band_noise(1000))
    run = FreeRun(model, log)
    assert correlation_of(run.tunables, fit_output_error(run, floor, tune=False)) is None
