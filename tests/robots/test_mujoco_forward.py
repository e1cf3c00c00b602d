"""A machine's laws in MuJoCo, against closed forms of a rotor and of two."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from chladni.robots.loading import load_robot
from chladni.robots.machine import Coupling, Machine, Transmission, about_centre, as_described, physical
from chladni.robots.robot import Servo

pytest.importorskip("mujoco")

from chladni.robots.mujoco_forward import Driven, longest_step_s, model_of, run

INERTIA, STEP_S, STEPS = 0.04, 1e-4, 5000
AT_S = np.arange(STEPS) * STEP_S
#: Of critical: what damps every spring between motor and link.
TEETH_DAMPED = 0.05

_ROTOR = (
    '<body name="{0}_link"><joint name="{0}" axis="0 0 1"/>'
    '<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.04"/></body>'
)
ROTORS = f"<mujoco><worldbody>{_ROTOR.format('one')}{_ROTOR.format('two')}</worldbody></mujoco>"


@pytest.fixture
def rotors(tmp_path: Path) -> Machine:
    """Two rotors beside one another, which nothing drives."""
    path = tmp_path / "rotors.xml"
    path.write_text(ROTORS)
    return as_described(load_robot(path))


def with_first(machine: Machine, **changed: object) -> Machine:
    """The machine with another first joint."""
    return replace(machine, joints=(replace(machine.joints[0], **changed), *machine.joints[1:]))


def course(
    machine: Machine, *, asked: float = 0.0, kind: str = "effort", start: float = 0.0, speed: float = 0.0
) -> np.ndarray:
    """``[step]``: positions of the first rotor."""
    return courses(machine, asked=asked, kind=kind, start=start, speed=speed)[0]


def courses(machine: Machine, *, asked: float, kind: str, start: float, speed: float) -> np.ndarray:
    """``[joint, step]``."""
    driven = Driven(
        asked=np.array([[asked], [0.0]]) * np.ones(STEPS), kind=(kind, "effort"), position=np.array([[start], [0.0]]),
        velocity=np.array([[speed], [0.0]]), steps=np.array([STEPS]), every=1, step_s=STEP_S,
    )  # fmt: skip
    return run(machine, ("one", "two"), driven)


def test_a_servo_follows_with_an_error_of_second_order_in_the_step(rotors: Machine) -> None:
    kp, kd, step_s = 60.0, 2.0, 1e-3
    time_s = np.arange(3000) * step_s
    command = 0.5 * np.sin(2.0 * np.pi * 1.5 * time_s)
    machine = with_first(rotors, servo=Servo(kind="position", kp=kp, kd=kd, limit=None, actuator=None))
    # From rest; between samples a command of many steps is a straight line.
    _, exact, _ = lsim(([kp], [INERTIA, kd, kp]), command, time_s)
    driven = Driven(
        asked=np.stack([command, 0.0 * command]), kind=("position", "effort"), position=np.zeros((2, 1)),
        velocity=np.zeros((2, 1)), steps=np.array([time_s.size]), every=1, step_s=step_s,
    )  # fmt: skip
    found = run(machine, ("one", "two"), driven)[0]
    # Half a step late, or early, would be 2e-3.
    np.testing.assert_allclose(found, exact, atol=1e-4)


# A step of Euler's method errs by half of its acceleration times its length.
EULER = 0.5 * STEP_S


def test_coulomb_friction_slows_in_a_straight_line_and_holds(rotors: Machine) -> None:
    found = course(with_first(rotors, friction=0.8), speed=4.0)
    stops_s = 4.0 * INERTIA / 0.8
    until = np.minimum(AT_S, stops_s)
    # MuJoCo's friction is a soft constraint; it stops within a few of its time constants.
    np.testing.assert_allclose(found, 4.0 * until - 0.5 * 0.8 / INERTIA * until**2, atol=2e-3)


def test_load_friction_grows_with_the_torque_that_the_motion_needs(rotors: Machine) -> None:
    found = course(with_first(rotors, friction=0.1, load=0.25), asked=1.0)
    rate = (1.0 - 0.1) / (INERTIA * 1.25)
    np.testing.assert_allclose(found, 0.5 * rate * AT_S**2, atol=2 * EULER * rate * AT_S[-1])


def test_stribeck_friction_is_large_when_slow(rotors: Machine) -> None:
    machine = with_first(rotors, friction=0.2, rise=0.3, fading=1.0)
    # MuJoCo's friction is soft, so that what sticks creeps.
    assert course(machine, asked=0.45)[-1] < 1e-2
    assert course(machine, asked=0.55)[-1] > 0.2
    fast = course(machine, speed=20.0)
    np.testing.assert_allclose(fast, 20.0 * AT_S - 0.5 * 0.2 / INERTIA * AT_S**2, atol=1e-3)


def test_quadratic_damping_slows_as_a_logarithm(rotors: Machine) -> None:
    found = course(with_first(rotors, quadratic=0.02), speed=5.0)
    decay = 0.02 / INERTIA
    np.testing.assert_allclose(found, np.log1p(decay * 5.0 * AT_S) / decay, atol=2e-3)


def test_viscous_damping_and_armature(rotors: Machine) -> None:
    found = course(with_first(rotors, damping=0.3, armature=0.06), speed=2.0)
    rate = 0.3 / (INERTIA + 0.06)
    np.testing.assert_allclose(found, 2.0 * (1.0 - np.exp(-rate * AT_S)) / rate, atol=1e-3)


def test_a_spring_swings_about_its_rest(rotors: Machine) -> None:
    found = course(with_first(rotors, stiffness=4.0, torque=-2.0))
    np.testing.assert_allclose(found, 0.5 * (1.0 - np.cos(np.sqrt(4.0 / INERTIA) * AT_S)), atol=2e-3)


def test_a_constant_torque_without_a_spring_pulls(rotors: Machine) -> None:
    found = course(with_first(rotors, torque=-0.5))
    np.testing.assert_allclose(found, 0.25 / INERTIA * AT_S**2, atol=1e-3)


def test_gain_and_lag_of_a_drive(rotors: Machine) -> None:
    found = course(with_first(rotors, gain=0.8), asked=0.5)
    np.testing.assert_allclose(found, 0.2 / INERTIA * AT_S**2, atol=1e-3)
    # The torque of a run's first step holds from before.
    assert course(with_first(rotors, lag_s=0.05), asked=0.5)[-1] == pytest.approx(0.25 / INERTIA * 0.25, rel=1e-3)


def servo(limit: float | None = None, lag_s: float = 0.0) -> Servo:
    """A soft servo without damping."""
    return Servo(kind="position", kp=4.0, kd=0.0, limit=limit, actuator=None, lag_s=lag_s)


def test_a_servo_swings_about_its_command_less_what_it_reads_too_much(rotors: Machine) -> None:
    machine = with_first(rotors, servo=servo(), drive_reading=0.1)
    found = course(machine, kind="position", asked=0.6)
    np.testing.assert_allclose(found, 0.5 * (1.0 - np.cos(10.0 * AT_S)), atol=2e-3)


def test_what_the_log_reads_is_off_alike_at_the_start_and_later(rotors: Machine) -> None:
    machine = with_first(rotors, servo=servo(), reading=0.1)
    found = course(machine, kind="position", asked=0.6, start=0.1)
    np.testing.assert_allclose(found, 0.1 + 0.5 * (1.0 - np.cos(10.0 * AT_S)), atol=2e-3)


def test_a_servo_gives_no_more_than_its_limit(rotors: Machine) -> None:
    machine = with_first(rotors, servo=servo(limit=0.1))
    found = course(machine, kind="position", asked=50.0)
    np.testing.assert_allclose(found, 0.05 / INERTIA * AT_S**2, atol=1e-3)


def test_damping_of_a_servo_within_its_limit_is_that_of_a_joint(rotors: Machine) -> None:
    def damped(limit: float) -> np.ndarray:
        drive = Servo(kind="position", kp=4.0, kd=0.3, limit=limit, actuator=None)
        return course(with_first(rotors, servo=drive), kind="position", asked=0.5)

    np.testing.assert_allclose(damped(1e3), damped(np.inf), atol=1e-12)
    assert np.max(np.abs(damped(0.5) - damped(np.inf))) > 1e-2


def test_a_velocity_servo_follows_as_a_first_order_lag(rotors: Machine) -> None:
    drive = Servo(kind="velocity", kp=None, kd=0.4, limit=None, actuator=None)
    found = course(with_first(rotors, servo=drive), kind="velocity", asked=2.0)
    rate = 0.4 / INERTIA
    np.testing.assert_allclose(found, 2.0 * (AT_S - (1.0 - np.exp(-rate * AT_S)) / rate), atol=1e-3)


def test_coupled_friction_takes_from_the_sum_of_speeds_alone(rotors: Machine) -> None:
    machine = replace(rotors, couplings=(Coupling(joints=("one", "two"), ratio=1.0, damping=0.2),))
    found = courses(machine, asked=0.0, kind="effort", start=0.0, speed=2.0)
    rate = 2.0 * 0.2 / INERTIA
    np.testing.assert_allclose(found.sum(axis=0), 2.0 * (1.0 - np.exp(-rate * AT_S)) / rate, atol=1e-3)
    np.testing.assert_allclose(found[0] - found[1], 2.0 * AT_S, atol=1e-9)


def test_a_spring_between_two_joints_turns_them_against_each_other(rotors: Machine) -> None:
    # What it stretches swings as one rotor on it; what it doesn't goes on as it went.
    stiffness, ratio, rest = 0.8, -0.5, 0.3
    spring = Coupling(joints=("one", "two"), ratio=ratio, stiffness=stiffness, torque=-stiffness * rest)
    found = courses(replace(rotors, couplings=(spring,)), asked=0.0, kind="effort", start=0.0, speed=2.0)
    turns = np.sqrt(stiffness * (1.0 + ratio**2) / INERTIA)
    stretched = rest + 2.0 / turns * np.sin(turns * AT_S) - rest * np.cos(turns * AT_S)
    np.testing.assert_allclose(found[0] + ratio * found[1], stretched, atol=2e-3)
    np.testing.assert_allclose(ratio * found[0] - found[1], 2.0 * ratio * AT_S, atol=1e-6)


@pytest.mark.parametrize("logs_motor", [False, True])
def test_a_run_begins_with_its_springs_wound_up_by_what_moves_the_links(rotors: Machine, logs_motor: bool) -> None:
    stiffness, rotor, passed, rate = 8.0, 0.3 * INERTIA, 0.4, 6.0
    between = Transmission(stiffness=stiffness, gap=0.0, inertia=rotor, logs_motor=logs_motor)
    driven = Driven(
        asked=np.zeros((2, STEPS)), kind=("effort", "effort"), position=np.zeros((2, 1)),
        velocity=np.array([[1.5], [0.0]]), passed=np.array([[[passed], [0.0]], [[rate], [0.0]]]),
        steps=np.array([STEPS]), every=1, step_s=STEP_S,
    )  # fmt: skip
    found = run(with_first(rotors, transmission=between), ("one", "two"), driven)[0]
    # Motor and link swing against each other about their centre, which goes on.
    turns = np.sqrt(stiffness * (1.0 / INERTIA + 1.0 / rotor))
    damped = turns * np.sqrt(1.0 - TEETH_DAMPED**2)
    wound, winding = passed / stiffness, rate / stiffness
    swing = np.cos(damped * AT_S) * wound + np.sin(damped * AT_S) * (winding + TEETH_DAMPED * turns * wound) / damped
    lead = swing * np.exp(-TEETH_DAMPED * turns * AT_S)
    part = INERTIA / (INERTIA + rotor) if logs_motor else -rotor / (INERTIA + rotor)
    expected = 1.5 * AT_S + part * (lead - wound) - part * winding * AT_S
    np.testing.assert_allclose(found, expected, atol=5e-3)


def test_coupled_coulomb_friction_brings_the_sum_to_rest_and_holds_it(rotors: Machine) -> None:
    machine = replace(rotors, couplings=(Coupling(joints=("one", "two"), ratio=1.0, friction=0.4),))
    found = courses(machine, asked=0.0, kind="effort", start=0.0, speed=2.0).sum(axis=0)
    slows = 2.0 * 0.4 / INERTIA
    until = np.minimum(AT_S, 2.0 / slows)
    np.testing.assert_allclose(found, 2.0 * until - 0.5 * slows * until**2, atol=2e-3)


def test_a_run_that_goes_astray_is_infinite_and_the_next_starts_anew(
    rotors: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    driven = Driven(
        asked=np.concatenate([np.full((2, 50), 1e12), np.zeros((2, 50))], axis=1), kind=("effort",) * 2,
        position=np.zeros((2, 2)), velocity=np.ones((2, 2)), steps=np.array([50, 50]), every=10, step_s=STEP_S,
    )  # fmt: skip
    found = run(rotors, ("one", "two"), driven)
    assert np.isinf(found[0, 1:5]).all()
    np.testing.assert_allclose(found[0, 5:], np.arange(5) * 10 * STEP_S)
    # MuJoCo would leave its warnings where the user works.
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_joints_that_a_log_lacks_are_held(rotors: Machine) -> None:
    driven = Driven(
        asked=np.ones((1, STEPS)), kind=("effort",), position=np.zeros((1, 1)), velocity=np.zeros((1, 1)),
        steps=np.array([STEPS]), every=1, step_s=STEP_S,
    )  # fmt: skip
    found = run(rotors, ("two",), driven)
    np.testing.assert_allclose(found[0], 0.5 / INERTIA * AT_S**2, atol=2e-3)
    assert model_of(rotors, ("two",)).dof_armature[0] > 1e3


def test_steps_are_short_for_stiff_servos(rotors: Machine) -> None:
    assert longest_step_s(rotors, ("one",)) == pytest.approx(1e-3)
    # A cable that the second joint winds up twice as far pulls four times as stiffly at it.
    cable = Coupling(joints=("one", "two"), ratio=2.0, stiffness=20000.0)
    coupled = replace(rotors, couplings=(cable,))
    assert [cable.stiffness_at(joint) for joint in ("one", "two", "three")] == [20000.0, 80000.0, 0.0]
    assert longest_step_s(coupled, ("two",)) == pytest.approx(0.5 * longest_step_s(coupled, ("one",)))
    stiff = with_first(rotors, servo=replace(servo(), kp=40000.0))
    assert longest_step_s(stiff, ("one",)) == pytest.approx(0.3 * np.sqrt(INERTIA / 40000.0))


def test_of_numbers_that_no_body_has_mass_and_centre_stay() -> None:
    rod = np.array([2.0, 0.4, 0.0, 0.0, 1e-4, 0.2, 0.2, 0.0, 0.0, 0.0])
    heavier = 1.2 * rod
    np.testing.assert_array_equal(physical(rod, heavier), heavier)
    # Gravity tells of a tenth more, a hundredth of a metre aside; not of moments of inertia about a rod's axis.
    wanted = rod + np.array([0.2, 0.02, 0.02, 0.0, -2e-4, 0.0, 0.0, 0.0, 0.0, 0.0])
    found = physical(rod, wanted)
    np.testing.assert_array_equal(found[:4], wanted[:4])
    _, _, inertia = about_centre(found)
    low, middle, high = np.linalg.eigvalsh(inertia)
    assert low > 0
    assert low + middle >= high * (1.0 - 1e-9)
    assert np.max(np.abs(found - wanted)) < 1e-3
    np.testing.assert_allclose(physical(rod, found), found, atol=1e-15)
    np.testing.assert_array_equal(physical(rod, -rod), rod)


def test_a_payload_shifts_mass_centre_and_inertia(rotors: Machine) -> None:
    # 1 kg in addition, 0.3 m off the axis.
    point = np.array([1.0, 0.3, 0.0, 0.0, 0.0, 0.09, 0.09, 0.0, 0.0, 0.0])
    machine = replace(rotors, inertial=rotors.inertial + np.array([point, np.zeros(10)]))
    found = course(machine, asked=0.5)
    np.testing.assert_allclose(found, 0.25 / (INERTIA + 0.09) * AT_S**2, atol=1e-3)
