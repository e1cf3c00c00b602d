"""Whitening that allows for an error of the law: against noise of known colour."""

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.gap.calibration import LAW_ERROR
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.law_error import with_law_error
from chladni.gap.tuning.output_error import fit_output_error
from chladni.models.effects.attached_effect import attached
from tests.gap.made_log import band_noise, chain, measured, white_floor

#: A drift: nearly all of its power below a hundredth of the sample rate.
DRIFT = np.array([[1.0, -1.6, 0.61]])


def drifting(rms: float) -> NoiseFloor:
    impulse = lfilter([1.0], DRIFT[0], np.eye(1, 4000)[0])
    innovation = rms / np.sqrt(np.sum(impulse**2))
    return NoiseFloor(
        rms=np.array([rms]), whitening=DRIFT, innovation_rms=np.array([innovation]), method=("periods",),
        std=np.array([0.1]), upper_bound=np.array([False]),
    )  # fmt: skip


def samples_of(floor: NoiseFloor, count: int, seed: int = 0):
    white = np.random.default_rng(seed).standard_normal(count + 2000)
    return (lfilter([1.0], floor.whitening[0], white) * floor.innovation_rms[0])[None, 2000:]


def test_a_white_floor_stays_as_it_is() -> None:
    floor = white_floor([0.1])
    assert with_law_error(floor, np.array([100.0])) is floor


def test_noise_that_is_loud_in_all_bands_keeps_its_colour() -> None:
    seen = with_law_error(drifting(10.0), np.array([1e-3]))
    np.testing.assert_allclose(seen.whitening, DRIFT, atol=1e-6)
    np.testing.assert_allclose(seen.innovation_rms, drifting(10.0).innovation_rms, rtol=1e-6)


@pytest.mark.parametrize("rms", [1e-5, 1e-3, 1e-2, 0.3])
def test_noise_alone_has_a_whitened_mean_square_of_one(rms: float) -> None:
    floor = drifting(rms)
    seen = with_law_error(floor, np.array([1.0]))
    white = seen.whitened(samples_of(floor, 200_000))
    # Drift of the last pole, 1/(1 - 0.97), leaves some 6000 independent samples: two sigma of 2 %.
    assert np.mean(white**2) == pytest.approx(1.0, rel=0.05)
    np.testing.assert_allclose(seen.rms, floor.rms)


def test_where_noise_is_far_below_the_law_error_all_bands_count_alike() -> None:
    seen = with_law_error(drifting(0.01 * LAW_ERROR), np.array([1.0]))
    gain = np.abs(np.fft.rfft(seen.whitening[0], 256))
    assert gain.max() / gain.min() < 1.01


@pytest.mark.nightly
def test_a_faint_drift_does_not_turn_a_fit_toward_the_corners_of_a_law() -> None:
    """Friction of another law than the fitted one: what is left must be what white noise would have left."""
    model = chain([1.0], [4e4], [8.0])
    machine = model.with_effects(
        [attached("stribeck_friction", "j0", {"coulomb": 20.0, "static": 30.0, "speed": 0.05}, variant="bristle")]
    )
    log, _ = measured(machine, band_noise(1500, rms=60.0), noise=1e-6)
    scale = float(np.std(log.outputs))
    left = []
    for floor in (drifting(1e-3 * scale), white_floor([1e-3 * scale])):
        start = attached("coulomb_friction", "j0", {"force": 10.0, "creep_speed": 5e-3})
        fit = fit_output_error(FreeRun(model, log), floor, effects=[start])
        left.append(float(np.std(log.outputs - fit.outputs)) / scale)
    assert left[0] < 1.02 * left[1]
