from dataclasses import replace

import numpy as np
import pytest

from chladni.io.log import open_log
from chladni.models.core.port import Port
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.mr_damper import MR_DAMPER, mr_damper_at, mr_damper_kind
from chladni.models.drives.mr_shipped import MEASURED_DAMPER, MEASURED_DAMPER_ASYMMETRIC
from chladni.models.drives.pneumatic_motor import PNEUMATIC_MOTOR
from chladni.models.files.model_file import load_model
from chladni.models.integrator.known_motion import force_along_motion
from chladni.models.integrator.simulate import simulate
from chladni.signals.channel import Channel
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries

RATE_HZ = 500.0


def moved(amplitude=0.02, seconds=3.0):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    x = amplitude * np.sin(np.pi * t)
    channel = Channel(name="displacement", unit="m")
    return t, TimeSeries(values=x[None], sample_rate_hz=RATE_HZ, channels=(channel,))


@pytest.mark.parametrize(
    ("law", "coefficients"), [("paper", MEASURED_DAMPER), ("asymmetric", MEASURED_DAMPER_ASYMMETRIC)]
)
def test_a_drive_whose_rod_is_moved_tells_the_law_s_force(law, coefficients):
    t, excitation = moved()
    model = drive_model(DRIVES["mr-damper"], {"current": 0.6, "size": 2.0}, {"law": law})
    simulation = simulate(model, excitation)
    velocity = 0.02 * np.pi * np.cos(np.pi * t)
    expected = force_along_motion(
        coefficients.scaled(force=2.0).law(0.6), excitation.values[0], velocity, t, substeps=8
    )
    force = simulation.outputs.values[0]
    # Velocity along straight lines between samples against a spline: (omega dt)^2/8.
    assert np.sqrt(np.mean((force - expected) ** 2) / np.mean(expected**2)) < 3e-5
    assert np.mean(force * velocity) > 0
    assert simulation.motion("damper").force == pytest.approx(force)
    assert model.flags(simulation) == ()


def test_each_knob_turns_what_it_says():
    base = drive_model(MR_DAMPER).compile().laws[0].parameters
    for name, place in (("alpha_scale", 0), ("c0_scale", 1), ("c1_scale", 2)):
        turned = drive_model(MR_DAMPER, {name: 1.5}).compile().laws[0].parameters
        ratio = np.array(turned[:4]) / np.array(base[:4])
        assert ratio == pytest.approx([1.5 if each == place else 1.0 for each in range(4)])


def test_more_than_the_measured_stroke_is_flagged():
    _, excitation = moved(amplitude=0.03, seconds=1.0)
    model = drive_model(MR_DAMPER)
    flags = model.flags(simulate(model, excitation))
    assert any("displacement reaches 30 mm, above 24.5 mm" in flag for flag in flags)


def test_a_current_outside_of_the_measured_is_unusual_and_an_impossible_one_refused():
    model = drive_model(MR_DAMPER, {"current": 1.5})
    assert [parameter.name for parameter in model.parameters.unusual()] == ["current"]
    with pytest.raises(ModelError, match=r"alpha\(9 A\)"):
        drive_model(MR_DAMPER, {"current": 9.0})
    with pytest.raises(ModelError, match="current: -1 A is not possible"):
        drive_model(MR_DAMPER, {"current": -1.0})


def test_a_kind_of_one_s_own_coefficients():
    kind = mr_damper_kind(MEASURED_DAMPER.scaled(force=3.0), name="big-damper")
    law = drive_model(kind, {"current": 0.0}).compile().laws[0]
    assert law.parameters == MEASURED_DAMPER.scaled(force=3.0).law(0.0).parameters


def test_at_a_joint_it_takes_vibration_away_the_more_the_higher_the_current():
    """The piston of the motor, hit once: how far it goes, and what remains of the motion after a second."""
    motor = drive_model(PNEUMATIC_MOTOR, {"viscous_loss": 0.0, "leakage": 0.0})
    reach, remaining = [], []
    for effects in ((), (mr_damper_at("piston", current_a=0.0),), (mr_damper_at("piston", current_a=1.0),)):
        flow = TimeSeries(
            values=np.zeros((1, 1000)), sample_rate_hz=500.0, channels=(Channel(name="flow", unit="m^3/s"),)
        )
        found = simulate(motor.with_effects(effects), flow, initial={"velocity": 0.05})
        reach.append(np.abs(found.outputs.values[0]).max())
        remaining.append(np.sqrt(np.mean(found.outputs.values[1, 500:] ** 2)))
    assert remaining[0] == pytest.approx(0.05 / np.sqrt(2), rel=0.05)
    assert max(remaining[1:]) < 0.01 * remaining[0]
    assert reach[2] < 0.6 * reach[1] < 0.6 * reach[0]


def test_it_attaches_beside_what_is_there_and_tells_what_it_is():
    compiled = drive_model(PNEUMATIC_MOTOR, options={"end_stops": "on"}).compile()
    damper = mr_damper_at("piston", current_a=0.5, coefficients=MEASURED_DAMPER_ASYMMETRIC, size=0.5)
    with_damper = damper.attach(compiled)
    assert len(with_damper.laws) == len(compiled.laws) + 1
    assert with_damper.laws[-1].port == compiled.port_index("piston", "joint")
    assert with_damper.laws[-1].parameters == MEASURED_DAMPER_ASYMMETRIC.scaled(force=0.5).law(0.5).parameters
    assert (damper.effect, damper.site, dict(damper.values)) == ("mr_damper", "piston", {"current": 0.5})


def test_where_it_cannot_act_is_told():
    compiled = drive_model(PNEUMATIC_MOTOR).compile()
    with pytest.raises(ModelError, match="no joint 'elbow'; there are: piston"):
        mr_damper_at("elbow").attach(compiled)
    turning = replace(
        compiled, ports=(Port(name="piston", kind="joint", unit="N m", displacement_unit="rad"), *compiled.ports[1:])
    )
    with pytest.raises(ModelError, match="the joint turns"):
        mr_damper_at("piston").attach(turning)
    with pytest.raises(ModelError, match="2 A lies outside of the fitted 0 to 1 A"):
        mr_damper_at("piston", current_a=2.0)
    with pytest.raises(ModelError, match="size 0 is not possible"):
        mr_damper_at("piston", size=0.0)


@pytest.mark.parametrize(("coefficients", "limit"), [(MEASURED_DAMPER, 7.0), (MEASURED_DAMPER_ASYMMETRIC, 4.6)])
def test_a_structure_with_the_damper_follows_a_log_that_a_viscous_damper_misses(shared_data, coefficients, limit):
    """The model file takes it for a viscous damper; the log's stroke moves the rod."""
    with open_log(shared_data / "mr_0.5A.mcap") as log:
        measured = log.read(["/damper.position[0]", "/damper.effort[0]"])
    viscous = load_model(shared_data / "models" / "mr_damper.toml")
    damped = viscous.with_values({"damper.stiffness": 0.0, "damper.damping": 0.0}).with_effects(
        [mr_damper_at("damper", current_a=0.5, coefficients=coefficients)]
    )
    force = measured.values[1]
    errors = []
    for model in (viscous, damped):
        simulated = simulate(model, measured.select(["/damper.position[0]"])).outputs.values[0]
        errors.append(100 * np.sqrt(np.mean((simulated - force) ** 2) / np.mean(force**2)))
    assert errors[1] < limit
    assert errors[0] > 4 * errors[1]


def test_the_drive_is_loaded_from_a_model_file(tmp_path):
    path = tmp_path / "damper.toml"
    path.write_text(
        'format = "chladni.model/1"\nname = "press"\nkind = "drive"\ndrive = "mr-damper"\n'
        '[parameters]\ncurrent = "500 mA"\n'
        '[[input]]\nname = "stroke"\nsignal = "displacement"\nchannel = "/damper.position[0]"\n'
        '[[output]]\nname = "force"\nsignal = "force"\nchannel = "/damper.effort[0]"\n'
    )
    compiled = load_model(path).compile()
    assert compiled.laws[0].parameters == MEASURED_DAMPER.law(0.5).parameters
    assert (compiled.inputs[0].channel, compiled.outputs[0].channel) == ("/damper.position[0]", "/damper.effort[0]")
