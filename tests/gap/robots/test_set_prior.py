"""What is believed of sets of words before a log is seen: joints that are made alike."""

from copy import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.search import made_alike, searched
from chladni.gap.robots.set_prior import SetPrior, like_joints
from chladni.gap.robots.term import Term
from chladni.gap.robots.torques import torques_of
from chladni.robots.loading import load_robot
from chladni.robots.machine import as_described
from chladni.robots.robot import Robot
from tests.robots.machines import arm, changed, commands, course, joint_log_of

pytest.importorskip("mujoco")

LEG = """
    <body name="{0}_thigh" pos="{1} 0 1">
      <joint name="{0}_hip" axis="0 1 0" damping="0.5" armature="0.1"/>
      <inertial pos="0 0 -0.2" mass="{2}" diaginertia="0.02 0.02 0.002"/>
      <body name="{0}_calf" pos="0 0 -0.4">
        <joint name="{0}_knee" axis="0 1 0" damping="0.2" armature="0.05"/>
        <inertial pos="0 0 -0.1" mass="1" diaginertia="0.01 0.01 0.001"/>
      </body>
    </body>"""
LEGS = """<mujoco model="legs">
  <compiler angle="radian"/>
  <option timestep="0.0005" integrator="implicitfast"/>
  <worldbody>{legs}</worldbody>
  <actuator>
    <position joint="left_hip" kp="120" kv="8"/><position joint="left_knee" kp="60" kv="3"/>
    <position joint="right_hip" kp="120" kv="8"/><position joint="right_knee" kp="60" kv="3"/>
  </actuator>
</mujoco>
"""
KNEES = frozenset({"left_knee", "right_knee"})


def legs(folder: Path, right: float = 2.0) -> Robot:
    """Two legs that hang from a stand, the thigh of the right one as heavy as that."""
    path = folder / "legs.xml"
    path.write_text(LEGS.format(legs=LEG.format("left", -0.2, 2.0) + LEG.format("right", 0.2, right)))
    return load_robot(path)


@pytest.fixture(scope="module")
def rubbing(tmp_path_factory: pytest.TempPathFactory) -> Contest:
    """Both knees rub, one by a tenth more."""
    robot = legs(tmp_path_factory.mktemp("legs"))
    machine = changed(changed(as_described(robot), 1, friction=0.9), 3, friction=1.0)
    command = np.concatenate([commands(6.0), 0.8 * commands(7.0)[:, 250:]])
    position = course(machine, command)
    position += 1e-5 * np.random.default_rng(0).standard_normal(position.shape)
    return Contest(torques_of(robot, joint_log_of(robot, position, command=command)))


def terms(contest: Contest, word: str, *sites: str) -> list[Term]:
    return [next(one for one in contest.terms if one.key == (word, site)) for site in sites]


def test_joints_are_alike_that_move_as_much_as_far_from_the_base(tmp_path: Path) -> None:
    assert set(like_joints(legs(tmp_path))) == {frozenset({"left_hip", "right_hip"}), KNEES}
    # Knees move the same shank still.
    assert like_joints(legs(tmp_path, right=3.0)) == (KNEES,)
    assert like_joints(arm(tmp_path)) == ()


def test_numbers_of_like_joints_are_exchangeable(rubbing: Contest) -> None:
    chosen = terms(rubbing, "coulomb_friction", "left_knee", "left_hip", "right_knee")
    information, nats = rubbing.prior.information(chosen, 2)
    covariance = np.linalg.inv(information)
    # Either is the common part and a quarter of its scale; the first two are of tolerances.
    expected = np.eye(5)
    expected[2, 4] = expected[4, 2] = 1.0 / (1.0 + 0.25**2)
    np.testing.assert_allclose(covariance, expected, atol=1e-12)
    assert nats == pytest.approx(np.linalg.slogdet(information)[1])


def test_a_word_at_all_that_are_alike_is_one_thing(rubbing: Contest) -> None:
    knees = terms(rubbing, "coulomb_friction", "left_knee", "right_knee")
    one_leg = terms(rubbing, "coulomb_friction", "left_knee", "left_hip")
    assert rubbing.prior.nats(knees) > rubbing.prior.nats(one_leg)
    unlike = replace(rubbing.prior, like=())
    assert unlike.nats(knees) == unlike.nats(one_leg)


def test_that_two_joints_are_coupled_is_one_thing_however_many_laws_it_takes(rubbing: Contest) -> None:
    left, right = "left_hip~left_knee", "right_hip~right_knee"
    dry, wet, other = (
        *terms(rubbing, "coulomb_friction", left), *terms(rubbing, "viscous_friction", left),
        *terms(rubbing, "viscous_friction", right),
    )  # fmt: skip
    # A thing more costs a factor of ten.
    assert rubbing.prior.nats([dry, wet]) - rubbing.prior.nats([dry, other]) == pytest.approx(np.log(10.0))


def test_both_knees_rub_and_what_they_share_makes_that_more_probable(rubbing: Contest) -> None:
    best = searched(rubbing)
    assert {one.key for one in best.terms} == {("coulomb_friction", knee) for knee in KNEES}
    apart = copy(rubbing)
    apart.prior, apart._fits = SetPrior(words=rubbing.prior.words, every=rubbing.prior.every, like=()), {}
    assert best.nats > apart.fit(best.terms).nats + 2.0
    found = {one.site: best.values(place)[0][0] for place, one in enumerate(best.terms)}
    assert found["left_knee"] == pytest.approx(0.9, rel=0.05)
    assert found["right_knee"] == pytest.approx(1.0, rel=0.05)


def test_words_of_one_are_tried_at_all_that_are_alike(rubbing: Contest) -> None:
    dry, wet = (terms(rubbing, word, "right_knee") for word in ("quadratic_damping", "viscous_friction"))
    mixed = rubbing.fit([*terms(rubbing, "coulomb_friction", "left_knee"), *dry, *wet])
    alike = made_alike(rubbing, mixed)
    assert {one.key for one in alike.terms} == {("coulomb_friction", knee) for knee in KNEES}
