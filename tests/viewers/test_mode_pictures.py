"""What the viewer really shows of modes: no view complains, and shapes move with the phase."""

import io
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.image import imread

from chladni.signals.arrays import Mask, Real
from chladni.viewers.rerun import write_rrd
from tests.viewers import synthetic_modes as made
from tests.viewers.headless import HeadlessViewer, headless_viewer
from tests.viewers.test_rerun_pictures import HAS_VULKAN

if TYPE_CHECKING:
    from numpy.typing import NDArray

pytestmark = [
    pytest.mark.viewer,
    pytest.mark.skipif(not HAS_VULKAN, reason="no Vulkan driver; on Debian: apt install mesa-vulkan-drivers"),
]
PATIENCE_S = 20.0
# Of the shape's view in a window of 1600 x 1000.
SHAPE = (slice(140, 960), slice(10, 620))


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[HeadlessViewer]:
    path = write_rrd(made.arm_study(), tmp_path_factory.mktemp("rrd") / "arm.rrd")
    with headless_viewer(path) as viewer:
        yield viewer


def pixels(viewer: HeadlessViewer) -> Real:
    picture: NDArray[Any] = imread(io.BytesIO(viewer.picture()), format="png")
    return picture[:, :, :3].astype(np.float64)


def red(picture: Real) -> Mask:
    """Where the colour of the greatest amplitude is."""
    wanted = np.array([250, 90, 40]) / 255
    return np.asarray(np.abs(picture - wanted).max(axis=2) < 0.12)


def seen(viewer: HeadlessViewer, wanted: Callable[[Real], bool]) -> Real:
    """Take pictures until one is as wanted: the viewer draws when it finds the time."""
    deadline = time.monotonic() + PATIENCE_S
    picture = pixels(viewer)
    while not wanted(picture) and time.monotonic() < deadline:
        picture = pixels(viewer)
    return picture


def has_red(picture: Real) -> bool:
    return bool(red(picture[SHAPE]).sum() > 100)


def across(picture: Real) -> float:
    """Where on the screen the points of greatest amplitude are, from left to right."""
    columns = np.flatnonzero(red(picture[SHAPE]).any(axis=0))
    return float(columns.mean()) if columns.size else np.nan


def test_shapes_move_with_the_phase_and_pass_through_rest(arm: HeadlessViewer) -> None:
    arm.show("Modes")
    places: dict[int, float] = {}
    for phase in (0, 90, 180):
        before = places.get(phase - 90, np.inf)
        arm.client.set_time("phase", sequence=phase, play_state="paused")
        places[phase] = across(seen(arm, lambda picture, before=before: across(picture) < before - 30))
    # The first mode moves the tool along x: to the right, to its place at rest, to the left.
    assert places[0] > places[90] + 30
    assert places[90] > places[180] + 30
    np.testing.assert_allclose(places[90], (places[0] + places[180]) / 2, atol=15)


def test_on_time_the_page_is_complete_when_the_file_opens(arm: HeadlessViewer) -> None:
    arm.show("Modes")
    arm.move("time", 0.0)
    assert has_red(seen(arm, has_red))
    assert arm.complaints() == []


@pytest.mark.parametrize("page", ["3: 66.32 Hz, 2.58 %", "All", "Poles and fit"])
def test_no_view_of_any_page_complains(arm: HeadlessViewer, page: str) -> None:
    arm.show(page)
    arm.move("time", 0.0)

    def is_drawn(picture: Real) -> bool:
        # More than the dark ground and its titles.
        return bool((picture[140:960] > 0.4).any(axis=2).mean() > 0.002)

    assert is_drawn(seen(arm, is_drawn))
    assert arm.complaints() == []


@pytest.mark.nightly
@pytest.mark.slow
def test_bars_without_places_are_shown(tmp_path: Path) -> None:
    with headless_viewer(write_rrd(made.without_geometry(), tmp_path / "bars.rrd")) as viewer:
        viewer.show("Modes")
        assert has_red(seen(viewer, has_red))
        assert viewer.complaints() == []
