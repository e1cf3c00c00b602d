"""MuJoCo models as simulators, against our own integrator and against MuJoCo itself."""

import pickle

import numpy as np
import pytest

import chladni
from chladni.models.core.port_law import PortLaw
from chladni.models.integrator.integrator import Integrator
from chladni.models.simulators.joint_law import JointLaw
from chladni.models.simulators.mujoco_simulator import mujoco_simulator
from chladni.models.simulators.wrapped_simulator import WrappedSimulator
from chladni.signals.errors import ModelError
from tests.models.simulators.slide import DAMPING, MASS, RATE_HZ, STIFFNESS, held, mjcf, model, smooth

mujoco = pytest.importorskip("mujoco", reason="needs the extra [mujoco]")


def viscous(_d, s, _t, parameters, _state, _rates):
    return parameters[0] * s


def slide(step_s=1 / RATE_HZ, **options):
    chosen = {"inputs": {"push": None}, "outputs": dict.fromkeys(["place", "speed"]), "joints": ["guide"], **options}
    return mujoco_simulator(mjcf(step_s), **chosen)


def answer(simulator, force, rate_hz=RATE_HZ, effects=(), **values):
    return WrappedSimulator(simulator=simulator, values=values, effects=tuple(effects)).respond(force, rate_hz)


def test_steps_are_mujocos_own():
    force = held(400)
    own = mujoco.MjModel.from_xml_string(mjcf())
    data = mujoco.MjData(own)
    expected = np.zeros((2, 400))
    for sample in range(400):
        data.ctrl[0] = force[0, sample]
        mujoco.mj_step(own, data)
        expected[:, sample] = data.sensordata[:2]
    assert np.array_equal(answer(slide(), force).outputs, expected)


def test_several_steps_in_a_sample():
    force = held(200)
    coarse = answer(slide(1 / 800), force).outputs
    fine = answer(slide(1 / 800), np.repeat(force, 4, axis=1), 800.0).outputs
    assert np.array_equal(coarse, fine[:, ::4])


@pytest.mark.parametrize(
    ("effect", "values", "variant"),
    [
        ("coulomb_friction", {"force": 6.0, "creep_speed": 0.01}, "regularised"),
        ("coulomb_friction", {"force": 6.0, "presliding": 5e-4}, "bristle"),
        ("hysteresis", {"force": 8.0, "yield": 0.005}, None),
        ("hardening_stiffness", {"cubic": 4e5}, None),
        ("backlash", {"gap": 0.01}, None),
        ("one_sided_stop", {"stiffness": 4e3, "clearance": 0.01}, None),
    ],
)
def test_effects_at_a_joint_act_as_around_a_model(effect, values, variant):
    whole = chladni.attached(effect, "guide", values, variant=variant)
    errors = []
    for rate_hz in (2000.0, 4000.0):
        force = smooth(round(1.5 * rate_hz), rate_hz)
        exact = Integrator(model().with_effects([whole]).compile(), rate_hz).run(force).outputs
        found = answer(slide(1 / rate_hz), force, rate_hz, [whole]).outputs
        plain = answer(slide(1 / rate_hz), force, rate_hz).outputs
        scale = np.sqrt(np.mean(exact**2, axis=1))
        errors.append(np.sqrt(np.mean((found - exact) ** 2, axis=1)) / scale)
        assert np.all(np.sqrt(np.mean((plain - exact) ** 2, axis=1)) > 0.1 * scale)
    # MuJoCo steps to first order, and holds inputs: half the step, half the error.
    assert np.all(errors[0] < 0.03)
    assert np.all(errors[1] < 0.65 * errors[0])


def test_a_viscous_law_is_as_good_as_mujocos_damping():
    force = held(600)
    law = JointLaw(laws=(PortLaw(port=0, function=viscous, parameters=(6.0,)),))
    ours = slide().respond(force, RATE_HZ, values={}, joint_laws={"guide": law}).outputs
    theirs = answer(slide(parameters={"guide.damping": 0.2}), force, **{"guide.damping": DAMPING + 6.0}).outputs
    # Both implicit, so equal but for rounding and the root's tolerance.
    assert np.allclose(ours, theirs, rtol=1e-7, atol=1e-7 * np.abs(theirs).max())


def test_friction_sticks_whatever_the_step():
    push = np.full((1, 400), 5.0)
    friction = chladni.attached("coulomb_friction", "guide", {"force": 20.0, "creep_speed": 1e-9})
    (motion,) = answer(slide(), push, effects=[friction]).motions
    # 5 of 20 N: a quarter of the creep speed, though one free step would make it 12.5 mm/s.
    assert np.abs(motion.velocity).max() < 1e-9
    assert motion.force[1:] == pytest.approx(5.0, rel=1e-3)


def test_parameters_are_those_of_another_model():
    force = held(400)
    names = {"cart.mass": 0.1, "guide.stiffness": 0.1, "guide.damping": 0.1}
    simulator = slide(parameters=names)
    assert {name: one.value for name, one in simulator.parameters.items()} == {
        "cart.mass": MASS,
        "guide.stiffness": STIFFNESS,
        "guide.damping": DAMPING,
    }
    heavy = answer(simulator, force, **{"cart.mass": 3.0, "guide.stiffness": 900.0}).outputs
    text = mjcf().replace(f'mass="{MASS}"', 'mass="3.0"').replace(f'stiffness="{STIFFNESS}"', 'stiffness="900"')
    other = mujoco_simulator(text, inputs={"push": None}, outputs=dict.fromkeys(["place", "speed"]))
    assert np.allclose(heavy, answer(other, force).outputs, rtol=1e-12)
    # A run leaves the simulator as it was.
    assert np.array_equal(answer(simulator, force).outputs, answer(slide(), force).outputs)


def test_units_and_sensors_with_several_numbers():
    simulator = slide(outputs={"place": "/a", "acc.x": None, "acc[2]": None})
    assert [(each.name, each.unit, each.channel) for each in simulator.outputs] == [
        ("place", "m", "/a"),
        ("acc.x", "m/s^2", None),
        ("acc[2]", "m/s^2", None),
    ]
    assert [(each.name, each.unit) for each in simulator.inputs] == [("push", "N")]
    (joint,) = simulator.joints
    assert (joint.stiffness, joint.damping, joint.unit) == (STIFFNESS, DAMPING, "N")
    first = answer(simulator, np.full((1, 1), 6.0)).outputs[:, 0]
    assert first == pytest.approx([0.0, 6.0 / MASS, 0.0], abs=1e-12)


def test_a_run_may_start_from_a_keyframe():
    assert answer(slide(keyframe="pulled"), np.zeros((1, 5))).outputs[0, 0] == pytest.approx(0.05)


def test_other_processes_get_the_same():
    force = held(100)
    again = pickle.loads(pickle.dumps(slide()))  # noqa: S301 - what was just written
    assert np.array_equal(answer(again, force).outputs, answer(slide(), force).outputs)


def test_from_a_file(tmp_path):
    path = tmp_path / "slide.xml"
    path.write_text(mjcf())
    simulator = mujoco_simulator(path, inputs={"push": None}, outputs={"place": None})
    assert simulator.name == "slide"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"inputs": {"pusch": None}}, "no actuator 'pusch'.*push"),
        ({"outputs": {"plce": None}}, "no sensor 'plce'.*place"),
        ({"outputs": {"acc": None}}, "gives 3 numbers; name one, such as acc.x"),
        ({"outputs": {"acc[3]": None}}, "gives 3 numbers"),
        ({"outputs": {"place.y": None}}, "gives 1 number;"),
        ({"joints": ["guid"]}, "no joint 'guid'.*guide"),
        ({"parameters": {"guide.colour": 0.1}}, "colour"),
        ({"parameters": {"guide.armature": 0.1}}, "can't be tuned"),
        ({"parameters": {"guide.damping": 0.0}}, "can't be tuned"),
        ({"keyframe": "pushed"}, "no key 'pushed'"),
    ],
)
def test_wrong_names_are_told(options, message):
    with pytest.raises(ModelError, match=message):
        slide(**options)


def test_wrong_models_are_told(tmp_path):
    with pytest.raises(ModelError, match="unrecognized element"):
        mujoco_simulator("<mujoco><nonsense/></mujoco>", inputs={}, outputs={})
    with pytest.raises(ModelError, match=r"nowhere\.xml"):
        mujoco_simulator(tmp_path / "nowhere.xml", inputs={}, outputs={})
    with pytest.raises(ModelError, match="RK4"):
        mujoco_simulator(mjcf(integrator="RK4"), inputs={}, outputs={})


def test_steps_must_fit_the_samples():
    with pytest.raises(ModelError, match="doesn't divide"):
        answer(slide(0.003), held(10))


def test_a_law_at_an_unknown_joint_is_told():
    with pytest.raises(ModelError, match="no joint 'knee'"):
        slide().respond(held(10), RATE_HZ, values={}, joint_laws={"knee": JointLaw(laws=())})


def test_divergence_is_told(capfd):
    runaway = JointLaw(laws=(PortLaw(port=0, function=viscous, parameters=(-5e4,)),))
    with pytest.raises(ModelError, match="diverges within"):
        slide().respond(held(400), RATE_HZ, values={}, joint_laws={"guide": runaway})
    # MuJoCo would print a warning, write a file and begin anew.
    assert capfd.readouterr().err == ""


def test_a_run_that_mujoco_restarted_is_told(tmp_path, monkeypatch):
    # A force that no step survives: MuJoCo resets itself, and the answer would look sound.
    monkeypatch.chdir(tmp_path)
    text = mjcf().replace(f'mass="{MASS}"', 'mass="0.1"')
    light = mujoco_simulator(text, inputs={"push": None}, outputs={"place": None})
    with pytest.raises(ModelError, match="diverges within"):
        answer(light, np.full((1, 50), 9e9))


@pytest.mark.parametrize("force", [1e15, np.nan])
def test_inputs_that_mujoco_would_drop_are_told(force):
    with pytest.raises(ModelError, match="input 'push' reaches"):
        answer(slide(), np.full((1, 50), force))
