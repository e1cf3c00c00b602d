"""Two effects: the second behind the first, both at once, and where two forces tell that there are two."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.gap.comparison.noise_estimate import estimate_noise
from chladni.gap.diagnosis import pairs
from chladni.gap.diagnosis.pairs import second_causes
from chladni.gap.diagnosis.search import Search
from chladni.gap.diagnosis.study import Study, recovered_states, study_of
from chladni.gap.explanation.hypotheses import hypothesis_of
from chladni.gap.location.locate import Location, explained_share, locate, located_pairs
from chladni.gap.plant.tunable import Tunables
from chladni.models.effects.attached_effect import AttachedEffect
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.structures.structure_output import StructureOutput
from tests.gap import made_log
from tests.gap.arm import all_but, arm, measured, with_outputs
from tests.gap.made_log import band_noise, chain

SPRING = chladni.attached("hardening_stiffness", "hand", {"cubic": 3e10})
LATE = chladni.attached("time_offset", "acc_column", {"offset": 3e-4})


@pytest.mark.nightly
def test_the_second_is_found_behind_the_first() -> None:
    study = study_of(arm(), measured((SPRING, LATE), seconds=6.0, seed=4), leave_out=all_but(), own={})
    first = study.contest.enter(hypothesis_of((SPRING,), study.location.tuned.z))
    found = most_probable(second_causes(study, first))
    assert {one.effect for one in found.hypothesis.effects} == {"hardening_stiffness", "time_offset"}
    assert np.all(found.held < 1.3)


def most_probable(found):
    return max(found, key=lambda one: one.log_evidence)


def words(found) -> set[str]:
    return {one.effect for one in found.hypothesis.effects}


def two_sensors(*effects: AttachedEffect, words: frozenset[str]):
    """A study of two bodies that show one displacement and one acceleration: any two forces explain both."""
    seen = (
        StructureOutput(name="x0", measures="displacement", at="b0"),
        StructureOutput(name="a1", measures="acceleration", at="b1"),
    )
    machine = replace(chain([2.0, 1.5], [5e4, 6e4], [12.0, 9.0]), outputs=seen)
    log, _ = made_log.measured(machine.with_effects(effects), band_noise(3000, rms=60.0), noise=2e-3)
    return study_of(machine, log, leave_out=frozenset(CATALOGUE) - words, own={})


@pytest.mark.nightly
@pytest.mark.parametrize(
    "first",
    [
        ("coulomb_friction", {"force": 10.0}),
        pytest.param(("hardening_stiffness", {"cubic": 2e9}), marks=pytest.mark.nightly),
    ],
)
def test_of_two_sensors_laws_tell_where_two_effects_are(first) -> None:
    effects = chladni.attached(first[0], "j0", first[1]), chladni.attached("coulomb_friction", "j1", {"force": 6.0})
    study = two_sensors(*effects, words=frozenset({"coulomb_friction", "hardening_stiffness", "gain_error"}))
    nothing = Search(study).nothing
    forces = located_pairs(study.location)
    pair, forms = pairs._weighed_pairs(study, nothing, forces)[0]
    assert {name for place in pair.places for name in place.names} == {"j0", "b0", "j1"}
    at_j1 = [one for one, _ in forms if one.trial.site.name == "j1"]
    assert min(at_j1, key=lambda one: one.cost).trial.effect == "coulomb_friction"
    # Beside a fit that leaves no more than they promise they aren't worth any.
    least = pairs.promised(pair, forms) / study.location.problem.scale
    assert pairs._weighed_pairs(study, replace(nothing, held=np.full_like(nothing.held, least)), forces) == []


@pytest.mark.nightly
def test_two_laws_whose_runs_are_lost_are_followed_from_the_states_that_two_forces_tell() -> None:
    caught = chladni.attached("ripple", "j0", {"amplitude": 20.0, "period": 1e-3, "phase": 0.7})
    rubbing = chladni.attached("coulomb_friction", "j1", {"force": 5.0})
    study = two_sensors(caught, rubbing, words=frozenset({"ripple", "coulomb_friction"}))
    found = pairs.paired_causes(study, Search(study).nothing)
    assert words(most_probable(found.ranked)) == {"ripple", "coulomb_friction"}
    assert found.states is not None
    # Of either force alone the machine would have gone another way.
    other = recovered_states(study.location.problem, study.location.best)
    assert not np.allclose(found.states.values, other.values, rtol=0.05)


def test_one_sensor_is_explained_by_any_force() -> None:
    log = with_outputs(measured((SPRING,), seconds=4.0), ["acc_wrist"])
    study = study_of(arm(), log, leave_out=frozenset(), own={})
    assert pairs._weighed_pairs(study, Search(study).nothing, located_pairs(study.location)) == []


@pytest.mark.nightly
def test_two_forces_are_told_where_they_explain_much_more_than_one() -> None:
    def location(*effects: AttachedEffect) -> Location:
        log = measured(effects, seconds=3.0, seed=4)
        return locate(arm(), log, estimate_noise(log), Tunables.of(arm()))

    both = location(SPRING, LATE)
    found = pairs._two_forces(both, located_pairs(both))
    assert found is not None
    assert {name for place in found.places for name in place.names} >= {"hand", "acc_column"}
    assert explained_share(both.tuned.chi, found.profile.chi) > max(both.shares.values())
    one = location(SPRING)
    assert pairs._two_forces(one, located_pairs(one)) is None


@pytest.fixture(scope="module")
def study() -> Study:
    """Of an arm that lacks nothing."""
    return study_of(arm(), measured(seconds=2.0), leave_out=frozenset(), own={})


@pytest.mark.nightly
def test_the_leading_place_is_paired_with_those_that_were_not_followed(study: Study) -> None:
    first = study.location.ranked[0]
    pairs = located_pairs(replace(study.location, ranked=(first,)))
    assert {pair.places[1] for pair in pairs} == set(study.location.places) - {first.places[0]}


@pytest.mark.nightly
def test_a_place_that_explains_as_much_as_the_leading_ones_is_paired_with_all_too(study: Study) -> None:
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
