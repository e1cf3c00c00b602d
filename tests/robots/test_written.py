"""Descriptions with what was found: they load again, and move as the machine does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.robots.loading import load_robot
from chladni.robots.machine import Coupling, Loop, Machine, Ripple, Stop, Transmission, as_described
from chladni.robots.written import WrittenRobot, write_robot
from chladni.signals.errors import LogError
from tests.robots.machines import RATE_HZ, arm, changed, commands, course, run_native, with_gains
from tests.robots.made import URDF

pytest.importorskip("mujoco")

#: A point of 0.4 kg in the forearm, 0.05 and 0.2 m from its origin.
POINT = np.array([0.4, 0.02, 0.0, 0.08, 0.016, 0.017, 0.001, 0.0, -0.004, 0.0])


@pytest.fixture
def described(tmp_path: Path) -> Machine:
    """The arm as its MJCF believes."""
    return as_described(arm(tmp_path))


CHANGES = {
    "friction": lambda one: changed(one, 0, friction=1.5),
    "damping": lambda one: changed(one, 1, damping=1.7),
    "quadratic damping": lambda one: changed(one, 0, quadratic=2.0),
    "armature": lambda one: changed(one, 1, armature=0.3),
    "spring": lambda one: changed(one, 0, stiffness=40.0, torque=12.0),
    "gains": lambda one: with_gains(one, 0, kp=90.0, kd=12.0),
    "gain": lambda one: changed(one, 1, gain=0.7),
    "limit": lambda one: with_gains(one, 0, limit=8.0),
    # Amid a step, so that rounding of the time doesn't matter.
    "delay": lambda one: changed(changed(one, 0, delay_s=0.01025), 1, delay_s=0.01025),
    "payload": lambda one: replace(one, inertial=one.inertial + np.array([np.zeros(10), POINT])),
    "tilt": lambda one: replace(one, tilt=(0.1, -0.2)),
    "coupling": lambda one: replace(
        one, couplings=(Coupling(joints=("shoulder", "elbow"), ratio=-1.0, friction=0.5, damping=0.8),)
    ),
    "coupled spring": lambda one: replace(
        one, couplings=(Coupling(joints=("shoulder", "elbow"), ratio=0.7, stiffness=25.0, torque=-6.0),)
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CHANGES)
def test_mjcf_moves_in_mujoco_as_the_machine_does(name: str, described: Machine, tmp_path: Path) -> None:
    machine = CHANGES[name](described)
    told = write_robot(machine, tmp_path / "found.xml")
    assert told.robot_file is None
    assert told.not_held == ()
    command = commands(3.0)
    before, after = course(described, command), course(machine, command)
    native = run_native(load_robot(told.robot), command)
    assert np.std(before - after) > 1e-3
    # Before its first command arrives a drive of MuJoCo goes to zero: a second is left for that to fade. And it takes
    # the position of a step for its torque at another place of the step.
    settled = slice(round(RATE_HZ), None)
    apart, changes = (np.max(np.abs(after - one)[:, settled]) for one in (native, before))
    assert apart < 0.03 * changes


@pytest.mark.parametrize("name", [one for one in CHANGES if "coupl" not in one])
def test_mjcf_reads_back_as_the_machine(name: str, described: Machine, tmp_path: Path) -> None:
    machine = CHANGES[name](described)
    back = as_described(load_robot(write_robot(machine, tmp_path / "found.xml").robot))
    np.testing.assert_allclose(back.inertial, machine.inertial, atol=1e-9)
    for one, other in zip(back.joints, machine.joints, strict=True):
        assert one.gains() == pytest.approx(other.gains())
        for number in ("friction", "damping", "armature", "delay_s"):
            assert getattr(one, number) == pytest.approx(getattr(other, number))


def test_what_was_not_found_stays_as_it_is_written(described: Machine, tmp_path: Path) -> None:
    told = write_robot(changed(described, 0, friction=1.5), tmp_path / "found.xml")
    text, old = told.description.read_text(), described.robot.description.read_text()
    lines = [one.strip().replace(" />", "/>") for one in text.splitlines()[1:]]
    different = [(a, b) for a, b in zip(lines, map(str.strip, old.splitlines()), strict=True) if a != b]
    assert different == [
        (
            '<joint name="shoulder" axis="0 1 0" damping="0.5" armature="0.1" frictionloss="1.5"/>',
            '<joint name="shoulder" axis="0 1 0" damping="0.5" armature="0.1"/>',
        )
    ]
    assert "<!-- angles in radian -->" in text


def test_springs_are_written_in_degrees_where_the_file_has_them(tmp_path: Path) -> None:
    robot = arm(tmp_path)
    text = robot.description.read_text().replace('<compiler angle="radian"/>', "")
    (tmp_path / "degrees.xml").write_text(text)
    machine = changed(as_described(load_robot(tmp_path / "degrees.xml")), 0, stiffness=40.0, torque=-20.0)
    back = load_robot(write_robot(machine, tmp_path / "found.xml").robot).model
    assert back.qpos_spring[0] == pytest.approx(0.5)


def test_what_no_description_holds_is_told(described: Machine, tmp_path: Path) -> None:
    machine = changed(described, 0, load=0.1, rise=0.4, fading=0.2, lag_s=0.01, reading=0.02)
    machine = changed(machine, 1, torque=2.0)
    told = write_robot(machine, tmp_path / "found.xml").not_held
    assert len(told) == 5
    for word in ("of the load", "Stribeck", "lags by 10 ms", "encoder reads 0.02 rad", "constant torque of -2"):
        assert any(word in one for one in told)


def test_delays_that_differ_are_those_of_actuators(described: Machine, tmp_path: Path) -> None:
    machine = changed(described, 1, delay_s=0.02)
    told = write_robot(machine, tmp_path / "found.xml")
    model = load_robot(told.robot).model
    np.testing.assert_allclose(model.actuator_delay, [0.0, 0.02])
    assert told.not_held == ()


def test_laws_that_no_description_holds_are_listed(described: Machine, tmp_path: Path) -> None:
    between = Transmission(stiffness=np.inf, gap=0.02, inertia=0.1, logs_motor=False)
    machine = changed(described, 0, loop=Loop(force=2.0, yields=0.1), dead=0.5, rate=1.5)
    machine = changed(machine, 0, ripple=Ripple(sine=3.0, cosine=4.0, period=0.2), transmission=between)
    machine = changed(machine, 0, stops=(Stop(stiffness=60.0, clearance=0.3, side=-1.0),))
    told = write_robot(machine, tmp_path / "found.xml").not_held
    words = (
        "over 0.1 rad",
        "ripple of 5 N m",
        "below -0.3 rad",
        "play of 0.02 rad",
        "nothing below 0.5",
        "1.5 rad/s",
    )
    assert len(told) == len(words)
    for word, one in zip(("over", "ripple", "stop", "play", "nothing", "faster"), told, strict=True):
        assert word in one
    assert all(any(word in one for one in told) for word in words)


def test_includes_are_put_in_place_and_meshes_found_from_elsewhere(tmp_path: Path) -> None:
    described = tmp_path / "given"
    arm(described)
    text = (described / "arm.xml").read_text()
    actuators = text[text.index("  <actuator>") : text.index("</mujoco>")]
    (described / "servos.xml").write_text(f"<mujocoinclude>{actuators}</mujocoinclude>")
    (described / "meshes").mkdir()
    (described / "meshes" / "ball.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    )
    mesh = '<asset><mesh name="ball" file="ball.obj"/></asset><include file="servos.xml"/>'
    text = text.replace(actuators, mesh).replace('angle="radian"', 'angle="radian" meshdir="meshes"')
    text = text.replace(
        '<body name="fore" pos="0 0 0.4">', '<body name="fore" pos="0 0 0.4"><geom type="mesh" mesh="ball"/>'
    )
    (described / "arm.xml").write_text(text)
    robot = load_robot(described / "arm.xml")
    assert robot.model.nmesh == 1
    (tmp_path / "found").mkdir()
    back = load_robot(write_robot(CHANGES["gains"](as_described(robot)), tmp_path / "found" / "arm.xml").robot)
    assert back.model.nmesh == 1
    assert back.joints[0].servo is not None
    assert back.joints[0].servo.kp == pytest.approx(90.0)


@pytest.fixture
def of_urdf(tmp_path: Path) -> Machine:
    """An arm of a URDF, whose servos a robot file knows."""
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "robot.toml").write_text(
        'format = "chladni.robot/1"\ndescription = "arm.urdf"\n[log]\nstate = "/states"\neffort = "none"\n'
        "[control]\nkp = { default = 80, elbow = 50 }\nkd = { default = 4 }\nlimit = { shoulder = 25 }\n"
        "[tolerance]\ninertia = 0.05\n"
    )
    return as_described(load_robot(tmp_path / "robot.toml"))


def found_in_urdf(of_urdf: Machine) -> Machine:
    """What a URDF and a robot file hold together."""
    machine = changed(of_urdf, 0, friction=1.2, damping=0.9, delay_s=0.01)
    for joint in (1, 2):
        machine = changed(machine, joint, delay_s=0.01)
    machine = with_gains(machine, 1, kp=40.0, kd=6.0, limit=7.0)
    fore = of_urdf.robot.links.index("fore")
    inertial = machine.inertial.copy()
    inertial[fore] += POINT
    return replace(machine, inertial=inertial, tilt=(0.05, 0.1))


def test_urdf_and_its_robot_file_move_as_the_machine_does(of_urdf: Machine, tmp_path: Path) -> None:
    machine = found_in_urdf(of_urdf)
    told = write_robot(machine, tmp_path / "found.urdf")
    assert told == WrittenRobot(description=tmp_path / "found.urdf", robot_file=tmp_path / "found.toml", not_held=())
    back = as_described(load_robot(told.robot))
    command = np.concatenate([commands(3.0), np.zeros((1, 750))])
    np.testing.assert_allclose(course(back, command), course(machine, command), atol=1e-6)
    assert np.std(course(back, command) - course(of_urdf, command)) > 1e-2
    assert back.robot.log == of_urdf.robot.log
    assert back.robot.tolerance == of_urdf.robot.tolerance
    assert "<!-- an arm -->" in told.description.read_text()
    assert "<gazebo" in told.description.read_text()


def test_what_urdf_lacks_is_told(of_urdf: Machine, tmp_path: Path) -> None:
    machine = changed(of_urdf, 1, armature=0.04, quadratic=0.1, stiffness=3.0, delay_s=0.02)
    machine = replace(
        machine, couplings=(Coupling(joints=("shoulder", "elbow"), ratio=1.0, friction=0.5, damping=0.02),)
    )
    told = write_robot(machine, tmp_path / "found.urdf").not_held
    assert len(told) == 5
    shared = "shoulder and elbow share Coulomb friction of 0.5 N m and viscous friction of 20 mN m s/rad;"
    for word in ("armature 0.04 kg m^2", "square of the speed", "a spring of 3", shared, "elbow 20 ms"):
        assert any(word in one for one in told)


def test_an_imu_that_is_turned_is_told(described: Machine, tmp_path: Path) -> None:
    told = write_robot(replace(described, imu_turned=(0.05, 0.0, -0.02)), tmp_path / "found.xml").not_held
    assert told == ("the IMU is turned by 0.05, 0, -0.02 rad about its own axes",)


def test_files_that_are_there_stay_unless_they_may_go(described: Machine, tmp_path: Path) -> None:
    (tmp_path / "found.xml").write_text("mine")
    with pytest.raises(LogError, match=r"found\.xml"):
        write_robot(described, tmp_path / "found.xml", overwrite=False)
    assert (tmp_path / "found.xml").read_text() == "mine"


def test_a_urdf_becomes_mjcf_where_the_path_says_so(of_urdf: Machine, tmp_path: Path) -> None:
    machine = changed(found_in_urdf(of_urdf), 1, armature=0.3, quadratic=0.4, stiffness=3.0, torque=1.0)
    told = write_robot(machine, tmp_path / "found.xml")
    assert told.not_held == ()
    assert told.robot_file == tmp_path / "found.toml"
    command = np.concatenate([commands(3.0), np.zeros((1, 750))])
    after = course(machine, command)
    # MuJoCo writes six digits of what it compiled.
    apart = np.max(np.abs(course(as_described(load_robot(told.robot)), command) - after))
    assert apart < 2e-3 * np.max(np.abs(after - course(of_urdf, command)))
    model = load_robot(told.description).model
    assert [model.actuator(place).name for place in range(model.nu)] == ["shoulder", "elbow", "lift"]
    np.testing.assert_allclose(model.actuator_delay, 0.01)
    np.testing.assert_allclose(model.actuator_forcerange[1], [-7.0, 7.0])


def test_a_plate_stays_one_that_mujoco_takes(described: Machine, tmp_path: Path) -> None:
    # Turned, so that its moments, of which one is the sum of the others, are rounded.
    turned, _ = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [0.3, 1.0, 4.0], [2.0, 0.1, 1.0]]))
    inertia = turned @ np.diag([0.02, 0.013, 0.007]) @ turned.T
    plate = np.array([2.0, 0.0, 0.0, 0.0, *inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])
    found = replace(described, inertial=np.array([plate, described.inertial[1]]))
    back = load_robot(write_robot(found, tmp_path / "found.xml").robot)
    np.testing.assert_allclose(as_described(back).inertial, found.inertial, atol=1e-9)
