import numpy as np
import pytest

from chladni.models.core.instrument import Instrument, Option
from chladni.models.core.parameter import Parameter, Parameters
from chladni.models.core.reading import Curve
from chladni.models.core.simulation import PortMotion, Simulation
from chladni.models.instruments.of_model import instrument_of
from chladni.models.instruments.robot_arm import arm_model
from chladni.models.structures.structure_model import StructureModel
from chladni.signals.channel import Channel
from chladni.signals.errors import ModelError
from chladni.signals.time_series import TimeSeries


def instrument() -> Instrument:
    def build(values: object, options: object) -> object:
        return values, options

    return Instrument(
        name="toy",
        title="A toy",
        parameters=Parameters((Parameter(name="gain", value=1.0, low=0.0, high=2.0, minimum=0.0),)),
        build=build,  # type: ignore[arg-type]  # what is built doesn't matter here
        options=(Option(name="load"), Option(name="loop", choices=("open", "closed"), default="closed")),
    )


def test_what_is_not_given_has_its_default() -> None:
    assert instrument().model() == ({"gain": 1.0}, {"load": "off", "loop": "closed"})
    assert instrument().model({"gain": 2.0}, {"load": "on"}) == ({"gain": 2.0}, {"load": "on", "loop": "closed"})


@pytest.mark.parametrize(
    ("values", "options", "words"),
    [
        ({"gian": 1.0}, {}, "did you mean gain"),
        ({"gain": -1.0}, {}, "not possible"),
        ({}, {"lode": "on"}, "lode = .on. is not known; there are: load, loop"),
        ({}, {"loop": "ajar"}, "loop = 'ajar' is not known; there are: open, closed"),
    ],
)
def test_unknown_settings_are_refused(values: dict[str, float], options: dict[str, str], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        instrument().model(values, options)


def test_a_default_is_one_of_the_choices() -> None:
    with pytest.raises(ModelError, match="none of off, on"):
        Option(name="load", default="maybe")


def test_any_model_has_an_instrument() -> None:
    made = instrument_of(arm_model(), title="The arm")
    assert made.step_input == "push"
    assert made.parameters["elbow.stiffness"].value == 1.6e5
    moved = made.model({"elbow.stiffness": 2e5})
    assert moved.parameters["elbow.stiffness"].value == 2e5


def test_a_model_without_outputs_has_none() -> None:
    mute = StructureModel(name="mute", structure=arm_model().structure, inputs=arm_model().inputs)
    with pytest.raises(ModelError, match=r"has no output.*\[\[output\]\]"):
        instrument_of(mute)


def test_a_curve_has_as_many_x_as_y() -> None:
    with pytest.raises(ModelError, match="x has shape"):
        Curve(label="c", x=np.zeros(3), y=np.zeros(4))


def test_a_simulation_names_the_ports_that_carry_laws() -> None:
    series = TimeSeries(values=np.zeros((1, 2)), sample_rate_hz=1.0, channels=(Channel(name="a"),))
    motion = PortMotion(name="elbow", kind="joint", displacement=np.zeros(2), velocity=np.zeros(2), force=np.zeros(2))
    run = Simulation(
        model="m", inputs=series, outputs=series, states=np.zeros((0, 2)), state_names=(), motions=(motion,)
    )
    assert run.motion("elbow") is motion
    with pytest.raises(ModelError, match="no law acts at 'wrist'; laws act at: elbow"):
        run.motion("wrist")
