import numpy as np
import pytest

from chladni.models.effects.attached_effect import attached
from tests.models.effects.motions import energy, force, law_of, loop
from tests.models.effects.small_models import one_body

FORCE, AMPLITUDE, OMEGA = 8.1, 2e-3, 12.0


def test_a_cycle_takes_four_times_force_times_amplitude() -> None:
    law = law_of(attached("coulomb_friction", "spring", {"force": FORCE, "creep_speed": 1e-6}), one_body())
    # The creep speed is 4e-5 of the largest speed; that fraction of the way is travelled with less than the force.
    assert energy(*loop(law, AMPLITUDE, OMEGA)) == pytest.approx(4 * FORCE * AMPLITUDE, rel=1e-6)


def test_a_bristle_takes_what_dahls_closed_form_says() -> None:
    presliding = 2e-5
    law = law_of(
        attached("coulomb_friction", "spring", {"force": FORCE, "presliding": presliding}, variant="bristle"),
        one_body(),
    )
    # w as a function of d: w' = 1 -+ w over presliding, so after a reversal w = 1 - 2 exp(-way/presliding). The way
    # 2 X is 200 presliding: of each half cycle the integral of (1 - w) = 2 presliding is missing.
    wanted = 2 * FORCE * (2 * AMPLITUDE - 2 * presliding)
    assert energy(*loop(law, AMPLITUDE, OMEGA)) == pytest.approx(wanted, rel=1e-4)


def test_slides_with_the_force_plus_the_asymmetry() -> None:
    law = law_of(attached("coulomb_friction", "spring", {"force": 20.4, "offset": -3.2}), one_body())
    assert force(law, s=0.1) == pytest.approx(17.2, rel=1e-12)
    assert force(law, s=-0.1) == pytest.approx(-23.6, rel=1e-12)


def test_the_creep_speed_is_where_three_quarters_are_reached() -> None:
    law = law_of(attached("coulomb_friction", "spring", {"force": 1.0, "creep_speed": 1e-3}), one_body())
    assert force(law, s=1e-3) == pytest.approx(np.tanh(1.0), rel=1e-12)
    # A slope of force/creep_speed at rest: the viscous damping that a linear model would take it for.
    assert force(law, s=1e-9) / 1e-9 == pytest.approx(1e3, rel=1e-9)
