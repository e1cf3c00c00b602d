"""MJCF and URDF: what is read of them, and what is refused."""

import sys
from pathlib import Path

import numpy as np
import pytest

from chladni import ModelError, load_robot
from chladni.robots.description import missing_meshes
from chladni.robots.loading import is_robot_file
from tests.robots.made import ARM, JOINTS, URDF, written

pytest.importorskip("mujoco")

CUBE = "solid a\nendsolid a\n"


def refusal(path: Path) -> str:
    with pytest.raises(ModelError) as refused:
        load_robot(path)
    assert len(refused.value.mistakes) == 1
    assert "\n" not in str(refused.value)
    return str(refused.value)


# --- MJCF ---


def test_joints_of_an_mjcf_are_read_with_what_it_believes(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, ARM))
    assert (robot.name, robot.base, robot.links) == ("arm", "fixed", ("base", "upper", "fore", "hand"))
    assert [one.name for one in robot.joints] == ["shoulder", "elbow", "lift"]
    assert [one.kind for one in robot.joints] == ["hinge", "hinge", "slide"]
    shoulder = robot.joint("shoulder")
    assert (shoulder.damping, shoulder.armature, shoulder.friction) == (0.5, 0.1, 0.3)
    assert (shoulder.range, shoulder.link, shoulder.dof) == ((-2.0, 2.0), "upper", 0)
    assert robot.joint("lift").range is None
    assert robot.remarks == ()
    assert robot.model.opt.gravity[2] == pytest.approx(-9.81)


def test_gains_of_actuators_count_at_the_joint(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, ARM))
    shoulder, elbow, lift = (one.servo for one in robot.joints)
    assert (shoulder.kind, shoulder.kp, shoulder.kd, shoulder.limit) == ("position", 80.0, 4.0, 30.0)
    assert shoulder.actuator == "shoulder_servo"
    # Gear 2: the actuator moves twice as far, and its force counts twice.
    assert (elbow.kind, elbow.kp, elbow.kd, elbow.limit) == ("position", 200.0, 8.0, None)
    assert (lift.kind, lift.kp, lift.kd, lift.limit) == ("effort", None, None, 30.0)


@pytest.mark.parametrize(
    ("actuators", "kind", "kp", "kd"),
    [
        ('<velocity joint="shoulder" kv="3"/>', "velocity", None, 3.0),
        ('<position joint="shoulder" kp="9"/><velocity joint="shoulder" kv="3"/>', "position", 9.0, 3.0),
        ('<general joint="shoulder" gainprm="2"/>', "effort", None, None),
    ],
)
def test_each_kind_of_actuator_is_told(
    tmp_path: Path, actuators: str, kind: str, kp: float | None, kd: float | None
) -> None:
    text = ARM[: ARM.index("<actuator>")] + f"<actuator>{actuators}</actuator></mujoco>"
    servo = load_robot(written(tmp_path, text)).joints[0].servo
    assert servo is not None
    assert (servo.kind, servo.kp, servo.kd) == (kind, kp, kd)


def test_a_servo_torque_by_these_gains_is_what_mujoco_applies(tmp_path: Path) -> None:
    import mujoco

    robot = load_robot(written(tmp_path, ARM))
    data = mujoco.MjData(robot.model)
    data.qpos[:2], data.qvel[:2], data.ctrl[:2] = (0.2, -0.1), (0.3, 0.5), (0.25, -0.3)
    mujoco.mj_forward(robot.model, data)
    for row, gear in ((0, 1.0), (1, 2.0)):
        servo = robot.joints[row].servo
        wanted = data.ctrl[row] / gear
        torque = servo.kp * (wanted - data.qpos[row]) - servo.kd * data.qvel[row]
        assert data.qfrc_actuator[row] == pytest.approx(torque)


def test_a_filter_of_the_command_is_kept_as_a_lag(tmp_path: Path) -> None:
    text = ARM[: ARM.index("<actuator>")] + (
        '<actuator><position joint="shoulder" kp="9" timeconst="0.05"/></actuator></mujoco>'
    )
    assert load_robot(written(tmp_path, text)).joints[0].servo.lag_s == pytest.approx(0.05)


def test_meshes_that_are_missing_take_their_geoms_along_and_nothing_else(tmp_path: Path) -> None:
    text = ARM.replace(
        "<worldbody>",
        '<compiler meshdir="assets"/><asset><mesh name="m" file="a.stl"/><mesh file="b.obj"/>'
        '<texture name="t" type="2d" file="t.png"/><material name="grey" texture="t"/></asset>'
        '<contact><pair geom1="named" geom2="ball"/></contact><worldbody>',
    ).replace(
        '<inertial pos="0 0 0.2" mass="2"',
        '<geom type="mesh" mesh="m" material="grey"/><geom name="named" type="mesh" mesh="b"/>'
        '<geom name="ball" size="0.1"/><inertial pos="0 0 0.2" mass="2"',
    )
    robot = load_robot(written(tmp_path, text))
    assert robot.remarks == (missing_meshes(2),)
    bare = load_robot(written(tmp_path, ARM, "bare.xml"))
    np.testing.assert_array_equal(robot.model.body_mass, bare.model.body_mass)
    np.testing.assert_array_equal(robot.model.body_inertia, bare.model.body_inertia)
    assert robot.model.geom("ball").size[0] == pytest.approx(0.1)


def test_a_mesh_that_is_there_is_used(tmp_path: Path) -> None:
    obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    written(tmp_path, obj, "assets/a.obj")
    text = ARM.replace(
        "<worldbody>", '<compiler meshdir="assets"/><asset><mesh name="m" file="a.obj"/></asset><worldbody>'
    ).replace('<joint name="elbow"', '<geom type="mesh" mesh="m"/><joint name="elbow"')
    robot = load_robot(written(tmp_path, text))
    assert (robot.model.nmesh, robot.remarks) == (1, ())
    robot = load_robot(tmp_path / "arm.xml", meshes=False)
    assert (robot.model.nmesh, robot.remarks) == (0, ())


def test_a_mesh_that_gives_a_mass_is_used_even_when_none_is_asked_for(tmp_path: Path) -> None:
    obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    written(tmp_path, obj, "a.obj")
    text = ARM.replace("<worldbody>", '<asset><mesh name="m" file="a.obj"/></asset><worldbody>').replace(
        '<inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/>', '<geom type="mesh" mesh="m"/>'
    )
    robot = load_robot(written(tmp_path, text), meshes=False)
    # A tetrahedron of the density of water.
    assert float(robot.model.body("hand").mass[0]) == pytest.approx(1000 / 6)


def test_a_mesh_that_mujoco_refuses_counts_as_missing(tmp_path: Path) -> None:
    written(tmp_path, CUBE, "a.stl")
    text = ARM.replace("<worldbody>", '<asset><mesh name="m" file="a.stl"/></asset><worldbody>').replace(
        '<joint name="elbow"', '<geom type="mesh" mesh="m"/><joint name="elbow"'
    )
    assert load_robot(written(tmp_path, text)).remarks == (missing_meshes(1),)


def test_mass_that_came_from_meshes_is_told(tmp_path: Path) -> None:
    text = ARM.replace("<worldbody>", '<asset><mesh name="m" file="a.stl"/></asset><worldbody>').replace(
        '<inertial pos="0 0 0" mass="4" diaginertia="0.02 0.02 0.02"/>', '<geom type="mesh" mesh="m"/>'
    )
    assert (
        "the mass of base isn't known: it came from meshes; give <inertial>"
        in load_robot(written(tmp_path, text)).remarks
    )


def test_a_link_that_moves_without_mass_is_refused_with_a_remedy(tmp_path: Path) -> None:
    text = ARM.replace('<inertial pos="0 0 0" mass="0.5" diaginertia="0.001 0.001 0.001"/>', "")
    assert "give each link that moves an <inertial>" in refusal(written(tmp_path, text))


def test_includes_inside_the_folder_are_read(tmp_path: Path) -> None:
    written(tmp_path, ARM, "parts/arm.xml")
    text = '<mujoco model="scene"><include file="parts/arm.xml"/><worldbody><light pos="0 0 3"/></worldbody></mujoco>'
    assert [one.name for one in load_robot(written(tmp_path, text, "scene.xml")).joints] == [*JOINTS]


def test_a_base_that_floats_is_told(tmp_path: Path) -> None:
    text = ARM.replace('<body name="base">', '<body name="base"><freejoint/>')
    robot = load_robot(written(tmp_path, text))
    assert robot.base == "floating"
    assert (robot.joints[0].position, robot.joints[0].dof) == (7, 6)


def test_a_thing_that_floats_beside_the_robot_is_no_base(tmp_path: Path) -> None:
    text = ARM.replace("<worldbody>", '<worldbody><body name="cube"><freejoint/><geom size="0.1"/></body>')
    assert load_robot(written(tmp_path, text)).base == "fixed"


def test_a_joint_that_follows_another_is_told(tmp_path: Path) -> None:
    text = ARM.replace(
        "<actuator>", '<equality><joint joint1="elbow" joint2="shoulder" polycoef="0 2 0 0 0"/></equality><actuator>'
    )
    robot = load_robot(written(tmp_path, text))
    assert robot.joint("elbow").follows == "shoulder"
    assert any(one.startswith("elbow follows shoulder (2 to 1)") for one in robot.remarks)


def test_a_loop_is_refused(tmp_path: Path) -> None:
    text = ARM.replace(
        "<actuator>", '<equality><connect name="rod" body1="hand" anchor="0 0 0"/></equality><actuator>'
    )
    message = refusal(written(tmp_path, text))
    assert "rod closes a loop (hand and world)" in message
    assert "take the constraint out" in message
    # The advice works.
    assert load_robot(written(tmp_path, text.replace("<connect", '<connect active="false"'))).joints


def test_a_weld_of_what_no_joint_moves_is_no_loop(tmp_path: Path) -> None:
    text = ARM.replace("<worldbody>", '<worldbody><body name="stand"><freejoint/><geom size="0.1"/></body>').replace(
        "<actuator>", '<equality><weld name="glue" body1="stand" body2="base"/></equality><actuator>'
    )
    assert any(one.startswith("glue is left out") for one in load_robot(written(tmp_path, text)).remarks)


def test_a_ball_joint_is_refused(tmp_path: Path) -> None:
    text = ARM.replace('<joint name="lift" type="slide" axis="0 0 1"/>', '<joint name="wrist" type="ball"/>')
    text = text[: text.index("<actuator>")] + "</mujoco>"
    assert "wrist is a ball joint" in refusal(written(tmp_path, text))


def test_tendons_and_what_drives_them_are_told(tmp_path: Path) -> None:
    text = ARM.replace(
        "<actuator>",
        '<tendon><fixed name="belt" stiffness="3"><joint joint="shoulder" coef="1"/><joint joint="elbow" coef="-1"/>'
        '</fixed></tendon><actuator><motor name="winch" tendon="belt"/>',
    )
    remarks = load_robot(written(tmp_path, text)).remarks
    assert "actuator winch drives no single joint: it's left out" in remarks
    assert any(one.startswith("tendon belt pulls at several joints") for one in remarks)


def test_a_description_without_gravity_is_told(tmp_path: Path) -> None:
    text = ARM.replace("<worldbody>", '<option gravity="0 0 0"/><worldbody>')
    assert any("no gravity" in one for one in load_robot(written(tmp_path, text)).remarks)


# --- URDF ---


def test_joints_of_a_urdf_are_read_with_their_limits(tmp_path: Path) -> None:
    robot = load_robot(written(tmp_path, URDF, "arm.urdf"))
    shoulder, elbow, lift = robot.joints
    assert (robot.name, robot.base) == ("urdf_arm", "fixed")
    assert (shoulder.name, shoulder.kind, shoulder.range) == ("shoulder", "hinge", (-2.0, 2.0))
    assert (shoulder.damping, shoulder.friction, shoulder.servo) == (0.5, 0.3, None)
    assert (shoulder.effort_limit, shoulder.velocity_limit) == (30.0, 3.0)
    assert (elbow.range, elbow.effort_limit, elbow.velocity_limit) == (None, 20.0, 4.0)
    assert (lift.kind, lift.range) == ("slide", (-0.1, 0.1))
    assert robot.links == ("base_link", "upper", "fore", "hand", "tool")
    assert robot.remarks == (missing_meshes(2),)
    assert float(robot.model.body("upper").mass[0]) == 1.0


def test_meshes_of_a_package_are_found_from_the_description_up(tmp_path: Path) -> None:
    obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    for name in ("upper", "fore"):
        written(tmp_path, obj, f"arm_description/meshes/{name}.obj")
    path = written(tmp_path, URDF.replace(".stl", ".obj"), "arm_description/urdf/arm.urdf")
    robot = load_robot(path)
    assert (robot.remarks, robot.model.nmesh) == ((), 2)
    # A mesh's volume adds no mass to what the description states.
    assert float(robot.model.body("upper").mass[0]) == 1.0


def test_a_urdf_joint_that_mimics_another_is_told(tmp_path: Path) -> None:
    text = URDF.replace('<limit effort="20" velocity="4"/>', '<mimic joint="shoulder" multiplier="-1"/>')
    assert load_robot(written(tmp_path, text, "arm.urdf")).joint("elbow").follows == "shoulder"


def test_inertias_that_no_body_has_and_links_without_mass_are_told(tmp_path: Path) -> None:
    text = URDF.replace('ixx="0.01" iyy="0.01" izz="0.002"', 'ixx="0.01" iyy="0.03" izz="0.002"', 1).replace(
        '<link name="hand"><inertial><origin xyz="0 0 0.1"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" '
        'izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>',
        '<link name="hand"/>',
    )
    remarks = load_robot(written(tmp_path, text, "arm.urdf")).remarks
    assert any(one.startswith("the inertia of upper is such as no body has") for one in remarks)
    assert any(one.startswith("hand: no mass is given") for one in remarks)


def test_inertias_that_arent_positive_are_taken_as_good_as_they_are(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    named = '<visual name="twice"><geometry><sphere radius="0.1"/></geometry></visual>'
    text = URDF.replace('ixx="0.01" iyy="0.01" izz="0.002" ixy="0"', 'ixx="0.01" iyy="0.01" izz="0" ixy="0"', 1)
    text = (
        text.replace('ixy="0"', 'ixy="0.03"')
        .replace('ixy="0.03"', 'ixy="0"', 1)
        .replace("</link>", f"{named}</link>")
    )
    robot = load_robot(written(tmp_path, text, "arm.urdf"))
    # A thin rod keeps its moments; what no body has is told.
    np.testing.assert_allclose(sorted(robot.model.body("upper").inertia), [1e-9, 0.01, 0.01])
    assert any(one.startswith("the inertia of fore, hand is such as no body has") for one in robot.remarks)
    assert capfd.readouterr() == ("", "")


def test_a_plate_whose_moments_are_rounded_keeps_them(tmp_path: Path) -> None:
    text = URDF.replace('ixx="0.01" iyy="0.01" izz="0.002"', 'ixx="0.0101" iyy="0.02" izz="0.03011"', 1)
    robot = load_robot(written(tmp_path, text, "arm.urdf"))
    np.testing.assert_allclose(sorted(robot.model.body("upper").inertia), [0.0101, 0.02, 0.0301], rtol=1e-3)
    assert robot.remarks == (missing_meshes(2),)


def test_xacro_is_refused_with_the_command_that_expands_it(tmp_path: Path) -> None:
    text = URDF.replace('<link name="base_link"/>', '<xacro:include filename="a.xacro"/><link name="base_link"/>')
    text = text.replace('<robot name="urdf_arm">', '<robot name="urdf_arm" xmlns:xacro="http://ros.org/wiki/xacro">')
    assert "xacro arm.urdf -o robot.urdf" in refusal(written(tmp_path, text, "arm.urdf"))


# --- which files are robots ---


@pytest.mark.parametrize(
    ("text", "name", "expected"),
    [
        (ARM, "arm.xml", True),
        (URDF, "arm.urdf", True),
        (URDF, "arm.txt", True),
        ('format = "chladni.robot/1"\ndescription = "arm.urdf"\n', "arm.toml", True),
        ('format = "chladni.model/1"\n', "arm.toml", False),
        ("<html><robot/></html>", "page.xml", False),
        ("time,force\n1,2\n", "log.csv", False),
        ("", "empty.xml", False),
        ("<!-- <mujoco> --><sdf/>", "a.sdf", False),
    ],
)
def test_a_robot_is_told_by_its_content(tmp_path: Path, text: str, name: str, expected: bool) -> None:
    assert is_robot_file(written(tmp_path, text, name)) is expected


def test_what_is_no_description_is_refused(tmp_path: Path) -> None:
    assert "neither MJCF (<mujoco>) nor URDF (<robot>)" in refusal(written(tmp_path, "<sdf/>", "a.sdf"))
    assert "no such file" in refusal(tmp_path / "gone.xml")


def test_without_mujoco_one_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    assert "pip install 'chladni[mujoco]'" in refusal(written(tmp_path, ARM))


# --- hostile ---


def test_entities_are_refused_before_they_expand(tmp_path: Path) -> None:
    bomb = '<!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;&b;&b;">]>' + ARM.replace("arm", "&c;", 1)
    assert refusal(written(tmp_path, bomb)).endswith("take <!DOCTYPE ...> out")
    outside = '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hostname">]>' + URDF.split("?>", 1)[1]
    assert ":1: declares a document type" in refusal(written(tmp_path, outside, "arm.urdf"))


def test_broken_xml_is_told_with_its_line(tmp_path: Path) -> None:
    assert refusal(written(tmp_path, "<mujoco>\n<worldbody>\n</mujoco>")).endswith(
        "arm.xml:3: not XML: mismatched tag"
    )


@pytest.mark.parametrize("tag", ["body", "default"])
def test_deep_nesting_is_refused(tmp_path: Path, tag: str) -> None:
    text = f"<mujoco><worldbody>{f'<{tag}>' * 5000}{f'</{tag}>' * 5000}</worldbody></mujoco>"
    assert "nested deeper than 200" in refusal(written(tmp_path, text))


def test_a_huge_file_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, "<mujoco>")
    with path.open("r+b") as file:
        file.truncate(1 << 34)
    assert "is larger than" in refusal(path)


@pytest.mark.parametrize("name", ["/etc/hostname", "../outside.xml", "a/../../outside.xml", "link.xml", "\0", ""])
def test_includes_from_elsewhere_are_refused(tmp_path: Path, name: str) -> None:
    written(tmp_path, ARM, "outside.xml")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link.xml").symlink_to(tmp_path / "outside.xml")
    text = f'<mujoco><include file="{name}"/></mujoco>'.replace("\0", "&#x1;")
    message = refusal(written(tmp_path, text, "in/arm.xml"))
    assert "hostname" not in message or "outside of its folder" in message


def test_a_file_that_includes_itself_or_another_twice_is_refused(tmp_path: Path) -> None:
    assert "twice" in refusal(written(tmp_path, '<mujoco><include file="arm.xml"/></mujoco>'))
    written(tmp_path, '<mujoco><include file="arm.xml"/></mujoco>', "b.xml")
    assert "twice" in refusal(written(tmp_path, '<mujoco><include file="b.xml"/></mujoco>'))


def test_what_would_take_any_memory_is_left_out_or_refused(tmp_path: Path) -> None:
    body = '<replicate count="99999999" offset="1 0 0"><body><geom size="0.1"/></body></replicate>'
    assert "at most 1000 copies" in refusal(written(tmp_path, ARM.replace("<worldbody>", f"<worldbody>{body}")))
    huge = ARM.replace(
        "<worldbody>",
        '<size memory="900G"/><asset><texture name="t" type="2d" builtin="flat" width="99999" height="99999"/>'
        '<hfield name="h" nrow="99999" ncol="99999" size="1 1 1 1"/></asset><worldbody><geom type="hfield" '
        'hfield="h"/><body><flexcomp name="f" type="grid" count="999 999 999" spacing="1 1 1"/></body>',
    )
    robot = load_robot(written(tmp_path, huge))
    assert (robot.model.ntex, robot.model.nhfield, robot.model.nflex) == (0, 0, 0)


@pytest.mark.parametrize("number", ["nan", "inf", "1e400", "-1", "word"])
def test_numbers_that_are_none_are_refused_in_one_line(
    tmp_path: Path, number: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert refusal(written(tmp_path, URDF.replace('mass value="1"', f'mass value="{number}"'), "arm.urdf"))
    assert refusal(written(tmp_path, ARM.replace('mass="2"', f'mass="{number}"')))
    # MuJoCo would leave its warnings in the current folder.
    assert {one.name for one in tmp_path.iterdir()} == {"arm.urdf", "arm.xml"}


@pytest.mark.parametrize("number", ["nan", "word", ""])
def test_a_velocity_limit_that_is_none_is_refused(tmp_path: Path, number: str) -> None:
    text = URDF.replace('velocity="3"', f'velocity="{number}"')
    assert "velocity" in refusal(written(tmp_path, text, "arm.urdf"))


def test_a_model_that_attaches_others_is_refused(tmp_path: Path) -> None:
    text = ARM.replace("<worldbody>", '<asset><model name="x" file="/etc/hostname"/></asset><worldbody>')
    assert "to_xml()" in refusal(written(tmp_path, text))


@pytest.mark.parametrize(("tag", "name"), [("joint", "turn"), ("link", "arm")])
def test_names_that_stand_twice_in_a_urdf_are_refused(tmp_path: Path, tag: str, name: str) -> None:
    # MuJoCo keeps the first and makes the second nameless, so that a log would be read for the wrong axis.
    text = (
        '<robot name="r"><link name="base"/><link name="arm"/><link name="fore"/>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="arm"/></joint>'
        '<joint name="bend" type="revolute"><parent link="arm"/><child link="fore"/></joint></robot>'
    )
    other = {"joint": "bend", "link": "fore"}[tag]
    doubled = text.replace(f'<{tag} name="{other}"', f'<{tag} name="{name}"')
    assert f"two {tag}s are called '{name}'" in refusal(written(tmp_path, doubled, "a.urdf"))
