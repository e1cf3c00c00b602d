"""Values and one sigma as texts."""

import math

import pytest

from chladni.signals.wording import with_sigma


@pytest.mark.parametrize(
    ("value", "deviation", "text"),
    [
        (12.50312, 0.0213, "12.503 ± 0.021"),
        (2500.3, 599.4, "2500 ± 600"),
        (0.258, 0.0042, "0.2580 ± 0.0042"),
        (1.0, 0.0995, "1.000 ± 0.100"),
        (3.1e-7, 2e-8, "3.10e-07 ± 2.0e-08"),
        (0.0, 0.02, "0.000 ± 0.020"),
        (1.5e12, 1e11, "1.50e+12 ± 1.0e+11"),
        (7.25, 0.0, "7.25"),
        (7.25, math.inf, "7.25"),
        (7.25, math.nan, "7.25"),
        (1.0, 1e-12, "1 ± 1e-12"),
    ],
)
def test_a_value_has_the_digits_its_deviation_deserves(value: float, deviation: float, text: str) -> None:
    assert with_sigma(value, deviation) == text
