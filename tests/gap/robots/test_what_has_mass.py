"""What has mass is physics, beside laws that idealise."""

from pathlib import Path

import numpy as np
import pytest

from chladni.gap.robots.contest import Contest
from chladni.gap.robots.torques import torques_of
from chladni.gap.robots.transmission_words import AT_MOTOR
from chladni.robots.machine import as_described
from tests.robots.machines import arm, changed, commands, course, joint_log_of

pytest.importorskip("mujoco")


def test_a_motor_that_does_not_yield_explains_no_more_than_its_rotor(tmp_path: Path) -> None:
    robot, command = arm(tmp_path), commands(8.0)
    position = course(changed(as_described(robot), 0, armature=0.6, friction=6.0), command)
    position += 2e-4 * np.random.default_rng(0).standard_normal(position.shape)
    contest = Contest(torques_of(robot, joint_log_of(robot, position, command=command)))
    rotor, elastic = (
        next(one for one in contest.terms if one.key == (word, "shoulder") and one.variant == variant)
        for word, variant in (("armature", None), ("joint_elasticity", AT_MOTOR))
    )
    plain, wider = contest.fit([rotor]), contest.fit([elastic])
    # What has mass is physics, of which a right description leaves nothing: a law's details would hide the friction.
    assert wider.left.log_likelihood.sum() < plain.left.log_likelihood.sum() + 1.0
    assert wider.nats < plain.nats - 4.0
