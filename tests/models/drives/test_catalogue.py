import pytest

from chladni.models.drives.catalogue import DRIVES


def test_words_are_those_of_the_model_file():
    assert {"pneumatic-motor", "hydraulic-motor", "dc-servo"} <= set(DRIVES)
    assert all(name == kind.name for name, kind in DRIVES.items())


def test_nobody_changes_the_catalogue():
    with pytest.raises(TypeError):
        DRIVES["other"] = DRIVES["dc-servo"]
