import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chladni.models.effects.attached_effect import attached
from chladni.signals.errors import ModelError
from tests.models.effects.motions import energy, force, law_of, loop
from tests.models.effects.small_models import one_body

VALUES = {"stiffness": 1e5, "clearance": 1e-3}


@pytest.mark.parametrize("variant", ["spring", "spring_damper", "hertz", "hertz_damper"])
def test_no_force_without_contact(variant: str) -> None:
    law = law_of(attached("one_sided_stop", "spring", VALUES, variant=variant), one_body())
    for d in (-1.0, 0.0, 1e-3):
        assert force(law, d=d, s=2.0) == 0.0
    assert force(law, d=1.1e-3, s=0.0) > 0.0


def test_the_spring_is_linear_in_the_penetration() -> None:
    law = law_of(attached("one_sided_stop", "spring", VALUES), one_body())
    assert force(law, d=1.5e-3, s=-4.0) == pytest.approx(50.0, rel=1e-12)


def test_the_other_side_mirrors() -> None:
    above = law_of(attached("one_sided_stop", "spring", VALUES, variant="spring_damper"), one_body())
    below = law_of(attached("one_sided_stop", "spring", {**VALUES, "side": -1}, variant="spring_damper"), one_body())
    for d, s in ((1.2e-3, 0.4), (2e-3, -0.4), (-2e-3, 0.1)):
        assert force(below, d=-d, s=-s) == pytest.approx(-force(above, d=d, s=s), abs=1e-15)


def test_hertz_grows_with_the_power_three_halves_from_the_stated_secant() -> None:
    law = law_of(attached("one_sided_stop", "spring", {**VALUES, "depth": 2e-4}, variant="hertz"), one_body())
    assert force(law, d=1.2e-3) == pytest.approx(1e5 * 2e-4, rel=1e-9)
    assert force(law, d=1.8e-3) / force(law, d=1.2e-3) == pytest.approx(4**1.5, rel=1e-9)


def test_without_damping_a_contact_takes_no_energy_and_with_it_the_closed_form() -> None:
    amplitude, omega, dissipation = 2e-3, 10.0, 3.0
    spring = law_of(attached("one_sided_stop", "spring", VALUES), one_body())
    assert energy(*loop(spring, amplitude, omega)) == pytest.approx(0.0, abs=1e-9)
    damped = law_of(
        attached("one_sided_stop", "spring", {**VALUES, "dissipation": dissipation}, variant="spring_damper"),
        one_body(),
    )
    # k p (1 + lambda p'): the damping part takes the integral of k lambda p p'^2 dt over the contact.
    t = np.linspace(0, 2 * np.pi / omega, 400_001)
    p = np.maximum(amplitude * np.sin(omega * t) - 1e-3, 0.0)
    wanted = np.trapezoid(1e5 * dissipation * p * (amplitude * omega * np.cos(omega * t)) ** 2, t)
    assert energy(*loop(damped, amplitude, omega)) == pytest.approx(float(wanted), rel=1e-5)


def test_a_slow_impact_loses_the_speed_that_hunt_and_crossley_give() -> None:
    dissipation, speed, mass = 0.5, 0.02, 2.0
    law = law_of(
        attached(
            "one_sided_stop", "spring", {"stiffness": 1e5, "clearance": 0.0, "dissipation": dissipation},
            variant="spring_damper",
        ),
        one_body(),
    )  # fmt: skip

    def rates(_t: float, x: np.ndarray) -> list[float]:
        return [x[1], -force(law, d=float(x[0]), s=float(x[1])) / mass]

    after = solve_ivp(rates, (0, 0.1), [0.0, speed], method="DOP853", rtol=1e-10, atol=1e-14, max_step=1e-4).y[1, -1]
    # Hunt & Crossley 1975: for slow impacts e = 1 - alpha v with lambda = 3 alpha/2; the next term is of order v^2.
    assert -after / speed == pytest.approx(1 - 2 / 3 * dissipation * speed, abs=2 * (dissipation * speed) ** 2)


def test_a_contact_never_pulls() -> None:
    law = law_of(
        attached("one_sided_stop", "spring", {**VALUES, "dissipation": 5.0}, variant="hertz_damper"), one_body()
    )
    assert force(law, d=2e-3, s=-10.0) == 0.0


def test_a_side_is_one_or_minus_one() -> None:
    with pytest.raises(ModelError, match=r"side = 0.5 must be 1 \(above\) or -1 \(below\)"):
        attached("one_sided_stop", "spring", {**VALUES, "side": 0.5})
