"""What the viewer really shows: no view complains, and a peak stands where it belongs."""

import io
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.image import imread

from chladni.signals.arrays import Mask, Real
from chladni.signals.study import Study
from chladni.viewers.rerun import write_rrd
from chladni.viewers.style import Style
from tests.viewers import synthetic
from tests.viewers.headless import HeadlessViewer, headless_viewer

if TYPE_CHECKING:
    from numpy.typing import NDArray

DRIVERS = (Path("/usr/share/vulkan/icd.d"), Path("/etc/vulkan/icd.d"))
HAS_VULKAN = "VK_ICD_FILENAMES" in os.environ or any(list(folder.glob("*.json")) for folder in DRIVERS)

pytestmark = [
    pytest.mark.viewer,
    pytest.mark.skipif(not HAS_VULKAN, reason="no Vulkan driver; on Debian: apt install mesa-vulkan-drivers"),
]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[HeadlessViewer]:
    path = write_rrd(synthetic.study(), tmp_path_factory.mktemp("rrd") / "arm.rrd")
    with headless_viewer(path) as viewer:
        yield viewer


def pixels(viewer: HeadlessViewer) -> Real:
    """[row, column, rgb] from 0 to 1."""
    picture: NDArray[Any] = imread(io.BytesIO(viewer.picture()), format="png")
    return picture[:, :, :3].astype(np.float64)


def of_colour(picture: Real, colour: tuple[int, int, int], tolerance: float = 0.1) -> Mask:
    return np.asarray(np.abs(picture - np.array(colour) / 255).max(axis=2) < tolerance)


def test_no_view_of_any_page_complains(arm: HeadlessViewer) -> None:
    for page in ("Overview", "wrist.x", "Frequency responses"):
        arm.show(page)
        arm.move("time", 0.0125)
        arm.picture()
        assert arm.complaints() == []


def test_the_arrangement_is_ours(arm: HeadlessViewer) -> None:
    kinds = [view.view_class for view in arm.views()]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {
        "TextDocument": 1,
        "TimeSeries": 2 + 2 + 3 + 4,
        "BarChart": 4,
        "2D": 1 + 4,
        "3D": 1,
    }


@pytest.mark.nightly
def test_names_that_try_to_break_the_viewer_do_not(tmp_path: Path) -> None:
    path = write_rrd(synthetic.hostile_study(), tmp_path / "hostile.rrd")
    with headless_viewer(path) as viewer:
        viewer.picture()
        assert viewer.complaints() == []


@pytest.mark.nightly
def test_peak_of_the_density_stands_under_the_cursor_at_its_frequency(tmp_path: Path) -> None:
    density = synthetic.density()
    only = replace(density, values=density.values[3:], std=density.std[3:], channels=density.channels[3:])
    study = Study(title="one", densities=(only,))
    colour = Style.of(study).on_dark(only.channels[0])
    with headless_viewer(write_rrd(study, tmp_path / "one.rrd")) as viewer:
        # Without the legend; and with the cursor elsewhere first, for it hides what is under it.
        viewer.move("frequency", 0.1)
        line = of_colour(pixels(viewer)[100:950, 500:1100], colour)
        viewer.move("frequency", synthetic.SECOND_PEAK_HZ / 1000)
        picture = pixels(viewer)[100:950, 500:1100]
    rows = np.where(line.any(axis=0), line.argmax(axis=0), line.shape[0])
    # The cursor is the one column that is bright and grey from top to bottom.
    bright = (picture.min(axis=2) > 0.5) & (np.ptp(picture, axis=2) < 0.05)
    cursor = int(bright.sum(axis=0).argmax())
    # The higher of the two peaks; lines of the spectrum are two pixels apart.
    assert abs(int(rows.argmin()) - cursor) <= 3


@pytest.mark.nightly
def test_deflection_shape_moves_with_the_cursor_and_rests_outside_the_band(arm: HeadlessViewer) -> None:
    arm.show("Frequency responses")
    pictures = {}
    for hertz in (synthetic.PEAK_HZ, synthetic.SECOND_PEAK_HZ, 500.0):
        arm.move("time", hertz / 1000)
        pictures[hertz] = pixels(arm)[100:500, 1060:1590]
    moved = {hertz: of_colour(picture, (225, 225, 225), 0.15) for hertz, picture in pictures.items()}
    assert moved[synthetic.PEAK_HZ].sum() > 3 * moved[500.0].sum() + 100
    assert (moved[synthetic.PEAK_HZ] ^ moved[synthetic.SECOND_PEAK_HZ]).sum() > 100
