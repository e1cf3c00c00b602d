"""What two logs compared say of how they were averaged."""

import pytest

import chladni
from chladni.apps.compare import compare_logs
from chladni.io.convert import convert
from tests.arm import FORCE, write_arm


@pytest.mark.nightly
@pytest.mark.slow
def test_a_note_is_told_once_and_with_its_log_when_it_holds_for_one(tmp_path):
    arm = write_arm(tmp_path)
    # The arm's log misses a stretch from 20 s on.
    convert(arm, tmp_path / "whole.mcap", end_s=19)
    with chladni.open_log(tmp_path / "whole.mcap") as whole, chladni.open_log(arm) as gappy:
        differing = compare_logs(whole, gappy, references=[FORCE])
        same = compare_logs(gappy, gappy, references=[FORCE])
    for found, sign in ((differing, "after: "), (same, "")):
        assert found.response is not None
        assert len(set(found.notes)) == len(found.notes)
        missing = [note for note in found.notes if "samples are missing" in note]
        assert missing
        assert all(note.startswith(sign) for note in missing)
    assert not [note for note in same.notes if note.startswith(("before", "after"))]
