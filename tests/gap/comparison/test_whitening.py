import numpy as np
import pytest
from scipy.signal import lfilter, welch

from chladni.gap.calibration import LAW_ERROR
from chladni.gap.comparison.whitening import noise_floor_of, with_law_error
from chladni.gap.plant.free_run import FreeRun
from chladni.gap.records.noise_floor import NoiseFloor
from chladni.gap.tuning.output_error import fit_output_error
from chladni.models.effects.attached_effect import attached
from tests.gap.made_log import band_noise, chain, measured, white_floor


def floor_of(spectrum: np.ndarray, *, samples: int = 20000) -> NoiseFloor:
    count = len(spectrum)
    return noise_floor_of(
        spectrum,
        samples=samples,
        freedom=np.full(count, 200.0),
        method=("periods",) * count,
        upper_bound=np.zeros(count, dtype=np.bool_),
        scale=np.ones(count),
    )


def spectrum_of(coefficients: np.ndarray, variance: float, lines: int = 1025) -> np.ndarray:
    z = np.exp(-2j * np.pi * np.linspace(0, 0.5, lines))
    return np.asarray(variance / np.abs(np.polyval(coefficients[::-1], z)) ** 2)


def test_an_autoregressive_spectrum_gives_back_its_coefficients() -> None:
    poles = 0.9 * np.exp(1j * np.array([0.7, -0.7, 2.0, -2.0]))
    coefficients = np.poly(poles).real
    floor = floor_of(np.array([spectrum_of(coefficients, 0.25)]))
    np.testing.assert_allclose(floor.whitening[0, :5], coefficients, atol=1e-6)
    assert floor.innovation_rms[0] == pytest.approx(0.5, rel=1e-6)
    # The spectrum at its own lines comes back, and its mean is the mean square.
    lines = np.linspace(0, 1, 4096, endpoint=False)
    assert np.mean(floor.density(lines)[0]) == pytest.approx(floor.rms[0] ** 2, rel=1e-6)


def test_white_noise_is_its_own_innovation_and_outputs_keep_their_sizes() -> None:
    floor = floor_of(np.array([np.full(513, 4.0), spectrum_of(np.array([1.0, -0.8]), 1.0, 513)]))
    np.testing.assert_allclose(floor.rms, [2.0, 1 / np.sqrt(1 - 0.64)], rtol=1e-6)
    np.testing.assert_allclose(floor.innovation_rms, [2.0, 1.0], rtol=1e-6)
    np.testing.assert_array_equal(floor.whitening[0, 1:], 0.0)
    np.testing.assert_allclose(floor.std, 1 / np.sqrt(400))


@pytest.mark.parametrize("rate_hz", [1.0, 250.0])
def test_a_one_sided_spectrum_adds_to_the_mean_square_and_is_that_of_the_noise(rate_hz: float) -> None:
    coefficients = np.array([1.0, -1.2, 0.8])
    floor = floor_of(np.array([spectrum_of(coefficients, 0.09)]))
    (density,) = floor.one_sided(rate_hz)
    hz = np.linspace(0, rate_hz / 2, density.size)
    assert np.trapezoid(density, hz) == pytest.approx(floor.rms[0] ** 2, rel=1e-6)
    noise = lfilter([0.3], coefficients, np.random.default_rng(1).standard_normal(200_000))
    seen_hz, seen = welch(noise, fs=rate_hz, nperseg=256)
    # 1561 segments with half overlap: each line scatters by 3 %; the window fills the sharpest turns a little.
    np.testing.assert_allclose(seen[2:-2], np.interp(seen_hz, hz, density)[2:-2], rtol=0.15)


def test_whitening_makes_the_noise_white_of_unit_variance() -> None:
    coefficients = np.array([1.0, -1.2, 0.8])
    noise = lfilter([0.3], coefficients, np.random.default_rng(1).standard_normal((1, 50000)))
    floor = floor_of(np.array([spectrum_of(coefficients, 0.09)]))
    white = floor.whitened(noise)[0, 10:]
    assert white.std() == pytest.approx(1.0, rel=5 / np.sqrt(2 * white.size))
    assert abs(np.mean(white[1:] * white[:-1])) < 5 / np.sqrt(white.size)


def test_the_order_grows_with_the_samples_that_vouch_for_it() -> None:
    rng = np.random.default_rng(2)
    rough = np.array([1 + 0.05 * rng.standard_normal(513)])
    assert floor_of(rough, samples=50).whitening.shape[1] == 1
    assert floor_of(np.abs(rough), samples=10**9).whitening.shape[1] > 1


def test_no_noise_at_all_still_gives_a_filter() -> None:
    floor = floor_of(np.zeros((2, 513)))
    assert np.all(floor.rms == 1e-9)
    assert np.all(np.isfinite(floor.whitened(np.ones((2, 10)))))


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
