import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from chladni.models.effects.catalogue import CATALOGUE
from chladni.models.effects.clues import FittedForm
from tests.models.effects.small_models import one_body


def force_of(**values: float):
    (law,) = attached("geometric", "spring", values).attach(one_body()).laws
    return lambda d: law.function(d, 0.0, 0.0, law.parameters, [], [])


@pytest.mark.parametrize("angle", [0.4, np.pi / 2, 2.2])
def test_with_its_stiffness_at_rest_it_is_the_slope_of_the_springs_energy(angle: float) -> None:
    stiffness, length, step = 3e3, 0.07, 1e-6
    force = force_of(stiffness=stiffness, length=length, angle=angle)

    def energy(d: float) -> float:
        stretched = np.hypot(length * np.cos(angle) + d, length * np.sin(angle))
        return 0.5 * stiffness * (stretched - length) ** 2

    for d in (-0.05, -0.004, 0.01, 0.2):
        whole = force(d) + stiffness * np.cos(angle) ** 2 * d
        assert whole == pytest.approx((energy(d + step) - energy(d - step)) / (2 * step), rel=1e-6)


def test_across_the_joint_it_begins_as_a_cube() -> None:
    # F = k d (1 - l/sqrt(l^2 + d^2)) = k d^3/(2 l^2) - ... (Carrella, Brennan, Waters 2007).
    force = force_of(stiffness=3e3, length=0.07)
    assert force(7e-4) == pytest.approx(3e3 * 7e-4**3 / (2 * 0.07**2), rel=1e-3)
    assert force(-7e-4) == pytest.approx(-force(7e-4))


def test_at_an_angle_it_has_an_even_term() -> None:
    # The second derivative of the energy's slope at rest: 3 k cos(angle) sin(angle)^2/length.
    angle, d = 1.0, 1e-5
    force = force_of(stiffness=3e3, length=0.07, angle=angle)
    even = 0.5 * (force(d) + force(-d)) / d**2
    assert even == pytest.approx(1.5 * 3e3 * np.cos(angle) * np.sin(angle) ** 2 / 0.07, rel=1e-3)


def test_along_its_joint_or_far_shorter_than_its_way_it_is_a_spring() -> None:
    way = 1e-3 * np.sin(np.linspace(0.0, 60.0, 2000))

    def degenerate(length: float, angle: float) -> bool:
        judge = CATALOGUE["geometric"].clues.is_degenerate
        assert judge is not None
        values = {"stiffness": 1e4, "length": length, "angle": angle}
        return judge(
            FittedForm(
                variant="spring",
                values=values,
                duration_s=1.0,
                band_hz=(1.0, 50.0),
                motion=lambda: (way, np.zeros_like(way)),
            )
        )

    assert degenerate(1e-9, 1.8)
    assert degenerate(0.05, 0.0)
    assert not degenerate(2e-3, np.pi / 2)
