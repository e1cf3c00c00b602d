"""Model files that are right: what they give, and that writing loses nothing."""

import string
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.model import Model
from chladni.models.core.port import Terminal
from chladni.models.drives.catalogue import DRIVES
from chladni.models.drives.drive_model import DriveModel, drive_model
from chladni.models.effects.attached_effect import attached
from chladni.models.elements.catalogue import ELEMENTS
from chladni.models.files.model_file import load_model, write_model
from chladni.models.schemes.block import element_block
from chladni.models.schemes.scheme_model import SchemeModel
from chladni.models.structures.controller import Controller
from chladni.models.structures.structure import Body, Joint, Structure
from chladni.models.structures.structure_input import StructureInput
from chladni.models.structures.structure_model import StructureModel
from chladni.models.structures.structure_output import StructureOutput
from chladni.signals.errors import LogError, ModelError
from tests.models.files.made_files import DRIVE, SCHEME, STRUCTURE, written


def structure(folder: Path, text: str = STRUCTURE) -> StructureModel:
    model = load_model(written(folder, text))
    assert isinstance(model, StructureModel)
    return model


def test_a_structure_is_read_in_si(tmp_path: Path) -> None:
    model = structure(tmp_path)
    assert model.structure == Structure(
        bodies=(Body(name="column", mass=12.0, position=(0.0, 0.0, 0.4)), Body(name="wrist", mass=2.5)),
        joints=(
            Joint(name="shoulder", between=("ground", "column"), stiffness=1.2e6, damping=200.0),
            Joint(name="elbow", between=("column", "wrist"), stiffness=6e5, damping=90.0),
        ),
    )
    assert model.inputs == (
        StructureInput(name="hammer", at="wrist", channel="/hammer.wrench.force.x"),
        StructureInput(name="motor", at="elbow"),
        StructureInput(name="floor", at="ground", kind="base_acceleration"),
        StructureInput(name="noise", at="axis", kind="disturbance"),
    )
    assert [(one.name, one.measures, one.at) for one in model.outputs] == [
        ("acc_wrist", "acceleration", "wrist"),
        ("bend", "displacement", "elbow"),
        ("pull", "force", "elbow"),
    ]
    assert model.controllers == (
        Controller(
            name="axis", feedback="bend", drives="motor", law="pd", gains={"kp": 2e4, "kd": 3.0},
            reference="/command.position[0]", gain=35.15, gain_unit="N/V", limit=10.0,
        ),
    )  # fmt: skip
    friction, cross = model.effects
    assert (friction.effect, friction.site, friction.values["force"]) == ("coulomb_friction", "elbow", 8.1)
    assert cross.values == {"coefficient": 0.02}
    tolerances = {one.name: one.tolerance for one in model.parameters.values()}
    assert tolerances["elbow.stiffness"] == 0.2
    assert tolerances["elbow.damping"] == 0.1


def test_a_structure_keeps_its_order_of_terminals(tmp_path: Path) -> None:
    compiled = structure(tmp_path).compile()
    assert [terminal.name for terminal in compiled.inputs] == ["axis", "hammer", "floor", "noise"]
    assert [terminal.unit for terminal in compiled.inputs] == ["m", "N", "m/s^2", "V"]


def test_rotating_bodies_take_inertias(tmp_path: Path) -> None:
    text = """\
format = "chladni.model/1"
name = "shaft"
kind = "structure"
[[body]]
name = "motor"
inertia = "20 kg m^2"
[[joint]]
name = "shaft"
between = ["ground", "motor"]
stiffness = "3 N m/deg"
damping = "0.5 N m s"
[[effect]]
effect = "coulomb_friction"
site = "shaft"
parameters = { force = "2 N m" }
"""
    model = structure(tmp_path, text)
    assert model.structure.bodies[0] == Body(name="motor", mass=20.0, motion="rotation")
    np.testing.assert_allclose(model.structure.joints[0].stiffness, 3 * 180 / np.pi, rtol=1e-15)
    assert model.structure.joints[0].damping == 0.5
    assert model.effects[0].values["force"] == 2.0


def test_a_limit_in_newtons_bounds_the_force(tmp_path: Path) -> None:
    model = structure(tmp_path, STRUCTURE.replace('"10 V"', '"100 N"'))
    assert (model.controllers[0].limit, model.controllers[0].limit_unit) == (100.0, "N")
    assert model.controllers[0].force_limit() == 100.0
    assert structure(tmp_path).controllers[0].force_limit() == pytest.approx(351.5, rel=1e-15)


def test_a_transfer_function_is_a_law(tmp_path: Path) -> None:
    text = STRUCTURE.replace('law = "pd"\ngains = { kp = "20 V/mm", kd = 3.0 }', "num = [2, 3.0]\nden = [0.1, 1]")
    controller = structure(tmp_path, text).controllers[0]
    assert (controller.law, controller.num, controller.den) == ("transfer-function", (2.0, 3.0), (0.1, 1.0))


def test_what_a_controller_may_have_beside_gains_survives(tmp_path: Path) -> None:
    changed = STRUCTURE.replace('law = "pd"', 'law = "pd"\nrate_of = "error"').replace(
        "kd = 3.0", "kd = 3.0, filter = 0.1"
    )
    controller = structure(tmp_path, changed.replace('"10 V"', '"100 N"')).controllers[0]
    assert (controller.rate_of, controller.gains["filter"]) == ("error", 0.1)
    assert_round_trip(structure(tmp_path), tmp_path)
    text = STRUCTURE.replace('law = "pd"\ngains = { kp = "20 V/mm", kd = 3.0 }', "num = [2, 3.0]\nden = [0.1, 1]")
    for one in (changed, changed.replace('"10 V"', '"100 N"'), text, STRUCTURE.replace('limit = "10 V"', "")):
        model = structure(tmp_path, one)
        assert assert_round_trip(model, tmp_path) == model


def test_bare_dotted_keys_are_parameters_too(tmp_path: Path) -> None:
    text = STRUCTURE.replace('"elbow.stiffness" = 0.2', 'elbow.stiffness = "30 %"')
    assert structure(tmp_path, text).parameters["elbow.stiffness"].tolerance == 0.3


def test_a_drive_is_read(tmp_path: Path) -> None:
    model = load_model(written(tmp_path, DRIVE))
    assert isinstance(model, DriveModel)
    assert model.parameters["active_area"].value == pytest.approx(60e-4, rel=1e-15)
    assert model.parameters["active_area"].tolerance == 0.02
    assert model.parameters["air_volume"].tolerance == 0.1
    assert model.options["end_stops"] == "on"
    assert [(t.name, t.channel) for t in model.compile().inputs] == [("flow", "/flow")]
    assert [t.name for t in model.compile().outputs] == ["v"]
    assert model.effects[0].values["limit"] == 0.5


def test_a_scheme_is_read(tmp_path: Path) -> None:
    model = load_model(written(tmp_path, SCHEME))
    assert isinstance(model, SchemeModel)
    assert model.parameters["regulator.integral_time"].value == pytest.approx(9.9, rel=1e-15)
    assert model.parameters["regulator.gain"].tolerance == 0.2
    assert [effect.site for effect in model.effects] == ["speed"]


def assert_same_equations(found: CompiledModel, expected: CompiledModel) -> None:
    for name in ("a", "b", "c", "d", "g", "h"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
    assert (found.inputs, found.outputs, found.ports) == (expected.inputs, expected.outputs, expected.ports)
    assert [law.parameters for law in found.laws] == [law.parameters for law in expected.laws]


def assert_round_trip(model: Model, folder: Path) -> Model:
    path = folder / "written.toml"
    write_model(model, path)
    found = load_model(path)
    assert found.parameters.numbers() == model.parameters.numbers()
    assert [one.tolerance for one in found.parameters.values()] == [
        one.tolerance for one in model.parameters.values()
    ]
    assert list(found.effects) == list(model.effects)
    assert_same_equations(found.compile(), model.compile())
    return found


@pytest.mark.parametrize("text", [STRUCTURE, DRIVE, SCHEME])
def test_what_is_written_reads_back(tmp_path: Path, text: str) -> None:
    model = load_model(written(tmp_path, text))
    found = assert_round_trip(model, tmp_path)
    if not isinstance(model, DriveModel):
        assert found == model


@pytest.mark.parametrize("word", DRIVES)
def test_every_drive_with_every_option_survives(tmp_path: Path, word: str) -> None:
    kind = DRIVES[word]
    assert_round_trip(drive_model(kind), tmp_path)
    for option in kind.options:
        for choice in option.choices:
            assert_round_trip(drive_model(kind, options={option.name: choice}), tmp_path)


@pytest.mark.parametrize("word", ELEMENTS)
def test_every_element_survives_in_a_scheme(tmp_path: Path, word: str) -> None:
    blocks = (element_block("first", "pt1", "+wish"), element_block("second", word, "-first", "+wish"))
    assert_round_trip(SchemeModel(name=word, blocks=blocks, inputs=(Terminal(name="wish", unit="1"),)), tmp_path)


def test_changed_values_are_what_is_written(tmp_path: Path) -> None:
    model = structure(tmp_path).with_values({"elbow.stiffness": 1 / 3, "axis.kp": 1e-7 / 3, "axis.limit": 1 / 7})
    path = tmp_path / "changed.toml"
    write_model(model, path)
    assert load_model(path).parameters.numbers() == model.parameters.numbers()


NAMES = st.text(string.ascii_letters + string.digits + "_-", min_size=1, max_size=8).map("x".__add__)
# So that the equations, which the reader looks at, don't overflow.
POSITIVE = st.floats(min_value=1e-100, max_value=1e100)
PRINTED = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20).filter(str.isprintable)
CHANNELS = st.none() | PRINTED


@st.composite
def structures(draw: st.DrawFn) -> StructureModel:
    names = draw(st.lists(NAMES, min_size=4, max_size=9, unique=True))
    bodies, joint, hammer, sensor = names[:-3], names[-3], names[-2], names[-1]
    motion = draw(st.sampled_from(["translation", "rotation"]))
    position = st.tuples(*[st.floats(-1e3, 1e3)] * 3)
    channels = draw(st.lists(CHANNELS, min_size=2, max_size=2, unique=True))
    return StructureModel(
        name=draw(PRINTED),
        structure=Structure(
            bodies=tuple(
                Body(name=name, mass=draw(POSITIVE), motion=motion, position=draw(position)) for name in bodies
            ),
            joints=(
                Joint(
                    name=joint,
                    between=("ground", bodies[0]),
                    stiffness=draw(POSITIVE | st.just(0.0)),
                    damping=draw(POSITIVE),
                ),
            ),
        ),
        inputs=(StructureInput(name=hammer, at=draw(st.sampled_from([joint, *bodies])), channel=channels[0]),),
        outputs=(
            StructureOutput(
                name=sensor,
                at=draw(st.sampled_from([joint, bodies[-1]])),
                measures=draw(st.sampled_from(["displacement", "velocity"])),
                channel=channels[1],
            ),
        ),
        tolerances={f"{joint}.damping": draw(st.floats(0, 10))},
        default_tolerance=draw(st.floats(0, 10)),
    )


@given(model=structures())
def test_any_structure_survives_its_file(model: StructureModel, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("model") / "m.toml"
    write_model(model, path)
    assert load_model(path) == model


def test_an_effect_of_ones_own_is_refused(tmp_path: Path) -> None:
    class Own:
        effect, site, values = "stickiness", "elbow", {}

        def attach(self, compiled: CompiledModel) -> CompiledModel:
            return compiled

    model = structure(tmp_path).with_effects([Own()])
    with pytest.raises(ModelError, match="'stickiness' at 'elbow' is none of the catalogue"):
        write_model(model, tmp_path / "own.toml")
    assert not (tmp_path / "own.toml").exists()


def test_a_model_of_no_kind_is_refused(tmp_path: Path) -> None:
    class Other:
        name, kind, effects = "other", "structure", ()

    for kind in ("structure", "drive", "scheme", "spell"):
        Other.kind = kind
        with pytest.raises(ModelError, match="file can hold"):
            write_model(Other(), tmp_path / "other.toml")  # type: ignore[arg-type]


def test_an_existing_file_is_kept_when_asked(tmp_path: Path) -> None:
    path = written(tmp_path, STRUCTURE)
    with pytest.raises(LogError, match="exists already"):
        write_model(structure(tmp_path), path, overwrite=False)
    assert path.read_text() == STRUCTURE


@pytest.mark.parametrize("name", ["emps", "emps_closed_loop", "mr_damper", "silverbox"])
def test_nominal_models_of_measured_logs_load_and_survive(shared_data: Path, tmp_path: Path, name: str) -> None:
    assert_round_trip(load_model(shared_data / "models" / f"{name}.toml"), tmp_path)


def test_the_measured_loop_has_command_and_force(shared_data: Path) -> None:
    compiled = load_model(shared_data / "models" / "emps_closed_loop.toml").compile()
    assert [(one.name, one.channel, one.unit) for one in compiled.inputs] == [("axis", "/command.position[0]", "m")]
    assert [(one.name, one.channel, one.unit) for one in compiled.outputs] == [
        ("position", "/axis.position[0]", "m"),
        ("motor", "/axis.effort[0]", "N"),
    ]
    assert [law.parameters for law in compiled.laws] == [(351.5,)]


def test_the_measured_damper_has_no_states(shared_data: Path) -> None:
    compiled = load_model(shared_data / "models" / "mr_damper.toml").compile()
    assert compiled.states == ()
    assert compiled.d.tolist() == [[1e3, 8e3, 0.0]]


def test_friction_of_the_vocabulary_reads_in_the_joint_s_unit(tmp_path: Path) -> None:
    model = structure(tmp_path).with_effects([attached("ripple", "motor", {"amplitude": 0.5, "period": 0.01})])
    assert_round_trip(model, tmp_path)


LINK = """
[[effect]]
effect = "missing_link"
site = "ground~wrist"
parameters = { stiffness = "20 kN/m", damping = 5.0 }

[[effect]]
effect = "swapped_channels"
site = "acc_wrist~bend"
"""


def test_a_pair_is_a_site(tmp_path: Path) -> None:
    model = structure(tmp_path, STRUCTURE + LINK)
    link, swap = model.effects[-2:]
    assert (link.site, link.values) == ("ground~wrist", {"stiffness": 2e4, "damping": 5.0})
    assert swap.site == "acc_wrist~bend"
    assert_round_trip(model, tmp_path)


@pytest.mark.parametrize("site", ["ground~wirst", "wrist~", "wrist~shoe"])
def test_a_pair_of_what_there_is_not_is_told(tmp_path: Path, site: str) -> None:
    with pytest.raises(ModelError, match=f"no site '{site}'"):
        structure(tmp_path, STRUCTURE + LINK.replace("ground~wrist", site))


def test_a_pair_that_there_is_not_leads_to_the_nearest_pair(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="ground~wrist"):
        structure(tmp_path, STRUCTURE + LINK.replace("ground~wrist", "ground~wirst"))
