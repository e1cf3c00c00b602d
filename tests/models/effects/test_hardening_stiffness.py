from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import energy, force, law_of, loop
from tests.models.effects.small_models import MASS, STIFFNESS, one_body


def test_is_a_cube_and_takes_no_energy() -> None:
    law = law_of(attached("hardening_stiffness", "spring", {"cubic": 5e6}), one_body())
    assert force(law, d=0.02) == pytest.approx(40.0, rel=1e-14)
    assert energy(*loop(law, 0.02, 5.0)) == pytest.approx(0.0, abs=1e-12)


def test_a_progressive_spring_doubles_its_cube_at_the_range() -> None:
    effect = attached("hardening_stiffness", "spring", {"cubic": 5e6, "range": 0.02}, variant="progressive")
    law = law_of(effect, one_body())
    assert force(law, d=0.02) == pytest.approx(80.0, rel=1e-14)
    assert force(law, d=-0.01) == pytest.approx(-5.0 * 1.25, rel=1e-14)


def test_a_cube_whose_middle_lies_beside_rest_is_asymmetric() -> None:
    # cubic (d - e)^3 but for what is linear and constant in d.
    cubic, beside = 5e6, 1e-3
    law = law_of(
        attached(
            "hardening_stiffness", "spring", {"cubic": cubic, "quadratic": -3 * cubic * beside}, variant="asymmetric"
        ),
        one_body(),
    )
    for d in (0.01, -0.02):
        shifted = cubic * ((d - beside) ** 3 - 3 * beside**2 * d + beside**3)
        assert force(law, d=d) == pytest.approx(shifted, rel=1e-12)


def test_the_free_vibration_has_the_period_of_duffings_closed_form() -> None:
    cubic, amplitude = 4e6, 0.02
    plant = one_body(damping=0.0)
    law = law_of(attached("hardening_stiffness", "spring", {"cubic": cubic}), plant)

    def rates(_t: float, x: np.ndarray) -> np.ndarray:
        return plant.a @ x + plant.g[:, law.port] * force(law, d=float(plant.displacement_state[law.port] @ x))

    # Backbone: from the conserved energy, T = 4 sqrt(m) times the integral of dx/sqrt(2 (V(X) - V(x))), x = X sin u.
    def integrand(u: float) -> float:
        return 1 / sqrt(STIFFNESS + 0.5 * cubic * amplitude**2 * (1 + np.sin(u) ** 2))

    period = 4 * sqrt(MASS) * quad(integrand, 0, pi / 2)[0]
    assert period < 0.8 * 2 * pi * sqrt(MASS / STIFFNESS)
    at_rest = solve_ivp(
        rates, (0, 2 * period), [amplitude, 0.0], method="DOP853", rtol=1e-11, atol=1e-13,
        events=lambda _t, x: x[1], dense_output=True,
    ).t_events[0]  # fmt: skip
    turning = at_rest[at_rest > 0.1 * period]
    assert turning[1] == pytest.approx(period, rel=1e-8)
