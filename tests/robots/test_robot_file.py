"""Robot files: what they add to a description, and every mistake with its line."""

from pathlib import Path

import pytest

from chladni import ModelError, load_robot
from chladni.robots.robot import ImuNames, LogNames, RobotTolerance
from tests.robots.made import ARM, URDF, written

pytest.importorskip("mujoco")

WHOLE = """format = "chladni.robot/1"
description = "arm.urdf"
base = "fixed"
[log]
state = "/joint_states"
command = "/joint_commands"
command_kind = "position"
effort = "current"
torque_constant = { default = 1.5, lift = "20 N/A" }
names = ["elbow", "shoulder"]
imu = { topic = "/imu", site = "hand" }
[control]
kp = { default = 100.0, elbow = "80 N m/rad" }
kd = { default = 5.0 }
limit = { default = 87.0, shoulder = "2 kN mm" }
delay = "8 ms"
[tolerance]
inertia = "5 %"
gains = 0.1
friction = "0.2 N m"
"""


def made(folder: Path, text: str = WHOLE) -> Path:
    written(folder, URDF, "arm.urdf")
    return written(folder, text, "arm.toml")


def mistakes(path: Path) -> list[str]:
    with pytest.raises(ModelError) as refused:
        load_robot(path)
    return [one.removeprefix(f"{path}:") for one in refused.value.mistakes]


def test_a_whole_file_is_read(tmp_path: Path) -> None:
    path = made(tmp_path)
    robot = load_robot(path)
    assert (robot.robot_file, robot.description, robot.base) == (path, tmp_path / "arm.urdf", "fixed")
    assert robot.delay_s == 0.008
    assert robot.tolerance == RobotTolerance(inertia=0.05, gains=0.1, friction=0.2)
    assert robot.log == LogNames(
        state="/joint_states",
        command="/joint_commands",
        command_kind="position",
        effort="current",
        torque_constant={"default": 1.5, "lift": 20.0},
        names=("elbow", "shoulder"),
        imu=ImuNames(topic="/imu", site="hand"),
    )
    servos = {one.name: one.servo for one in robot.joints}
    assert {name: (one.kind, one.kp, one.kd, one.limit, one.actuator) for name, one in servos.items()} == {
        "shoulder": ("position", 100.0, 5.0, 2.0, None),
        "elbow": ("position", 80.0, 5.0, 87.0, None),
        "lift": ("position", 100.0, 5.0, 87.0, None),
    }


def test_a_file_that_names_its_description_alone_adds_nothing(tmp_path: Path) -> None:
    robot = load_robot(made(tmp_path, 'format = "chladni.robot/1"\ndescription = "arm.urdf"\n'))
    assert (robot.log, robot.tolerance, robot.delay_s) == (LogNames(), RobotTolerance(), 0.0)
    assert [one.servo for one in robot.joints] == [None] * 3


def test_what_the_file_says_of_servos_counts_before_the_description(tmp_path: Path) -> None:
    written(tmp_path, ARM)
    text = 'format = "chladni.robot/1"\ndescription = "arm.xml"\n[control]\nkp = { shoulder = 60 }\n'
    shoulder, elbow, _ = load_robot(written(tmp_path, text, "arm.toml")).joints
    assert (shoulder.servo.kp, shoulder.servo.kd, shoulder.servo.limit) == (60.0, 4.0, 30.0)
    assert elbow.servo.kp == 200.0


@pytest.mark.parametrize(("name", "text"), [("arm.xml", ARM), ("arm.urdf", URDF)])
def test_a_base_can_be_set_afloat_and_fixed(tmp_path: Path, name: str, text: str) -> None:
    written(tmp_path, text, name)
    floating = 'format = "chladni.robot/1"\ndescription = "{}"\nbase = "floating"\n'
    robot = load_robot(written(tmp_path, floating.format(name), "arm.toml"))
    assert (robot.base, robot.joints[0].dof, robot.model.nv) == ("floating", 6, 9)
    assert "the base is taken as floating, as the robot file says" in robot.remarks
    afloat = ARM.replace('<body name="base">', '<body name="base"><freejoint/>')
    written(
        tmp_path, afloat.replace("<actuator>", '<keyframe><key qpos="0 0 0 1 0 0 0 0 0 0"/></keyframe><actuator>')
    )
    fixed = 'format = "chladni.robot/1"\ndescription = "arm.xml"\nbase = "fixed"\n'
    robot = load_robot(written(tmp_path, fixed, "arm.toml"))
    assert (robot.base, robot.joints[0].dof, robot.model.nv) == ("fixed", 0, 3)


def test_all_mistakes_are_told_at_once_with_their_lines(tmp_path: Path) -> None:
    text = (
        WHOLE.replace('base = "fixed"', 'bse = "fixed"')
        .replace('command_kind = "position"', 'command_kind = "velocty"')
        .replace('lift = "20 N/A"', 'lift = "20 N m/A"')
        .replace('["elbow", "shoulder"]', '["elbw", "shoulder", "shoulder"]')
        .replace('site = "hand"', 'site = "hnd"')
        .replace('elbow = "80 N m/rad"', 'ellbow = "80 N m/rad"')
        .replace("kd = { default = 5.0 }", "kd = { default = -5.0 }")
        .replace('"8 ms"', '"8 mm"')
        .replace("gains = 0.1", "gains = inf")
    )
    found = mistakes(made(tmp_path, text))
    assert [one.split(":")[0] for one in found] == ["3", "7", "9", "10", "10", "11", "13", "14", "16", "19"]
    joined = "\n".join(found)
    for told in (
        "bse: unknown key; did you mean base?",
        "found 'velocty'",
        "torque_constant lift: found '20 N m/A'",
        "no joint 'elbw'; did you mean elbow?",
        "'shoulder' stands there twice",
        "no site or link 'hnd'; did you mean hand?",
        "no joint 'ellbow'; did you mean elbow?",
        "kd default: found -5.0; must not be negative",
        "delay: found '8 mm', which is in m",
        "gains: found inf",
    ):
        assert told in joined


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "is empty"),
        ('format = "chladni.robot/1"\n', "description: is missing"),
        ('format = "chladni.robot/1"\ndescription = "gone.urdf"\n', "gone.urdf: no such file"),
        ('format = "chladni.robot/2"\ndescription = "arm.urdf"\n', "must be 'chladni.robot/1'"),
        ('format = "chladni.robot/1"\ndescription = "arm.toml"\n', "neither MJCF"),
        ('format = "chladni.robot/1"\ndescription = 3\n', "must be text"),
        ('format = "chladni.robot/1"\ndescription = "arm.urdf"\n[control]\nkp = 3\n', "must be a table"),
        ('format = "chladni.robot/1"\ndescription = "arm.urdf"\n[log]\nnames = []\n', "at least 1"),
        ('format = "chladni.robot/1"\ndescription = "arm.urdf"\n[control]\ndelay = true\n', "must be a number"),
        ("format = [", "not TOML"),
    ],
)
def test_a_file_that_is_wrong_is_told(tmp_path: Path, text: str, told: str) -> None:
    path = made(tmp_path, text)
    with pytest.raises(ModelError) as refused:
        load_robot(path)
    assert told in str(refused.value)
    assert str(path) in str(refused.value)
