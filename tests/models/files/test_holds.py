"""What runs between samples, as model files of all kinds say it."""

from pathlib import Path

import pytest

from chladni.models.core.compiled_model import CompiledModel
from chladni.models.core.port import HOLDS, HoldKind
from chladni.models.files.model_file import load_model, write_model
from chladni.signals.errors import ModelError
from tests.models.files.made_files import DRIVE, SCHEME, STRUCTURE, written

#: Where a hold stands in a file, by the name of the signal that it belongs to.
PLACES = {
    "hammer": (STRUCTURE, 'at = "wrist"\nchannel = "/hammer.wrench.force.x"'),
    "acc_wrist": (STRUCTURE, 'channel = "/wrist.accel.linear.x"'),
    "axis": (STRUCTURE, 'reference = "/command.position[0]"'),
    "noise": (STRUCTURE, 'kind = "disturbance"'),
    "flow": (DRIVE, 'signal = "flow"'),
    "v": (DRIVE, 'signal = "velocity"'),
    "reference": (SCHEME, 'name = "reference"'),
}


def with_hold(name: str, hold: str) -> str:
    text, place = PLACES[name]
    assert text.count(place) == 1
    return text.replace(place, f'{place}\nhold = "{hold}"')


def hold_in(compiled: CompiledModel, name: str) -> HoldKind | None:
    (found,) = [one.hold for one in (*compiled.inputs, *compiled.outputs) if one.name == name]
    return found


@pytest.mark.parametrize("hold", HOLDS)
@pytest.mark.parametrize("name", PLACES)
def test_a_hold_is_read_kept_and_written(tmp_path: Path, name: str, hold: HoldKind) -> None:
    model = load_model(written(tmp_path, with_hold(name, hold)))
    assert hold_in(model.compile(), name) == hold
    write_model(model, tmp_path / "again.toml")
    assert hold_in(load_model(tmp_path / "again.toml").compile(), name) == hold


@pytest.mark.parametrize("name", PLACES)
def test_what_nobody_said_is_straight_and_stays_unsaid(tmp_path: Path, name: str) -> None:
    model = load_model(written(tmp_path, PLACES[name][0]))
    assert hold_in(model.compile(), name) is None
    assert set(model.compile().holds) <= {"foh"}
    write_model(model, tmp_path / "again.toml")
    assert "hold" not in (tmp_path / "again.toml").read_text()


@pytest.mark.parametrize("name", PLACES)
def test_a_hold_is_replaced_in_a_model_and_in_its_equations(tmp_path: Path, name: str) -> None:
    model = load_model(written(tmp_path, PLACES[name][0]))
    there = model.with_holds({name: "band_limited"})
    assert hold_in(there.compile(), name) == "band_limited"
    assert hold_in(model.compile().with_holds({name: "zoh"}), name) == "zoh"
    assert hold_in(model.compile(), name) is None
    for one in (model, model.compile()):
        with pytest.raises(ModelError, match=f"no input or output '{name}x'; did you mean '{name}'"):
            one.with_holds({f"{name}x": "zoh"})


@pytest.mark.parametrize("name", PLACES)
def test_a_word_that_is_none_is_told(tmp_path: Path, name: str) -> None:
    with pytest.raises(ModelError, match="hold: found 'first'; must be"):
        load_model(written(tmp_path, with_hold(name, "first")))


def test_a_prescribed_motion_is_not_held(tmp_path: Path) -> None:
    text = STRUCTURE.replace('kind = "base_acceleration"', 'kind = "displacement"\nat = "column"\nhold = "zoh"')
    with pytest.raises(ModelError, match=r"\[\[input\]\] 3 hold: found 'zoh'; a motion that jumps has no velocity"):
        load_model(written(tmp_path, text))
    with pytest.raises(ModelError, match="a motion that jumps"):
        load_model(written(tmp_path, text.replace('hold = "zoh"\n', ""))).with_holds({"floor": "zoh"})
