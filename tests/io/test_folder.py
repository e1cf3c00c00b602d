"""Folders that are made."""

from pathlib import Path

import pytest

from chladni.io.folder import made_folder
from chladni.signals.errors import LogError


def test_a_folder_is_made_with_those_above_it_and_may_be_there_already(tmp_path: Path) -> None:
    wanted = tmp_path / "one" / "two"
    assert made_folder(wanted) == made_folder(wanted) == wanted
    assert wanted.is_dir()


@pytest.mark.parametrize("below", [".", "below", "below/that"])
def test_a_file_in_the_way_is_told(tmp_path: Path, below: str) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LogError, match=r"file.*: can't be made a folder .*; name another"):
        made_folder(tmp_path / "file" / below)
