import numpy as np
import pytest

from chladni.gap.comparison.local_rational import ResidualSpectra, local_fit, output_error
from tests.gap.comparison import made_measurements as made

SAMPLES = 8192


def rms(densities: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt(densities.mean(axis=1)))


@pytest.mark.parametrize("start", [0, 2000])
def test_a_linear_machine_leaves_next_to_nothing_whether_it_starts_at_rest_or_not(start: int) -> None:
    force = np.random.default_rng(1).standard_normal(SAMPLES + start)
    y = made.machine(force, made.weights(3, 1))[:, start:]
    found = local_fit(force[None, start:], y)
    assert found is not None
    # Second-degree terms over a block of a mode's width; noise of sensors is a thousand times as much.
    assert np.all(rms(found.densities()) < 1e-5 * y.std(axis=1))


def test_two_inputs_are_told_apart() -> None:
    force = np.random.default_rng(2).standard_normal((2, SAMPLES))
    y = made.machine(force[0], made.weights(2, 1)) + made.machine(force[1], made.weights(2, 9))
    found = local_fit(force, y)
    assert found is not None
    assert np.all(rms(found.densities()) < 1e-5 * y.std(axis=1))
    alone = local_fit(force[:1], y)
    assert alone is not None
    assert np.all(rms(alone.densities()) > 0.1 * y.std(axis=1))


@pytest.mark.parametrize("colour", ["white", "pink", "resonant"])
def test_the_residual_has_the_power_of_the_noise_band_by_band(colour: str) -> None:
    rng = np.random.default_rng(3)
    force = rng.standard_normal(SAMPLES)
    y = made.machine(force, made.weights(2, 1))
    noise = 0.01 * y.std(axis=1, keepdims=True) * made.coloured(rng, y.shape, colour)
    found = local_fit(force[None], y + noise)
    assert found is not None
    lines = np.abs(np.fft.rfft(noise, axis=1)) ** 2 / SAMPLES
    frequency = np.fft.rfftfreq(SAMPLES)
    for low in range(0, len(found.edges) - 9, 8):
        inside = (frequency > found.edges[low]) & (frequency < found.edges[low + 8])
        freedom = found.freedom[low : low + 8].sum()
        ratio = found.densities()[:, low : low + 8].mean(axis=1) / lines[:, inside].mean(axis=1)
        # Both sides see the same noise; what differs is what the fit takes, a third of it. Five sigma.
        assert np.all(np.abs(ratio - 1) < 5 / np.sqrt(freedom))


def test_an_input_that_stands_still_changes_nothing_but_the_freedom() -> None:
    rng = np.random.default_rng(4)
    force = rng.standard_normal(SAMPLES)
    y = made.machine(force, made.weights(1, 1)) + 0.1 * rng.standard_normal(SAMPLES)
    found = local_fit(np.array([force, np.zeros(SAMPLES)]), y)
    assert found is not None
    # The estimator's own scatter, 1/sqrt(2 freedom), five times.
    assert rms(found.densities())[0] == pytest.approx(0.1, rel=5 / np.sqrt(2 * found.freedom.sum()))


def test_units_of_inputs_do_not_matter() -> None:
    rng = np.random.default_rng(5)
    force = rng.standard_normal(SAMPLES)
    y = made.machine(force, made.weights(1, 1)) + 0.1 * rng.standard_normal(SAMPLES)
    one, other = local_fit(force[None], y), local_fit(1e9 * force[None], y)
    assert one is not None
    assert other is not None
    np.testing.assert_allclose(other.densities(), one.densities(), rtol=1e-6)


def test_a_record_shorter_than_a_block_gives_none_and_a_silent_output_zero() -> None:
    rng = np.random.default_rng(6)
    assert local_fit(rng.standard_normal((1, 40)), rng.standard_normal((1, 40))) is None
    silent = local_fit(rng.standard_normal((1, 500)), np.zeros((2, 500)))
    assert silent is not None
    assert not silent.densities().any()


def test_a_rational_function_of_second_degree_is_fitted_exactly() -> None:
    rng = np.random.default_rng(7)
    r = np.linspace(-1, 1, 20)
    u = rng.standard_normal((1, 20)) + 1j * rng.standard_normal((1, 20))
    response = (1 + 2j * r - r**2) / (1 + (0.5 - 0.2j) * r + 0.3j * r**2)
    left = output_error(u[:, :, None], response * u, r)
    assert np.abs(left).max() < 1e-12


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
