import numpy as np
import pytest

from chladni.gap.comparison.residual_spectra import ResidualSpectra

BLOCKS, LINES = 200, 40


def spectra_of(residual: np.ndarray) -> ResidualSpectra:
    return ResidualSpectra(
        residual=residual / np.sqrt(LINES),
        freedom=np.full((BLOCKS, residual.shape[2]), float(LINES)),
        edges=np.linspace(0, 0.5, BLOCKS + 1),
    )


def noise(rng: np.random.Generator, outputs: int) -> np.ndarray:
    shape = (BLOCKS, LINES, outputs)
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


@pytest.mark.parametrize("outputs", [1, 2, 5])
def test_noise_of_each_sensor_keeps_its_power(outputs: int) -> None:
    sizes = np.arange(1, outputs + 1)
    found = spectra_of(noise(np.random.default_rng(1), outputs) * sizes)
    for densities in (found.densities(), found.incoherent_densities()):
        # Power of 200 x 40 complex numbers is known to 1/sqrt(8000).
        np.testing.assert_allclose(densities.mean(axis=1), sizes**2, rtol=5 / np.sqrt(BLOCKS * LINES))


def test_what_all_outputs_share_is_taken_out() -> None:
    rng = np.random.default_rng(2)
    shared = 30 * noise(rng, 1) * np.array([1.0, -0.5j, 2.0, 0.7])
    own = noise(rng, 4)
    found = spectra_of(own + shared)
    assert np.all(found.densities().mean(axis=1) > 200)
    # 1/[S^-1]_jj = 1/(1 - |l_j|^2/(1 + |l|^2)) with unit noise.
    loading = 30 * np.abs([1.0, 0.5, 2.0, 0.7])
    expected = 1 / (1 - loading**2 / (1 + np.sum(loading**2)))
    np.testing.assert_allclose(found.incoherent_densities().mean(axis=1), expected, rtol=5 / np.sqrt(BLOCKS * LINES))
    assert np.all(expected >= 1)


def test_one_signal_on_all_outputs_leaves_nothing() -> None:
    shared = noise(np.random.default_rng(3), 1) * np.array([1.0, 2.0])
    found = spectra_of(shared)
    assert np.all(found.incoherent_densities().mean(axis=1) < 1e-9 * found.densities().mean(axis=1))


def test_too_little_freedom_or_a_silent_output_leaves_the_whole_residual() -> None:
    rng = np.random.default_rng(4)
    silent = noise(rng, 2) * np.array([1.0, 0.0])
    np.testing.assert_array_equal(spectra_of(silent).incoherent_densities(), spectra_of(silent).densities())
    few = ResidualSpectra(residual=noise(rng, 4), freedom=np.full((BLOCKS, 4), 6.0), edges=np.arange(BLOCKS + 1.0))
    np.testing.assert_array_equal(few.incoherent_densities(), few.densities())
