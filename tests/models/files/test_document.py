"""The files that the document shows are files that load."""

import re
from pathlib import Path

import pytest

from chladni.models.files.model_file import load_model, write_model
from chladni.models.structures.structure_model import StructureModel

DOCUMENT = Path(__file__).parents[3] / "docs" / "model-file.md"
EXAMPLES = re.findall(r"```toml\n(format.*?)```", DOCUMENT.read_text(encoding="utf-8"), re.DOTALL)


def test_the_document_has_a_file_of_each_kind() -> None:
    assert [re.search(r'kind = "(\w+)"', text)[1] for text in EXAMPLES] == ["structure", "drive", "scheme"]  # type: ignore[index]


@pytest.mark.parametrize("text", EXAMPLES)
def test_the_document_s_files_load_and_survive(tmp_path: Path, text: str) -> None:
    path = tmp_path / "m.toml"
    path.write_text(text)
    model = load_model(path)
    write_model(model, path)
    assert load_model(path).parameters.numbers() == model.parameters.numbers()


def test_the_document_s_arm_is_as_it_says(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(EXAMPLES[0])
    model = load_model(path)
    assert isinstance(model, StructureModel)
    assert model.parameters["elbow.stiffness"].value == 600000.0
    assert model.parameters["axis.kv"].unit == "V/(m/s)"
    assert [one.name for one in model.compile().inputs] == ["axis", "hammer", "disturbance"]
    assert [one.name for one in model.compile().outputs] == ["acc_wrist", "bend", "motor"]
    # A stable loop: the numbers in the document are ones that work.
    assert model.poles().real.max() < 0
