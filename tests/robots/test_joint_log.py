"""Joints of a log: matched by name, on the grid of the states, with commands that are held."""

from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni import LogError
from chladni.robots.joint_log import JointLog, joint_log
from tests.make_logs import IMU, JOINT_STATE, START_NS, LogMaker, header, imu, joint_state
from tests.robots.made import ARM, JOINTS, JointTopic, motion, write_joints, written

pytest.importorskip("mujoco")

RATE_HZ = 250.0
DELAY_S = 0.02
ARRAY = """std_msgs/MultiArrayLayout layout
float64[] data
================================================================================
MSG: std_msgs/MultiArrayLayout
std_msgs/MultiArrayDimension[] dim
uint32 data_offset
================================================================================
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride
"""
TRAJECTORY = """std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
================================================================================
MSG: builtin_interfaces/Duration
int32 sec
uint32 nanosec
"""


def states(**changes) -> JointTopic:
    position = changes.pop("position", motion(4, RATE_HZ, delay_s=DELAY_S))
    return JointTopic(changes.pop("topic", "/joint_states"), position, rate_hz=RATE_HZ, **changes)


def commands(rate_hz: float = RATE_HZ, **changes) -> JointTopic:
    position = changes.pop("position", motion(4, rate_hz))
    return JointTopic(changes.pop("topic", "/joint_commands"), position, rate_hz=rate_hz, **changes)


def matched(folder: Path, topics, *, robot_file: str = "", text: str = ARM, **options) -> JointLog:
    """Match the arm with a log of these topics, or with the log at a path."""
    written(folder, text)
    robot = folder / "arm.xml"
    if robot_file:
        head = 'format = "chladni.robot/1"\ndescription = "arm.xml"\n'
        robot = written(folder, head + robot_file, "arm.toml")
    path = topics if isinstance(topics, Path) else write_joints(folder / "log.mcap", topics)
    with chladni.open(path) as log:
        return joint_log(chladni.load_robot(robot), log, **options)


def told(log: JointLog) -> str:
    return "\n".join(log.remarks)


# --- names ---


def test_states_and_commands_on_one_grid_are_given_as_they_are(tmp_path: Path) -> None:
    effort = motion(4, RATE_HZ) * 3
    found = matched(tmp_path, [states(velocity=effort / 2, effort=effort), commands()])
    assert (found.log, found.joints, found.sample_rate_hz) == ("log.mcap", JOINTS, RATE_HZ)
    assert (found.start_time_ns, found.breaks) == (START_NS, ())
    assert (found.state_topic, found.command_topic) == ("/joint_states", "/joint_commands")
    assert (found.command_kind, found.command_rate_hz, found.effort_kind) == ("position", RATE_HZ, "measured")
    np.testing.assert_array_equal(found.position, motion(4, RATE_HZ, delay_s=DELAY_S))
    np.testing.assert_array_equal(found.command, motion(4, RATE_HZ))
    np.testing.assert_array_equal(found.velocity, effort / 2)
    np.testing.assert_array_equal(found.effort, effort)
    np.testing.assert_allclose(found.time_s, np.arange(1000) / RATE_HZ)
    assert (found.unmatched, found.unknown, found.remarks, found.damage) == ((), (), (), ())


def test_joints_are_matched_by_name_in_the_robots_order(tmp_path: Path) -> None:
    order = [2, 0, 1]
    names = [JOINTS[place] for place in order]
    position = motion(4, RATE_HZ, delay_s=DELAY_S)
    found = matched(tmp_path, [states(position=position[order], names=names), commands()])
    np.testing.assert_array_equal(found.position, position)


def test_names_that_change_their_order_are_told_and_read_by_name(tmp_path: Path) -> None:
    position = motion(4, RATE_HZ, delay_s=DELAY_S)
    swapped, names = position.copy(), [list(JOINTS)] * 1000
    swapped[:2, 1::2] = position[1::-1, 1::2]
    names[1::2] = [[JOINTS[1], JOINTS[0], JOINTS[2]]] * 500
    found = matched(tmp_path, [states(position=swapped, names=names), commands()])
    np.testing.assert_array_equal(found.position, position)
    assert "/joint_states: messages name joints in 2 ways" in told(found)


def test_joints_that_one_side_lacks_are_told(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(names=["shoulder", "elbo", "gripper"])])
    assert (found.joints, found.unmatched, found.unknown) == (("shoulder",), ("elbow", "lift"), ("elbo", "gripper"))


def test_a_log_of_another_robot_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"names no joint of arm, but a, b, c; .*rename"):
        matched(tmp_path, [states(names=["a", "b", "c"])])


def test_messages_without_names_are_refused_with_a_remedy_that_works(tmp_path: Path) -> None:
    topics = [states(names=[[]] * 1000)]
    with pytest.raises(LogError, match=r"don't name their joints.*state = \"/joint_states\""):
        matched(tmp_path, topics)
    remedy = '[log]\nstate = "/joint_states"\nnames = ["shoulder", "elbow", "lift"]\n'
    assert matched(tmp_path, topics, robot_file=remedy).joints == JOINTS


def test_a_name_that_stands_twice_is_left_out_and_told(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(names=["shoulder", "elbow", "elbow"])])
    assert found.joints == ("shoulder",)
    assert "elbow stands twice in a message" in told(found)


def test_a_log_without_joints_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "numbers.csv"
    path.write_text("t,a\n" + "\n".join(f"{place / 100},{place % 7}" for place in range(100)))
    with pytest.raises(LogError, match="record sensor_msgs/JointState"):
        matched(tmp_path, path)


# --- which is which ---


def test_of_topics_whose_names_say_nothing_the_later_is_the_state(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(topic="/a"), commands(topic="/b")])
    assert (found.state_topic, found.command_topic) == ("/a", "/b")
    assert "/a is taken as the state: it follows /b by 20 ms" in told(found)


def test_topics_that_move_together_are_refused_and_can_be_named(tmp_path: Path) -> None:
    topics = [states(topic="/a"), commands(topic="/b", position=motion(4, RATE_HZ, delay_s=DELAY_S))]
    with pytest.raises(LogError, match="/a and /b move together"):
        matched(tmp_path, topics)
    found = matched(tmp_path, topics, state="/b", command="/a")
    assert (found.state_topic, found.command_topic) == ("/b", "/a")


def test_a_second_topic_of_states_is_no_command(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(), states(topic="/measured/joint_states")])
    assert (found.state_topic, found.command_topic, found.command) == ("/joint_states", None, None)
    assert "/measured/joint_states tell of the same joints as the state; not used" in told(found)


def test_a_copy_of_the_states_is_no_command(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(), states(topic="/copy")])
    assert found.command_topic is None
    assert "/copy tells of the same joints, and the state doesn't follow it" in told(found)


def test_commands_alone_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="nothing tells what was measured"):
        matched(tmp_path, [commands()])


def test_states_without_names_beside_commands_are_told_as_such(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"/joint_states don't name their joints"):
        matched(tmp_path, [states(names=[[]] * 1000), commands()])


def test_commands_of_other_names_are_told(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(), commands(names=["a", "b", "c"])])
    assert found.command is None
    assert "/joint_commands names no joint of arm, but a, b, c" in told(found)


def test_efforts_that_states_and_commands_share_are_told(tmp_path: Path) -> None:
    effort = motion(4, RATE_HZ)
    found = matched(tmp_path, [states(effort=effort), commands(effort=effort)])
    assert "/joint_states and /joint_commands hold the same efforts" in told(found)
    found = matched(tmp_path, [states(effort=effort), commands(effort=2 * effort)])
    assert "the same efforts" not in told(found)


def test_a_topic_that_isnt_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="did you mean /joint_states"):
        matched(tmp_path, [states()], state="/joint_state")


def test_the_robot_file_names_the_topics(tmp_path: Path) -> None:
    topics = [states(topic="/a"), commands(topic="/b"), commands(topic="/c_command")]
    found = matched(tmp_path, topics, robot_file='[log]\nstate = "/a"\ncommand = "/b"\n')
    assert (found.state_topic, found.command_topic) == ("/a", "/b")


# --- times ---


def test_slow_commands_are_held_between_their_messages(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(), commands(50.0)])
    np.testing.assert_array_equal(found.command, np.repeat(motion(4, 50.0), 5, axis=1))
    assert found.command_rate_hz == pytest.approx(50.0)
    assert "commands come at 50 Hz, states at 250 Hz: each command is held until the next" in told(found)


@pytest.mark.parametrize(("offset_s", "shift"), [(0.002, 1), (-0.002, 0)])
def test_commands_stamped_two_milliseconds_apart_count_from_their_stamps(
    tmp_path: Path, offset_s: float, shift: int
) -> None:
    found = matched(tmp_path, [states(), commands(offset_s=offset_s)])
    wanted = motion(4, RATE_HZ)
    # A sample of the states sees the last command that was stamped before it.
    np.testing.assert_array_equal(found.command, wanted[:, : 1000 - shift])
    np.testing.assert_array_equal(found.position, motion(4, RATE_HZ, delay_s=DELAY_S)[:, shift:])
    assert f"2 ms {'after' if shift else 'before'} the states' samples" in told(found)


def test_rare_commands_are_held_from_their_own_stamps(tmp_path: Path) -> None:
    times_s = np.array([0.0, 0.5013, 1.7, 1.9001, 3.3])
    steps = np.arange(15.0).reshape(3, 5) / 10
    found = matched(tmp_path, [states(), commands(position=steps, times_s=times_s)])
    place = np.searchsorted(times_s, found.time_s + 1e-9, side="right") - 1
    np.testing.assert_array_equal(found.command, steps[:, place])
    assert found.command_rate_hz is None
    assert "5 commands at no fixed rate" in told(found)


def test_commands_that_begin_late_and_end_early_are_told(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(), commands(position=motion(2, RATE_HZ), offset_s=1.0)])
    assert found.position.shape == (3, 500)
    assert found.time_s[0] == pytest.approx(1.0)
    np.testing.assert_array_equal(found.command, motion(2, RATE_HZ))
    assert "commands begin 1 s after the states: that part is left out" in told(found)
    assert "commands end 1 s before the states: that part is left out" in told(found)


def test_commands_of_another_time_are_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="no time in common"):
        matched(tmp_path, [states(), commands(offset_s=20.0)])


def test_gaps_are_not_bridged(tmp_path: Path) -> None:
    kept = np.r_[0:400, 450:1000]
    position = motion(4, RATE_HZ, delay_s=DELAY_S)[:, kept]
    found = matched(tmp_path, [states(position=position, times_s=kept / RATE_HZ), commands()])
    assert found.breaks == (400,)
    np.testing.assert_array_equal(found.position, position)
    np.testing.assert_array_equal(found.command, motion(4, RATE_HZ)[:, kept])
    np.testing.assert_allclose(found.time_s, kept / RATE_HZ)


def test_a_window_of_time_is_read(tmp_path: Path) -> None:
    found = matched(tmp_path, [states(), commands()], start_s=1.0, end_s=2.0)
    np.testing.assert_array_equal(found.position, motion(4, RATE_HZ, delay_s=DELAY_S)[:, 250:500])
    assert found.start_time_ns == START_NS + 10**9


# --- values ---


def test_positions_alone_are_enough(tmp_path: Path) -> None:
    found = matched(tmp_path, [states()])
    assert (found.velocity, found.effort, found.effort_kind, found.command, found.command_kind) == (None,) * 5


def test_a_joint_whose_position_is_no_number_is_left_out(tmp_path: Path) -> None:
    position = motion(4, RATE_HZ, delay_s=DELAY_S)
    position[1] = np.nan
    found = matched(tmp_path, [states(position=position), commands()])
    assert (found.joints, found.unmatched) == (("shoulder", "lift"), ("elbow",))
    assert "elbow: position is mostly no number; left out" in told(found)
    np.testing.assert_array_equal(found.command, motion(4, RATE_HZ)[[0, 2]])


def test_single_samples_that_are_no_numbers_are_gaps(tmp_path: Path) -> None:
    position = motion(4, RATE_HZ, delay_s=DELAY_S)
    position[1, 100:110] = np.nan
    found = matched(tmp_path, [states(position=position)])
    assert found.breaks == (100,)
    assert np.isfinite(found.position).all()


@pytest.mark.parametrize("nothing", [0.0, np.nan])
def test_fields_that_nobody_fills_count_as_absent(tmp_path: Path, nothing: float) -> None:
    empty = np.full((3, 1000), nothing)
    found = matched(tmp_path, [states(velocity=empty, effort=empty)])
    assert (found.velocity, found.effort) == (None, None)
    assert np.isnan(nothing) or "/joint_states: velocity is 0 throughout" in told(found)


def test_currents_become_efforts_by_the_robot_files_constants(tmp_path: Path) -> None:
    current = motion(4, RATE_HZ)
    control = '[log]\neffort = "current"\ntorque_constant = { default = 2.0, elbow = 3.0 }\n'
    found = matched(tmp_path, [states(effort=current)], robot_file=control)
    np.testing.assert_allclose(found.effort, current * [[2.0], [3.0], [2.0]])
    assert found.effort_kind == "current"
    found = matched(tmp_path, [states(effort=current)], robot_file='[log]\neffort = "current"\n')
    assert found.effort is None
    assert "current without a torque_constant" in told(found)
    assert matched(tmp_path, [states(effort=current)], robot_file='[log]\neffort = "none"\n').effort is None


def test_degrees_are_refused_with_a_remedy_that_works(tmp_path: Path) -> None:
    position = motion(4, RATE_HZ, delay_s=DELAY_S)
    path = write_joints(tmp_path / "degrees.mcap", [states(position=np.degrees(position))])
    with pytest.raises(LogError, match=r"if that is in degrees.*path = \"/joint_states.position\[0\]\""):
        matched(tmp_path, path)
    rows = "".join(f'[[channel]]\npath = "/joint_states.position[{row}]"\nunit = "deg"\n' for row in range(3))
    setup = written(tmp_path, f'format = "chladni.setup/1"\n{rows}', "setup.toml")
    with chladni.open(path, setup=setup) as log:
        found = joint_log(chladni.load_robot(tmp_path / "arm.xml"), log)
    np.testing.assert_allclose(found.position, position, atol=1e-9)


def test_angles_that_leap_by_a_turn_run_on(tmp_path: Path) -> None:
    turning = np.arange(1000) / RATE_HZ * 6
    position = np.stack([turning, np.zeros(1000), np.zeros(1000)])
    wrapped = np.angle(np.exp(1j * position))
    text = ARM.replace('range="-2 2" limited="true"', "")
    found = matched(tmp_path, [states(position=wrapped), commands(position=np.roll(wrapped, -2, axis=1))], text=text)
    np.testing.assert_allclose(np.diff(found.position[0]), 6 / RATE_HZ)
    assert np.abs(found.command[0, :-2] - found.position[0, :-2]).max() < 0.1
    assert "shoulder: angles leap by a turn; made to run on" in told(found)


# --- other messages ---


def with_commands(path: Path, topic: str, kind: str, definition: str, message) -> Path:
    """A log of states, and of commands of another type at 50 Hz."""
    measured, wanted = motion(4, RATE_HZ, delay_s=DELAY_S), motion(4, 50.0)
    with LogMaker(path) as log:
        state = log.ros2("/joint_states", "sensor_msgs/msg/JointState", JOINT_STATE)
        command = log.ros2(topic, kind, definition)
        for place in range(1000):
            stamp_ns = START_NS + place * 4_000_000
            if place % 5 == 0:
                log.write(command, message(stamp_ns, wanted[:, place // 5].tolist()), stamp_ns)
            log.write(state, joint_state(stamp_ns, JOINTS, measured[:, place].tolist()), stamp_ns)
    return path


def point(positions: list[float]) -> dict:
    return {
        "positions": positions,
        "velocities": [],
        "accelerations": [],
        "effort": [],
        "time_from_start": {"sec": 0, "nanosec": 0},
    }


def test_the_first_point_of_a_trajectory_is_the_command(tmp_path: Path) -> None:
    def message(stamp_ns: int, wanted: list[float]) -> dict:
        points = [point(wanted[::-1]), point([9.0, 9.0, 9.0])]
        return {"header": header(stamp_ns), "joint_names": list(JOINTS[::-1]), "points": points}

    path = with_commands(tmp_path / "log.mcap", "/go", "trajectory_msgs/msg/JointTrajectory", TRAJECTORY, message)
    found = matched(tmp_path, path)
    assert (found.command_topic, found.command_kind) == ("/go", "position")
    np.testing.assert_array_equal(found.command, np.repeat(motion(4, 50.0), 5, axis=1))


def test_an_array_of_commands_needs_names_from_the_robot_file(tmp_path: Path) -> None:
    def message(_: int, wanted: list[float]) -> dict:
        return {"layout": {"dim": [], "data_offset": 0}, "data": wanted[::-1]}

    kind = "std_msgs/msg/Float64MultiArray"
    path = with_commands(tmp_path / "log.mcap", "/position_controller/commands", kind, ARRAY, message)
    found = matched(tmp_path, path)
    assert found.command is None
    assert 'a robot file that has command = "/position_controller/commands"' in told(found)
    names = '[log]\ncommand = "/position_controller/commands"\nnames = ["lift", "elbow", "shoulder"]\n'
    found = matched(tmp_path, path, robot_file=names)
    assert found.command_kind == "position"
    np.testing.assert_array_equal(found.command, np.repeat(motion(4, 50.0), 5, axis=1))
    found = matched(tmp_path, path, robot_file=names + 'command_kind = "effort"\n')
    assert found.command_kind == "effort"


# --- the base ---


def with_imu(folder: Path, topics=("/imu",), span_s=(0.0, 4.0), upright=9.81) -> Path:
    """A log of states at 250 Hz, and of an IMU at the same times, or for a part, that turns and is level."""
    position = motion(4, RATE_HZ)
    with LogMaker(folder / "imu.mcap") as log:
        state = log.ros2("/joint_states", "sensor_msgs/msg/JointState", JOINT_STATE)
        sensors = [log.ros2(topic, "sensor_msgs/msg/Imu", IMU) for topic in topics]
        for place in range(1000):
            stamp_ns = START_NS + place * 4_000_000
            log.write(state, joint_state(stamp_ns, JOINTS, position[:, place].tolist()), stamp_ns)
            there = span_s[0] <= place / RATE_HZ < span_s[1]
            for sensor in sensors if there else ():
                log.write(sensor, imu(stamp_ns, (0, 0, upright), (place / 1000, 0, 0)), stamp_ns)
    return folder / "imu.mcap"


AFLOAT = ARM.replace('<body name="base">', '<body name="base"><freejoint/><site name="imu_link"/>')


def test_the_only_imu_is_that_of_a_base_that_floats(tmp_path: Path) -> None:
    found = matched(tmp_path, with_imu(tmp_path), text=AFLOAT)
    assert (found.imu.topic, found.imu.site, found.imu.orientation) == ("/imu", "imu_link", None)
    np.testing.assert_array_equal(found.imu.angular_velocity[0], np.arange(1000) / 1000)
    np.testing.assert_array_equal(found.imu.linear_acceleration[2], np.full(1000, 9.81))
    assert "/imu is taken as the IMU of the base, at imu_link" in told(found)


def test_joints_count_where_a_base_that_floats_has_its_imu(tmp_path: Path) -> None:
    found = matched(tmp_path, with_imu(tmp_path, span_s=(0.4, 3.0)), text=AFLOAT)
    assert found.time_s[0] == pytest.approx(0.4)
    assert found.time_s[-1] == pytest.approx(2.996)
    assert found.position.shape[1] == found.imu.angular_velocity.shape[1] == found.imu.there.sum()
    assert "samples of /imu begin 0.4 s after the states" in told(found)
    assert "samples of /imu end 1 s before the states" in told(found)
    with pytest.raises(LogError, match="states and /imu have no time in common; record them together"):
        matched(tmp_path, with_imu(tmp_path, span_s=(2.5, 4.0)), text=AFLOAT, end_s=2.0)
    # A base that is fixed needs none.
    names = '[log]\nimu = { topic = "/imu", site = "hand" }\n'
    assert matched(tmp_path, with_imu(tmp_path, span_s=(0.4, 3.0)), robot_file=names).time_s[0] == 0.0


def test_the_robot_file_names_the_imu(tmp_path: Path) -> None:
    names = '[log]\nimu = { topic = "/imu", site = "hand" }\n'
    assert matched(tmp_path, with_imu(tmp_path), robot_file=names).imu.site == "hand"
    assert matched(tmp_path, with_imu(tmp_path)).imu is None
    with pytest.raises(LogError, match=r"no topic '/imu2'.*did you mean /imu"):
        matched(tmp_path, with_imu(tmp_path), robot_file=names.replace("/imu", "/imu2"))


def test_an_accelerometer_in_g_is_told_with_a_remedy_that_works(tmp_path: Path) -> None:
    log = with_imu(tmp_path, upright=1.0)
    found = matched(tmp_path, log, text=AFLOAT)
    assert (
        'if that is in g, say so in a setup file (--setup): [[channel]] path = "/imu.linear_acceleration.x"'
        in told(found)
    )
    rows = "".join(f'[[channel]]\npath = "/imu.linear_acceleration.{axis}"\nunit = "g"\n' for axis in "xyz")
    setup = written(tmp_path, f'format = "chladni.setup/1"\n{rows}', "setup.toml")
    with chladni.open(log, setup=setup) as opened:
        found = joint_log(chladni.load_robot(tmp_path / "arm.xml"), opened)
    np.testing.assert_allclose(found.imu.linear_acceleration[2], 9.80665)
    assert "in g" not in told(found)


def test_of_several_imus_none_is_guessed(tmp_path: Path) -> None:
    found = matched(tmp_path, with_imu(tmp_path, ["/a/imu", "/b/imu"]), text=AFLOAT)
    assert found.imu is None
    assert "/a/imu, /b/imu: name the IMU of the base" in told(found)


def test_a_controllers_own_state_holds_both(tmp_path: Path) -> None:
    definition = TRAJECTORY.replace(
        "trajectory_msgs/JointTrajectoryPoint[] points",
        "trajectory_msgs/JointTrajectoryPoint desired\ntrajectory_msgs/JointTrajectoryPoint actual\n"
        "trajectory_msgs/JointTrajectoryPoint error",
    )
    measured, wanted = motion(4, RATE_HZ, delay_s=DELAY_S), motion(4, RATE_HZ)
    path = tmp_path / "log.mcap"
    with LogMaker(path) as log:
        state = log.ros2("/arm/state", "control_msgs/msg/JointTrajectoryControllerState", definition)
        for place in range(1000):
            stamp_ns = START_NS + place * 4_000_000
            parts = [wanted[:, place], measured[:, place], wanted[:, place] - measured[:, place]]
            message = {"header": header(stamp_ns), "joint_names": list(JOINTS)} | {
                name: point(part.tolist()) for name, part in zip(("desired", "actual", "error"), parts, strict=True)
            }
            log.write(state, message, stamp_ns)
    found = matched(tmp_path, path)
    assert (found.state_topic, found.command_topic) == ("/arm/state.actual", "/arm/state.desired")
    np.testing.assert_array_equal(found.position, measured)
    np.testing.assert_array_equal(found.command, wanted)
