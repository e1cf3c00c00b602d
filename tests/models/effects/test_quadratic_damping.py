from math import pi

import pytest

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import energy, law_of, loop
from tests.models.effects.small_models import one_body


def test_a_cycle_takes_eight_thirds_c_omega_squared_x_cubed() -> None:
    law = law_of(attached("quadratic_damping", "spring", {"coefficient": 90.0}), one_body())
    omega, amplitude = 2 * pi * 4.0, 3e-3
    wanted = 8 / 3 * 90.0 * omega**2 * amplitude**3
    # The trapezoidal rule on 4000 steps a cycle leaves 2e-7.
    assert energy(*loop(law, amplitude, omega)) == pytest.approx(wanted, rel=1e-6)
