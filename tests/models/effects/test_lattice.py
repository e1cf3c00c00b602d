"""Steps of a sensor are seen in its samples."""

import numpy as np
import pytest

from chladni.models.effects.lattice import lattice_of

RNG = np.random.default_rng(1)
SMOOTH = RNG.standard_normal(8000)


@pytest.mark.parametrize("step", [0.05, 0.1, 0.23, 0.9, 1.4, 2.1])
def test_the_step_is_found(step: float) -> None:
    found = lattice_of(step * np.round(SMOOTH / step))
    assert found is not None
    assert found.step == pytest.approx(step, rel=1e-3)
    assert found.strength > 0.99


def test_a_smooth_signal_has_none() -> None:
    assert lattice_of(SMOOTH) is None


def test_a_signal_that_stands_still_most_of_the_time_has_none() -> None:
    signal = 1e-4 * SMOOTH
    signal[:150] += 3.0
    assert lattice_of(signal) is None


def test_a_constant_has_none() -> None:
    assert lattice_of(np.ones(100)) is None


@pytest.mark.parametrize("seed", [0, 1])
def test_the_step_is_found_where_few_samples_leave_the_level_of_most(seed: int) -> None:
    signal = np.random.default_rng(seed).normal(size=20_000)
    found = lattice_of(5.0 * np.round(signal / 5.0))
    assert found is not None
    assert found.step == pytest.approx(5.0)
