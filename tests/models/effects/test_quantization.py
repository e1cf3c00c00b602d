import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import force
from tests.models.effects.small_models import one_body


def test_recorded_samples_lie_on_the_grid_nearest_to_them() -> None:
    ((_, action),) = attached("quantization", "acc", {"step": 0.25}).attach(one_body()).output_maps
    samples = np.random.default_rng(6).normal(size=2000)
    found = action(samples, 100.0)
    np.testing.assert_array_equal(found / 0.25, np.round(found / 0.25))
    assert np.max(np.abs(found - samples)) <= 0.125
    # The error is spread evenly over a step: its RMS is step/sqrt(12), here within 4 sigma of 2000 samples.
    assert np.std(found - samples) == pytest.approx(0.25 / np.sqrt(12), rel=0.06)


@pytest.mark.parametrize(
    ("d", "seen"), [(0.0, 0.0), (0.1, 0.0), (0.15, 0.25), (0.125, 0.125), (-0.4, -0.5), (-0.25, -0.25), (7.6, 7.5)]
)
def test_in_a_loop_steps_have_steep_but_finite_risers(d: float, seen: float) -> None:
    (law,) = attached("quantization", "place", {"step": 0.25}).attach(one_body(), in_loop=True).laws
    assert d + force(law, d=d) == pytest.approx(seen, abs=1e-12)


def test_risers_take_five_percent_of_a_step_and_are_continuous() -> None:
    (law,) = attached("quantization", "place", {"step": 1.0}).attach(one_body(), in_loop=True).laws
    d = np.linspace(-3.0, 3.0, 60_001)
    seen = d + np.array([force(law, d=one) for one in d])
    slope = np.diff(seen) / np.diff(d)
    assert np.max(slope) == pytest.approx(20.0, rel=1e-6)
    assert np.mean(slope > 1e-6) == pytest.approx(0.05, abs=0.001)


def test_numbers_too_large_for_the_grid_are_left_alone() -> None:
    (law,) = attached("quantization", "place", {"step": 1e-6}).attach(one_body(), in_loop=True).laws
    assert force(law, d=1e30) == 0.0
