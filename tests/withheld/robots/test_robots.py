"""Withheld robots: their machines obey mechanics, their truths fit their motions, their cases are sealed."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import chladni
from chladni.signals.errors import SetupError

pin = pytest.importorskip("pinocchio", reason="pip install pin example-robot-data")
pytest.importorskip("scipy")

from chladni_withheld.campaign import make_cases  # noqa: E402 - behind what may be missing
from chladni_withheld.folders import case_folders, truth_of_case  # noqa: E402
from chladni_withheld.marking import mark  # noqa: E402
from chladni_withheld.robots.afloat import let_float  # noqa: E402
from chladni_withheld.robots.cause import Stage  # noqa: E402
from chladni_withheld.robots.causes import OUTSIDE_CAUSES  # noqa: E402
from chladni_withheld.robots.descriptions import SOURCES, describe  # noqa: E402
from chladni_withheld.robots.draw import ALL_CAUSES, draw_case  # noqa: E402
from chladni_withheld.robots.scene import RefusedError, draw_scene  # noqa: E402
from chladni_withheld.score import scored  # noqa: E402
from chladni_withheld.vocabulary import FAMILY_OF, OUTSIDE  # noqa: E402

#: Between motor and link, from outside. Friction, payload and delay have tests of their own.
ONE_OF_EACH_KIND = {"joint_elasticity", "push"}


def staged(seed, *, floats=False):
    """A short log of a robot with nothing hidden, densely sampled and with a perfect encoder."""
    for rng in np.random.default_rng(seed).spawn(20):
        try:
            scene = draw_scene(rng, floats=floats)
            recorder = replace(scene.recorder, state_hz=1000.0, state_s=0.0, length_s=6.0, resolution=0.0)
            scene = replace(scene, recorder=recorder)
            return rng, Stage(scene=scene, quiet=scene.motion())
        except RefusedError:
            continue
    raise AssertionError


def needed(model, motion):
    data = model.createData()
    return np.array([pin.rnea(model, data, *each) for each in
                     zip(motion.link.T, motion.link_speed.T, motion.acceleration.T, strict=True)]).T  # fmt: skip


def energy(model, motion):
    data = model.createData()
    return np.array([pin.computeKineticEnergy(model, data, q, v) + pin.computePotentialEnergy(model, data, q)
                     for q, v in zip(motion.link.T, motion.link_speed.T, strict=True)])  # fmt: skip


@pytest.mark.parametrize("name", SOURCES)
def test_every_description_is_a_robot_of_six_to_twelve_joints(name):
    robot = describe(name)
    assert 6 <= robot.model.nv == robot.model.nq <= 12
    assert len(robot.joints) == len(robot.links) == robot.model.nv
    assert np.all(robot.high > robot.low)
    assert "<visual" not in robot.urdf
    assert pin.buildModelFromXML(robot.urdf).nv == robot.model.nv


@pytest.mark.nightly
def test_work_of_the_motors_is_the_energy_of_the_links():
    _, stage = staged(1)
    motion, model = stage.quiet, stage.scene.machine.model
    power = np.sum(motion.given * motion.link_speed, axis=0)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(motion.t_s))])
    stored = energy(model, motion)
    assert np.ptp(stored) > 0
    assert_allclose(work, stored - stored[0], atol=0.02 * np.ptp(stored))


@pytest.mark.nightly
def test_a_base_that_floats_obeys_mechanics_and_its_imu_feels_it():
    _, stage = staged(21, floats=True)
    motion, machine = stage.quiet, stage.scene.machine
    base, sensor = machine.base, machine.base.sensor
    pose, twist, push = motion.base[:7], motion.base[7:13], motion.base[13:]
    model = let_float(machine.model)
    data = model.createData()
    q, v, a = (np.vstack(both).T for both in
               ((pose, motion.link), (twist, motion.link_speed), (push, motion.acceleration)))  # fmt: skip
    needed = np.array([pin.rnea(model, data, *each) for each in zip(q, v, a, strict=True)]).T
    held = np.array([base.force(t, pin.XYZQUATToSE3(place), speed)
                     for t, place, speed in zip(motion.t_s, pose.T, twist.T, strict=True)]).T  # fmt: skip
    # A step of the integration lies between what pulls and where it's told.
    assert_allclose(needed[6:], motion.given, atol=0.02 * motion.given.std())
    assert_allclose(needed[:6], held, atol=0.02 * np.abs(needed[:6]).max())
    # The IMU's place, differentiated twice in the world.
    poses = [pin.XYZQUATToSE3(place) * sensor.pose for place in pose.T]
    point = np.array([one.translation for one in poses])
    step = motion.t_s[1] - motion.t_s[0]
    force = np.gradient(np.gradient(point, step, axis=0), step, axis=0) - machine.model.gravity.linear
    own = np.array([one.rotation.T @ each for one, each in zip(poses, force, strict=True)])
    stamps, felt = motion.imu[0] - 0.5 / sensor.rate_hz, motion.imu[4:]
    inside = (stamps > motion.t_s[5]) & (stamps < motion.t_s[-5])
    between = np.array([np.interp(stamps[inside], motion.t_s, row) for row in own.T])
    assert np.sqrt(np.mean((felt[:, inside] - between) ** 2)) < 0.03 * np.sqrt(np.mean(felt**2))


@pytest.mark.nightly
def test_an_afloat_case_has_its_imu_in_its_files():
    case = draw_case(5, 1, "afloat")
    assert 'base = "floating"' in case.model
    assert 'imu = { topic = "/imu", site = "trunk_imu" }' in case.model
    assert '<link name="trunk_imu"' in case.beside["robot.urdf"]
    assert case.topics[0].channels[0].name == "/imu.angular_velocity.x"
    assert len(case.effects) == 1
    assert case.effects[0].severity_tuned > 3.0


@pytest.mark.nightly
def test_a_robot_afloat_that_is_right_is_a_whole_truth(tmp_path):
    assert make_cases(tmp_path, count=1, seed=2, generator="robots", kinds=["afloat_none=1"]) == 1
    (case,) = case_folders(tmp_path)
    assert truth_of_case(tmp_path, case)["effects"] == []


def test_what_is_told_of_bases_that_float_is_scored():
    truth = {"kind": "afloat", "ratio": 9.0,
             "effects": [{"effect": "delay", "site": "knee", "parameters": {"delay": 0.01}}]}  # fmt: skip
    right, wrong = (answer(("delay", site, {"delay": {"value": 0.01}})) for site in ("knee", "hip"))
    none = {"kind": "afloat_none", "effects": []}
    quiet = answer(verdict="none")
    score = scored([mark("a", truth, right), mark("b", truth, wrong), mark("c", none, quiet), mark("d", none, wrong)])
    robots = score["robots"]
    assert (robots["afloat_site"]["right"], robots["afloat_site"]["count"]) == (1, 2)
    assert (robots["afloat_wrong"]["right"], robots["afloat_wrong"]["count"]) == (2, 4)
    assert mark("c", none, quiet).whole_is_right
    assert not mark("d", none, wrong).whole_is_right


@pytest.mark.nightly
def test_friction_takes_energy_and_never_gives_any():
    rng, stage = staged(2)
    cause = ALL_CAUSES["coulomb_friction"](rng, stage, 1)
    motion = stage.scene.motion(cause.change(stage.scene.machine))
    lost = motion.given - needed(stage.scene.machine.model, motion)
    power = lost[1] * motion.link_speed[1]
    assert np.sum(power) > 0
    # But what the bristles give back.
    assert np.sum(np.minimum(power, 0.0)) > -0.05 * np.sum(np.maximum(power, 0.0))


@pytest.mark.nightly
def test_friction_and_payload_of_the_truth_are_found_by_regression():
    rng, stage = staged(3)
    scene = stage.scene
    friction = ALL_CAUSES["coulomb_friction"](rng, stage, 0)
    viscous = ALL_CAUSES["viscous_friction"](rng, stage, 2)
    load = ALL_CAUSES["payload"](rng, stage, 0)
    machine = load.change(viscous.change(friction.change(scene.machine)))
    motion = scene.motion(machine)
    model = scene.machine.model
    data = model.createData()
    lacks = motion.given - needed(model, motion)
    speed = motion.link_speed
    columns = [
        pin.computeJointTorqueRegressor(model, data, *each)[:, 10 * load.link : 10 * load.link + 10]
        for each in zip(motion.link.T, speed.T, motion.acceleration.T, strict=True)
    ]
    table = np.concatenate([
        np.moveaxis(np.array(columns), 0, 1),
        np.stack([np.sign(speed) * np.eye(model.nv)[0][:, None], speed * np.eye(model.nv)[2][:, None]], axis=2),
    ], axis=2).reshape(lacks.size, -1)  # fmt: skip
    moving = (np.abs(speed) > 0.2 * speed.std(axis=1, keepdims=True)).ravel()
    found = np.linalg.lstsq(table[moving], lacks.ravel()[moving])[0]
    body = pin.Inertia.FromDynamicParameters(machine.model.inertias[load.link + 1].toDynamicParameters()
                                             - model.inertias[load.link + 1].toDynamicParameters())  # fmt: skip
    assert body.mass == pytest.approx(load.parameters["mass"])
    assert found[-2] == pytest.approx(friction.parameters["force"], rel=0.1)
    assert found[-1] == pytest.approx(viscous.parameters["coefficient"], rel=0.1)
    without = lacks - (table[:, :10] @ body.toDynamicParameters()).reshape(lacks.shape)
    others = [joint for joint in range(model.nv) if joint not in (0, 2)]
    assert np.all(without[others].std(axis=1) < 0.02 * motion.given[others].std(axis=1))


@pytest.mark.nightly
def test_a_delay_shifts_what_the_servo_follows():
    rng, stage = staged(4)
    cause = ALL_CAUSES["common_delay"](rng, stage, 0)
    motion, scene = stage.scene.motion(cause.change(stage.scene.machine)), stage.scene
    servo, commands = scene.machine.servo, scene.commands
    followed = (motion.asked + servo.kd[:, None] * motion.speed) / servo.kp[:, None] + motion.reading
    late = np.searchsorted(commands.t_s, motion.t_s - cause.parameters["delay"], "right") - 1
    # Between two ticks of the loop the torque is held while the arm moves on.
    assert np.median(np.abs(followed - commands.values[:, late])) < 2e-3


@pytest.mark.nightly
@pytest.mark.parametrize(
    "word",
    [word if word in ONE_OF_EACH_KIND else pytest.param(word, marks=pytest.mark.nightly) for word in ALL_CAUSES],
)
def test_every_cause_changes_the_motion(word):
    for seed in range(10, 40):
        rng, stage = staged(seed)
        try:
            cause = ALL_CAUSES[word](rng, stage, int(rng.integers(len(stage.scene.robot.joints))))
            motion = stage.scene.motion(cause.change(stage.scene.machine))
        except RefusedError:
            continue
        assert cause.effect in (OUTSIDE if word in OUTSIDE_CAUSES else FAMILY_OF)
        assert np.abs(motion.reading - stage.quiet.reading).max() > 1e-5
        return
    raise AssertionError(word)


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_case():
    one, same, other = (draw_case(seed, 1, "none") for seed in (5, 5, 6))
    assert (one.model, one.beside) == (same.model, same.beside)
    assert (one.model, one.beside) != (other.model, other.beside)
    for first, second in zip(one.topics, same.topics, strict=True):
        assert_array_equal(first.values, second.values)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    directory = tmp_path_factory.mktemp("robots")
    assert make_cases(directory, count=1, seed=3, generator="robots", kinds=["effect=1"]) == 1
    return directory


def test_a_case_is_a_robot_file_with_its_description_and_a_log(campaign):
    (case,) = case_folders(campaign)
    folder = campaign / "cases" / case.name
    assert sorted(path.name for path in folder.iterdir()) == ["case.json", "log.mcap", "robot.toml", "robot.urdf"]
    assert case.model.name == "robot.toml"
    truth = truth_of_case(campaign, case)
    assert sorted(truth["files"]) == ["log.mcap", "robot.toml", "robot.urdf"]
    joints = truth["robot"]["joints"]
    with chladni.open_log(case.log) as log:
        series = log.read([f"/joint_states.position[{joint}]" for joint in joints])
    step = truth["robot"]["resolution"]
    assert_allclose(series.values / step, np.rint(series.values / step), atol=1e-6)
    for hidden in truth["effects"]:
        assert hidden["effect"] not in case.model.read_text()
        assert hidden["severity_tuned"] > 3.0


def test_a_description_that_was_changed_breaks_the_seal(campaign):
    (case,) = case_folders(campaign)
    path = case.model.with_name("robot.urdf")
    text = path.read_text()
    path.write_text(text + "<!-- -->")
    with pytest.raises(SetupError, match=r"robot.urdf: isn't what was sealed"):
        truth_of_case(campaign, case)
    path.write_text(text)
    truth_of_case(campaign, case)


def answer(*causes, verdict="effect", **further):
    keys = ("effect", "site", "parameters")
    told = [{"probability": 0.95, **dict(zip(keys, one, strict=True))} for one in causes]
    return {"format": "chladni.gap/1", "verdict": verdict, "causes": told, **further}


def test_what_says_the_same_is_right():
    truth = {"kind": "effect", "ratio": 9.0, "effects": [
        {"effect": "payload", "site": "hand", "parameters": {"mass": 1.0},
         "also": [{"effect": "parameter", "site": "hand.mass"}]}
    ]}  # fmt: skip
    assert mark("x", truth, answer(("payload", "hand", {"mass": {"value": 1.04}}))).is_right
    assert mark("x", truth, answer(("parameter", "hand.mass", {}))).all_found()
    assert not mark("x", truth, answer(("parameter", "elbow.mass", {}))).all_found()


@pytest.mark.parametrize(("said", "right"), [
    (answer(("joint_spring", "knee~hip", {})), True),
    (answer(("joint_spring", "knee", {})), False),
    (answer(("backlash", "hip", {})), False),
    (answer(verdict="unknown", where={"sites": [{"name": "knee", "share": 0.8}]}), True),
])  # fmt: skip
def test_what_two_joints_share_is_named_at_both_or_unknown_at_one(said, right):
    truth = {"kind": "outside", "ratio": 9.0, "effects": [
        {"effect": "coupled_spring", "site": "hip~knee",
         "also": [{"effect": "joint_spring", "site": "hip~knee"}, {"effect": "coupled_spring", "site": "knee"}]}
    ]}  # fmt: skip
    one = mark("x", truth, said)
    assert one.wrongly_named(0.9) is not right
    assert scored([one])["robots"]["coupled"]["right"] == int(right)


def test_numbers_of_causes_are_held_against_the_truth():
    joints = [{"effect": "coulomb_friction", "site": f"j{k}", "parameters": {"force": 2.0}, "severity_tuned": clear}
              for k, clear in enumerate((9.0, 9.0, 9.0, 1.0))]  # fmt: skip
    said = answer(("coulomb_friction", "j0", {"force": {"value": 2.3}}), ("coulomb_friction", "j1", {"force": 2.5}))
    score = scored([mark("x", {"kind": "all_joints", "effects": joints, "ratio": 9.0}, said)])
    assert (score["robots"]["joints"]["right"], score["robots"]["joints"]["count"]) == (1, 3)
    late = {"kind": "effect", "ratio": 9.0,
            "effects": [{"effect": "delay", "site": "all commands", "parameters": {"delay": 0.008}}]}  # fmt: skip
    for found, right in ((0.0085, 1), (0.0095, 0)):
        said = answer(("delay", "all commands", {"delay": {"value": found}}))
        assert scored([mark("x", late, said)])["robots"]["delay"]["right"] == right


def test_doubtful_gains_are_no_wrong_names():
    truth = {"kind": "gains", "ratio": 9.0, "effects": [{"effect": "viscous_friction", "site": "j0"}],
             "gains": {"j0": {"kp": 1.1, "kd": 0.9}, "j1": {"kp": 1.2, "kd": 1.0}}}  # fmt: skip
    said = answer(("controller_gain", "j1", {"kp": {"value": 1.19}, "kd": {"value": 1.0}}),
                  ("viscous_friction", "j0", {}),
                  tuned_parameters={"j0.kp": {"nominal": 100.0, "value": 111.0}})  # fmt: skip
    one = mark("x", truth, said)
    assert one.is_right
    assert not one.wrongly_named(0.5)
    score = scored([one])["robots"]
    assert (score["gains"]["right"], score["gains"]["count"]) == (3, 4)
    assert score["gains_site"]["right"] == 1


@pytest.mark.parametrize(("where", "told"), [
    ({"sites": [{"name": "j1", "share": 0.9}], "regimes": [{"variable": "time", "low": 3.0, "high": 3.6}]}, True),
    ({"sites": [{"name": "j1", "share": 0.9}], "regimes": [{"variable": "time", "low": 5.0, "high": 5.6}]}, False),
    ({"sites": [{"name": "j1", "share": 0.9}], "times": [{"start_s": 3.0, "end_s": 3.6}]}, True),
    ({"sites": [{"name": "j1", "share": 0.9}], "times": [{"start_s": 5.0, "end_s": 5.6}]}, False),
    ({"sites": [{"name": "j0", "share": 0.9}], "regimes": [{"variable": "time", "low": 3.0, "high": 3.6}]}, False),
])  # fmt: skip
def test_a_push_is_told_with_its_place_and_time(where, told):
    truth = {"kind": "outside", "ratio": 9.0, "effects": [
        {"effect": "push", "site": "hand", "parameters": {"start": 3.0, "end": 3.5},
         "also": [{"effect": "push", "site": "j1"}]}
    ]}  # fmt: skip
    one = mark("x", truth, answer(verdict="unknown", where=where))
    assert one.told is told
    assert scored([one])["robots"]["push"]["right"] == int(told)


@pytest.mark.parametrize(("group", "told"), [(["arm", "hand"], True), (["arm"], False)])
def test_a_push_is_told_by_a_force_on_any_link_of_its_group(group, told):
    truth = {"kind": "outside", "ratio": 9.0, "effects": [
        {"effect": "push", "site": "hand", "parameters": {"start": 3.0, "end": 3.5}, "also": []}
    ]}  # fmt: skip
    said = answer(("external_force", "arm", {"start": {"value": 2.9}, "end": {"value": 3.6}}), verdict="unknown")
    said["causes"][0]["group"] = group
    assert mark("x", truth, said).told is told
