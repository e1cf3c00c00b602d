"""Runs whose clocks read between samples, and their slopes."""

import numpy as np
import pytest

from chladni.gap.plant.free_run import FreeRun, read_late
from chladni.gap.plant.law_plant import Setting, coarse_run, fine_run, slopes_of
from chladni.models.effects.attached_effect import attached
from tests.gap.made_log import RATE_HZ, band_noise, measured, three_bodies

SAMPLES = 1000
LAW = attached("quadratic_damping", "j2", {"coefficient": 3e3})
WINDOWS = {"one run": None, "windows": ((0, 430), (430, SAMPLES))}


def late(samples):
    return attached("time_offset", "a1", {"offset": samples / RATE_HZ})


@pytest.fixture(params=WINDOWS)
def run(request):
    log = measured(three_bodies(), band_noise(SAMPLES))[0]
    return FreeRun(three_bodies(), log, tolerance=1e-9, windows=WINDOWS[request.param])


def starts_of(run):
    initial = np.zeros((len(run.windows), 6))
    initial[:, :3] = 1e-4, -2e-4, 1e-4
    return initial


def test_a_late_clock_reads_what_was_and_the_start_before_it():
    outputs = np.stack([np.sin(0.1 * np.arange(50.0)), np.arange(50.0)])
    read = read_late(np.stack([outputs, 2 * outputs]), np.array([0.0, 1.5]), 1.0)
    np.testing.assert_array_equal(read[:, 0], [outputs[0], 2 * outputs[0]])
    np.testing.assert_allclose(read[1, 1], 2 * np.maximum(np.arange(50.0) - 1.5, 0.0), atol=1e-12)


@pytest.mark.parametrize("beyond", [np.nan, np.inf])
def test_what_left_the_numbers_stays_beyond_them_and_the_rest_is_read(beyond):
    """Slopes along motions that part overflow: the fit says so, when it's asked for them."""
    sound = np.sin(0.1 * np.arange(150.0)).reshape(3, 1, 50)
    lost = sound.copy()
    lost[1, 0, 20] = beyond
    read = read_late(lost, np.array([1.5]), 1.0)
    assert np.isnan(read[1]).all()
    np.testing.assert_array_equal(read[::2], read_late(sound, np.array([1.5]), 1.0)[::2])


@pytest.mark.parametrize("laws", [(), (LAW,)], ids=["alone", "beside a law"])
@pytest.mark.parametrize("samples", [1.3, -0.6])
def test_slopes_are_differences_of_the_march(samples, laws, run):
    effects, by = (*laws, late(samples)), 1e-6
    z, start = np.linspace(-0.5, 0.5, 9), starts_of(run)
    changed = [Setting(z + by * row, effects) for row in np.eye(9)]
    changed.append(Setting(z, (*laws, late(samples + by))))
    here = coarse_run(run, Setting(z, effects), start)
    own, starts = slopes_of(run, here, [(setting, by) for setting in changed])
    moved = start.copy()
    moved[-1, 4] += 1e-7
    runs = [(coarse_run(run, setting, start), by) for setting in changed]
    runs.append((coarse_run(run, Setting(z, effects), moved), 1e-7))
    # A start is seen in its own window; at its very beginning a late clock reads the window before.
    begins = run.windows[-1][0] + 10
    for found, (there, size), seen in zip([*own, starts[4]], runs, [*[0] * len(own), begins], strict=True):
        difference = (there.outputs - here.outputs)[:, seen:] / size
        assert np.linalg.norm(difference) > 0
        assert np.linalg.norm(found[:, seen:] - difference) < 2e-3 * np.linalg.norm(difference)


@pytest.mark.parametrize("laws", [(), (LAW,)], ids=["alone", "beside a law"])
def test_slopes_along_a_fine_run_are_those_of_fine_runs(laws, run):
    effects, by = (*laws, late(1.3)), 1e-3
    z, start = np.zeros(9), starts_of(run)
    here = fine_run(run, Setting(z, effects), start)
    np.testing.assert_allclose(here.outputs, run.outputs(z, effects, start), rtol=0, atol=1e-9)
    changed = [Setting(z + by * np.eye(9)[3], effects), Setting(z, (*laws, late(1.3 + by)))]
    own, _ = slopes_of(run, here, [(setting, by) for setting in changed])
    for found, setting in zip(own, changed, strict=True):
        difference = (run.outputs(setting.z, setting.effects, start) - here.outputs) / by
        assert np.linalg.norm(found - difference) < 0.05 * np.linalg.norm(difference)


def test_clipping_comes_behind_a_late_clock(run):
    """Slopes of what a map of samples gives are taken where it acts."""
    z, by, start = np.zeros(9), 1e-6, starts_of(run)

    def effects(samples):
        return (LAW, late(samples), attached("clipping", "a1", {"limit": 20.0}))

    here = fine_run(run, Setting(z, effects(1.3)), start)
    own, _ = slopes_of(run, here, [(Setting(z, effects(1.3 + by)), by)])
    plain = fine_run(run, Setting(z, effects(1.3)[:2]), start)
    free, _ = slopes_of(run, plain, [(Setting(z, effects(1.3 + by)[:2]), by)])
    clipped = np.abs(plain.before_maps[1]) > 20.0
    assert 0.05 < clipped.mean() < 0.95
    np.testing.assert_allclose(own[0, 1], np.where(clipped, 0.0, free[0, 1]), rtol=0, atol=2e-3 * np.abs(free).max())
