import json
from types import SimpleNamespace

import pytest

from chladni.cli import compare
from chladni.signals.comparison import PeakChange
from chladni.signals.peak import Peak
from tests.arm import TOOL, write_arm


@pytest.fixture(scope="module")
def louder_log(tmp_path_factory):
    """The same machine, its tool's sensor reading half as much again."""
    return write_arm(tmp_path_factory.mktemp("louder"), gain=1.5, name="louder.mcap")


def test_the_same_log_twice_has_not_changed(run, arm_log):
    outcome = run("compare", arm_log, arm_log, "--json", "-")
    document = outcome.document
    assert document["format"] == "chladni.compare/1"
    assert not any(level["significant"] for level in document["levels"])
    assert {peak["fate"] for peak in document["peaks"]} == {"unchanged"}
    assert "nothing that scatter doesn't explain" in outcome.err


@pytest.mark.nightly
def test_a_louder_channel_is_found_and_the_others_are_not(run, arm_log, louder_log):
    outcome = run("compare", arm_log, louder_log, "--json", "-")
    levels = {level["channel"]: level for level in outcome.document["levels"]}
    assert levels[TOOL]["change_db"] == pytest.approx(3.52, abs=0.01)  # 20 log10(1.5)
    assert [name for name, level in levels.items() if level["significant"]] == [TOOL]
    assert TOOL in outcome.err


def test_logs_without_a_common_channel_are_refused(run, arm_log, tmp_path):
    other = tmp_path / "other.csv"
    other.write_text("time [s],x [N]\n" + "".join(f"{t / 100},{t % 7}\n" for t in range(2000)))
    assert run("convert", other, tmp_path / "other.mcap").code == 0
    outcome = run("compare", arm_log, tmp_path / "other.mcap")
    assert outcome.code == 2
    assert "share no channel" in outcome.err
    assert "; nothing to compare. One has " in outcome.err


def test_figures_are_saved_where_asked_for(run, arm_log, louder_log, tmp_path):
    outcome = run("compare", arm_log, louder_log, "--channel", TOOL, "--figures", tmp_path / "new")
    assert outcome.code == 0, outcome.err
    drawn = ("change-of-psd-1-acceleration", "psd-acceleration")
    names = [f"{name}.{kind}" for name in drawn for kind in ("png", "svg")]
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == names
    assert all(name in outcome.out.replace("\n", "") for name in names)


def test_a_long_list_of_changes_is_cut_with_a_word(run, monkeypatch):
    monkeypatch.setattr(compare, "MOST_ROWS", 2)
    peak = Peak(frequency_hz=10.0, frequency_std_hz=0.1, height=1.0, height_std=0.1, unit="N", channels=("a",))
    gone = PeakChange(fate="vanished", before=peak, after=None, shift_hz=float("nan"), shift_std_hz=float("nan"))
    told = []
    out = SimpleNamespace(channel_table=lambda title, _columns, rows: told.append((title, len(rows))))
    compare._print_peaks(out, "Peaks", [gone] * 5)
    assert told == [("Peaks: 2 of 5 changes, all of them with --json", 2)]


@pytest.mark.nightly
@pytest.mark.slow
def test_modes_of_both_are_compared_when_asked_for(run, arm_log, tmp_path):
    from tests.arm import write_arm

    # A sensor's gain changes one component of every shape, but no frequency and no damping.
    louder = write_arm(tmp_path, gain=1.2)
    outcome = run("compare", arm_log, louder, "--modes", "--json", tmp_path / "compared.json")
    document = json.loads((tmp_path / "compared.json").read_text())
    assert [one["fate"] for one in document["modes"]] == ["unchanged"] * 5
    assert all(one["mac"] < 1 for one in document["modes"])
    assert all(one["shift_std_hz"] > 0 for one in document["modes"])
    assert "change of damping ratio" in outcome.out
    assert run("compare", arm_log, louder, "--json", "-").document["modes"] is None


@pytest.mark.nightly
def test_modes_from_responses_alone_are_compared_too(run, arm_log):
    document = run("compare", arm_log, arm_log, "--operational", "--json", "-").document
    assert {one["fate"] for one in document["modes"]} == {"unchanged"}
