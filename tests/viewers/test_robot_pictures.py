"""A robot's diagnosis in figures, in the report and in a .rrd file, read back."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr

from chladni.apps.gap_evidence import gap_evidence
from chladni.apps.robot_scene import robot_scene
from chladni.gap.records.diagnosis import Diagnosis
from chladni.gap.robots.diagnose import diagnose_robot
from chladni.viewers.figures.gap import gap_album
from chladni.viewers.figures.gap_sheet import gap_sheet
from chladni.viewers.figures.robot import torque_map_figures
from chladni.viewers.report.gap import gap_report_html
from chladni.viewers.rerun.gap import write_gap_rrd
from chladni.viewers.robot_scene import RobotScene
from tests.robots.machines import arm, commands, joint_log_of, run_native
from tests.viewers.headless import headless_viewer
from tests.viewers.rrd import Contents
from tests.viewers.test_rerun_pictures import HAS_VULKAN

pytest.importorskip("mujoco")

SECONDS = 12.0


@pytest.fixture(autouse=True)
def strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """Of an arm whose shoulder rubs."""
    folder = tmp_path_factory.mktemp("arm")
    command = commands(SECONDS)
    position = run_native(arm(folder, "machine/arm.xml", shoulder=' frictionloss="2"'), command)
    robot = arm(folder)
    return diagnose_robot(robot, joint_log_of(robot, position, command=command))


@pytest.fixture(scope="module")
def scene(found: Diagnosis) -> RobotScene:
    one = robot_scene(found)
    assert one is not None
    return one


@pytest.fixture(scope="module")
def file(found: Diagnosis, scene: RobotScene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_gap_rrd(gap_evidence(found), tmp_path_factory.mktemp("rrd") / "gap.rrd", scene=scene)


@pytest.fixture(scope="module")
def contents(file: Path) -> Contents:
    return Contents(file)


@pytest.mark.parametrize("what", ["measured", "before", "after"])
def test_links_move_as_the_kinematics_say(contents: Contents, scene: RobotScene, what: str) -> None:
    poses = getattr(scene, what)
    for link in range(poses.place.shape[1]):
        moved = np.array(contents.column(f"/robot/{what}/{link + 1}", "Transform3D:translation"))[:, 0]
        np.testing.assert_allclose(moved, poses.place[:, link], atol=1e-6)
    times = contents.times(f"/robot/{what}/1", "time")
    np.testing.assert_allclose(times / 1e9, scene.time_s, atol=1e-9)


def test_ghosts_let_the_measured_robot_through_and_have_the_colours_of_before_and_after(contents: Contents) -> None:
    colours = {}
    for what in ("measured", "before", "after"):
        (shape, *_) = (one for one in sorted(contents.entities()) if one.startswith(f"/robot/{what}/1/ellipsoid"))
        colours[what] = contents.static(shape)["Ellipsoids3D:colors"][0]
    assert colours["measured"] & 255 == 255
    assert all(colours[what] & 255 < 128 for what in ("before", "after"))
    red, blue = (colours[what] >> 24 for what in ("before", "after"))
    assert red > blue


def test_joints_have_their_shares_as_names_and_colours(contents: Contents) -> None:
    shoulder = contents.static("/robot/measured/1/joint_1")
    assert shoulder["Cylinders3D:labels"] == ["shoulder 100 %"]
    # The most missing is orange.
    assert shoulder["Cylinders3D:colors"][0] >> 8 == 250 << 16 | 90 << 8 | 40


def test_a_joint_that_nothing_is_known_of_is_grey(scene: RobotScene, found: Diagnosis, tmp_path: Path) -> None:
    blank = replace(scene, share=np.full(len(scene.joints), np.nan))
    one = Contents(write_gap_rrd(gap_evidence(found), tmp_path / "gap.rrd", scene=blank))
    disc = one.static("/robot/measured/1/joint_1")
    assert disc["Cylinders3D:labels"] == ["shoulder"]
    assert disc["Cylinders3D:colors"][0] >> 8 == 105 << 16 | 105 << 8 | 105


def test_the_robot_is_hidden_where_the_log_has_a_gap(scene: RobotScene, found: Diagnosis, tmp_path: Path) -> None:
    time_s = np.where(np.arange(scene.time_s.size) <= 100, scene.time_s, scene.time_s + 3.0)
    cut = replace(scene, time_s=time_s, gaps=(100,))
    one = Contents(write_gap_rrd(gap_evidence(found), tmp_path / "gap.rrd", scene=cut))
    sizes = np.array(one.column("/robot/measured", "Transform3D:scale"))[:, 0, 0]
    assert sizes.tolist() == [1.0, 0.0, 1.0]
    times = one.times("/robot/measured", "time") / 1e9
    np.testing.assert_allclose(times, [time_s[0], time_s[100] + 1e-3, time_s[101]], atol=1e-6)


def test_positions_and_torques_are_on_the_time_of_the_log(contents: Contents, found: Diagnosis) -> None:
    motion, signals = found.motion, found.signals
    assert motion is not None
    assert signals is not None
    np.testing.assert_allclose(contents.scalars("/positions/1/0")[:, 0], motion.measured[0])
    np.testing.assert_allclose(contents.times("/errors/1/0", "time") / 1e9, signals.seconds, atol=1e-9)


def test_every_joint_has_its_maps(contents: Contents) -> None:
    for over in ("velocity", "position"):
        for place in (1, 2):
            samples = contents.static(f"/torque/{over}/{place}/samples")
            assert 0 < len(samples["Points2D:positions"]) == len(samples["Points2D:colors"]) <= 3000
    assert "/torque/velocity/1/law" in contents.entities()


def test_a_long_log_makes_no_large_file(file: Path) -> None:
    # Twelve seconds, three robots of two links; a hundred bytes a row.
    assert file.stat().st_size < 2_000_000


@pytest.mark.nightly
@pytest.mark.skipif(not HAS_VULKAN, reason="no Vulkan driver to draw with")
def test_the_viewer_shows_all_pages_without_complaint(file: Path) -> None:
    with headless_viewer(file) as viewer:
        for page in ("Robot", "Torque residuals", "Friction", "Torque over position"):
            viewer.show(page)
            assert viewer.picture()
        assert {view.name for view in viewer.views()} >= {"shoulder [N m]", "elbow [N m]"}
        assert viewer.complaints() == []


def test_figures_are_the_residuals_first_and_a_map_for_each_joint(found: Diagnosis) -> None:
    album = gap_album(gap_evidence(found))
    assert next(iter(album.sections)) == "residuals"
    assert not album.sections["errors"]
    (residual,) = album.sections["residuals"].values()
    assert [one.get_title(loc="left").split()[0] for one in residual.axes] == ["shoulder", "elbow"]
    (friction,) = album.sections["friction"].values()
    shoulder = next(one for one in friction.axes if one.get_title(loc="left") == "shoulder")
    assert {one.get_label() for one in shoulder.lines} >= {"found", "described"}
    assert set(album.sections["motion"]) == {"position error"}
    for name in ("torque residual", "friction", "torque over position", "position error"):
        assert album.rendered(name, "png").startswith(b"\x89PNG")


def test_many_joints_share_a_sheet_and_more_have_several(found: Diagnosis) -> None:
    for count, figures in ((12, 1), (13, 2)):
        maps = tuple(replace(found.torque_maps[0], site=f"joint_{place}") for place in range(count))
        album = gap_album(gap_evidence(replace(found, torque_maps=maps)))
        assert len(album.sections["friction"]) == figures


def test_the_report_begins_with_the_torque_that_is_missing(found: Diagnosis) -> None:
    page = gap_report_html(gap_evidence(found), interactive=False)
    assert "creep_speed" not in page
    assert page.index("Torque that is missing") < page.index("Answer")
    assert page.index("<img") < page.index("Answer")


def test_nothing_of_a_robot_is_drawn_of_a_model(found: Diagnosis) -> None:
    model = replace(found, motion=None, torque_maps=(), machine=None)
    album = gap_album(gap_evidence(model))
    assert not any(album.sections[name] for name in ("residuals", "friction", "positions", "motion"))
    assert robot_scene(model) is None


def test_a_robot_that_no_simulation_holds_is_drawn_as_measured(found: Diagnosis, tmp_path: Path) -> None:
    assert found.motion is not None
    alone = replace(found, motion=replace(found.motion, before=None, after=None, horizon_s=None))
    one: Any = Contents(write_gap_rrd(gap_evidence(alone), tmp_path / "gap.rrd", scene=robot_scene(alone)))
    assert not any(entity.startswith(("/robot/before", "/robot/after")) for entity in one.entities())
    assert "Measured; no simulation holds" in one.view_names()
    assert not gap_album(gap_evidence(alone)).sections["motion"]


def test_errors_that_are_left_out_since_they_hide_others_are_told(found: Diagnosis) -> None:
    assert found.motion is not None
    astray = replace(found, motion=replace(found.motion, before=None))
    (figure,) = gap_album(gap_evidence(astray)).sections["motion"].values()
    (legend,) = figure.legends
    assert [one.get_text() for one in legend.get_texts()] == [
        "error before: more than the motion itself", "error after"
    ]  # fmt: skip


def test_a_sheet_says_all_that_was_found_of_a_robot(found: Diagnosis) -> None:
    rubs = found.causes[0]
    joints = tuple(
        replace(rubs, site=f"joint_{place}", group=(f"joint_{place}",), parameters={
            name: replace(one, value=one.value * 2**place) for name, one in rubs.parameters.items()
        })
        for place in range(6)
    )  # fmt: skip
    title = gap_sheet(gap_evidence(replace(found, causes=joints))).get_suptitle().replace("\n", " ")
    for one in joints:
        assert f"{one.site} " in title
    assert "bring" in title


@pytest.mark.parametrize(
    ("site", "ratio", "told"),
    [
        ("joint_5~joint_6", 1.0, "velocity of joint_5 + joint_6"),
        ("joint_5~joint_6", -0.5, "joint_5 − 0.5 × joint_6"),
        ("left_shoulder_pitch~left_shoulder_roll", 2.0, "velocity of 1st + 2 × 2nd"),
    ],
)
def test_a_pair_says_which_sum_of_two_motions_it_is_drawn_over(
    found: Diagnosis, site: str, ratio: float, told: str
) -> None:
    pair = replace(next(one for one in found.torque_maps if one.over == "velocity"), site=site, ratio=ratio)
    [figure] = torque_map_figures(gap_evidence(replace(found, torque_maps=(pair,))), "velocity").values()
    assert figure.axes[0].get_xlabel() == f"{told} [rad/s]"
