"""A diagnosis in a .rrd file: read back by rerun's own reader, value by value."""

import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr

from chladni.apps.gap_evidence import gap_evidence
from chladni.apps.gap_structure import structure_sketch
from chladni.gap.records.diagnosis import Diagnosis
from chladni.signals.engineering import engineering
from chladni.viewers.gap_band import band_told, shown_hz
from chladni.viewers.rerun import gap_signals, restoring_force
from chladni.viewers.rerun.gap import write_gap_rrd
from chladni.viewers.restoring_force import force_range
from tests import made_diagnosis as made
from tests.viewers.headless import EXECUTABLE, headless_viewer
from tests.viewers.rrd import Contents
from tests.viewers.test_rerun_pictures import HAS_VULKAN


@pytest.fixture(autouse=True)
def strict() -> Any:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def written(found: Diagnosis, folder: Path) -> Path:
    sketch = structure_sketch(made.arm_model(), found.where)
    return write_gap_rrd(gap_evidence(found), folder / "gap.rrd", sketch=sketch)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(made.diagnosis(), tmp_path_factory.mktemp("rrd"))


@pytest.fixture(scope="module")
def arm(file: Path) -> Contents:
    return Contents(file)


def test_rerun_verifies_the_file(file: Path) -> None:
    outcome = subprocess.run([EXECUTABLE, "rrd", "verify", file], capture_output=True, text=True, check=False)
    assert outcome.returncode == 0, outcome.stderr


@pytest.mark.parametrize("row", [0, 1])
def test_signals_are_measured_before_and_after(arm: Contents, row: int) -> None:
    signals = made.signals()
    for place, values in enumerate((signals.measured, signals.before, signals.after)):
        np.testing.assert_array_equal(arm.scalars(f"/signals/{row + 1}/{place}")[:, 0], values[row])
    times = arm.times(f"/signals/{row + 1}/0", "time")
    np.testing.assert_array_equal(times, np.arange(values.shape[1]) * 2_000_000)


def test_errors_are_what_is_left(arm: Contents) -> None:
    signals = made.signals()
    for place, simulated in enumerate((signals.before, signals.after)):
        np.testing.assert_array_equal(arm.scalars(f"/errors/2/{place}")[:, 0], signals.measured[1] - simulated[1])


@pytest.mark.parametrize("entity", ["/signals/1/0", "/errors/1/1", "/restoring_force/time/0"])
def test_vibration_does_not_look_like_silence_when_zoomed_out(arm: Contents, entity: str) -> None:
    policy = arm.static(entity)["SeriesLines:aggregation_policy"]
    assert policy == [rr.components.AggregationPolicy.MinMax.value]


def test_both_maps_have_one_range_of_colours(arm: Contents) -> None:
    before, after = (arm.static(f"/gap_map/{what}") for what in ("before", "after"))
    assert before["Tensor:value_range"] == after["Tensor:value_range"]
    picture = before["Tensor:data"][0]
    times, lines = made.signals().gap_map.shape
    assert (picture["shape"][0], picture["shape"][1] <= lines) == (times, True)


def test_the_surface_has_a_dot_for_each_sample_and_the_law_over_it(arm: Contents) -> None:
    force = arm.static("/restoring_force/velocity/force")["Points2D:positions"]
    law = arm.static("/restoring_force/velocity/law")["Points2D:positions"]
    assert len(force) == len(law) == 3000
    # Both stand at the same velocities, up and down by the noise.
    np.testing.assert_array_equal(np.array(force)[:, 0], np.array(law)[:, 0])
    np.testing.assert_allclose(
        arm.scalars("/restoring_force/time/1")[:, 0], made.restoring_force().law_force, rtol=1e-12
    )


def test_maps_show_the_band_that_holds_the_gap_and_say_what_lies_above(tmp_path: Path) -> None:
    signals = made.signals()
    lines = signals.map_frequency_hz
    low = np.where(lines < 20, 1.0, 1e-5) * np.ones_like(signals.gap_map)
    narrow = replace(signals, gap_map=low, gap_map_after=1e-3 * low)
    contents = Contents(written(replace(made.diagnosis(), signals=narrow), tmp_path))
    shown = lines <= shown_hz(narrow)
    assert 20 < lines[shown][-1] < 30
    for what, density in (("before", low), ("after", 1e-3 * low)):
        picture = contents.static(f"/gap_map/{what}")["Tensor:data"][0]
        assert list(picture["shape"]) == [len(density), int(shown.sum())]
        (name,) = (name for name in contents.view_names() if name.startswith(f"Gap {what} [dB re 1/Hz]"))
        assert name.endswith(f" · {band_told(narrow)}")


@pytest.fixture(scope="module")
def wild(tmp_path_factory: pytest.TempPathFactory) -> Contents:
    """Of a force that swings to a hundred times its size at the ends of the record."""
    surface = made.restoring_force()
    force = surface.force.copy()
    force[[0, 1, -1]] = 100 * np.abs(force).max() * np.array([1.0, -0.5, -1.0])
    found = replace(made.diagnosis(), restoring_forces=(replace(surface, force=force),))
    return Contents(written(found, tmp_path_factory.mktemp("wild")))


def test_wild_ends_of_a_record_do_not_flatten_the_force_over_time(wild: Contents) -> None:
    (name,) = (name for name in wild.view_names() if name.startswith("Force recovered at elbow [N]"))
    (low, high), *_ = (row["ScalarAxis:range"][0] for row in wild.blueprint if row.get("ScalarAxis:range"))
    assert (low, high) == pytest.approx(force_range(made.restoring_force()), rel=0.1)
    assert name.startswith(f"Force recovered at elbow [N], ±{engineering(high, None, 'N')} ")
    most = np.abs(wild.scalars("/restoring_force/time/0")).max()
    assert name.endswith(f" · reaches {engineering(most, None, 'N')}, beyond the axis")


@pytest.mark.parametrize("over", ["displacement", "velocity"])
def test_dots_beyond_the_axis_are_counted_not_drawn_among_the_numbers(wild: Contents, over: str) -> None:
    dots = np.array(wild.static(f"/restoring_force/{over}/force")["Points2D:positions"])
    assert ((dots[:, 1] >= 0) & (dots[:, 1] <= restoring_force.HEIGHT)).all()
    (name,) = (name for name in wild.view_names() if name.startswith(f"Force recovered at elbow over {over}"))
    assert name.endswith(f" · {3000 - len(dots)} of 3000 dots lie beyond the axis")
    assert len(dots) < len(wild.static(f"/restoring_force/{over}/law")["Points2D:positions"]) == 3000


def test_names_of_both_axes_stand_within_the_view(arm: Contents) -> None:
    labels = arm.static("/restoring_force/velocity/axes/numbers")
    bounds = [row["VisualBounds2D:range"][0] for row in arm.blueprint if row.get("VisualBounds2D:range")]
    for name in ("velocity [m/s]", "force [N]"):
        x, y = labels["Points2D:positions"][labels["Points2D:labels"].index(name)]
        for one in bounds:
            (left, right), (top, bottom) = one["x_range"], one["y_range"]
            assert left < x < right
            # A name hangs below its place.
            assert top < y < bottom


def test_the_law_over_time_is_drawn_in_front_of_the_force(arm: Contents) -> None:
    # The viewer draws lines in the order of their paths.
    paths = sorted(entity for entity in arm.entities() if entity.startswith("/restoring_force/time/"))
    assert [arm.static(path)["SeriesLines:names"] for path in paths] == [["recovered"], ["law"]]


def test_parts_of_the_structure_are_named_with_their_shares_and_coloured(arm: Contents) -> None:
    joints = arm.static("/structure/joints")
    assert joints["LineStrips3D:labels"] == ["shoulder 31 %", "elbow 93 %"]
    shoulder, elbow = joints["LineStrips3D:colors"]
    # Red counts more in the one that explains more.
    assert (elbow >> 24) & 255 > (shoulder >> 24) & 255
    assert arm.static("/structure/bodies")["Points3D:labels"] == ["column", "wrist"]


def test_the_answer_is_inert_markdown(tmp_path: Path) -> None:
    found = replace(made.diagnosis(), remarks=("see ![x](http://a/b.png)",))
    text = Contents(written(found, tmp_path)).static("/answer")["TextDocument:text"][0]
    assert "**Most likely Coulomb friction of 8.10" in text
    assert "![x]" not in text
    assert "http\\:" in text


def test_the_arrangement_has_a_page_of_each_kind(arm: Contents) -> None:
    names = arm.view_names()
    for name in ("Answer", "acc_wrist [m/s²]", "acc_column [m/s²]"):
        assert name in names
    assert any(name.startswith("Force recovered at elbow [N], ±") for name in names)
    assert any(name.startswith("Gap before [dB re 1/Hz]") for name in names)
    assert any(name.startswith("What each part alone can explain") for name in names)


def test_long_logs_are_thinned_and_say_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gap_signals, "ROWS_OF_A_LINE", 300)
    contents = Contents(written(made.diagnosis(), tmp_path))
    assert contents.scalars("/signals/1/0").shape[0] <= 300
    assert any("least and greatest of every" in name for name in contents.view_names())


def test_what_is_not_there_has_no_page(tmp_path: Path) -> None:
    bare = replace(made.agreeing(), signals=None, restoring_forces=())
    contents = Contents(write_gap_rrd(gap_evidence(bare), tmp_path / "bare.rrd"))
    assert contents.entities() >= {"/answer"}
    assert not any(entity.startswith(("/signals", "/structure", "/gap_map")) for entity in contents.entities())
    assert contents.view_names() == ["Answer"]


@pytest.mark.nightly
@pytest.mark.viewer
@pytest.mark.skipif(not HAS_VULKAN, reason="no Vulkan driver; on Debian: apt install mesa-vulkan-drivers")
def test_no_view_of_any_page_complains(file: Path) -> None:
    with headless_viewer(file) as viewer:
        for page in ("Answer", "Gap map", "Restoring force", "Structure"):
            viewer.show(page)
            viewer.picture(max_size=400)
            assert viewer.complaints() == []


def test_of_two_forces_each_has_a_page(tmp_path: Path) -> None:
    first = made.restoring_force()
    found = replace(made.two_causes(), restoring_forces=(first, replace(first, site="shoulder")))
    contents = Contents(written(found, tmp_path))
    for site in ("elbow", "shoulder"):
        assert f"/restoring_force_at_{site}/velocity/force" in contents.entities()
        assert any(name.startswith(f"Force recovered at {site} over velocity") for name in contents.view_names())
