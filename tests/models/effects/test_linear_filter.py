import pickle

import numpy as np
import pytest
from scipy.signal import lsim

from chladni.models.effects.linear_filter import first_order, gain, high_pass, second_order


@pytest.mark.parametrize(
    ("way", "fraction"),
    [
        (first_order(0.03), ([1.0], [0.03, 1.0])),
        (second_order(40.0, 0.2), ([1600.0], [1.0, 16.0, 1600.0])),
        (high_pass(5.0), ([1.0, 0.0], [1.0, 5.0])),
        (gain(-2.0), ([-2.0], [1.0])),
    ],
)
def test_filters_samples_as_straight_lines_join_them(way, fraction) -> None:  # type: ignore[no-untyped-def]
    samples = np.random.default_rng(8).normal(size=400)
    # The same straight lines in steps of a tenth, through the fraction in place of the states.
    fine_s = np.arange(3991) / 2500.0
    _, wanted, _ = lsim(fraction, np.interp(fine_s, np.arange(400) / 250.0, samples), fine_s)
    np.testing.assert_allclose(way(samples, 250.0), wanted[::10], atol=1e-10)


def test_survives_a_process_boundary() -> None:
    again = pickle.loads(pickle.dumps(second_order(40.0, 0.2)))  # noqa: S301 - our own bytes
    np.testing.assert_array_equal(again.a, second_order(40.0, 0.2).a)
