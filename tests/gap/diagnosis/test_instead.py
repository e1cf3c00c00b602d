"""A loop of hysteresis isn't believed where a function of displacement and velocity leaves less."""

import numpy as np
import pytest

from chladni.gap.diagnosis.instead import explained_elsewhere, explained_instead
from chladni.gap.diagnosis.study import Study, study_of
from chladni.gap.explanation.hypotheses import wrong_parameters
from chladni.gap.explanation.hypothesis import Contestant, Hypothesis
from chladni.models.effects.attached_effect import AttachedEffect, attached
from tests.gap.arm import RATE_HZ, arm, measured
from tests.gap.rubber import Rubber

LOOP = attached("hysteresis", "elbow", {"force": 20.0, "yield": 1e-4, "shape": 2.0})
DRAG = attached("quadratic_damping", "elbow", {"coefficient": 300.0})
SPRING = attached("hardening_stiffness", "shoulder", {"cubic": 1e12})


def study(*effects: AttachedEffect) -> Study:
    return study_of(arm(), measured(effects, seed=5), leave_out=frozenset(), own={})


def believed(effect: AttachedEffect, left: float, *others: AttachedEffect) -> Contestant:
    """Effects that leave this mean square, in units of the noise."""
    effects = (effect, *others)
    hypothesis = Hypothesis(effects=effects, fitted=((),) * len(effects), start_z=np.zeros(0))
    return Contestant(hypothesis=hypothesis, fit=None, held=np.full(3, left), gap=0.0, prior=0.0)


@pytest.fixture(scope="module")
def dragged() -> Study:
    return study(DRAG)


@pytest.mark.slow
def test_drag_is_no_loop(dragged: Study) -> None:
    gap = dragged.location.tuned.chi
    assert gap > 10.0
    found = explained_instead(dragged, believed(LOOP, 1.0 + 0.05 * gap))
    assert found is not None
    assert found.loopless == "elbow"
    assert "elbow" in found.sentence()


def test_other_words_are_not_contradicted_by_a_function(dragged: Study) -> None:
    assert explained_instead(dragged, believed(DRAG, 1.0 + 0.05 * dragged.location.tuned.chi)) is None


@pytest.mark.slow
def test_a_loop_that_leaves_little_stays() -> None:
    looped = study(LOOP)
    assert looped.location.tuned.chi > 10.0
    assert explained_instead(looped, believed(LOOP, 1.0 + 0.02 * looped.location.tuned.chi)) is None
    assert explained_instead(looped, believed(LOOP, 1.05)) is None


@pytest.mark.slow
def test_a_joint_that_relaxes_a_little_passes_for_no_wrong_value() -> None:
    assert told_for_parameters(study(Rubber(stiffness=2e3))) == "shoulder"
    off = {"shoulder.damping": 2.0, "shoulder.stiffness": 1.2}
    stiffer = study_of(arm(), measured(seed=5, off=off), leave_out=frozenset(), own={})
    assert told_for_parameters(stiffer) is None


def told_for_parameters(found: Study) -> str | None:
    """The joint that relaxes, where values that are off leave as little as could be."""
    hypothesis = wrong_parameters(found.location)
    assert hypothesis is not None
    best = Contestant(hypothesis=hypothesis, fit=None, held=np.full(3, 1.05), gap=0.0, prior=0.0)
    instead = explained_instead(found, best)
    return None if instead is None or instead.linear is None else instead.linear.joint


@pytest.mark.slow
def test_along_one_orbit_any_force_is_a_function_and_nothing_is_contradicted() -> None:
    turns = 2.0 * np.pi * 11.3 * np.arange(4000) / RATE_HZ
    force = 200.0 * np.sin(turns)
    log = measured((DRAG,), seed=5, force=force)
    orbit = study_of(arm(), log, leave_out=frozenset(), own={})
    assert explained_instead(orbit, believed(LOOP, 1.0 + 0.05 * orbit.location.tuned.chi)) is None


@pytest.mark.slow
def test_where_another_force_acts_too_a_function_contradicts_no_loop(dragged: Study) -> None:
    both = study(DRAG, SPRING)
    assert next(one.profile.chi for one in both.location.ranked if "elbow" in one.places[0].names) > 1.5
    left = 1.0 + 0.9 * both.location.tuned.chi
    assert explained_instead(dragged, believed(LOOP, left)) is not None
    assert explained_instead(both, believed(LOOP, left)) is None


def test_one_force_by_a_law_elsewhere_explains_more_than_what_is_named(dragged: Study) -> None:
    left = 1.0 + 0.05 * dragged.location.tuned.chi
    found = explained_elsewhere(dragged, believed(SPRING, left))
    assert found is not None
    assert found.elsewhere == "elbow"
    assert "at elbow" in found.sentence()
    assert explained_elsewhere(dragged, believed(DRAG, left)) is None
    assert explained_elsewhere(dragged, believed(SPRING, 1.2)) is None
    # Where the log can't tell two sites apart, what is named is named at both.
    assert explained_elsewhere(dragged, believed(SPRING, left), [believed(DRAG, left)]) is None


@pytest.mark.slow
def test_two_forces_are_no_one_force_elsewhere() -> None:
    both = study(DRAG, SPRING)
    load = attached("added_mass", "wrist", {"mass": 1.0})
    assert explained_elsewhere(both, believed(load, 1.0 + 0.9 * both.location.tuned.chi)) is None


def test_equal_mounts_on_all_sensors_are_no_two_causes_where_one_filter_of_the_command_does_as_much() -> None:
    lagging = study(attached("lag", "shaker", {"time_constant": 5e-4}))
    mounts = tuple(
        attached("mounting_resonance", f"acc_{name}", {"frequency": 150.0, "damping_ratio": 0.7})
        for name in ("column", "arm", "wrist")
    )
    assert lagging.location.tuned.chi > 10.0
    found = explained_elsewhere(lagging, believed(mounts[0], 1.05, *mounts[1:]))
    assert found is not None
    assert found.elsewhere in ("shaker", "wrist")
    # One word that leaves only noise stays: nothing says that a law elsewhere is likelier.
    assert explained_elsewhere(lagging, believed(mounts[0], 1.05)) is None


def test_two_causes_that_are_two_are_not_contradicted(dragged: Study) -> None:
    mount = attached("mounting_resonance", "acc_arm", {"frequency": 150.0, "damping_ratio": 0.1})
    both = study(DRAG, mount)
    assert explained_elsewhere(both, believed(DRAG, 1.05, mount)) is None
    assert explained_elsewhere(dragged, believed(SPRING, 1.05, DRAG)) is None
