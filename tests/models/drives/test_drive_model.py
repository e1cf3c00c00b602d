import copy
from collections.abc import Mapping
from dataclasses import replace
from multiprocessing.reduction import ForkingPickler

import numpy as np
import pytest

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import drive_model
from chladni.models.drives.selection import ChosenSignal
from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError
from tests.models.drives.oracles import FREQUENCY_HZ, named

PNEUMATIC, HYDRAULIC, SERVO = (DRIVES[name] for name in ("pneumatic-motor", "hydraulic-motor", "dc-servo"))


def test_a_model_shows_all_signals_unless_some_are_chosen():
    model = drive_model(PNEUMATIC)
    assert (model.name, model.kind) == ("pneumatic-motor", "drive")
    assert named(model.compile().inputs) == ["flow", "load"]
    chosen = drive_model(
        PNEUMATIC, name="press", inputs=[ChosenSignal(signal="flow", name="supply", channel="/q")],
        outputs=[ChosenSignal(signal="velocity")],
    )  # fmt: skip
    compiled = chosen.compile()
    assert (chosen.name, named(compiled.inputs), named(compiled.outputs)) == ("press", ["supply"], ["velocity"])
    assert compiled.inputs[0].channel == "/q"


def test_values_are_replaced_and_nothing_else():
    model = drive_model(PNEUMATIC, {"active_area": 60e-4}, {"end_stops": "on"})
    other = model.with_values({"reduced_mass": 200.0})
    assert other.parameters["active_area"].value == 60e-4
    assert other.parameters["reduced_mass"].value == 200.0
    assert model.parameters["reduced_mass"].value == 300.0
    assert other.options == {"end_stops": "on", "seal_friction": "off"}
    with pytest.raises(ModelError, match="did you mean reduced_mass"):
        model.with_values({"reduced_mas": 1.0})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"values": {"active_aera": 1.0}}, "no parameter 'active_aera'; did you mean active_area?"),
        ({"values": {"active_area": -1.0}}, "active_area: -1 m.2 is not possible"),
        ({"options": {"stops": "on"}}, "pneumatic-motor: no option 'stops'; options: end_stops, seal_friction"),
        ({"options": {"end_stops": "yes"}}, "option end_stops = 'yes'; choose one of off, on"),
        ({"inputs": [ChosenSignal(signal="voltage")]}, "no signal 'voltage'; signals: flow, load, displacement"),
        ({"inputs": [ChosenSignal(signal="velocity")]}, "no input 'velocity'; inputs: flow, load"),
        ({"inputs": [ChosenSignal(signal="flow")] * 2}, "signal 'flow' is chosen twice"),
        ({"inputs": [ChosenSignal(signal="flow", name="piston")]}, "name 'piston' is used twice"),
    ],
)
def test_mistakes_are_told_when_the_model_is_made(changes, message):
    with pytest.raises(ModelError, match=message):
        drive_model(PNEUMATIC, **changes)


def test_a_signal_of_an_option_that_is_off_is_refused():
    with pytest.raises(ModelError, match="no input 'reference'; inputs: flow, load"):
        drive_model(HYDRAULIC, inputs=[ChosenSignal(signal="reference")])
    drive_model(HYDRAULIC, {}, {"loop": "position"}, inputs=[ChosenSignal(signal="reference")])


@pytest.mark.parametrize("kind", DRIVES.values(), ids=list(DRIVES))
def test_models_survive_pickle_and_copy(kind):
    model = drive_model(kind)
    # What a pool of processes does with a model.
    for other in (ForkingPickler.loads(ForkingPickler.dumps(model)), copy.deepcopy(model)):
        np.testing.assert_array_equal(other.compile().a, model.compile().a)


def test_friction_attaches_at_the_piston():
    effect = attached("coulomb_friction", "piston", {"force": 50.0})
    model = drive_model(PNEUMATIC).with_effects([effect])
    compiled = model.compile()
    assert model.effects == (effect,)
    assert [compiled.ports[law.port].name for law in compiled.laws] == ["piston"]
    assert drive_model(PNEUMATIC).with_effects([]).compile().is_linear()


def test_mass_added_to_the_body_is_mass():
    heavier = drive_model(PNEUMATIC).with_effects([attached("added_mass", "axis", {"mass": 100.0})])
    built = drive_model(PNEUMATIC, {"reduced_mass": 400.0})
    np.testing.assert_allclose(
        heavier.compile().frequency_response(FREQUENCY_HZ),
        built.compile().frequency_response(FREQUENCY_HZ),
        rtol=1e-9,
    )


def test_an_input_outside_of_loops_gets_its_effects_on_samples():
    model = drive_model(PNEUMATIC).with_effects([attached("saturation", "flow", {"limit": 5e-5})])
    compiled = model.compile()
    assert not compiled.laws
    assert [place for place, _ in compiled.input_maps] == [0]


def test_an_output_that_is_fed_back_carries_its_effects_around_the_loop():
    options = {"loop": "position"}
    gain = attached("gain_error", "stroke", {"gain": 2.0})
    stroke = ChosenSignal(signal="displacement", name="stroke")
    speed = ChosenSignal(signal="velocity")
    wrong = drive_model(HYDRAULIC, {}, options, outputs=[stroke, speed]).with_effects([gain]).compile()
    # A sensor that shows twice the stroke is a loop of twice the gain, but for its reference.
    twice = drive_model(HYDRAULIC, {"position_gain": 0.03}, options, outputs=[stroke, speed]).compile()
    reference, flow = named(wrong.inputs).index("reference"), named(wrong.inputs).index("flow")
    found, expected = (one.frequency_response(FREQUENCY_HZ) for one in (wrong, twice))
    np.testing.assert_allclose(found[0, reference], expected[0, reference], rtol=1e-9)
    np.testing.assert_allclose(found[0, flow], 2 * expected[0, flow], rtol=1e-9)
    np.testing.assert_allclose(found[1, flow], expected[1, flow], rtol=1e-9)


def test_an_effect_at_a_commanded_input_acts_inside_the_loop():
    model = drive_model(SERVO, {}, {"loop": "current"}).with_effects([attached("delay", "voltage", {"delay": 1e-3})])
    compiled = model.compile()
    response = drive_model(SERVO).compile().frequency_response(FREQUENCY_HZ)[0, 0]
    s = 2j * np.pi * FREQUENCY_HZ
    p = SERVO.parameters.numbers()
    around = p["current_gain"] * (1 + 1 / (p["current_time"] * s)) * response * np.exp(-s * 1e-3)
    found = compiled.frequency_response(FREQUENCY_HZ)[0, 0]
    np.testing.assert_allclose(found, around / (1 + around), rtol=1e-9)


def test_a_sensor_that_clips_inside_a_loop_is_a_law_outside_of_one_a_map():
    clipping = attached("clipping", "velocity", {"limit": 1.0})
    inside = drive_model(SERVO, {}, {"loop": "velocity"}).with_effects([clipping]).compile()
    outside = drive_model(SERVO).with_effects([clipping]).compile()
    assert (len(inside.laws), len(inside.output_maps)) == (1, 0)
    assert (len(outside.laws), len(outside.output_maps)) == (0, 1)


def test_an_unknown_site_is_told():
    model = drive_model(PNEUMATIC).with_effects([attached("coulomb_friction", "elbow", {"force": 1.0})])
    with pytest.raises(ModelError, match="elbow"):
        model.compile()


def test_equations_are_made_once_for_checks_response_and_flags() -> None:
    asked: list[float] = []
    kind = DRIVES["hydraulic-motor"]

    def counted(values: Mapping[str, float], options: Mapping[str, str]) -> CompiledModel:
        asked.append(values["active_area"])
        return kind.build(values, options)

    model = drive_model(replace(kind, build=counted))
    model.compile()
    assert len(asked) == 1
    # Another setting has equations of its own.
    area = 2 * asked[0]
    changed = model.with_values({"active_area": area}).compile()
    assert asked[1:] == [area]
    assert not np.array_equal(changed.a, model.compile().a)
