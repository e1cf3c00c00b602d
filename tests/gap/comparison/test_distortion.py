from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from chladni.gap.comparison.distortion import Distortion, distortion_of
from chladni.gap.comparison.periodicity import with_period
from tests.gap.comparison import made_measurements as made

PERIOD, PERIODS, HIGHEST = 4096, 8, 600
NOISE = 0.01


def lines_of(kind: str, rng: np.random.Generator) -> np.ndarray:
    odd = np.arange(1, HIGHEST, 2)
    if kind == "full":
        return np.arange(1, HIGHEST)
    if kind == "odd":
        return odd
    # One of four odd lines, at random, is left out to see what falls there.
    out = np.arange(0, odd.size - 3, 4) + rng.integers(0, 4, (odd.size - 3 + 3) // 4)
    return np.delete(odd, out)


def run(kind: str, *, square: float = 0.0, cube: float = 0.0, seed: int = 1, noise: float = NOISE) -> Distortion:
    """Split the output ``x + square (x^2 - 1) + cube x^3`` of a filtered multisine x of unit power."""
    rng = np.random.default_rng(seed)
    u = np.tile(made.multisine(rng, PERIOD, lines_of(kind, rng)), PERIODS + 1)
    x = lfilter([1.0, -0.7], [1.0, -0.5], u)[PERIOD:]
    x /= x.std()
    y = x + square * x**2 + cube * x**3
    found = distortion_of(with_period(made.measurement(u[PERIOD:], y + noise * rng.standard_normal(y.size))))
    assert found is not None
    return found


def truth(square: float, cube: float) -> np.ndarray:
    """Shares (linear, even, odd, noise) for Gaussian x by Hermite polynomials: x^3 = (x^3 - 3 x) + 3 x."""
    powers = np.array([(1 + 3 * cube) ** 2, 2 * square**2, 6 * cube**2, NOISE**2])
    return np.asarray(powers / powers.sum())


@pytest.mark.parametrize("kind", ["odd", "odd-random"])
@pytest.mark.parametrize(("square", "cube"), [(0.1, 0.0), (0.0, 0.05), (0.06, 0.03)])
def test_even_and_odd_distortion_are_told_apart(kind: str, square: float, cube: float) -> None:
    found = [run(kind, square=square, cube=cube, seed=seed).shares[0] for seed in range(1, 7)]
    split = np.array([[one.linear, one.even, one.odd, one.noise] for one in found])
    np.testing.assert_allclose(split.sum(axis=1), 1.0)
    linear, even, odd, noise = split.mean(axis=0)
    expected = truth(square, cube)
    # A multisine is Gaussian up to its realisation, which scatters the even share by 9 % and the odd one by 22 %;
    # three sigma of the mean of six.
    assert even == pytest.approx(expected[1], rel=0.11, abs=1e-5)
    assert odd == pytest.approx(expected[2], rel=0.27, abs=2e-5)
    assert noise == pytest.approx(expected[3], rel=0.1)
    assert linear == pytest.approx(expected[0], abs=0.003)


@pytest.mark.parametrize("kind", ["odd", "odd-random"])
def test_a_linear_machine_shows_no_distortion(kind: str) -> None:
    found = run(kind)
    share = found.shares[0]
    # What's left of the noise of 8 periods on hundreds of lines.
    assert max(share.even, share.odd) < 0.1 * share.noise
    assert share.noise == pytest.approx(NOISE**2, rel=0.1)
    assert found.remarks == ()


def test_with_all_lines_excited_only_the_sum_is_told() -> None:
    found = run("full", square=0.06, cube=0.03)
    (told,) = found.shares
    expected = truth(0.06, 0.03)
    # One realisation: three sigma of 18 %.
    assert told.nonlinear == pytest.approx(expected[1] + expected[2], rel=0.55)
    assert told.noise == pytest.approx(expected[3], rel=0.1)
    assert (told.even, told.odd) == (None, None)
    assert told.linear + told.nonlinear + told.noise == pytest.approx(1.0)
    assert any("odd lines only" in remark for remark in found.remarks)
    assert run("full").shares[0].nonlinear < 0.1 * NOISE**2


def test_a_sine_shows_its_harmonics() -> None:
    x = np.sqrt(2) * np.sin(2 * np.pi * 5 * np.arange(PERIOD * 6) / PERIOD)
    rng = np.random.default_rng(2)
    y = x + 0.1 * x**2 + 0.05 * x**3 + 1e-3 * rng.standard_normal(x.size)
    found = distortion_of(with_period(made.measurement(x, y)))
    assert found is not None
    share = found.shares[0]
    # sqrt(2)^2 sin^2: a second harmonic of amplitude 1; sqrt(2)^3 sin^3: a third of sqrt(2)^3/4, three in the first.
    first = (1 + 0.05 * 2 * 0.75) ** 2
    even, odd = 0.1**2 / 2, (0.05 * np.sqrt(8) / 4) ** 2 / 2
    total = first + even + odd + 1e-6
    assert share.even == pytest.approx(even / total, rel=0.01)
    assert share.odd == pytest.approx(odd / total, rel=0.02)
    assert any("too few lines" in remark for remark in found.remarks)


def test_no_answer_without_periods_or_with_several_inputs() -> None:
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(5000)
    assert distortion_of(with_period(made.measurement(noise, noise))) is None
    both = np.tile(np.array([made.multisine(rng, 500, np.arange(3, 90)) for _ in range(2)]), 8)
    assert distortion_of(with_period(made.measurement(both, both.sum(axis=0)))) is None


def test_measured_aircraft_grows_nonlinear_with_level(shared_data: Path) -> None:
    low, high = (distortion_of(made.aircraft(shared_data, level)) for level in (1, 7))
    assert low is not None
    assert high is not None
    quiet, loud = (np.array([one.nonlinear for one in found.shares]) for found in (low, high))
    assert np.all(loud > 2 * quiet)
    # The connection that rattles is at the payload.
    assert np.argmax(loud) == 2
